"""Event: something that happened during a trial, such as an execute or a gap of a source."""

from dataclasses import dataclass
from enum import IntEnum


class EventLevel(IntEnum):
    """How much an event matters; the values are those of the levels of ``foxglove.Log``."""

    INFO = 2
    WARNING = 3
    ERROR = 4


@dataclass(frozen=True)
class Event:
    """A time-stamped remark in a log.

    Attributes
    ----------
    time_ns
        When it happened, ns since 1970-01-01 UTC.
    text
        What happened, in one line, such as ``execute, 20 starboard``.
    source
        Who reports it: ``operator`` for a mark of a person, else the name of the program's part or
        of the stream, such as ``udp://127.0.0.1:10110``.
    level
        How much it matters.

    Examples
    --------
    >>> Event(0, "execute, 20 starboard").source
    'operator'
    """

    time_ns: int
    text: str
    source: str = "operator"
    level: EventLevel = EventLevel.INFO
