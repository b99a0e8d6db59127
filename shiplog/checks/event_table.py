"""Events of a log as a table for people and as plain values for JSON, bounded in number."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from shiplog.text_table import TextTable
from shiplog.types import Event

MAX_ROWS = 30  # of the table
MAX_JSON_EVENTS = 1000
OPERATOR = "operator"  # the source of marks of a person


def event_table(events: Sequence[Event], start_ns: int | None) -> TextTable:
    """Return a table of events; where they are many, marks of a person come before others.

    Parameters
    ----------
    events
        The events in the order of time.
    start_ns
        The start of the log, ns since 1970-01-01 UTC; None for one without samples.
    """
    listed = _as_dicts(events, start_ns, MAX_ROWS)
    is_one_day = len({each["time_utc"][:10] for each in listed}) == 1
    rows = [
        (
            each["time_utc"][11 if is_one_day else 0 : 19].replace("T", " "),
            f"{each['since_start_secs']:.1f}",
            each["level"],
            each["source"],
            each["text"],
        )
        for each in listed
    ]
    rest = len(events) - len(rows)
    remarks = (f"{rest} more events are in the log.",) if rest else ()
    columns = ("time (UTC)", "since start\n[s]", "level", "source", "text")
    return TextTable("Events", columns, tuple(rows), remarks, has_prose=True)


def events_to_json(events: Sequence[Event], start_ns: int | None) -> dict[str, Any]:
    """Return events as plain values, and the number of those that are omitted."""
    listed = _as_dicts(events, start_ns, MAX_JSON_EVENTS)
    return {"events": listed, "events_omitted": len(events) - len(listed)}


def _as_dicts(events: Sequence[Event], start_ns: int | None, most: int) -> list[dict[str, Any]]:
    origin = events[0].time_ns if start_ns is None and events else start_ns or 0
    return [
        {
            "time_utc": f"{np.datetime64(event.time_ns, 'ns').astype('M8[ms]')}Z",
            "since_start_secs": round((event.time_ns - origin) * 1e-9, 3),
            "level": event.level.name.lower(),
            "source": event.source,
            "text": event.text,
        }
        for event in _most_relevant(events, most)
    ]


def _most_relevant(events: Sequence[Event], most: int) -> list[Event]:
    """Return so many events in the order of time: marks of a person, then the most severe."""
    ranked = sorted(events, key=lambda event: (event.source != OPERATOR, -event.level))
    return sorted(ranked[:most], key=lambda event: event.time_ns)
