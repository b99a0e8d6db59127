"""Times of one GNSS receiver: its epochs, its latencies, and whether they follow its messages."""

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

import numpy as np

from shiplog.checks.quantiles import Quantiles

_JUMP_SECS = 0.5
_BLOCK = 30  # latencies between comparisons of medians
_BUFFER = 4096
_MAX_LATENCIES = 1 << 16  # kept of each kind of message: the sources are those of the wire
_RECENT = 30  # latencies of which the least one is that of the messages without a time
_MAX_KINDS = 64  # of messages without a time
_STEPS = 16  # messages, of whose intervals the usual one is the median
_MIN_STEPS = 4
_STEADY = 0.25  # of the usual interval of reception, by which one may differ
_SLIP = 0.5  # of an interval of reception, by which that of the stated times differs


class Latency:
    """The time of reception minus the time in the message, of one kind of message.

    Attributes
    ----------
    count
        The number of values.
    """

    def __init__(self) -> None:
        self._values = Quantiles(_MAX_LATENCIES)
        self._buffer: list[float] = []
        self._block: list[float] = []
        self._block_median: float | None = None
        self.count = 0

    def add(self, secs: float) -> float | None:
        """Add a value, s; return the size of a jump of the median where one has just shown."""
        self.count += 1
        self._buffer.append(secs)
        if len(self._buffer) >= _BUFFER:
            self._flush()
        self._block.append(secs)
        if len(self._block) < _BLOCK:
            return None
        before, self._block_median = self._block_median, median(self._block)
        self._block.clear()
        jump = 0.0 if before is None else self._block_median - before
        return jump if abs(jump) > _JUMP_SECS else None

    def quantiles(self) -> tuple[float, float, float]:
        """Return the median and the 5 % and 95 % quantiles, s."""
        self._flush()
        low, middle, high = np.quantile(self._values.values, (0.05, 0.5, 0.95)).tolist()
        return middle, low, high

    def _flush(self) -> None:
        self._values.add(np.array(self._buffer))
        self._buffer.clear()


class TimeSteps:
    """The steps of the times in one kind of message, against the intervals of its reception."""

    def __init__(self) -> None:
        self._utc_ns: deque[int] = deque(maxlen=_STEPS)
        self._received_ns: deque[int] = deque(maxlen=_STEPS)

    def slip(self, utc_ns: int, received_ns: int) -> tuple[float, float] | None:
        """Take a message; return step and interval, s, where these differ at a steady pace.

        Where messages do not come at a steady pace, or faster than their times step, they were
        delayed.
        """
        self._utc_ns.append(utc_ns)
        self._received_ns.append(received_ns)
        if len(self._utc_ns) < _MIN_STEPS:
            return None
        step_ns, interval_ns = utc_ns - self._utc_ns[-2], received_ns - self._received_ns[-2]
        if abs(step_ns - interval_ns) <= _SLIP * interval_ns:
            return None
        intervals = [later - earlier for earlier, later in pairwise(self._received_ns)]
        usual_ns = median(intervals)
        is_steady = all(abs(each - usual_ns) < _STEADY * usual_ns for each in intervals[-2:])
        is_delayed = received_ns - self._received_ns[0] < (utc_ns - self._utc_ns[0]) / 2
        return (step_ns * 1e-9, interval_ns * 1e-9) if is_steady and not is_delayed else None


@dataclass
class ReceiverTimes:
    """The times of one receiver, which are those of its reference: one kind of its messages.

    Attributes
    ----------
    reference
        The kind of message whose times are those of the receiver; empty before the first one.
    received_ns
        When the last one was received, ns.
    count
        The number of its times so far.
    """

    reference: str = ""
    received_ns: int = 0
    count: int = 0
    _utc_ns: int = 0
    _period_ns: int = 10**9
    _recent_ns: deque[int] = field(default_factory=lambda: deque(maxlen=_RECENT))  # latencies
    _heard: dict[str, int] = field(default_factory=dict)  # messages by kind since the last time
    _heard_before: dict[str, int] = field(default_factory=dict)  # and between the two before

    @property
    def least_latency_ns(self) -> int:
        """The least of the last latencies, ns: a message can be delayed and never be early."""
        return min(self._recent_ns)

    def set_reference(self, kind: str) -> None:
        """Take the times of another kind of message from here on."""
        self.reference = kind
        self._recent_ns.clear()

    def set_time(self, utc_ns: int, received_ns: int) -> None:
        """Take the time in a message of the reference."""
        if self._recent_ns and utc_ns > self._utc_ns:
            self._period_ns = utc_ns - self._utc_ns
        self._utc_ns, self.received_ns = utc_ns, received_ns
        self._recent_ns.append(received_ns - utc_ns)
        self._heard_before, self._heard = self._heard, {}
        self.count += 1

    def hear(self, kind: str) -> None:
        """Take a message without a time."""
        if len(self._heard) < _MAX_KINDS or kind in self._heard:
            self._heard[kind] = self._heard.get(kind, 0) + 1

    def epoch_ns(self, kind: str, received_ns: int) -> int:
        """Return the epoch of the burst to which a message without a time belongs, ns.

        A kind that comes more than once between two times belongs to no burst: it was measured
        before its reception by the least latency.
        """
        since_ns = received_ns - self.received_ns
        is_single = self._heard_before.get(kind) == 1 and self._heard.get(kind, 0) <= 1
        if is_single and since_ns < 1.5 * self._period_ns:
            return self._utc_ns + round(since_ns / self._period_ns) * self._period_ns
        return received_ns - self.least_latency_ns
