"""Header of a trial's long form: lines of JSON with all that is not a sample.

It may come from a file that anybody wrote, so that every value is checked.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from shiplog.errors import LogError
from shiplog.mcap.schema import schema_for
from shiplog.printable import escape_json
from shiplog.types import Channel, Event, EventLevel, TrialLog

MAX_TIME_NS = 2**63 - 1
LEVELS = {level.name.lower(): level for level in EventLevel}


def header_lines(log: TrialLog) -> str:
    """Return the header: JSON lines of the metadata, channels, events and the vessel file."""
    lines = ["metadata " + _json(dict(log.metadata))]
    for c in log:
        entry = {"name": c.name, "source": c.source, "unit": c.unit, "fields": list(c.fields)}
        lines.append("channel " + _json(entry | {"metadata": dict(c.metadata)}))
    lines += ["event " + _json(_event_entry(event)) for event in log.events]
    if log.vessel_toml is not None:
        lines += ["vessel " + _json(line) for line in log.vessel_toml.split("\n")]
    return "\n".join(lines)


def read_header(name: str, lines: list[str]) -> TrialLog:
    """Read the lines of `header_lines` as a log without samples.

    Parameters
    ----------
    name
        Name of the log, also for error messages.
    lines
        The lines of the header.

    Raises
    ------
    LogError
        A line cannot be read or has values of wrong types, or two channels have one topic.
    """
    metadata: dict[str, str] = {}
    events: list[Event] = []
    channels: dict[tuple[str, tuple[str, ...]], Channel] = {}
    vessel: list[str] = []
    for line in lines:
        key, _, text = line.partition(" ")
        try:
            entry = json.loads(text)
            if key == "metadata":
                metadata |= _texts("metadata", entry)
            elif key == "channel":
                channel = _empty_channel(**entry)
                if channel.key in channels:
                    raise ValueError(f"a second channel {channel.topic}")
                channels[channel.key] = channel
            elif key == "event":
                events.append(_event(**entry))
            elif key == "vessel":
                vessel.append(_text("vessel", entry))
            else:
                raise ValueError(f"unknown key {key!r}")
        except (ValueError, TypeError, RecursionError) as error:
            raise LogError(
                f"header line {line[:60]!r} cannot be read ({error}); convert the log again: {name}"
            ) from error
    vessel_toml = "\n".join(vessel) if vessel else None
    return TrialLog(name, tuple(channels.values()), metadata, vessel_toml, events=tuple(events))


def with_checksum_warning(log: TrialLog, is_unchanged: bool | None) -> TrialLog:
    """Return a log that was read from a table, with a warning unless its checksum is right.

    Parameters
    ----------
    log
        The log.
    is_unchanged
        Whether the table has its checksum; None where it was written without one.
    """
    if is_unchanged:
        return log
    text = (
        "the table has no checksum, so that a change of its data is not detected; write it again "
        "with this version of shiplog"
        if is_unchanged is None
        else "the table was changed since shiplog wrote it: its data or header do not have its "
        "checksum; if nobody edited it, it is damaged: convert the log again"
    )
    return replace(log, warnings=(*log.warnings, text))


def _json(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False)
    text.encode()  # half of a character would be refused on reading back
    return escape_json(text)


def _event_entry(event: Event) -> dict[str, str | int]:
    return {
        "time_ns": event.time_ns,
        "text": event.text,
        "source": event.source,
        "level": event.level.name.lower(),
    }


def _event(time_ns: object, text: object, source: object, level: object) -> Event:
    if type(time_ns) is not int or not 0 <= time_ns <= MAX_TIME_NS:
        raise ValueError(f"time_ns must be a number of ns since 1970, not {time_ns!r:.40}")
    if (known := LEVELS.get(_text("level", level))) is None:
        raise ValueError(f"no level of an event: {level!r:.40}; there are {', '.join(LEVELS)}")
    return Event(time_ns, _text("text", text), _text("source", source), known)


def _empty_channel(
    name: object, source: object, unit: object, fields: object, metadata: object
) -> Channel:
    if not isinstance(fields, list):
        raise TypeError(f"fields must be a list, not {fields!r:.40}")
    names = tuple(_text("a field", field) for field in fields)
    schema_for(names)  # raises ValueError for fields without a message schema
    empty = np.zeros(0, np.int64)
    values = np.zeros((0, len(names)) if names else 0)
    texts = _text("name", name), _text("source", source), _text("unit", unit)
    return Channel(*texts, empty, empty, values, names, _texts("metadata", metadata))


def _texts(what: str, entry: Any) -> Mapping[str, str]:  # noqa: ANN401 - any value of JSON
    if not isinstance(entry, dict):
        raise TypeError(f"{what} must be texts by key, not {entry!r:.40}")
    return {_text("a key", key): _text(f"{what} {key!r:.40}", entry[key]) for key in entry}


def _text(what: str, value: object) -> str:
    """Check that a value is a text which can be stored; a lone half of a character cannot."""
    if not isinstance(value, str):
        raise TypeError(f"{what} must be a text, not {value!r:.40}")
    value.encode()
    return value
