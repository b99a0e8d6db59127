"""Tests of recorders.nmea0183.utc_fields, with datetime as the reference."""

from datetime import UTC, datetime

import pytest

from recorders.nmea0183.utc_fields import utc_of
from recorders.streams.gnss_clock import Utc, nearest_ns

HOUR_NS = 3600 * 10**9
DAY_NS = 24 * HOUR_NS


def _utc_of(body: str) -> Utc | None:
    formatter, *fields = body.encode().split(b",")
    return utc_of(formatter.decode(), tuple(fields))


@pytest.mark.parametrize(
    ("body", "when"),
    [
        ("ZDA,000000.17,01,08,2014,,", datetime(2014, 8, 1, 0, 0, 0, 170_000, UTC)),
        ("ZDA,235959,29,02,2024,00,00", datetime(2024, 2, 29, 23, 59, 59, 0, UTC)),
        ("RMC,130156.000,A,,,,,0.00,,201125,,,D", datetime(2025, 11, 20, 13, 1, 56, 0, UTC)),
        ("RMC,235959.226,A,,,,,,,151294,,", datetime(1994, 12, 15, 23, 59, 59, 226_000, UTC)),
        ("RMC,000000,A,,,,,,,010179,,", datetime(2079, 1, 1, tzinfo=UTC)),
    ],
)
def test_a_date_and_a_time_are_read(body: str, when: datetime) -> None:
    utc = _utc_of(body)
    assert utc is not None
    assert utc.day is not None
    ns = int(when.replace(microsecond=0).timestamp()) * 10**9 + when.microsecond * 1000
    assert utc.day * DAY_NS + utc.clock_ns == ns


@pytest.mark.parametrize(
    ("body", "clock_ns"),
    [
        ("GGA,235959.226,,,,,1,06", DAY_NS - 774_000_000),
        ("GLL,6005.071,N,02332.346,E,095559,A,D", 9 * HOUR_NS + (55 * 60 + 59) * 10**9),
        ("GNS,014035.00,4332.6,S,17235.4,E,RR,13", HOUR_NS + (40 * 60 + 35) * 10**9),
        ("ZDA,095559,,,,00,", 9 * HOUR_NS + (55 * 60 + 59) * 10**9),
        ("RMC,010000,A,,,,,,,,,", HOUR_NS),
        ("ZDA,235960,,,,,", DAY_NS),  # a leap second
    ],
)
def test_a_time_without_a_date_is_a_time_of_day(body: str, clock_ns: int) -> None:
    assert _utc_of(body) == Utc(clock_ns, None)


@pytest.mark.parametrize(
    "body",
    [
        "HDT,218.53,T",
        "ZDA,,01,08,2014,,",
        "RMC,130156.000,V,,,,,0.00,,201125,,,N",
        "RMC,130156.000,A,,,,,0.00,,201125,,,E",
        "GGA,130156.000,,,,,0,00",
        "GLL,,,,,130156,V,N",
        "GNS,130156,,,,,NN,00",
        "GGA",
    ],
)
def test_a_time_without_a_fix_is_not_used(body: str) -> None:
    assert _utc_of(body) is None


@pytest.mark.parametrize(
    "body",
    [
        "ZDA,240000,01,08,2014,,",
        "ZDA,126000,01,08,2014,,",
        "ZDA,120061,01,08,2014,,",
        "ZDA,12:00:00,01,08,2014,,",
        "ZDA,120000.x,01,08,2014,,",
        "ZDA,120000,30,02,2014,,",
        "ZDA,120000,01,13,2014,,",
        "ZDA,120000,-1,08,2014,,",
        "ZDA,120000,01,08,20140,,",
        "ZDA,120000,01,08,9999,,",
        "RMC,120000,A,,,,,,,310225,,",
        "RMC,120000,A,,,,,,,0108,,",
    ],
)
def test_a_malformed_time_is_an_error(body: str) -> None:
    with pytest.raises(ValueError, match=r".*"):
        _utc_of(body)


@pytest.mark.parametrize(
    ("clock_hours", "reference_hours", "expected_hours"),
    [(23.5, 24.5, 23.5), (0.5, 47.5, 48.5), (12, 24, 12), (12, 23.9, 12), (0, 100, 96)],
)
def test_a_time_of_day_is_the_one_nearest_to_the_reference(
    clock_hours: float, reference_hours: float, expected_hours: float
) -> None:
    near = nearest_ns(int(clock_hours * HOUR_NS), int(reference_hours * HOUR_NS))
    assert near == int(expected_hours * HOUR_NS)
