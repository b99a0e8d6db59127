"""Logs of several files: divided recordings, and the hourly files of other recorders."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap import records
from mcap.reader import make_reader

from recorders.record import Rotation, record
from recorders.source import Recordable
from shiplog import Channel, LogError, LogWriter, TrialLog, UsageError, open_log, read
from shiplog.checks.info import read_log_info
from shiplog.mcap.part_names import part_files
from shiplog.mcap.raw_reader import read_raw
from shiplog.mcap.recover import recover
from shiplog.tables.convert import convert
from shiplog.types import Event, RawPackets

START = 1_700_000_000 * 10**9
SECOND = 10**9


class Sensors:
    """A source whose second channel begins late."""

    metadata = {"source": "test"}  # noqa: RUF012
    vessel_toml = "# a vessel\n"

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        rng = np.random.default_rng(1)
        for k in range(8):
            at = START + np.arange(k * 50, (k + 1) * 50) * 10**8
            items: list[Recordable] = [_channel("yaw_rate", at, rng.normal(size=50))]
            items.append(RawPackets("gyro", "nmea0183", at[:2], (b"one", b"two")))
            items.append(Event(int(at[3]), f"event {k}"))
            if k > 3:
                items.append(_channel("speed", at, rng.normal(size=50)))
            yield tuple(items)


def _channel(name: str, at: np.ndarray, values: np.ndarray) -> Channel:
    return Channel(name, "test", "rad/s" if name == "yaw_rate" else "m/s", at, at + 7, values)


@pytest.fixture
def divided(tmp_path: Path) -> Path:
    """A recording in several parts, by its base name; beside it the same in one file."""
    (tmp_path / "parts").mkdir()
    record(Sensors(), tmp_path / "trial.mcap")
    path = tmp_path / "parts" / "trial.mcap"
    recording = record(Sensors(), path, rotation=Rotation(megabytes=0.0025))
    assert len(recording.files) > 3
    return path


def _require_equal(one: TrialLog, other: TrialLog) -> None:
    assert (one.metadata, one.vessel_toml) == (other.metadata, other.vessel_toml)
    assert (one.events, one.warnings) == (other.events, other.warnings)
    assert [c.key for c in one] == [c.key for c in other]
    for ours, theirs in zip(one, other, strict=True):
        for name in ("measured_ns", "received_ns", "values"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))


@pytest.mark.parametrize("name", ["trial.mcap", "", "trial.*.mcap"])
def test_the_parts_of_a_recording_are_the_log_that_one_file_is(divided: Path, name: str) -> None:
    whole = read(divided.parents[1] / "trial.mcap")
    _require_equal(read(divided.parent / name), whole)


def test_the_paths_of_the_parts_in_any_order_are_one_log(
    divided: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, paths = read(divided), [*divided.parent.iterdir()]
    paths.sort(key=lambda path: path.name[::-1])
    for each in (paths, map(str, paths)):
        _require_equal(read(each), whole)
    monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 100)
    log = open_log(paths)
    values = [chunk[0].values for chunk in log.chunks()]
    np.testing.assert_array_equal(np.concatenate(values), whole.channels[0].values)


def test_paths_that_are_no_log_together_are_refused(divided: Path) -> None:
    first, second, *_ = sorted(divided.parent.iterdir())
    assert read([first]).name == first.name
    with pytest.raises(LogError, match="both part 1"):
        read([first, second, first])
    with pytest.raises(LogError, match="no such file"):
        read([first, divided.parent / "absent.mcap"])
    with pytest.raises(UsageError, match="name at least one file"):
        read([])


def test_events_and_raw_packets_of_all_parts_are_read(divided: Path) -> None:
    whole = divided.parents[1] / "trial.mcap"
    assert [p for packets in read_raw(divided) for p in packets.data] == [
        p for packets in read_raw(whole) for p in packets.data
    ]
    ours, theirs = read_log_info(divided), read_log_info(whole)
    assert ours.to_dict() == theirs.to_dict()


def test_a_part_of_a_divided_log_is_that_of_the_whole(divided: Path) -> None:
    whole = divided.parents[1] / "trial.mcap"
    bounds = START + 7 * SECOND, START + 31 * SECOND
    ours = read(divided, channels=["yaw_rate"], start_ns=bounds[0], end_ns=bounds[1])
    theirs = read(whole, channels=["yaw_rate"], start_ns=bounds[0], end_ns=bounds[1])
    np.testing.assert_array_equal(ours["yaw_rate"].values, theirs["yaw_rate"].values)
    assert len(ours["yaw_rate"]) == 240


def test_a_divided_log_longer_than_memory_comes_in_chunks(
    divided: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read(divided)
    monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 100)
    monkeypatch.setattr("shiplog.mcap.stream.FILE_CHUNK_SAMPLES", 60)
    log = open_log(divided)
    assert not isinstance(log, TrialLog)
    for _ in range(2):  # passes
        chunks = list(log.chunks())
        assert len(chunks) > 4
        for number, channel in enumerate(whole):
            values = np.concatenate([chunk[number].values for chunk in chunks])
            np.testing.assert_array_equal(values, channel.values)
    assert log.events == whole.events


def test_a_missing_part_is_named_with_what_it_held(divided: Path) -> None:
    (divided.parent / "trial.002.mcap").unlink()
    log = read(divided)
    assert log.data_lost
    assert log.warnings[0].startswith("part 2 of the recording is missing (")
    assert "messages received from 2023-11-14T" in log.warnings[0]


def test_a_missing_last_part_is_noticed(divided: Path) -> None:
    last = max(divided.parent.iterdir())
    last.unlink()
    log = read(divided)
    assert log.data_lost
    assert f"the recording goes on in {last.name}, which is missing" in log.warnings[0]


def test_recovery_makes_one_file_of_all_parts(divided: Path) -> None:
    good = divided.with_name("good.mcap")
    recovery = recover(divided, good)
    assert recovery.lost_messages == {}
    assert not recovery.is_lost
    _require_equal(read(good), replace(read(divided), name="good.mcap"))
    assert recovery.attachments == 1  # each part has the vessel file


def test_recovery_without_a_part_states_that_it_is_lost(divided: Path) -> None:
    divided.with_name("trial.002.mcap").unlink()
    recovery = recover(divided, divided.with_name("good.mcap"))
    assert recovery.is_lost
    assert recovery.lost_messages is None
    assert "part 2 of the recording is missing" in recovery.part_warnings[0]


def test_copies_of_hourly_files_keep_their_attachments_and_their_different_channels(
    tmp_path: Path,
) -> None:
    (tmp_path / "day").mkdir()
    for hour, names in enumerate((("yaw_rate", "speed"), ("speed", "yaw_rate"))):
        at = START + hour * 5 * 10**9 + np.arange(50) * 10**8
        photo = records.Attachment(0, at[0].item(), f"{hour}.jpg", "image/jpeg", b"\xff")
        with LogWriter(tmp_path / "day" / f"{hour}.mcap", vessel_toml="# a vessel") as log:
            log.write(*(_channel(name, at, np.full(50, float(len(name)))) for name in names))
            log.write_records([photo], [])
    convert(tmp_path / "day", tmp_path / "copy.mcap")
    assert recover(tmp_path / "day", tmp_path / "good.mcap").lost_messages == {}
    for path in (tmp_path / "copy.mcap", tmp_path / "good.mcap"):
        log = read(path)
        np.testing.assert_array_equal(log["yaw_rate"].values, np.full(100, 8.0))
        np.testing.assert_array_equal(log["speed"].values, np.full(100, 5.0))
        with path.open("rb") as stream:
            attached = {each.name for each in make_reader(stream).iter_attachments()}
        assert attached == {"0.jpg", "1.jpg", "vessel.toml"}


def test_the_remainder_of_a_killed_recorder_is_the_last_part(divided: Path) -> None:
    last = max(divided.parent.iterdir())
    data = last.read_bytes()
    last.unlink()
    last.with_name(f"{last.name}.part").write_bytes(data[: len(data) // 2])
    log = read(divided)
    assert 200 < len(log["yaw_rate"]) <= 400
    assert any("the end is missing" in warning for warning in log.warnings)


def test_parts_of_two_recordings_are_refused(divided: Path) -> None:
    record(Sensors(), divided.with_name("b.mcap"), rotation=Rotation(megabytes=0.0025))
    with pytest.raises(LogError, match="are of different recordings"):
        read(divided.parent)


def test_a_part_that_is_there_twice_is_refused(divided: Path) -> None:
    part = divided.parent / "trial.002.mcap"
    (divided.parent / "copy.mcap").write_bytes(part.read_bytes())
    with pytest.raises(LogError, match=r"copy\.mcap and trial\.002\.mcap are both part 2"):
        read(divided.parent)


def test_damage_is_located_in_its_part(divided: Path) -> None:
    part = divided.parent / "trial.002.mcap"
    data = bytearray(part.read_bytes())
    for at in range(len(data) // 3, len(data) // 3 + 40):
        data[at] ^= 0xFF
    part.write_bytes(data)
    log = read(divided)
    assert log.data_lost
    assert any(" of trial.002.mcap: " in warning for warning in log.warnings)


def _hour(path: Path, start_secs: float, *names: str, count: int = 100) -> None:
    """Write a file of another recorder, which gives ids to channels in its own order."""
    at = START + round(start_secs * SECOND) + np.arange(count) * 10**8
    with LogWriter(path) as writer:
        for name in names:
            writer.write(_channel(name, at, np.arange(count) + start_secs))


def test_hourly_files_of_another_recorder_are_one_log(tmp_path: Path) -> None:
    _hour(tmp_path / "b.mcap", 0.0, "yaw_rate", "speed")
    _hour(tmp_path / "a.mcap", 10.0, "speed", "yaw_rate")
    log = read(tmp_path)
    assert not log.warnings
    expected = [*range(100), *range(10, 110)]
    assert log["yaw_rate"].values.tolist() == log["speed"].values.tolist() == expected


def test_files_with_a_gap_or_other_topics_are_joined_with_a_warning(tmp_path: Path) -> None:
    _hour(tmp_path / "a.mcap", 0.0, "yaw_rate")
    _hour(tmp_path / "b.mcap", 3600.0, "yaw_rate", "speed")
    gap, topics, *_ = read(tmp_path).warnings
    assert gap == "3590 s are missing between a.mcap and b.mcap; add their file"
    assert topics == "a.mcap and b.mcap do not have the same topics; only one has /speed/test"


def test_files_that_overlap_or_have_no_common_topic_are_refused(tmp_path: Path) -> None:
    _hour(tmp_path / "a.mcap", 0.0, "yaw_rate")
    _hour(tmp_path / "b.mcap", 5.0, "yaw_rate")
    with pytest.raises(LogError, match=r"a\.mcap and b\.mcap are not the parts of one recording"):
        read(tmp_path)
    _hour(tmp_path / "b.mcap", 10.0, "speed")
    with pytest.raises(LogError, match="they have no common topic"):
        read(tmp_path)


def test_a_file_is_never_taken_for_parts_of_its_name(divided: Path) -> None:
    divided.write_bytes((divided.parents[1] / "trial.mcap").read_bytes())
    assert part_files(divided) == (divided,)
    assert part_files(divided.with_name("none.mcap")) == (divided.with_name("none.mcap"),)
    with pytest.raises(LogError, match="no such file"):
        read(divided.with_name("none.mcap"))
