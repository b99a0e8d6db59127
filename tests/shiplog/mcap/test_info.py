import json
from pathlib import Path

import numpy as np
import pytest

from recorders.record import record
from recorders.simulated.simulate import SimulatedTrial
from shiplog import Channel, LogError, LogWriter
from shiplog.mcap.info import read_log_info


def test_a_finished_log_is_described_from_its_summary(
    zigzag: SimulatedTrial, tmp_path: Path
) -> None:
    record(zigzag, tmp_path / "z.mcap")
    info = read_log_info(tmp_path / "z.mcap")
    yaw = info.channels[0]
    assert (yaw.topic, yaw.unit, yaw.samples) == ("/yaw_rate/simulated", "rad/s", 5001)
    assert yaw.positive == "bow to starboard"
    assert info.has_vessel
    assert info.metadata["manoeuvre"] == "zigzag-20-20"
    assert info.to_dict()["duration_secs"] == pytest.approx(500, abs=0.1)


def test_an_unfinished_log_is_described_by_reading_it(tmp_path: Path) -> None:
    at = np.arange(100) * 10**8
    writer = LogWriter(tmp_path / "cut.mcap", metadata={"ship": "test"})
    writer.write(Channel("speed", "log", "m/s", at, at, np.ones(100)))
    writer.flush()
    info = read_log_info(tmp_path / "cut.mcap")
    assert info.channels[0].samples == 100
    assert info.metadata["ship"] == "test"
    assert any("not finished" in warning for warning in info.warnings)
    assert json.loads(json.dumps(info.to_dict()))["metadata"]["ship"] == "test"
    writer.close()


def test_a_damaged_summary_is_not_used(tmp_path: Path) -> None:
    at = np.arange(100) * 10**8
    path = tmp_path / "flipped.mcap"
    with LogWriter(path, metadata={"ship": "test"}) as writer:
        writer.write(Channel("speed", "log", "m/s", at, at, np.ones(100)))
    whole, data = read_log_info(path), path.read_bytes()
    place = data.rindex(b"/speed/log")
    path.write_bytes(data[:place] + b"/speex/log" + data[place + 10 :])
    info = read_log_info(path)
    assert info.channels[0].topic == "/speed/log"
    assert (info.start_ns, info.end_ns) == (whole.start_ns, whole.end_ns)
    assert info.metadata == whole.metadata
    assert any("checksum of the summary is wrong" in warning for warning in info.warnings)
    assert info.data_lost


def test_only_the_summary_of_a_finished_log_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at = np.arange(100) * 10**8
    with LogWriter(tmp_path / "a.mcap") as writer:
        writer.write(Channel("speed", "log", "m/s", at, at, np.ones(100)))
    monkeypatch.delattr("zstandard.ZstdDecompressor")
    assert read_log_info(tmp_path / "a.mcap").channels[0].samples == 100


def test_a_file_that_is_not_mcap_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"not at all")
    with pytest.raises(LogError, match="not an MCAP file"):
        read_log_info(tmp_path / "a.mcap")
