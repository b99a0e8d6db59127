"""What `shiplog info` reports of a log: its channels, raw packets, foreign topics and events."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from shiplog.types import Event

from .event_table import events_to_json


@dataclass(frozen=True)
class ValueRange:
    """The range of one component of a channel, in the unit in which people read it.

    Attributes
    ----------
    component
        The name of the component; empty for a scalar.
    unit
        The unit of `lowest` and `highest`.
    lowest, highest
        The smallest and the largest value in the file; NaN and infinite values are excluded.
    """

    component: str
    unit: str
    lowest: float
    highest: float


@dataclass(frozen=True)
class ChannelInfo:
    """One topic of shiplog in a file.

    Attributes
    ----------
    topic
        The topic, such as ``/yaw_rate/gyro``.
    source
        The sensor or program, such as ``gyro``.
    unit
        The unit of the values in shiplog.
    positive
        The sign convention in words.
    samples
        The number of samples.
    rate_hz
        The sampling rate, from the median interval; None if unknown.
    irregular
        Whether many intervals differ from their median by more than half.
    gaps, longest_gap_secs
        The number of gaps and the length of the longest, s; None if unknown.
    ranges
        The range of each component; empty if unknown.
    """

    topic: str
    source: str
    unit: str
    positive: str
    samples: int
    rate_hz: float | None = None
    irregular: bool = False
    gaps: int | None = None
    longest_gap_secs: float | None = None
    ranges: tuple[ValueRange, ...] = ()


@dataclass(frozen=True)
class ForeignTopic:
    """One topic of another program, whose messages are read by a layout only.

    Attributes
    ----------
    topic
        The topic.
    schema
        The name of its message schema, which is the type of its messages; empty if it has none.
    messages
        The number of messages.
    encoding
        The encoding of the messages, such as ``cdr``; empty if it is not stated.
    schema_encoding
        The encoding of the schema, such as ``ros2msg``; empty if it has none.
    rate_hz
        The mean rate between the first and the last message; None if unknown.
    first_ns, last_ns
        Its first and last time of reception, ns since 1970-01-01 UTC; None if unknown.
    """

    topic: str
    schema: str
    messages: int
    encoding: str = ""
    schema_encoding: str = ""
    rate_hz: float | None = None
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass(frozen=True)
class RawTopic:
    """The raw packets of one source in the whole file.

    Attributes
    ----------
    topic
        The topic, such as ``/raw/gyro``.
    source
        The source, such as ``gyro``.
    format
        The format by which the packets can be decoded again, such as ``nmea0183``.
    packets
        The number of packets.
    size
        Their size in the file before compression, bytes; None if unknown.
    rate_hz
        Their mean rate between the first and the last; None if unknown.
    first_ns, last_ns
        The first and last time of reception, ns since 1970-01-01 UTC; None if unknown.
    """

    topic: str
    source: str
    format: str
    packets: int
    size: int | None = None
    rate_hz: float | None = None
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass(frozen=True)
class LogInfo:
    """The content of a file, or of a part of it.

    Attributes
    ----------
    name
        The name of the file, with the bounds of the part.
    start_ns, end_ns
        Its first and last time, ns since 1970-01-01 UTC: of measurement if the file was read; of
        reception if it has foreign topics only, or if taken from the summary. None if it is empty.
    channels
        Its topics of shiplog.
    foreign
        The topics of other programs in the whole file.
    metadata
        Text about the trial, by key.
    has_vessel
        Whether a vessel file is attached.
    finished
        Whether the recorder has closed the file.
    warnings
        Problems met in reading the file.
    data_lost
        Whether a part of the file could not be read.
    raw
        The topics of raw packets in the whole file.
    events
        What happened, in the order of time.
    """

    name: str
    start_ns: int | None
    end_ns: int | None
    channels: tuple[ChannelInfo, ...]
    foreign: tuple[ForeignTopic, ...]
    metadata: Mapping[str, str]
    has_vessel: bool
    finished: bool = True
    warnings: tuple[str, ...] = ()
    data_lost: bool = False
    raw: tuple[RawTopic, ...] = ()
    events: tuple[Event, ...] = ()

    @property
    def start_utc(self) -> str | None:
        """The start in UTC to the second, in ISO 8601; None if the file is empty."""
        if self.start_ns is None:
            return None
        return f"{np.datetime64(self.start_ns, 'ns').astype('M8[s]')}Z"

    @property
    def duration_secs(self) -> float:
        """The time from the start to the end, s."""
        if self.start_ns is None or self.end_ns is None:
            return 0.0
        return (self.end_ns - self.start_ns) * 1e-9

    @property
    def state(self) -> str:
        """Whether the file is finished and whole, in words."""
        state = "finished" if self.finished else "not finished"
        return f"{state}, damaged" if self.data_lost else state

    def to_dict(self) -> dict[str, Any]:
        """Return the content as plain values for JSON."""
        names = ("start_utc", "duration_secs", "state")
        derived = {name: getattr(self, name) for name in names}
        return asdict(self) | derived | events_to_json(self.events, self.start_ns)
