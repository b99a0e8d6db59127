"""A log read by chunks from its file is the log that is read into memory."""

import tracemalloc
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType, Writer
from mcap_files import (
    START,
    channel,
    end_mcap_chunk,
    file_records,
    flip_bit,
    mcap_chunk_ranges,
    offset_between,
    position,
    samples_by_mcap,
    scalar,
    write_by_mcap,
    write_messages,
)

import shiplog.mcap.stream
from shiplog import Channel, LogError, LogWriter, TrialLog, read, write
from shiplog.mcap.messages import descriptor_set
from shiplog.mcap.schema import schema_for
from shiplog.mcap.stream import LogFile, open_log
from shiplog.types import concatenate_channels
from shiplog.units import GEOGRAPHIC

ANYWHERE = st.floats(0, 1, exclude_max=True)
CHUNK = 300


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Treat small files as longer than memory."""
    _small(monkeypatch)


def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shiplog.mcap.stream, "MAX_SAMPLES_IN_MEMORY", 10)
    monkeypatch.setattr(shiplog.mcap.stream, "FILE_CHUNK_SAMPLES", CHUNK)


def open_as_file(path: Path) -> LogFile:
    log = open_log(path)
    assert isinstance(log, LogFile)
    return log


def joined_chunks(chunks: Iterator[tuple[Channel, ...]]) -> dict[Any, Channel]:
    """Join the parts of each topic."""
    parts: dict[Any, list[Channel]] = defaultdict(list)
    for chunk in chunks:
        for part in chunk:
            parts[part.key].append(part)
    return {key: concatenate_channels(channel_parts) for key, channel_parts in parts.items()}


def description(c: Channel) -> tuple[object, ...]:
    return c.name, c.source, c.unit, c.fields, dict(c.metadata), c.values.dtype, c.values.shape


def assert_same_log(log: LogFile, expected_log: TrialLog) -> None:
    result = {key: c for key, c in joined_chunks(log.chunks()).items() if len(c)}
    expected = {c.key: c for c in expected_log if len(c)}
    assert result.keys() == expected.keys()
    for key, c in expected.items():
        assert description(result[key]) == description(c)
        np.testing.assert_array_equal(result[key].received_ns, c.received_ns)
        np.testing.assert_array_equal(result[key].measured_ns, c.measured_ns)
        assert result[key].values.tobytes() == c.values.tobytes()
    assert log.name == expected_log.name
    assert log.metadata == expected_log.metadata
    assert log.vessel_toml == expected_log.vessel_toml
    assert log.warnings == expected_log.warnings
    assert log.data_lost == expected_log.data_lost


def write_recording(path: Path) -> bytes:
    """Write a log of two channels, flushed every hundred samples; return the file's bytes."""
    with LogWriter(path, metadata={"place": "Neva"}) as writer:
        for start in range(0, 1000, 100):
            at = START + 1000 * np.arange(start, start + 100)
            values = np.random.default_rng(start).normal(size=(2, 100))
            writer.write(Channel("yaw_rate", "test", "rad/s", at - 7, at, values[0]))
            writer.write(Channel("speed", "test", "m/s", at, at + 5, values[1]))
            end_mcap_chunk(writer)
    return path.read_bytes()


def trial() -> tuple[Channel, ...]:
    return (
        channel("yaw_rate", 3000, 1),
        channel("speed", 700, 2),
        channel("yaw_rate", 90, 3, "imu"),
        position(30, GEOGRAPHIC),
        position(40, ("north", "east")),
    )


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"index_types": IndexType.NONE},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4},
        {"enable_crcs": False},
        {"enable_data_crcs": True},
        {"repeat_channels": False, "repeat_schemas": False},
        {"use_statistics": False, "use_summary_offsets": False},
        {"chunk_size": 100},
    ],
    ids=str,
)
def test_chunks_joined_are_the_log_read_whole_in_every_file_layout(
    path: Path, options: dict[str, Any]
) -> None:
    write_by_mcap(path, *trial(), **{"chunk_size": 1 << 13, **options})
    log = open_as_file(path)
    assert_same_log(log, read(path))
    assert_same_log(log, read(path))  # a second pass


def test_chunks_have_the_samples_that_the_mcap_library_reads(path: Path) -> None:
    original = channel("yaw_rate", 3000, 1), channel("speed", 700, 2)
    write_by_mcap(path, *original, chunk_size=1 << 13)
    by_mcap = samples_by_mcap(path)
    for c in joined_chunks(open_as_file(path).chunks()).values():
        assert [t[0] for t in by_mcap[c.topic]] == c.received_ns.tolist()
        assert b"".join(t[2] for t in by_mcap[c.topic]) == c.values.tobytes()


def test_chunks_have_the_intended_size_and_all_channels_in_order(
    path: Path,
) -> None:
    write_by_mcap(path, *trial(), chunk_size=4000)
    topics = [c.topic for c in read(path)]
    chunks = list(open_as_file(path).chunks())
    assert len(chunks) > 5
    for chunk in chunks[:-1]:
        assert CHUNK <= sum(map(len, chunk)) <= CHUNK + 4000 // 40
    for chunk in chunks:
        assert [c.topic for c in chunk] == topics


def test_before_the_first_pass_the_log_has_the_content_of_the_summary(path: Path) -> None:
    write(TrialLog("t", trial()[:3], {"place": "Neva"}, "T1 = 1\n"), path)
    log = open_as_file(path)
    assert (log.name, log.metadata["place"], log.vessel_toml) == ("trial.mcap", "Neva", "T1 = 1\n")
    assert log.warnings == ()
    assert not log.data_lost


def test_a_short_log_is_read_into_memory(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = write_recording(path)
    for contents in (data, data[:-40]):  # with a summary and without
        path.write_bytes(contents)
        for limit, kind in ((2000, TrialLog), (1999, LogFile)):
            monkeypatch.setattr(shiplog.mcap.stream, "MAX_SAMPLES_IN_MEMORY", limit)
            log = open_log(path)
            assert isinstance(log, kind)
            assert log.warnings == read(path).warnings


def test_units_are_converted_in_every_chunk(path: Path) -> None:
    write_messages(path, [scalar(float(k)) for k in range(1000)], unit="deg/s")
    (yaw_rate,) = joined_chunks(open_as_file(path).chunks()).values()
    assert yaw_rate.unit == "rad/s"
    np.testing.assert_allclose(yaw_rate.values, np.radians(np.arange(1000.0)), rtol=1e-15)


@pytest.mark.parametrize("unfinished", [False, True])
def test_a_topic_described_twice_is_one_channel_in_every_chunk(
    path: Path, *, unfinished: bool
) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2000)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        metadata = {"unit": "rad/s"}
        first, second = (
            writer.register_channel(
                "/yaw_rate/gyro", "protobuf", schema_id, metadata | {"run": run}
            )
            for run in "12"
        )
        for k in range(1000):
            writer.add_message(first if k % 3 and k < 600 else second, k, scalar(k), k)
        writer.finish()
    if unfinished:
        path.write_bytes(path.read_bytes()[:-10])
    log = open_as_file(path)
    assert_same_log(log, read(path))
    (yaw_rate,) = joined_chunks(log.chunks()).values()
    assert yaw_rate.values.tolist() == list(range(1000))
    assert yaw_rate.metadata == {"run": "1"}


def test_a_file_with_samples_out_of_order_is_read_into_memory_and_sorted(path: Path) -> None:
    rng = np.random.default_rng(0)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        channel_id = writer.register_channel("/a/b", "protobuf", schema_id, {})
        for hundred in range(0, 1000, 100):
            for k in (hundred + rng.integers(0, 100, 100)).tolist():
                writer.add_message(channel_id, k // 2, scalar(rng.normal()), k)
            writer.flush()
        writer.finish()
    log = open_log(path)
    assert isinstance(log, TrialLog)
    assert np.all(np.diff(log["a"].received_ns) >= 0)
    np.testing.assert_array_equal(log["a"].values, read(path)["a"].values)


@pytest.mark.parametrize("unfinished", [False, True])
def test_a_file_with_mcap_chunks_out_of_order_is_read_into_memory(
    path: Path, *, unfinished: bool
) -> None:
    with LogWriter(path) as writer:
        for start in (5000, 0):
            at = START + start + np.arange(1000)
            writer.write(Channel("speed", "log", "m/s", at, at, np.ones(1000)))
            end_mcap_chunk(writer)
    if unfinished:
        path.write_bytes(path.read_bytes()[:-10])
    log = open_log(path)
    assert isinstance(log, TrialLog)
    assert np.all(np.diff(log["speed"].received_ns) > 0)


def _unset(case: str) -> tuple[np.ndarray, np.ndarray]:
    """Return (600,) times of reception and measurement, of which some were not set."""
    clock = np.arange(600) * 1_000_000_000
    measured = START + clock
    if case == "all before zero":
        return clock + 1, clock - 30_000_000_000
    if case == "few in all, many in one chunk":
        measured[200:220] = 0
    elif case == "many in all, few in each chunk":
        measured[::25] = 0
    elif case == "a clock of its own in one chunk":
        measured[300:] -= 1024 * 7 * 86_400 * 1_000_000_000
    return START + clock, measured


@pytest.mark.parametrize("unfinished", [False, True])
@pytest.mark.parametrize(
    "case",
    [
        "all before zero",
        "few in all, many in one chunk",
        "many in all, few in each chunk",
        "a clock of its own in one chunk",
    ],
)
def test_whether_times_are_replaced_is_decided_once_for_the_whole_file(
    path: Path, monkeypatch: pytest.MonkeyPatch, case: str, *, unfinished: bool
) -> None:
    received, measured = _unset(case)
    with LogWriter(path) as writer:
        for at in range(0, 600, 50):
            rows = slice(at, at + 50)
            writer.write(
                Channel("speed", "log", "m/s", measured[rows], received[rows], np.ones(50))
            )
            end_mcap_chunk(writer)
    if unfinished:
        path.write_bytes(path.read_bytes()[:-10])
    monkeypatch.setattr(shiplog.mcap.stream, "FILE_CHUNK_SAMPLES", 50)
    log, expected = open_log(path), read(path)
    (speed,) = joined_chunks(log.chunks()).values()
    np.testing.assert_array_equal(speed.measured_ns, expected["speed"].measured_ns)
    np.testing.assert_array_equal(speed.received_ns, expected["speed"].received_ns)
    assert log.warnings == expected.warnings
    assert any(word in " ".join(log.warnings) for word in ("not set", "median"))


def test_a_long_log_of_a_clock_that_begins_at_zero_is_read_by_chunks(path: Path) -> None:
    at = np.arange(1000) * 1_000_000
    write(TrialLog("t", (Channel("speed", "log", "m/s", at, at, np.ones(1000)),)), path)
    assert_same_log(open_as_file(path), read(path))


def test_messages_outside_of_mcap_chunks_are_read_into_memory(path: Path) -> None:
    write_by_mcap(path, *trial(), use_chunking=False)
    log = open_log(path)
    assert isinstance(log, TrialLog)
    assert sum(map(len, log)) == 3860


def test_a_selected_source_is_alone_and_first_in_every_chunk(path: Path) -> None:
    original = [
        channel("speed", 2000, 2),
        channel("yaw_rate", 2000, 1),
        channel("yaw_rate", 900, 3, "imu"),
    ]
    write_by_mcap(path, *original, chunk_size=4000)
    selected = {"yaw_rate": "imu"}
    log = open_as_file(path).select_sources(selected)
    for chunk in log.chunks():
        topics = [c.topic for c in chunk]
        assert topics == ["/yaw_rate/imu", "/speed/test"]
    assert_same_log(log, read(path).select_sources(selected))


@pytest.mark.parametrize("selected", [{"yaw_rate": "compass"}, {"rudder": "test"}])
def test_a_missing_source_is_the_same_error_as_of_a_log_in_memory(
    path: Path, selected: dict[str, str]
) -> None:
    write_by_mcap(path, *trial())
    with pytest.raises(LogError) as in_file:
        open_as_file(path).select_sources(selected)
    with pytest.raises(LogError) as in_memory:
        read(path).select_sources(selected)
    assert str(in_file.value) == str(in_memory.value)


def test_files_that_read_rejects_are_rejected_when_opening(path: Path) -> None:
    for contents in (b"", b"time,yaw_rate\n"):
        path.write_bytes(contents)
        with pytest.raises(LogError):
            open_log(path)
    write_messages(path, [scalar(1.0)] * 100, unit="m")
    with pytest.raises(LogError, match="should be in rad/s"):
        open_log(path)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.add_metadata("shiplog", {"format_version": "2"})
        writer.finish()
    with pytest.raises(LogError, match="install a newer"):
        open_log(path)


def test_an_abandoned_pass_closes_the_file(path: Path) -> None:
    write_by_mcap(path, *trial(), chunk_size=4000)
    log = open_as_file(path)
    chunks = log.chunks()
    next(chunks)
    chunks.close()  # type: ignore[attr-defined]
    assert_same_log(log, read(path))


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, Path]:
    path = tmp_path_factory.mktemp("damaged") / "trial.mcap"
    return write_recording(path), path


def _assert_same_log_or_both_rejected(path: Path) -> None:
    try:
        expected_log = read(path)
    except LogError:
        with pytest.raises(LogError):
            _read_all_chunks(path)
        return
    log = open_log(path)
    if isinstance(log, LogFile):
        assert_same_log(log, expected_log)
    else:
        assert log.warnings == expected_log.warnings


def _read_all_chunks(path: Path) -> None:
    log = open_log(path)
    assert isinstance(log, LogFile)
    list(log.chunks())


@given(ANYWHERE, ANYWHERE, st.booleans())
@settings(derandomize=True, deadline=None, max_examples=150)
def test_a_file_with_a_flipped_bit_gives_the_same_log_as_read(
    damaged: tuple[bytes, Path], record: float, where: float, in_its_head: bool
) -> None:
    data, path = damaged
    _, start, end = file_records(data)[offset_between(record, 0, len(file_records(data)))]
    if in_its_head:
        end = min(end, start + 60)
    path.write_bytes(flip_bit(data, offset_between(where, 8 * start, 8 * end)))
    with pytest.MonkeyPatch.context() as patch:
        _small(patch)
        _assert_same_log_or_both_rejected(path)


@given(ANYWHERE, st.sampled_from([0, 1, 4096]))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_an_unfinished_file_gives_the_same_log_as_read(
    damaged: tuple[bytes, Path], where: float, zeros: int
) -> None:
    data, path = damaged
    path.write_bytes(data[: offset_between(where, 8, len(data))] + bytes(zeros))
    with pytest.MonkeyPatch.context() as patch:
        _small(patch)
        _assert_same_log_or_both_rejected(path)


def test_a_damaged_first_mcap_chunk_loses_no_other(path: Path) -> None:
    data = write_recording(path)
    _, end = mcap_chunk_ranges(data)[0]
    (data_end,) = (begin for opcode, begin, _ in file_records(data) if opcode == Opcode.DATA_END)
    broken = flip_bit(data, 8 * (end - 20))
    for contents in (
        broken,
        broken[:data_end],
    ):  # with and without a summary
        path.write_bytes(contents)
        log = open_log(path)
        assert isinstance(log, LogFile)
        assert_same_log(log, read(path))


def test_memory_of_a_pass_does_not_grow_with_the_file(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shiplog.mcap.stream, "FILE_CHUNK_SAMPLES", 1 << 15)
    peaks = []
    for count in (100_000, 400_000):
        write(TrialLog("t", (channel("yaw_rate", count),)), path)
        log = open_as_file(path)
        tracemalloc.start()
        samples = sum(len(c) for chunk in log.chunks() for c in chunk)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert samples == count
    assert peaks[1] < 1.4 * peaks[0]
    assert peaks[1] < 400_000 * 24
