"""Events of a log: read from any file, cut, pickled, and kept by every conversion."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from mcap_files import end_mcap_chunk, mcap_chunk_ranges

import shiplog.mcap.stream
from shiplog import Channel, LogFile, LogWriter, TrialLog, open_log, read
from shiplog.checks.info import read_log_info
from shiplog.mcap.raw_reader import read_raw
from shiplog.tables.convert import convert
from shiplog.types import Event, EventLevel, RawPackets

START = 1_700_000_000_000_000_000
SECOND = 10**9
EVENTS = (
    Event(START - 3 * SECOND, "power on", "gps"),
    Event(START + 10 * SECOND, "execute, 20 starboard"),
    Event(START + 20 * SECOND, 'no data\nfor "5 s"', "gps", EventLevel.WARNING),
    Event(START + 59 * SECOND, "finished", "operator", EventLevel.ERROR),
)


def chunk(k: int) -> tuple[Channel, RawPackets]:
    """Return ten samples and packets of the k-th second."""
    at = START + k * SECOND + np.arange(10) * SECOND // 10
    packets = tuple(b"$HEROT,%d.%d,A" % (k, i) for i in range(10))
    return (
        Channel("yaw_rate", "gyro", "rad/s", at, at, np.sin(at * 1e-9)),
        RawPackets("gyro", "nmea0183", at, packets),
    )


def record(path: Path, *, finish: bool = True) -> LogWriter:
    writer = LogWriter(path)
    for k in range(60):
        writer.write(*chunk(k), *(e for e in EVENTS if (e.time_ns - START) // SECOND == k))
        if k == 0:
            writer.write(EVENTS[0])
        end_mcap_chunk(writer) if k % 7 == 0 else writer.flush()
    if finish:
        writer.close()
    return writer


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


@pytest.fixture
def as_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shiplog.mcap.stream, "MAX_SAMPLES_IN_MEMORY", 0)
    monkeypatch.setattr(shiplog.mcap.stream, "FILE_CHUNK_SAMPLES", 50)


def test_a_log_has_its_events_in_the_order_of_time(path: Path) -> None:
    record(path)
    log = read(path)
    assert log.events == EVENTS
    assert log.warnings == ()
    assert pickle.loads(pickle.dumps(log)).events == EVENTS  # noqa: S301 - our own
    assert TrialLog("t", (), events=EVENTS[::-1]).events == EVENTS


def test_events_of_unfinished_and_damaged_files_are_read(path: Path) -> None:
    writer = record(path, finish=False)
    data = path.read_bytes()
    writer.close()
    path.write_bytes(data)
    assert read(path).events == EVENTS
    ranges = mcap_chunk_ranges(data)  # ended after 0, 7, 14, 21 s, ...
    path.write_bytes(data[: ranges[5][0]])
    assert read(path).events == EVENTS[:3]
    damaged = bytearray(data)
    damaged[sum(ranges[4]) // 2] ^= 0x10  # from 22 to 28 s
    path.write_bytes(damaged)
    log = read(path)
    assert log.data_lost
    assert log.events == EVENTS


def test_a_part_of_a_file_has_its_events(path: Path) -> None:
    record(path)
    assert read(path, channels=()).events == EVENTS
    assert read(path, channels=["yaw_rate"], end_ns=START + 15 * SECOND).events == EVENTS[:2]


@pytest.mark.usefixtures("as_file")
@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [(None, None, EVENTS), (10, 20, EVENTS[1:2]), (15, None, EVENTS[2:]), (None, 20, EVENTS[:2])],
)
def test_a_cut_has_the_events_within_it_and_is_open_where_it_has_no_bound(
    path: Path,
    start: float | None,
    end: float | None,
    expected: tuple[Event, ...],
) -> None:
    record(path)
    assert read(path).between(start, end).events == expected
    log = open_log(path, start, end)
    assert isinstance(log, LogFile)
    assert log.events == expected
    assert sum(len(c) for chunk in log.chunks() for c in chunk) > 0
    assert log.events == expected


def test_the_times_of_events_follow_a_clock_that_was_set_back(path: Path) -> None:
    step = -30 * SECOND
    with LogWriter(path) as writer:
        for k in range(60):
            samples, _ = chunk(k)
            shift = step if k >= 40 else 0
            at = samples.received_ns + shift
            other = Channel("rudder", "x", "rad", at, at, np.sin(at * 1e-9))
            writer.write(Channel("yaw_rate", "gyro", "rad/s", at, at, samples.values), other)
            end_mcap_chunk(writer)
            if k in (20, 50):
                writer.write(Event(START + k * SECOND + SECOND // 2 + shift, f"{k}"))
    log = read(path)
    assert any("set back" in warning for warning in log.warnings)
    times = [(event.time_ns - START) / SECOND for event in log.events]
    assert times == pytest.approx([20.5, 50.5], abs=0.11)


def test_raw_packets_are_read_in_the_order_of_the_file(path: Path) -> None:
    for finish in (False, True):
        writer = record(path, finish=finish)
        packets = list(read_raw(path))
        assert {(p.source, p.format, p.topic) for p in packets} == {
            ("gyro", "nmea0183", "/raw/gyro")
        }
        data = [d for p in packets for d in p.data]
        assert data == [d for k in range(60) for d in chunk(k)[1].data]
        received = np.concatenate([p.received_ns for p in packets])
        np.testing.assert_array_equal(received[:11], [*chunk(0)[1].received_ns, START + SECOND])
        writer.close()


def test_info_lists_raw_packets_and_events(path: Path) -> None:
    record(path)
    info = read_log_info(path)
    (raw,) = info.raw
    assert (raw.topic, raw.packets, raw.format) == ("/raw/gyro", 600, "nmea0183")
    assert raw.rate_hz == pytest.approx(10)
    assert info.foreign == ()
    entries = info.to_dict()["events"]
    assert [entry["text"] for entry in entries] == [event.text for event in EVENTS]
    assert [entry["since_start_secs"] for entry in entries] == [-3.0, 10.0, 20.0, 59.0]
    assert entries[1]["time_utc"] == "2023-11-14T22:13:30.000Z"


def test_info_of_a_long_file_has_events_and_packets(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(path)
    monkeypatch.setattr("shiplog.checks.info.MAX_MESSAGES_TO_READ", 10)
    info = read_log_info(path)
    assert info.events == EVENTS
    assert info.raw[0].packets == 600


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mcap"])
def test_conversions_keep_events_and_name_the_packets_that_they_drop(
    path: Path, tmp_path: Path, suffix: str
) -> None:
    record(path)
    table, back = tmp_path / f"table{suffix}", tmp_path / "back.mcap"
    _, warnings = convert(path, table)
    convert(table, back)
    assert read(back).events == EVENTS
    if suffix == ".mcap":
        assert warnings == []
        data = [d for p in read_raw(back) for d in p.data]
        assert data == [d for k in range(60) for d in chunk(k)[1].data]
    else:
        (warning,) = warnings
        assert "600 of /raw/gyro" in warning


def test_a_converted_part_has_the_packets_and_events_within_it(path: Path, tmp_path: Path) -> None:
    record(path)
    part = tmp_path / "part.mcap"
    convert(path, part, start=10, end=20)
    data = [d for p in read_raw(part) for d in p.data]
    assert data == [d for k in range(10, 20) for d in chunk(k)[1].data]
    assert read(part).events == EVENTS[1:2]


def test_a_recording_of_packets_alone_is_rescued(path: Path, tmp_path: Path) -> None:
    writer = LogWriter(tmp_path / "raw.mcap.part")
    writer.write(chunk(0)[1])
    writer.flush()
    convert(tmp_path / "raw.mcap.part", path)
    assert sum(map(len, read_raw(path))) == 10
    writer.close()
