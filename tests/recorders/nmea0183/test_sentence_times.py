"""Tests of recorders.nmea0183.sentence_times."""

from datetime import UTC, date, datetime

import pytest
from sentences import sentence

from recorders.nmea0183 import sentence_times
from recorders.nmea0183.sentence_times import (
    SentenceTimes,
    even_times,
    find_reference,
    first_day,
)
from recorders.streams.packets import NO_TIME, Packet
from shiplog.errors import LogError, UsageError

TODAY = date(2026, 6, 1)
SECOND_NS = 10**9
HDT = sentence("HEHDT,1.0,T")


def _zda(when: datetime) -> bytes:
    return sentence(f"GPZDA,{when:%H%M%S.%f},{when:%d,%m,%Y},,"[:-2] + ",,")


def _lines(*lines: bytes) -> list[Packet]:
    return [Packet(line, NO_TIME) for line in lines]


def _stamped(
    packets: list[Packet], day: date | None = None, batch: int = 10_000
) -> tuple[list[float], list[str]]:
    """Return the times in s since the first line's day, and the warnings."""
    warnings: list[str] = []
    reference = find_reference(packets, day, TODAY)
    times = SentenceTimes(reference, lambda text, _time_ns: warnings.append(text))
    cut = [packets[i : i + batch] for i in range(0, len(packets), batch)]
    done = [packet for part in times.stamped(iter(cut)) for packet in part]
    assert [packet.data for packet in done] == [packet.data for packet in packets]
    return [packet.received_ns / SECOND_NS for packet in done], [*reference.warnings, *warnings]


def _at(secs: float, start: datetime = datetime(2026, 5, 1, 12, tzinfo=UTC)) -> bytes:
    return _zda(datetime.fromtimestamp(start.timestamp() + secs, UTC))


START = datetime(2026, 5, 1, 12, tzinfo=UTC).timestamp()


def test_lines_are_interpolated_by_their_order_and_continued_at_both_ends() -> None:
    packets = _lines(HDT, HDT, _at(0), HDT, HDT, HDT, _at(1), HDT, _at(2), HDT)
    times, warnings = _stamped(packets)
    expected = [-0.5, -0.25, 0, 0.25, 0.5, 0.75, 1, 1.5, 2, 2.5]
    assert [time - START for time in times] == pytest.approx(expected, abs=1e-6)
    assert warnings == [
        "no time stamps: times are those of GPZDA, interpolated by the order of lines"
    ]


@pytest.mark.parametrize("batch", [1, 2, 3, 7])
def test_where_batches_are_cut_changes_no_time(batch: int) -> None:
    packets = _lines(*[_at(n // 5) if n % 5 == 2 else HDT for n in range(60)])
    assert _stamped(packets, batch=batch) == _stamped(packets)


@pytest.mark.parametrize("dated", [True, False])
def test_midnight_of_a_leap_day_is_passed(dated: bool) -> None:
    start = datetime(2024, 2, 29, 23, 59, 58, tzinfo=UTC)
    lines = []
    for n in range(4):
        when = datetime.fromtimestamp(start.timestamp() + n, UTC)
        lines += [_zda(when) if dated else sentence(f"GPZDA,{when:%H%M%S},,,,,"), HDT]
    times, _ = _stamped(_lines(*lines), None if dated else date(2024, 2, 29))
    expected = [start.timestamp() + n / 2 for n in range(8)]
    assert times == pytest.approx(expected, abs=1e-6)


def test_a_time_without_a_date_is_counted_from_1970_with_a_warning() -> None:
    lines = [sentence("GPZDA,095559,,,,00,"), HDT, sentence("GPZDA,095601,,,,00,")]
    times, warnings = _stamped(_lines(*lines))
    assert times == [35_759, 35_760, 35_761]
    assert warnings[1] == "GPZDA has no date: counted from 1970-01-01; state it with --date"


def test_the_date_of_another_sentence_is_preferred_to_a_time_without_a_date() -> None:
    rmc = "GPRMC,1200{:02d},A,6005.071,N,02332.346,E,1,1,010526,,"
    gga = "GPGGA,1200{:02d},6005.071,N,02332.346,E,1,9,1,0,M,,,,"
    lines = [sentence(text.format(n)) for n in range(3) for text in (gga, gga, rmc)]
    times, warnings = _stamped(_lines(*lines))
    assert times[2] == START
    assert "those of GPRMC" in warnings[0]


def test_two_receivers_that_are_slightly_apart_do_not_run_backwards() -> None:
    lines = [_at(n + shift) for n in range(20) for shift in (0, 1.2)]
    times, _ = _stamped(_lines(*lines))
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(20.2)


def test_missing_lines_are_no_slow_lines() -> None:
    lines = [_at(n) if n < 10 else _at(n + 600) for n in range(20) for _ in range(1)]
    packets = _lines(*[line for each in lines for line in (each, HDT, HDT, HDT)])
    times, warnings = _stamped(packets)
    assert times[36] - START == pytest.approx(9)
    assert times[39] - START == pytest.approx(9.75)
    assert times[40] - START == pytest.approx(610)
    assert "no times for 601 s: lines may be missing" in warnings


def test_a_first_step_of_years_is_a_gap_and_no_rate_of_lines() -> None:
    first, second = datetime(1980, 1, 6, tzinfo=UTC), datetime(2026, 5, 1, 12, tzinfo=UTC)
    times, warnings = _stamped(_lines(*[HDT] * 50, _at(0, first), _at(0, second), *[HDT] * 400))
    assert times[:51] == [first.timestamp()] * 51
    assert times[51:] == [second.timestamp()] * 401
    assert any(text.startswith("no times for") for text in warnings)


def test_a_clock_set_back_is_followed_with_a_warning() -> None:
    lines = [_at(n) for n in range(100, 120)] + [_at(n) for n in range(30)]
    times, warnings = _stamped(_lines(*lines))
    assert times[-1] - START == pytest.approx(29)
    assert "the times of ZDA were set back" in warnings


def test_lines_of_a_single_epoch_have_its_time_with_a_warning() -> None:
    times, warnings = _stamped(_lines(HDT, _at(0), HDT, _at(0), HDT))
    assert times == [START] * 5
    assert "all lines have one time" in warnings[-1]


def test_a_silent_receiver_is_counted_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentence_times, "MAX_HELD", 50)
    packets = _lines(_at(0), HDT, _at(2), *[HDT] * 120)
    times, warnings = _stamped(packets)
    assert [time - START for time in times] == pytest.approx(list(range(123)))
    assert warnings.count("no new time in 50 lines: counted on") == 2


def test_too_many_lines_without_a_second_time_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentence_times, "MAX_HELD", 50)
    with pytest.raises(LogError, match=r"without a second UTC time; .*--interval"):
        _stamped(_lines(_at(0), *[HDT] * 60))


def test_a_file_without_any_time_is_refused_with_the_remedy() -> None:
    with pytest.raises(LogError, match=r"the file has no time: .*first 2 lines.*--interval"):
        find_reference(_lines(HDT, HDT), None)


def test_a_stated_date_corrects_a_rollover_and_one_that_contradicts_is_refused() -> None:
    head = _lines(_zda(datetime(1994, 12, 16, tzinfo=UTC)))
    reference = find_reference(head, date(2014, 8, 1), TODAY)
    assert reference.first_ns == datetime(2014, 8, 1, tzinfo=UTC).timestamp() * SECOND_NS
    assert "1024 weeks early" in reference.warnings[1]
    with pytest.raises(UsageError, match="--date 2015-01-01 contradicts the date 1994-12-16"):
        find_reference(head, date(2015, 1, 1), TODAY)


def test_another_receiver_corrects_a_rollover() -> None:
    old = sentence("GPZDA,000000,16,12,1994,,")
    head = _lines(old, old, sentence("INZDA,000000,01,08,2014,,"))
    reference = find_reference(head, None, TODAY)
    assert reference.first_ns == datetime(2014, 8, 1, tzinfo=UTC).timestamp() * SECOND_NS


def test_an_old_date_alone_is_reported_and_not_changed() -> None:
    reference = find_reference(_lines(_zda(datetime(1994, 12, 16, tzinfo=UTC))), None, TODAY)
    assert reference.first_ns == datetime(1994, 12, 16, tzinfo=UTC).timestamp() * SECOND_NS
    assert "more than 1024 weeks back" in reference.warnings[1]


def test_even_times_go_on_from_batch_to_batch() -> None:
    batches = even_times(iter([_lines(HDT, HDT), _lines(HDT)]), 5 * SECOND_NS, 0.1)
    times = [packet.received_ns for batch in batches for packet in batch]
    assert times == [5_000_000_000, 5_100_000_000, 5_200_000_000]


def test_the_first_date_of_sentences() -> None:
    assert first_day(_lines(HDT, sentence("GPZDA,1,1,1,1"), _at(0))) == date(2026, 5, 1)
    assert first_day(_lines(HDT)) is None
