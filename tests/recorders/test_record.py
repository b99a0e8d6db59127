"""The loop that records: all samples kept, whatever ends it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from recorders.record import Recording, record
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


def test_all_samples_of_a_source_are_written_and_counted(tmp_path: Path) -> None:
    counts: list[int] = []
    recording = record(Sensor(), tmp_path / "a.mcap", on_chunk=counts.append)
    assert recording == Recording(samples=30, channels=1, interrupted=False)
    assert counts == [10, 20, 30]
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 30
    assert log.metadata["source"] == "test"


def test_ctrl_c_ends_the_recording_and_keeps_the_samples(tmp_path: Path) -> None:
    recording = record(Sensor(KeyboardInterrupt()), tmp_path / "a.mcap")
    assert recording == Recording(samples=20, channels=1, interrupted=True)
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


def test_a_failing_source_loses_no_sample_and_leaves_an_older_file_alone(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"older")
    with pytest.raises(ShiplogError, match=r"no signal; the 20 samples .* in .*a\.mcap\.part"):
        record(Sensor(ShiplogError("no signal")), tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == b"older"
    log = read(tmp_path / "a.mcap.part")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


@pytest.mark.parametrize("place", ["", "no/such/folder/a.mcap"])
def test_an_unwritable_place_is_reported_and_leaves_no_file(tmp_path: Path, place: str) -> None:
    with pytest.raises(ShiplogError, match="cannot write"):
        record(Sensor(), tmp_path / place)
    assert list(tmp_path.iterdir()) == []
