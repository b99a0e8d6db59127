"""Printed times: ISO 8601, date orders, midnight, and time zones."""

from datetime import UTC, datetime, timedelta, tzinfo
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from shiplog.layouts.layout import TimeForm
from shiplog.tables.printed_times import TimeTextError, parse_times

BERLIN = ZoneInfo("Europe/Berlin")


def read(texts: list[str], dates: list[str] | None = None, **form: object) -> list[str]:
    times_ns, _ = parse_times(texts, dates, TimeForm(**form))  # type: ignore[arg-type]
    return [str(time)[:23] for time in times_ns.astype("datetime64[ns]")]


@pytest.mark.parametrize(
    "text",
    [
        "2026-03-29T00:55:00Z",
        "2026-03-29 00:55:00.000+00:00",
        "2026-03-29T02:55:00+0200",
        "2026-03-28T19:25-05:30",
        "20260329T005500Z",
        "29-Mar-2026 00:55:00 UTC",
        "29.03.2026 00:55:00,000 Z",
        "3/29/2026 12:55:00 AM Z",
    ],
)
def test_one_instant_in_many_forms(text: str) -> None:
    assert read([text]) == ["2026-03-29T00:55:00.000"]


def test_iso_times_are_those_of_the_standard_library() -> None:
    start = datetime(2026, 12, 31, 23, 59, 58, tzinfo=UTC)
    instants = [start + timedelta(milliseconds=137 * i) for i in range(100)]
    times_ns, warnings = parse_times([i.isoformat() for i in instants], None, TimeForm())
    expected = [round(i.timestamp() * 1e6) * 1000 for i in instants]
    np.testing.assert_allclose(times_ns - expected[0], np.array(expected) - expected[0], atol=1000)
    assert warnings == []


@pytest.mark.parametrize(
    ("text", "zone", "differs"),
    [
        ("2026-03-29T00:55:00Z", UTC, False),
        ("2026-07-01T02:00:00+02:00", BERLIN, False),
        ("2026-01-01T02:00:00+02:00", BERLIN, True),
        ("2026-07-01T02:00:00+02:00", UTC, True),
        ("2026-03-29T02:30:00+02:00", BERLIN, True),  # an hour that Berlin does not have
    ],
)
def test_a_zone_that_contradicts_the_printed_offset_is_a_warning(
    text: str, zone: tzinfo, *, differs: bool
) -> None:
    times_ns, warnings = parse_times([text], None, TimeForm(zone=zone))
    assert times_ns[0] == round(datetime.fromisoformat(text).timestamp()) * 10**9
    assert [("which is used" in each, "remove time.zone" in each) for each in warnings] == (
        [(True, True)] if differs else []
    )


def test_a_time_without_a_zone_is_read_as_utc_with_a_warning() -> None:
    times_ns, warnings = parse_times(["1970-01-01 00:00:01"], None, TimeForm())
    assert times_ns.tolist() == [10**9]
    assert len(warnings) == 1
    assert "time.zone" in warnings[0]


def test_ambiguous_dates_are_refused_unless_the_order_is_stated() -> None:
    with pytest.raises(TimeTextError, match="day and month are ambiguous"):
        read(["03/04/2026 00:00"], zone=UTC)
    assert read(["03/04/2026 00:00"], zone=UTC, date_order="dmy")[0].startswith("2026-04-03")
    assert read(["03/04/2026 00:00"], zone=UTC, date_order="mdy")[0].startswith("2026-03-04")
    with pytest.raises(TimeTextError, match="no month from 1 to 12"):
        read(["13/04/2026 00:00"], zone=UTC, date_order="mdy")
    assert read(["290326 00:00"], zone=UTC, date_order="dmy")[0].startswith("2026-03-29")


def test_day_times_pass_midnight() -> None:
    expected = ["1970-01-01T23:59:59.000", "1970-01-02T00:00:00.000"]
    assert read(["23:59:59", "00:00:00"], zone=UTC) == expected
    assert read(["235959", "000000"], zone=UTC) == expected
    start_ns = 5 * 86_400 * 10**9
    assert read(["23:59:59", "00:00:00"], zone=UTC, start_ns=start_ns)[1].startswith("1970-01-07")


@pytest.mark.parametrize("advanced_at", [1, 2, 3, 4])  # early, in time, late, never
def test_a_date_column_passes_midnight_whenever_it_is_advanced(advanced_at: int) -> None:
    clock = ["23:59:58", "23:59:59", "00:00:00", "00:00:01"]
    dates = ["2026-03-29" if i < advanced_at else "2026-03-30" for i in range(4)]
    times_ns, _ = parse_times(clock, dates, TimeForm(zone=UTC))
    assert np.diff(times_ns).tolist() == [10**9] * 3


def test_summer_time_of_a_named_zone() -> None:
    assert read(["2026-03-29 01:59:59", "2026-03-29 03:00:00"], zone=BERLIN) == [
        "2026-03-29T00:59:59.000",
        "2026-03-29T01:00:00.000",
    ]
    assert read(["2026-10-25 02:59:59", "2026-10-25 02:00:00"], zone=BERLIN) == [
        "2026-10-25T00:59:59.000",
        "2026-10-25T01:00:00.000",
    ]
    with pytest.raises(TimeTextError, match="has twice"):
        read(["2026-10-25 02:10:00"], zone=BERLIN)
    with pytest.raises(TimeTextError, match="does not exist"):
        read(["2026-03-29 02:30:00"], zone=BERLIN)


@pytest.mark.parametrize("text", ["2026-02-30 00:00", "2026-01-01 24:01", "noon", "26-03-29 10:00"])
def test_an_impossible_time_is_refused(text: str) -> None:
    with pytest.raises(TimeTextError):
        read([text], zone=UTC)


@pytest.mark.parametrize(
    "text",
    ["2026-03-29T10:00:01.25Z", "29.03.2026 10:00:01,25+02:00", "3/29/2026 10:00:01 PM", "10:00:01",
     "20260329T100001.123456789123Z", "29-Mar-2026 1:00:01"],
)  # fmt: skip
def test_texts_of_one_form_give_the_times_of_texts_of_several_forms(text: str) -> None:
    form = TimeForm(0, UTC)
    alike, _ = parse_times([text, text], None, form)
    mixed, _ = parse_times([text, text + " "], None, form)  # the blank is another form
    np.testing.assert_array_equal(alike, mixed)
