"""Tests of recorders.streams.stamps; the expected times are those of datetime or of `date -u`."""

import argparse
from datetime import UTC, date, datetime

import pytest

from recorders.streams.counts import StreamCounts
from recorders.streams.packets import NO_TIME, Packet
from recorders.streams.stamps import (
    FORMS,
    StampReader,
    add_date_option,
    find_stamp_form,
    read_stamps,
)
from shiplog.errors import LogError, UsageError

PAYLOAD = b"$HEHDT,218.53,T*12"
INSTANT_NS = 1_406_851_200_124_000_000  # 2014-08-01 00:00:00.124 UTC


def _ns(*args: int, micros: int = 0) -> int:
    return int(datetime(*args, tzinfo=UTC).timestamp()) * 10**9 + micros * 1000


def _packets(*lines: bytes) -> list[Packet]:
    return [Packet(line, NO_TIME) for line in lines]


@pytest.mark.parametrize("separator", [b" ", b"\t", b",", b", ", b";"])
@pytest.mark.parametrize(
    ("name", "stamp", "time_ns"),
    [
        ("iso", b"2014-08-01T00:00:00.124000Z", INSTANT_NS),
        ("iso", b"2014-08-01 00:00:00,124", INSTANT_NS),
        ("iso", b"2014-08-01T02:00:00.124+02:00", INSTANT_NS),
        ("iso", b"2014-07-31T18:30:00.124-0530", INSTANT_NS),
        ("iso", b"2014-08-01T00:00:00.124000001Z", INSTANT_NS + 1),
        ("iso", b"2024-02-29T23:59:59Z", _ns(2024, 2, 29, 23, 59, 59)),
        ("canboat", b"2011-11-24-22:42:04.388", _ns(2011, 11, 24, 22, 42, 4, micros=388_000)),
        ("candump", b"(1406851200.124000)", INSTANT_NS),
        ("s", b"1406851200.124", INSTANT_NS),
        ("s", b"1406851200", INSTANT_NS - 124_000_000),
        ("ms", b"1406851200124", INSTANT_NS),
        ("ms", b"1406851200124.5", INSTANT_NS + 500_000),
        ("us", b"1406851200124000", INSTANT_NS),
        ("ns", b"1406851200124000000", INSTANT_NS),
    ],
)
def test_a_stamp_is_detected_read_and_removed(
    name: str, stamp: bytes, time_ns: int, separator: bytes
) -> None:
    line = stamp + separator + PAYLOAD
    form = find_stamp_form(_packets(line))
    assert form is not None
    assert form.name == name
    assert StampReader(form).read(line) == (time_ns, PAYLOAD)


@pytest.mark.parametrize(
    "line",
    [
        PAYLOAD,
        b"\\s:GR0001*11\\" + PAYLOAD,
        b"!AIVDM,1,1,,A,13u,0*5C",
        b"MET,12.1,22",
        b"",
        b"12.5 3",
    ],
)
def test_lines_without_a_stamp_are_known_as_such(line: bytes) -> None:
    assert find_stamp_form(_packets(line, line)) is None


def test_an_empty_file_has_no_stamps() -> None:
    assert find_stamp_form([]) is None


def test_a_stated_form_is_used_and_none_switches_the_detection_off() -> None:
    head = _packets(b"22:42:04.388 " + PAYLOAD)
    assert find_stamp_form(head, "clock") is FORMS["clock"]
    assert find_stamp_form(head, "none") is None


def test_a_stated_form_that_no_line_has_is_refused_with_an_example() -> None:
    with pytest.raises(LogError, match=r"no line begins with .*1322174524388;.*--stamp \(auto, no"):
        find_stamp_form(_packets(PAYLOAD), "ms")


@pytest.mark.parametrize(
    "lines",
    [
        [b"22:42:04 " + PAYLOAD, PAYLOAD, PAYLOAD],
        [b"22:42:04 " + PAYLOAD, b"1406851200 " + PAYLOAD],
    ],
)
def test_stamps_on_some_lines_or_of_two_forms_are_refused_with_the_remedy(
    lines: list[bytes],
) -> None:
    with pytest.raises(LogError, match=r"not all lines begin with the same form.*--stamp"):
        find_stamp_form(_packets(*lines))


def test_times_of_day_pass_midnight_and_late_lines_do_not() -> None:
    reader = StampReader(FORMS["clock"], date(2024, 2, 28))
    clocks = [b"23:59:59.5", b"00:00:00.25", b"23:59:59.75", b"00:00:01", b"12:00:00", b"00:00:00"]
    times = [read[0] for clock in clocks if (read := reader.read(clock + b" x")) is not None]
    assert times == [
        _ns(2024, 2, 28, 23, 59, 59, micros=500_000),
        _ns(2024, 2, 29, micros=250_000),
        _ns(2024, 2, 28, 23, 59, 59, micros=750_000),
        _ns(2024, 2, 29, 0, 0, 1),
        _ns(2024, 2, 29, 12),
        _ns(2024, 2, 29),
    ]


def test_a_missing_zone_is_reported() -> None:
    reader = StampReader(FORMS["iso"])
    reader.read(b"2014-08-01T00:00:00Z x")
    assert not reader.zone_is_assumed
    reader.read(b"2014-08-01T00:00:01 x")
    assert reader.zone_is_assumed


@pytest.mark.parametrize(
    "line",
    [
        b"2014-13-01T00:00:00Z x",
        b"2014-02-30T00:00:00Z x",
        b"2014-08-01T25:00:00Z x",
        b"2014-08-01T00:00:00+99:00 x",
        b"2014-08-01T00:00:00Z",
        b"9999-12-31T23:59:59Z x",
        b"0001-01-01T00:00:00+05:00 x",
        b"1969-12-31T23:59:59Z x",
        b"x",
        b"",
    ],
)
def test_lines_without_a_valid_stamp_are_rejected_and_counted(line: bytes) -> None:
    counts = StreamCounts()
    good = b"2014-08-01T00:00:00.124Z " + PAYLOAD
    batches = read_stamps(iter([_packets(line, good)]), StampReader(FORMS["iso"]), counts)
    assert list(batches) == [[Packet(PAYLOAD, INSTANT_NS)]]
    assert counts.rejected == {"no valid time stamp": 1}


@pytest.mark.parametrize("text", ["01.05.2026", "1969-12-31", "2262-01-01", "", "2026-02-30"])
def test_a_day_that_no_log_can_hold_is_a_usage_error(text: str) -> None:
    parser = argparse.ArgumentParser()
    add_date_option(parser)
    with pytest.raises(UsageError, match="--date takes YYYY-MM-DD"):
        parser.parse_args([f"--date={text}"])


@pytest.mark.parametrize("day", [date(1970, 1, 1), date(2261, 12, 31)])
def test_the_first_and_the_last_day_that_a_log_can_hold_are_read(day: date) -> None:
    parser = argparse.ArgumentParser()
    add_date_option(parser)
    assert parser.parse_args(["--date", str(day)]).date == day
