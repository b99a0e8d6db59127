"""Tests of recorders.trial.recorded_source: files joined in the order of their times."""

from dataclasses import replace
from pathlib import Path

import pytest
from number_format import NUMBERS

from recorders.record import record
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import parse_options
from recorders.trial.open_source import StreamRequest, open_streams
from recorders.trial.recorded_source import RecordedSource
from shiplog import read
from shiplog.errors import LogError, UsageError
from shiplog.types import Channel


def _request(path: Path, **options: float) -> StreamRequest:
    parsed = parse_options(NUMBERS, options, path.stem)
    return StreamRequest(path.stem, NUMBERS, str(path), parsed, None, f"{path.stem}.")


def _written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_two_files_are_joined_in_the_order_of_reception(tmp_path: Path) -> None:
    fast = _written(tmp_path / "fast.txt", *(f"heading {n / 1000}" for n in range(20_000)))
    slow = _written(tmp_path / "slow.txt", *(f"speed {n / 10}" for n in range(200)))
    source = open_streams(
        [_request(fast, step=0.01), _request(slow, start=3.0, step=1.0)], ReceptionClock()
    )
    chunks = list(source.chunks())
    ends = 0
    for chunk in chunks:
        times = [t for item in chunk for t in item.received_ns.tolist()]  # type: ignore[union-attr]
        assert min(times) >= ends
        ends = max(times)
    record(open_streams([_request(fast, step=0.01), _request(slow, start=3.0, step=1.0)],
                        ReceptionClock()), tmp_path / "log.mcap")  # fmt: skip
    log = read(tmp_path / "log.mcap")
    assert log.warnings == ()
    assert len(log["heading/fast.N"]) == 20_000
    assert len(log["speed/slow.N"]) == 200
    assert log["speed/slow.N"].measured_ns[0] == 3 * 10**9


def test_a_file_without_any_sample_is_an_error_that_names_it(tmp_path: Path) -> None:
    source = open_streams([_request(_written(tmp_path / "a.txt", "x", "y"))], ReceptionClock())
    assert isinstance(source, RecordedSource)
    with pytest.raises(LogError, match=r"no sample could be decoded.*a\.txt"):
        list(source.chunks())


def test_a_file_without_any_sample_leaves_no_recording(tmp_path: Path) -> None:
    """The next attempt, with the right format, finds nothing in its way."""
    for _ in range(2):
        source = open_streams([_request(_written(tmp_path / "a.txt", "x", "y"))], ReceptionClock())
        with pytest.raises(LogError, match=r"no sample could be decoded from a\.txt"):
            record(source, tmp_path / "log.mcap")
    assert not list(tmp_path.glob("log*"))


def test_a_file_without_any_sample_beside_another_is_a_warning(tmp_path: Path) -> None:
    good = _written(tmp_path / "good.txt", "rpm 60")
    bad = _written(tmp_path / "bad.txt", "x", "y")
    source = open_streams([_request(good), _request(bad)], ReceptionClock())
    assert isinstance(source, RecordedSource)
    list(source.chunks())
    warnings = [stream.decoder.counts.warnings for stream in source.streams]
    assert warnings[0] == ()
    [warning] = warnings[1]
    assert warning.startswith(
        "no sample could be decoded from bad.txt: 2 of 2 packets cannot be read (most: not a"
    )


def test_all_missing_files_are_named_at_once(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no such file: .*a\.txt; no such file: .*b\.txt"):
        open_streams([_request(tmp_path / "a.txt"), _request(tmp_path / "b.txt")], ReceptionClock())


def test_the_standard_input_is_that_of_one_stream() -> None:
    with pytest.raises(UsageError, match="two sources read the standard input"):
        open_streams([_request(Path("-")), _request(Path("-"))], ReceptionClock())


def test_files_that_overlap_in_part_or_not_at_all_lose_no_sample(tmp_path: Path) -> None:
    spans = {"first": 0.0, "overlaps": 0.55, "later": 100.0}
    requests = [
        _request(_written(tmp_path / f"{name}.txt", *(f"rpm {n}" for n in range(10))), start=start)
        for name, start in spans.items()
    ]
    chunks = list(open_streams(requests, ReceptionClock()).chunks())
    samples = [
        sample
        for chunk in chunks
        for sample in sorted(
            (t, c.source) for c in chunk if isinstance(c, Channel) for t in c.received_ns.tolist()
        )
    ]
    assert len(samples) == 30
    assert samples == sorted(samples)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        open_streams([_request(tmp_path / "none.txt")], ReceptionClock())


def test_live_and_recorded_sources_together_are_refused(tmp_path: Path) -> None:
    file = _written(tmp_path / "a.txt", "rpm 60")
    live = StreamRequest("live", NUMBERS, "udp://127.0.0.1:1", parse_options(NUMBERS, {}, "live"))
    with pytest.raises(UsageError, match="have no common time"):
        open_streams([_request(file), live], ReceptionClock())


def test_the_pace_changes_no_sample(tmp_path: Path) -> None:
    file = _written(tmp_path / "a.txt", *(f"rpm {n}" for n in range(50)))
    slow, fast = (
        list(open_streams([replace(_request(file), pace=pace)], ReceptionClock()).chunks())
        for pace in (50.0, None)
    )
    assert len(slow) > len(fast)
    record_of = [
        [
            sample
            for chunk in chunks
            for channel in chunk
            if isinstance(channel, Channel)
            for sample in zip(channel.received_ns.tolist(), channel.values.tolist(), strict=True)
        ]
        for chunks in (slow, fast)
    ]
    assert len(record_of[0]) == 50
    assert record_of[0] == record_of[1]
