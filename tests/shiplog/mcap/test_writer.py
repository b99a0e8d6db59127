import subprocess
import sys
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import NonSeekingReader, make_reader

import shiplog.mcap.writer
from shiplog import Channel, LogWriter, ShiplogError, TrialLog, UsageError, read, write
from shiplog.mcap.encode import McapChunk, MessageBatch, encode_mcap_chunks
from shiplog.units import GEOGRAPHIC

START = 1_700_000_000_000_000_000
HOUR = 3_600_000_000_000
SECONDS = START + np.arange(5) * 10**9
UNIT = {"yaw_rate": "rad/s", "speed": "m/s", "rpm": "rpm", "rudder": "rad", "winch_force": "kN"}


def channel(name: str, count: int, seed: int = 0) -> Channel:
    rng = np.random.default_rng(seed)
    measured = START + np.sort(rng.integers(0, HOUR, count))
    received = measured + rng.integers(0, 10_000_000, count)
    return Channel(
        name,
        "test",
        UNIT[name],
        measured,
        np.sort(received),
        rng.normal(size=count),
    )


def trial(*channels: Channel) -> TrialLog:
    return TrialLog("trial.mcap", channels, {"place": "Neva"}, "name = 'ship'\n")


def same(one: Channel, other: Channel) -> bool:
    return (
        (one.name, one.source, one.unit, one.fields, dict(one.metadata))
        == (other.name, other.source, other.unit, other.fields, dict(other.metadata))
        and one.values.tobytes() == other.values.tobytes()
        and np.array_equal(one.measured_ns, other.measured_ns)
        and np.array_equal(one.received_ns, other.received_ns)
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


def test_a_log_is_read_as_it_was_written(path: Path) -> None:
    fixes = Channel(
        "position", "gnss", "deg", SECONDS[:5], SECONDS[:5], np.ones((5, 3)), GEOGRAPHIC
    )
    local = Channel(
        "position",
        "local",
        "m",
        SECONDS[:4],
        SECONDS[:4],
        np.arange(8.0).reshape(4, 2),
        ("north", "east"),
        {"origin": "59.9 30.2"},
    )
    original = trial(channel("yaw_rate", 1000), fixes, local, channel("winch_force", 10))
    write(original, path)
    log = read(path)
    assert log.name == "trial.mcap"
    assert log.warnings == ()
    assert log.vessel_toml == original.vessel_toml
    assert log.metadata["place"] == "Neva"
    assert [c.topic for c in log] == [c.topic for c in original]
    assert all(same(one, other) for one, other in zip(original, log, strict=True))


OURS = {"format_version", "written_by", "channel", "source", "unit", "positive"}
keys = st.text(min_size=1).filter(lambda key: key not in OURS)  # OURS are written by the writer


@st.composite
def channels(draw: st.DrawFn, name: str, earliest: int, latest: int) -> Channel:
    count = draw(st.integers(0, 20))
    times = st.integers(earliest, latest)
    return Channel(
        name,
        draw(st.text("abc/_1", max_size=5)),
        "rad/s",
        np.sort(draw(arrays(np.int64, count, elements=times))),
        np.sort(draw(arrays(np.int64, count, elements=times))),
        draw(arrays(np.float64, count, elements=st.floats(allow_nan=True))),
        metadata=draw(st.dictionaries(keys, st.text(), max_size=2)),
    )


def two_channels(earliest: int, latest: int) -> st.SearchStrategy[tuple[Channel, ...]]:
    return st.tuples(*(channels(name, earliest, latest) for name in ("yaw_rate", "vibration")))


@given(two_channels(START, START + HOUR), st.dictionaries(keys, st.text()))
@settings(derandomize=True, deadline=None, max_examples=100)
def test_any_log_of_clocks_that_run_on_is_read_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory,
    original: tuple[Channel, ...],
    metadata: dict[str, str],
) -> None:
    path = tmp_path_factory.mktemp("any") / "trial.mcap"
    write(TrialLog("any", original, metadata), path)
    log = read(path)
    by_topic = {c.topic: c for c in log}
    assert all(same(c, by_topic[c.topic]) for c in original)
    assert metadata.items() <= log.metadata.items()
    assert log.warnings == ()


@given(two_channels(0, 2**63 - 1))
@settings(derandomize=True, deadline=None, max_examples=100)
def test_a_log_of_any_times_is_read_and_no_sample_is_lost_in_silence(
    tmp_path_factory: pytest.TempPathFactory, original: tuple[Channel, ...]
) -> None:
    path = tmp_path_factory.mktemp("any") / "trial.mcap"
    write(TrialLog("any", original), path)
    try:
        log = read(path)
    except ShiplogError as error:
        assert "\n" not in str(error)  # noqa: PT017 - a refusal is one of two outcomes
        return
    assert sum(map(len, log)) == sum(map(len, original)) or log.warnings


def test_the_mcap_library_verifies_the_file(path: Path) -> None:
    write(trial(channel("yaw_rate", 30_000), channel("rudder", 10_000)), path)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 40_000
        assert summary.statistics.chunk_count > 1
        assert sum(1 for _ in reader.iter_messages()) == 40_000
        assert "shiplog" in str(reader.get_header())
        stream.seek(0)
        whole = NonSeekingReader(stream, validate_crcs=True)  # verifies the data section too
        assert sum(1 for _ in whole.iter_messages(log_time_order=False)) == 40_000


def test_measured_is_the_publish_time_and_received_the_log_time(path: Path) -> None:
    original = channel("yaw_rate", 100)
    write(trial(original), path)
    with path.open("rb") as stream:
        messages = [message for *_, message in make_reader(stream).iter_messages()]
    assert [m.publish_time for m in messages] == original.measured_ns.tolist()
    assert [m.log_time for m in messages] == original.received_ns.tolist()
    assert [m.sequence for m in messages] == list(range(100))


def test_channels_are_interleaved_in_the_order_of_reception(path: Path) -> None:
    write(trial(channel("yaw_rate", 300, 1), channel("speed", 200, 2), channel("rpm", 9, 3)), path)
    with path.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages(log_time_order=False))
    times = [message.log_time for *_, message in messages]
    assert times == sorted(times)
    assert len({c.topic for _, c, _ in messages[:50]}) >= 2


def test_the_file_has_the_metadata_of_each_channel(path: Path) -> None:
    rudder = Channel(
        "rudder",
        "feedback",
        "rad",
        [START],
        [START],
        [0.1],
        metadata={"model": "X1", "unit": "no"},  # type: ignore[arg-type]
    )
    write(trial(rudder, channel("winch_force", 1)), path)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    metadata = {c.topic: c.metadata for c in summary.channels.values()}
    assert metadata["/rudder/feedback"] == {
        "channel": "rudder",
        "source": "feedback",
        "unit": "rad",
        "positive": "turns the bow to starboard",
        "model": "X1",
    }
    assert "positive" not in metadata["/winch_force/test"]


def test_the_file_has_its_metadata_and_the_vessel_file(path: Path) -> None:
    log = TrialLog("t", (channel("speed", 3),), {"crew": "two", "format_version": "0"}, "T1 = 1\n")
    write(log, path)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        (vessel,) = reader.iter_attachments()
    assert metadata.name == "shiplog"
    assert metadata.metadata["crew"] == "two"
    assert metadata.metadata["format_version"] == "1"
    assert (vessel.name, vessel.media_type) == ("vessel.toml", "application/toml")
    assert vessel.data == b"T1 = 1\n"


def test_a_log_without_a_vessel_has_no_attachment(path: Path) -> None:
    write(TrialLog("t", (channel("speed", 3),)), path)
    with path.open("rb") as stream:
        assert list(make_reader(stream).iter_attachments()) == []
    assert read(path).vessel_toml is None


def test_the_same_log_gives_the_same_bytes(tmp_path: Path) -> None:
    log = trial(channel("yaw_rate", 5000), channel("speed", 500))
    write(log, tmp_path / "one")
    write(log, tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_a_log_read_and_written_again_is_the_same_file(tmp_path: Path) -> None:
    write(trial(channel("yaw_rate", 5000), channel("speed", 500)), tmp_path / "one")
    write(read(tmp_path / "one"), tmp_path / "two")
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_parts_written_one_by_one_are_one_channel(path: Path) -> None:
    whole = channel("yaw_rate", 100)
    with LogWriter(path) as writer:
        for at in range(0, 100, 10):
            part = slice(at, at + 10)
            writer.write(
                Channel(
                    whole.name,
                    whole.source,
                    whole.unit,
                    whole.measured_ns[part],
                    whole.received_ns[part],
                    whole.values[part],
                )
            )
    (original,) = read(path)
    assert same(original, whole)
    with path.open("rb") as stream:
        sequences = [message.sequence for *_, message in make_reader(stream).iter_messages()]
    assert sequences == list(range(100))


def test_parts_of_many_channels_written_one_by_one_are_joined(path: Path) -> None:
    rng = np.random.default_rng(8)
    whole = [channel("yaw_rate", 5000, 1), channel("speed", 900, 2), channel("winch_force", 70, 3)]
    times = np.sort(rng.choice(whole[0].received_ns, 400, replace=False))
    cuts = [[0, *np.searchsorted(c.received_ns, times), len(c)] for c in whole]
    with LogWriter(path) as writer:
        for number in range(len(times) + 1):
            writer.write(
                *(c.part(at[number], at[number + 1]) for c, at in zip(whole, cuts, strict=True))
            )
            if rng.random() < 0.02:
                writer.flush()
    assert all(same(one, other) for one, other in zip(read(path), whole, strict=True))
    with path.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages(log_time_order=False))
    received = [message.log_time for *_, message in messages]
    assert received == sorted(received)
    for c in whole:
        of_it = [message.sequence for _, its, message in messages if its.topic == c.topic]
        assert of_it == list(range(len(c)))


def test_a_long_channel_is_written_in_little_memory(path: Path) -> None:
    count = 1_000_000
    at = START + np.arange(count)
    long = Channel("speed", "log", "m/s", at, at, np.ones(count))
    with LogWriter(path) as writer:
        tracemalloc.start()
        writer.write(long)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < count * 24


def test_a_channel_without_samples_is_kept(path: Path) -> None:
    write(trial(channel("speed", 3), channel("rpm", 0)), path)
    log = read(path)
    assert len(log["rpm"]) == 0
    assert log.warnings == ()


def test_a_second_close_has_no_effect(path: Path) -> None:
    writer = LogWriter(path)
    writer.write(channel("speed", 3))
    writer.close()
    size = path.stat().st_size
    writer.close()
    assert path.stat().st_size == size


def test_a_killed_process_leaves_all_flushed_samples(path: Path) -> None:
    code = """
import os, sys, numpy as np
from shiplog import Channel, LogWriter
writer = LogWriter(sys.argv[1], metadata={"place": "Neva"}, vessel_toml="T1 = 1")
for start in range(0, 1000, 100):
    times = np.arange(start, start + 100)
    writer.write(Channel("yaw_rate", "gyro", "rad/s", times, times, times * 0.5))
    writer.flush()
times = np.arange(1000, 1100)
writer.write(Channel("yaw_rate", "gyro", "rad/s", times, times, times * 0.5))
os._exit(9)
"""
    done = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert done.returncode == 9
    log = read(path)
    np.testing.assert_array_equal(log["yaw_rate"].measured_ns, np.arange(1000))
    np.testing.assert_array_equal(log["yaw_rate"].values, np.arange(1000) * 0.5)
    assert log.metadata["place"] == "Neva"
    assert log.vessel_toml == "T1 = 1"
    assert len(log.warnings) == 1
    assert "1000 complete samples were read" in log.warnings[0]


def test_a_unit_that_no_reader_can_convert_is_rejected_before_recording(path: Path) -> None:
    for unit in ("m/s", "deg/fortnight"):
        with pytest.raises(UsageError, match=unit):
            write(TrialLog("t", (Channel("yaw_rate", "gyro", unit, [0], [0], [0.1]),)), path)  # type: ignore[arg-type]
    assert not path.exists()


@pytest.mark.parametrize("place", [".", "nowhere/trial.mcap", "file/trial.mcap"])
def test_a_path_that_cannot_be_written_is_an_error_that_leaves_no_file(
    tmp_path: Path, place: str
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ShiplogError, match="cannot write"):
        write(trial(channel("speed", 3)), tmp_path / place)
    with pytest.raises(ShiplogError, match="cannot write"):
        LogWriter(tmp_path / place)
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("stands", [True, False])
def test_a_failed_write_leaves_the_existing_file(
    path: Path, monkeypatch: pytest.MonkeyPatch, *, stands: bool
) -> None:
    if stands:
        write(trial(channel("speed", 30)), path)
    before = path.read_bytes() if stands else None

    def full_disk(batches: list[MessageBatch], max_bytes: int) -> Iterator[McapChunk]:
        yield from encode_mcap_chunks(batches, max_bytes)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shiplog.mcap.writer, "encode_mcap_chunks", full_disk)
    with pytest.raises(ShiplogError, match="no space left on device"):
        write(trial(channel("speed", 1000)), path)
    assert [p.read_bytes() for p in path.parent.iterdir()] == ([before] if stands else [])


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_a_full_disk_is_reported_by_flush_and_the_file_is_closed() -> None:
    writer = LogWriter("/dev/full")
    writer.write(channel("speed", 3))
    with pytest.raises(OSError, match="No space left"):
        writer.flush()
    with pytest.raises(OSError, match="No space left"):
        writer.close()
    writer.close()
