from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from recorders.record import record
from shiplog import Channel, ShiplogError, read


class Sensor:
    """A source of three chunks that may be interrupted."""

    metadata = {"source": "test"}  # noqa: RUF012
    vessel_toml = None

    def __init__(self, interruption: BaseException | None = None) -> None:
        self.interruption = interruption

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        for k in range(3):
            if k == 2 and self.interruption:
                raise self.interruption
            at = np.arange(k * 10, (k + 1) * 10) * 10**8
            yield (Channel("yaw_rate", "gyro", "rad/s", at, at, np.sin(at * 1e-9)),)


def test_all_that_a_source_yields_is_written_and_told(tmp_path: Path) -> None:
    told: list[int] = []
    assert record(Sensor(), tmp_path / "a.mcap", on_chunk=told.append) == (30, False)
    assert told == [10, 20, 30]
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 30
    assert log.metadata["source"] == "test"


def test_ctrl_c_ends_the_recording_and_keeps_what_came(tmp_path: Path) -> None:
    assert record(Sensor(KeyboardInterrupt()), tmp_path / "a.mcap") == (20, True)
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


def test_a_source_that_fails_loses_nothing_and_leaves_the_final_name_alone(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"what stood there")
    with pytest.raises(ShiplogError, match=r"cable is out; the 20 samples .* in .*a\.mcap\.part"):
        record(Sensor(ShiplogError("the cable is out")), tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == b"what stood there"
    log = read(tmp_path / "a.mcap.part")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


@pytest.mark.parametrize("place", ["", "no/such/folder/a.mcap"])
def test_a_place_that_cannot_be_written_is_said_and_left_clean(tmp_path: Path, place: str) -> None:
    with pytest.raises(ShiplogError, match="cannot write"):
        record(Sensor(), tmp_path / place)
    assert list(tmp_path.iterdir()) == []
