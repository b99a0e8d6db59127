"""Events as a table: bounded in number, with marks of a person and severe ones first."""

from shiplog.checks.event_table import MAX_ROWS, event_table, events_to_json
from shiplog.types import Event, EventLevel


def test_many_events_are_bounded_and_those_of_a_person_are_kept() -> None:
    events = [Event(k * 10**9, f"gap {k}", "gps") for k in range(500)]
    events[333] = Event(333 * 10**9, "execute")
    events[444] = Event(444 * 10**9, "lost", "gps", EventLevel.ERROR)
    table = event_table(events, 0)
    assert len(table.rows) == MAX_ROWS
    texts = [row[-1] for row in table.rows]
    assert texts[-2:] == ["execute", "lost"]
    assert table.remarks == (f"{500 - MAX_ROWS} more events are in the log.",)
    assert events_to_json(events, 0)["events_omitted"] == 0


def test_the_date_is_shown_where_events_are_of_several_days() -> None:
    events = [Event(0, "a"), Event(86_400 * 10**9, "b")]
    assert [row[0] for row in event_table(events, 0).rows] == [
        "1970-01-01 00:00:00",
        "1970-01-02 00:00:00",
    ]
    assert event_table(events[:1], 0).rows[0][:3] == ("00:00:00", "0.0", "info")
    assert event_table((), None).rows == ()
