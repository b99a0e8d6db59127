"""Tests of recorders.nmea2000.line_times."""

import pytest
from decoded_streams import file_batches

from recorders.nmea2000.line_formats import FORMATS
from recorders.nmea2000.line_times import LineTimes
from recorders.streams.counts import StreamCounts
from shiplog.errors import LogError, UsageError

SECOND_NS = 10**9
DAY_NS = 86400 * SECOND_NS
HOUR_NS = 3600 * SECOND_NS
DATA = b"ff,10,27,ff,7f,ff,7f,fc"


def canboat(stamp: str) -> bytes:
    return stamp.encode() + b",2,127250,27,255,8," + DATA


def yacht_devices(stamp: str) -> bytes:
    return stamp.encode() + b" R 09F1121B FF 10 27 FF 7F FF 7F FC"


def ikonvert(stamp: str) -> bytes:
    return b"!PDGY,127250,2,27,255," + stamp.encode() + b",/xAn/3//f/w="


def candump(stamp: float) -> bytes:
    return b"(%010.6f) can0 09F1121B#FF1027FF7FFF7FFC" % stamp


def times_of(
    name: str, lines: list[bytes], start_ns: int | None = None, size: int = 100
) -> tuple[list[int], StreamCounts]:
    counts = StreamCounts()
    times = LineTimes(FORMATS[name], start_ns, counts)
    batches = times.apply(file_batches(lines, size))
    return [packet.received_ns for batch in batches for packet in batch], counts


@pytest.mark.parametrize(
    ("stamp", "time_ns"),
    [
        ("1970-01-02T00:00:01.5Z", DAY_NS + 1_500_000_000),
        ("1970-01-02T00:00:01Z", DAY_NS + SECOND_NS),
        ("1970-01-02-00:00:01.078", DAY_NS + 1_078_000_000),
        ("1972-02-29T00:00:00.000000001Z", 789 * DAY_NS + 1),
    ],
)
def test_dates_and_times_are_read_to_the_nanosecond(stamp: str, time_ns: int) -> None:
    assert times_of("canboat", [canboat(stamp)])[0] == [time_ns]


def test_stamps_of_candump_are_seconds_since_1970_or_a_date() -> None:
    epoch, _ = times_of("candump", [candump(1745600961.25)])
    date, _ = times_of("candump", [b"(2025-04-25 17:09:21.250000) can0 09F1121B#FF"])
    assert epoch == date == [1_745_600_961_250_000_000]


def test_a_time_of_day_goes_past_midnight() -> None:
    lines = [yacht_devices(s) for s in ("23:59:59.900", "00:00:00.100", "00:00:00.050")]
    times, counts = times_of("yacht-devices", lines, 20_000 * DAY_NS + 5 * HOUR_NS)
    midnight_ns = 20_001 * DAY_NS
    assert times == [midnight_ns - 10**8, midnight_ns + 10**8, midnight_ns + 5 * 10**7]
    assert counts.warnings == ()


def test_a_time_of_day_that_goes_back_by_hours_is_of_the_next_day_and_warned_about() -> None:
    lines = [yacht_devices(s) for s in ("18:00:00.000", "08:00:00.000", "08:00:01.000")]
    times, counts = times_of("yacht-devices", lines, 0)
    assert times == [18 * HOUR_NS, DAY_NS + 8 * HOUR_NS, DAY_NS + 8 * HOUR_NS + SECOND_NS]
    assert "goes back by 10.0 h" in counts.warnings[0]


def test_actisense_stamps_are_times_of_day() -> None:
    line = b"A173321.107 1BFF2 1F112 FF1027FF7FFF7FFC"
    assert times_of("actisense-ascii", [line], DAY_NS)[0] == [
        DAY_NS + 17 * HOUR_NS + (33 * 60 + 21) * SECOND_NS + 107 * 10**6
    ]


def test_without_a_date_the_log_begins_in_1970_with_a_warning() -> None:
    times, counts = times_of("yacht-devices", [yacht_devices("00:00:01")])
    assert times == [SECOND_NS]
    assert "state its date by --start" in counts.warnings[0]


def test_ikonvert_prints_milliseconds_without_leading_zeros() -> None:
    times, _ = times_of("ikonvert", [ikonvert(s) for s in ("482.37", "482.117", "483.0")], 0)
    assert times == [482_037_000_000, 482_117_000_000, 483_000_000_000]


def test_elapsed_times_count_from_the_start() -> None:
    lines = [candump(stamp) for stamp in (0.0, 0.5)]
    assert times_of("candump-elapsed", lines, DAY_NS)[0] == [DAY_NS, DAY_NS + SECOND_NS // 2]


def test_intervals_are_added() -> None:
    lines = [candump(stamp) for stamp in (0.0, 0.5, 0.25)]
    times, _ = times_of("candump-intervals", lines, DAY_NS)
    assert times == [DAY_NS, DAY_NS + 500_000_000, DAY_NS + 750_000_000]


def test_a_gateway_that_restarted_is_refused() -> None:
    lines = [ikonvert(f"{secs}.0") for secs in (481, 482, 483, 2, 3)]
    with pytest.raises(LogError, match=r"begins again after 483.000 s.*cut the file there"):
        times_of("ikonvert", lines, 0)


def test_a_date_is_refused_where_the_stamps_have_one() -> None:
    with pytest.raises(UsageError, match="omit --start"):
        LineTimes(FORMATS["canboat"], 0, StreamCounts())


@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_a_single_stamp_out_of_order_is_rejected_wherever_batches_are_cut(size: int) -> None:
    stamps = ["00:00:01", "00:00:02", "08:00:03", "00:00:04", "00:00:05"]
    lines = [canboat(f"1970-01-01T{stamp}Z") for stamp in stamps]
    times, counts = times_of("canboat", lines, size=size)
    assert times == [n * SECOND_NS for n in (1, 2, 4, 5)]
    assert counts.rejected == {"stamp out of order": 1}


def test_stamps_that_go_back_a_little_stay_as_they_are() -> None:
    lines = [canboat(f"1970-01-01T00:00:0{n}Z") for n in (3, 1, 4)]
    assert times_of("canboat", lines)[0] == [3 * SECOND_NS, SECOND_NS, 4 * SECOND_NS]


def test_intervals_beyond_the_times_of_a_log_are_rejected() -> None:
    lines = [candump(secs) for secs in (0.0, 1.0, 5e9, 5e9, 1.0)]
    times, counts = times_of("candump-intervals", lines)
    assert times == [0, SECOND_NS, 5 * 10**18 + SECOND_NS, 5 * 10**18 + 2 * SECOND_NS]
    assert counts.rejected == {"stamp out of order": 1}


@pytest.mark.parametrize(
    "stamp",
    [
        "2016-13-09T16:41:09Z",
        "2015-02-29T00:00:00Z",
        "9999-01-01T00:00:00Z",
        "1950-01-01T00:00:00Z",
    ],
)
def test_an_impossible_date_is_rejected_once(stamp: str) -> None:
    lines = [canboat("2016-01-01T00:00:00Z"), canboat(stamp), canboat("2016-01-01T00:00:01Z")]
    times, counts = times_of("canboat", lines, size=1)
    assert len(times) == 2
    assert counts.rejected == {"impossible time": 1}


def test_a_header_has_the_time_of_the_line_after_it_and_a_comment_that_before_it() -> None:
    lines = [b"# format=FAST", canboat("1970-01-01T00:00:01Z"), b"# pause"]
    assert times_of("canboat", lines)[0] == [SECOND_NS] * 3


def test_lines_that_wait_for_a_stamp_are_bounded_in_number() -> None:
    comments = [b"# comment"] * 30_000
    times, counts = times_of("canboat", [*comments, canboat("1970-01-01T00:00:01Z"), *comments])
    assert sum(counts.rejected.values()) + len(times) == 60_001
    assert 10_000 <= counts.rejected["no time stamp"] <= 30_000


def test_lines_without_times_are_refused() -> None:
    with pytest.raises(LogError, match="no line has a time"):
        times_of("candump", [b"  can0  09F1121B   [2]  FF 10"] * 3)


def test_stamps_that_no_bus_can_keep_up_with_are_refused() -> None:
    lines = [canboat(f"2024-02-17T05:15:49.{n // 100:03d}Z") for n in range(5000)]
    with pytest.raises(LogError, match=r"no times of reception: \d+ messages within 0\.0"):
        times_of("canboat", lines)


def test_a_burst_of_a_gateway_is_accepted() -> None:
    burst = [canboat("2024-02-17T05:15:49.000Z")] * 1500
    assert len(times_of("canboat", burst)[0]) == 1500
