"""Status of a live recording: what each channel last had, and which channels have gone stale."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from recorders.source import Recordable
from shiplog.checks.event_table import OPERATOR
from shiplog.types import Channel, Event, EventLevel

NEEDED = ("yaw_rate", "speed", "rudder", "rpm")  # by a replay
RATE_SAMPLES = 50  # of which a rate is the mean
MIN_SAMPLES_TO_MISS = 5  # before that, the rate of a channel is not known
STALE_INTERVALS = 10  # that a channel may be silent
STALE_NS = 3_000_000_000  # ... and at least this long
STALE_UNKNOWN_NS = 60_000_000_000  # that a channel of unknown rate may be silent
FIRST_ALARM_NS = 10_000_000_000  # after the start, for a needed channel that was never heard


@dataclass
class ChannelStatus:
    """What a channel has sent so far.

    Attributes
    ----------
    name, source, unit
        Those of the channel.
    samples
        The number of samples.
    last_ns
        The time of reception of the last one, ns.
    last_value
        The last value; of a position its latitude or north, and its longitude or east.
    has_value
        Whether any sample was a number: a sensor that marks all its values as invalid has none.
    stale
        Whether it has been silent for longer than its rate explains.
    """

    name: str
    source: str
    unit: str
    samples: int = 0
    last_ns: int = 0
    last_value: tuple[float, ...] = ()
    has_value: bool = False
    stale: bool = False
    _recent_ns: deque[int] = field(default_factory=lambda: deque(maxlen=RATE_SAMPLES), repr=False)

    @property
    def topic(self) -> str:
        """The topic, such as ``/yaw_rate/TI``."""
        return f"/{self.name}/{self.source}"

    @property
    def rate_hz(self) -> float:
        """The mean rate of the last samples; NaN where there are fewer than two."""
        if len(self._recent_ns) < 2 or self._recent_ns[-1] == self._recent_ns[0]:
            return float("nan")
        return 1e9 * (len(self._recent_ns) - 1) / (self._recent_ns[-1] - self._recent_ns[0])

    def add(self, channel: Channel) -> None:
        """Add the samples of a chunk."""
        self.samples += len(channel)
        self._recent_ns.extend(channel.received_ns[-RATE_SAMPLES:].tolist())
        self.last_ns = int(channel.received_ns[-1])
        self.has_value = self.has_value or bool(np.isfinite(channel.values).any())
        self.last_value = tuple(np.atleast_1d(channel.values[-1]).tolist())

    def is_silent(self, now_ns: int) -> bool:
        """Whether the last sample is older than the rate explains."""
        if self.samples < MIN_SAMPLES_TO_MISS:
            return now_ns - self.last_ns > STALE_UNKNOWN_NS
        interval_ns = 1e9 / self.rate_hz if self.rate_hz > 0 else 0.0
        return now_ns - self.last_ns > max(STALE_NS, STALE_INTERVALS * interval_ns)


class TrialStatus:
    """Status of all channels of a recording.

    Parameters
    ----------
    start_ns
        When the recording began, ns.

    Attributes
    ----------
    events
        The number of events of the streams and of people.
    last_mark
        The last event that a person has marked, or None.
    """

    def __init__(self, start_ns: int) -> None:
        self._start_ns = start_ns
        self._channels: dict[str, ChannelStatus] = {}
        self._missing_reported = False
        self.events = 0
        self.last_mark: Event | None = None

    @property
    def channels(self) -> list[ChannelStatus]:
        """The channels heard so far, needed ones first."""
        order = {name: number for number, name in enumerate(NEEDED)}
        return sorted(
            self._channels.values(), key=lambda c: (order.get(c.name, len(order)), c.topic)
        )

    @property
    def missing(self) -> list[str]:
        """The needed channels of which no value was heard."""
        heard = {channel.name for channel in self._channels.values() if channel.has_value}
        return [name for name in NEEDED if name not in heard]

    def add(self, items: Iterable[Recordable]) -> None:
        """Add what was received."""
        for item in items:
            if isinstance(item, Event):
                self.events += 1
                if item.source == OPERATOR:
                    self.last_mark = item
            elif isinstance(item, Channel) and len(item):
                status = self._channels.get(item.topic)
                if status is None:
                    status = ChannelStatus(item.name, item.source, item.unit)
                    self._channels[item.topic] = status
                status.add(item)

    def alarms(self, now_ns: int) -> list[Event]:
        """Return an event for each channel that has just gone silent or come back, or is missing.

        Parameters
        ----------
        now_ns
            The time of the clock of reception, ns.
        """
        events = [
            self._change(channel, now_ns)
            for channel in self._channels.values()
            if channel.is_silent(now_ns) != channel.stale
        ]
        if not self._missing_reported and now_ns - self._start_ns > FIRST_ALARM_NS:
            self._missing_reported = True
            secs = FIRST_ALARM_NS // 10**9
            events += [
                Event(
                    now_ns, f"nothing heard of {name} in {secs} s", "recorder", EventLevel.WARNING
                )
                for name in self.missing
            ]
        return events

    def _change(self, channel: ChannelStatus, now_ns: int) -> Event:
        """Change whether a channel is stale, and return the event that reports it."""
        channel.stale = not channel.stale
        if not channel.stale:
            return Event(now_ns, f"{channel.topic} is heard again", "recorder", EventLevel.INFO)
        silent_secs = (now_ns - channel.last_ns) * 1e-9
        level = EventLevel.WARNING if channel.name in NEEDED else EventLevel.INFO
        text = f"{channel.topic} has been silent for {silent_secs:.1f} s"
        return Event(now_ns, text, "recorder", level)
