import json
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter

from recorders.record import record
from recorders.simulated.simulate import SimulatedTrial
from shiplog import Channel, LogError, LogWriter, UsageError
from shiplog.checks.info import read_log_info
from shiplog.cli.main import main
from shiplog.tables.convert import convert


def test_a_finished_log_is_described_with_rates_and_ranges(
    zigzag: SimulatedTrial, tmp_path: Path
) -> None:
    record(zigzag, tmp_path / "z.mcap")
    info = read_log_info(tmp_path / "z.mcap")
    yaw = info.channels[0]
    assert (yaw.topic, yaw.unit, yaw.samples) == ("/yaw_rate/simulated", "rad/s", 5001)
    assert yaw.positive == "bow to starboard"
    assert yaw.rate_hz == pytest.approx(10, rel=0.01)
    (values,) = yaw.ranges
    assert values.unit == "deg/s"
    assert -5 < values.lowest < -0.1
    assert 0.1 < values.highest < 5
    assert (yaw.source, yaw.gaps, yaw.irregular) == ("simulated", 0, False)
    north, east = info.channels[-1].ranges
    assert (north.component, east.component, north.unit) == ("north", "east", "m")
    assert info.start_utc == "2026-01-01T00:00:00Z"
    assert info.finished
    assert not info.foreign
    assert info.has_vessel
    assert info.metadata["manoeuvre"] == "zigzag-20-20"
    assert info.to_dict()["duration_secs"] == pytest.approx(500, abs=0.1)


def test_the_altitude_of_a_fix_is_in_metres(tmp_path: Path) -> None:
    at = np.arange(10) * 10**8
    fixes = np.tile([54.0, 10.0, 12.5], (10, 1))
    with LogWriter(tmp_path / "fix.mcap") as writer:
        fields = ("latitude", "longitude", "altitude")
        writer.write(Channel("position", "27", "deg", at, at, fixes, fields))
    ranges = read_log_info(tmp_path / "fix.mcap").channels[0].ranges
    assert [(r.component, r.unit, r.highest) for r in ranges] == [
        ("latitude", "deg", 54.0),
        ("longitude", "deg", 10.0),
        ("altitude", "m", 12.5),
    ]


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
    assert not info.data_lost


def test_only_the_summary_of_a_huge_log_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    at = np.arange(100) * 10**8
    with LogWriter(tmp_path / "a.mcap") as writer:
        writer.write(Channel("speed", "log", "m/s", at, at, np.ones(100)))
    monkeypatch.delattr("zstandard.ZstdDecompressor")
    monkeypatch.setattr("shiplog.checks.info.MAX_MESSAGES_TO_READ", 99)
    info = read_log_info(tmp_path / "a.mcap")
    assert info.channels[0].samples == 100
    assert "only the summary of its 100 messages" in info.warnings[0]


def _write_foreign(path: Path, *, finish: bool) -> None:
    """Write ten messages of another program, 1 s apart from 100 s on, in one MCAP chunk."""
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema("std/Text", "ros2msg", b"string data")
        channel = writer.register_channel("/chatter", "cdr", schema)
        for i in range(10):
            at = (100 + i) * 10**9
            writer.add_message(channel, at, b"text", at)
        writer.finish()
    if not finish:
        data = path.read_bytes()
        path.write_bytes(data[: -len(data) // 4])


@pytest.mark.parametrize("finish", [True, False])
def test_foreign_topics_are_listed_whether_the_file_is_finished_or_cut(
    tmp_path: Path, *, finish: bool
) -> None:
    _write_foreign(tmp_path / "bag.mcap", finish=finish)
    info = read_log_info(tmp_path / "bag.mcap")
    (topic,) = info.foreign
    assert (topic.topic, topic.schema, topic.messages) == ("/chatter", "std/Text", 10)
    assert (topic.encoding, topic.schema_encoding) == ("cdr", "ros2msg")
    assert (topic.first_ns, topic.last_ns) == (100 * 10**9, 109 * 10**9)
    assert topic.rate_hz == pytest.approx(1.0)
    assert (info.start_ns, info.end_ns) == (topic.first_ns, topic.last_ns)
    assert info.finished is finish
    assert not info.channels


def test_a_topic_with_two_types_or_none_has_a_row_for_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (tmp_path / "bag.mcap").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema("pkg/Odd", "jsonschema", b"{}")
        for schema_id in (schema, 0):
            channel = writer.register_channel("/odd", "json", schema_id)
            writer.add_message(channel, 10**18, b"{}", 10**18)
        writer.finish()
    topics = read_log_info(tmp_path / "bag.mcap").foreign
    assert [(each.schema, each.encoding, each.schema_encoding) for each in topics] == [
        ("pkg/Odd", "json", "jsonschema"),
        ("", "json", ""),
    ]
    assert all(each.rate_hz is None for each in topics)
    assert main(["info", str(tmp_path / "bag.mcap")]) == 0
    assert "json/jsonschema" in capsys.readouterr().out


def test_a_log_of_foreign_topics_alone_is_not_converted(tmp_path: Path) -> None:
    _write_foreign(tmp_path / "bag.mcap", finish=True)
    with pytest.raises(LogError, match=r"nothing to convert.*/chatter"):
        convert(tmp_path / "bag.mcap", tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_a_file_that_is_not_mcap_is_rejected(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"not at all")
    with pytest.raises(LogError, match="not an MCAP file"):
        read_log_info(tmp_path / "a.mcap")


def _write_speeds(path: Path, times_secs: np.ndarray) -> None:
    at = (times_secs * 1e9).astype(np.int64)
    with LogWriter(path) as writer:
        writer.write(Channel("speed", "log", "m/s", at, at, times_secs))


def test_gaps_and_irregular_sampling_are_shown(tmp_path: Path) -> None:
    regular = np.arange(0.0, 100.0)
    _write_speeds(tmp_path / "gap.mcap", np.concatenate((regular, regular + 130)))
    (channel,) = read_log_info(tmp_path / "gap.mcap").channels
    assert (channel.gaps, channel.irregular) == (1, False)
    assert channel.longest_gap_secs == pytest.approx(31)
    _write_speeds(tmp_path / "jitter.mcap", np.cumsum(np.tile([0.1, 0.1, 0.4], 40)))
    (channel,) = read_log_info(tmp_path / "jitter.mcap").channels
    assert channel.irregular


@pytest.mark.parametrize("limit", [10, 1000])
def test_a_part_is_described_by_its_own_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: int
) -> None:
    monkeypatch.setattr("shiplog.checks.info.MAX_MESSAGES_TO_READ", limit)
    _write_speeds(tmp_path / "a.mcap", np.arange(0.0, 101.0))
    info = read_log_info(tmp_path / "a.mcap", 20, -50)
    (channel,) = info.channels
    assert (info.name, channel.samples) == ("a.mcap (20 to 50 s)", 30)
    assert channel.ranges[0].lowest == pytest.approx(20 * 3600 / 1852)
    assert info.duration_secs == pytest.approx(29)


def test_a_log_without_samples_has_no_start(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "empty.mcap"):
        pass
    info = read_log_info(tmp_path / "empty.mcap")
    assert (info.start_utc, info.duration_secs, info.state) == (None, 0.0, "finished")
    with pytest.raises(UsageError, match=r"empty.mcap has no samples"):
        read_log_info(tmp_path / "empty.mcap", 10)


def test_attachments_and_metadata_of_other_programs_are_reported_as_not_kept(
    tmp_path: Path,
) -> None:
    path = tmp_path / "mixed.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        writer.add_attachment(0, 0, "photo.jpg", "image/jpeg", b"...")
        writer.add_metadata("rosbag2", {"version": "8"})
        writer.finish()
    (warning,) = read_log_info(path).warnings
    assert "attachment 'photo.jpg', metadata 'rosbag2'" in warning
    assert "only a copy in MCAP keeps" in warning


def test_a_log_of_ours_has_no_foreign_records(zigzag: SimulatedTrial, tmp_path: Path) -> None:
    record(zigzag, tmp_path / "z.mcap")
    assert read_log_info(tmp_path / "z.mcap").warnings == ()
