"""One GNSS receiver: its times, and its messages that wait until these are known."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from .receiver_times import Latency, ReceiverTimes, TimeSteps

MAX_WAIT_NS = 2 * 10**9  # for the first time of a receiver
_MAX_HOLD_NS = 10 * 10**9  # for the times that show whether they can be used
_VERIFIED = 8  # so many show it
_MAX_HELD = 1000  # messages
_LATENCIES_SECS = -0.2, 2.0  # what differs more is an offset of the recorder's clock

WriteSamples = Callable[[int], object]
"""Writes the samples of a message, given their time of measurement, ns."""


class HeldMessage(NamedTuple):
    """A message that waits for the times of its receiver.

    Attributes
    ----------
    kind
        Its kind.
    received_ns
        Its time of reception, ns.
    stated_ns
        The time in it, ns; None where it has none.
    write
        Writes its samples.
    """

    kind: str
    received_ns: int
    stated_ns: int | None
    write: WriteSamples


@dataclass
class GnssReceiver:
    """What is known of one source of messages, which may be a receiver.

    Attributes
    ----------
    first_ns
        The time of reception of its first message, ns.
    times
        Its times.
    is_applied
        Whether its times are those of its samples; None while this is not known.
    rollovers
        By how many rollovers of the GPS week its last date was early.
    contradicts
        Whether a date of it contradicted the time of reception.
    slips
        Whether its times do not step as its messages come.
    is_offset
        Whether its times differ from those of reception by more than a latency can be.
    latencies, steps
        By kind of message.
    """

    first_ns: int
    times: ReceiverTimes = field(default_factory=ReceiverTimes)
    is_applied: bool | None = None
    rollovers: int = 0
    contradicts: bool = False
    slips: bool = False
    is_offset: bool = False
    latencies: defaultdict[str, Latency] = field(default_factory=lambda: defaultdict(Latency))
    steps: defaultdict[str, TimeSteps] = field(default_factory=lambda: defaultdict(TimeSteps))
    _held: list[HeldMessage] = field(default_factory=list)

    def add(self, message: HeldMessage) -> None:
        """Let a message wait, and decide about the times as soon as they show it."""
        if message.stated_ns is None:
            self.times.hear(message.kind)
        self._held.append(message)
        waited_ns = message.received_ns - self.first_ns
        if (
            self.slips
            or self.times.count >= _VERIFIED
            or len(self._held) >= _MAX_HELD
            or waited_ns >= (_MAX_HOLD_NS if self.times.count else MAX_WAIT_NS)
        ):
            self.decide()

    def decide(self) -> None:
        """Decide whether the times are those of the samples, unless this is known already.

        An offset of the recorder's clock is not applied: the samples of the other sensors have it.
        """
        if self.is_applied is not None:
            return
        if self.latencies and self.times.count:
            lowest, highest = _LATENCIES_SECS
            self.is_offset = not lowest < self.times.least_latency_ns * 1e-9 < highest
        self.is_applied = bool(self.times.count) and not (self.slips or self.is_offset)

    def release(self, *, in_bursts: bool) -> None:
        """Write the messages that wait; `in_bursts` is as in `GnssClock`."""
        held, self._held = self._held, []
        for message in held:
            message.write(self._measured_ns(message, in_bursts=in_bursts))

    def _measured_ns(self, message: HeldMessage, *, in_bursts: bool) -> int:
        if not self.is_applied:
            return message.received_ns
        if message.stated_ns is not None:
            return message.stated_ns
        if in_bursts:
            return self.times.epoch_ns(message.kind, message.received_ns)
        return message.received_ns - self.times.least_latency_ns
