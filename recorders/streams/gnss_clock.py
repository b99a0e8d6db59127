"""Times of GNSS receivers against the times of reception: week rollover, latency, and its jumps."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from statistics import median
from typing import NamedTuple

import numpy as np

from shiplog.checks.quantiles import Quantiles
from shiplog.tables.printed_times import DAY_NS, HALF_DAY_NS

ROLLOVER_NS = 1024 * 7 * DAY_NS  # the GPS week of ten bits begins again at 0
MAX_ROLLOVERS = 2
_MAX_DATE_ERROR_NS = 2 * DAY_NS  # a clock of the recorder that is wrong by less is an offset
_MIN_LATENCY_SECS = 0.2  # reported from here on
_MIN_OFFSET_SECS = 2.0  # no receiver is as late: the clock of the recorder is wrong
_JUMP_SECS = 0.5
_BLOCK = 30  # latencies between comparisons of medians
_BUFFER = 4096
_SILENCE_NS = 10 * 10**9  # a receiver's time is continued so long
_MAX_SOURCES = 64
_MAX_LATENCIES = 1 << 16  # kept of each kind of sentence: the sources are those of the wire

Warn = Callable[[str, int | None], None]
"""Takes a warning and its time, ns since 1970-01-01 UTC; None is the end of the stream."""


class Utc(NamedTuple):
    """Time in a sentence or message.

    Attributes
    ----------
    clock_ns
        The time of day, ns.
    day
        The date, days since 1970-01-01; None where there is none.
    """

    clock_ns: int
    day: int | None


def nearest_ns(clock_ns: int, reference_ns: int) -> int:
    """Return the time with this time of day that is nearest to a reference, ns."""
    return reference_ns + (clock_ns - reference_ns + HALF_DAY_NS) % DAY_NS - HALF_DAY_NS


def rollovers(utc_ns: int, reference_ns: int) -> int:
    """Return by how many rollovers of the GPS week a time lies before a reference; usually 0.

    Examples
    --------
    >>> day_ns = 86_400 * 10**9
    >>> rollovers(0, 7168 * day_ns), rollovers(0, 3000 * day_ns)
    (1, 0)
    """
    count = round((reference_ns - utc_ns) / ROLLOVER_NS)
    error_ns = abs(reference_ns - utc_ns - count * ROLLOVER_NS)
    return count if 1 <= count <= MAX_ROLLOVERS and error_ns < _MAX_DATE_ERROR_NS else 0


class Latency:
    """The time of reception minus the time in the sentence, of one kind of sentence.

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


@dataclass
class _Receiver:
    """The last time of one receiver."""

    utc_ns: int | None = None
    latency_ns: int = 0
    period_ns: int = 10**9
    rollovers: int = 0
    contradicts: bool = False
    latencies: dict[str, Latency] = field(default_factory=dict)  # by formatter


class GnssClock:
    """The times of all receivers of a stream.

    Parameters
    ----------
    warn
        Receives warnings: a rollover, a jump, a date that contradicts the times of reception.
    received_is_known
        Whether the times of reception are known; if not, there are no latencies.
    remedy
        What to do about a late receiver, for the warning; empty where there is nothing to do.
    """

    def __init__(self, warn: Warn, *, received_is_known: bool = True, remedy: str = "") -> None:
        self._warn = warn
        self._received_is_known = received_is_known
        self._remedy = f"; {remedy}" if remedy else ""
        self._receivers: dict[str, _Receiver] = {}

    def set_time(self, source: str, formatter: str, utc: Utc, received_ns: int) -> int | None:
        """Take the time in a sentence, and return it as ns since 1970-01-01 UTC.

        A date that is early by rollovers of the GPS week is corrected. None where the date
        contradicts the time of reception otherwise.
        """
        receiver = self._receivers.get(source)
        if receiver is None:
            if len(self._receivers) >= _MAX_SOURCES:
                return None
            receiver = self._receivers[source] = _Receiver()
        utc_ns = self._dated(source, receiver, utc, received_ns)
        if utc_ns is None:
            return None
        if receiver.utc_ns is not None and utc_ns > receiver.utc_ns:
            receiver.period_ns = utc_ns - receiver.utc_ns
        receiver.utc_ns, receiver.latency_ns = utc_ns, received_ns - utc_ns
        if self._received_is_known:
            latency = receiver.latencies.setdefault(formatter, Latency())
            if (jump := latency.add(receiver.latency_ns * 1e-9)) is not None:
                self._warn(
                    f"{source}{formatter}: reception against GNSS time jumps by {jump:+.2f} s: "
                    "the recorder's clock or the receiver was set",
                    received_ns,
                )
        return utc_ns

    def measured_ns(self, source: str, received_ns: int) -> int:
        """Return the time of measurement of a sentence without a time, ns.

        It is that of the burst to which it belongs, where its talker sends times; else that of
        reception.
        """
        receiver = self._receivers.get(source)
        if receiver is None or receiver.utc_ns is None:
            return received_ns
        time_ns = received_ns - receiver.latency_ns
        since_ns = time_ns - receiver.utc_ns
        if not 0 <= since_ns < _SILENCE_NS:
            return received_ns
        if since_ns < 1.5 * receiver.period_ns:
            return receiver.utc_ns + round(since_ns / receiver.period_ns) * receiver.period_ns
        return time_ns

    def notes(self) -> Iterator[tuple[str, str]]:
        """Yield the latency of each kind of sentence, as key and text for the metadata of a log."""
        for source, receiver in self._receivers.items():
            for formatter, latency in receiver.latencies.items():
                middle, low, high = latency.quantiles()
                key = f"latency_s.{source}.{formatter.strip()}"
                yield key, f"{middle:.3f} (90 % from {low:.3f} to {high:.3f})"

    def finish(self) -> None:
        """Report latencies that matter, one warning for each receiver."""
        for source, receiver in self._receivers.items():
            late = {
                formatter: middle
                for formatter, latency in receiver.latencies.items()
                if abs(middle := latency.quantiles()[0]) > _MIN_LATENCY_SECS
            }
            if not late:
                continue
            listed = ", ".join(f"{kind.strip()} {secs:.2f} s" for kind, secs in late.items())
            if max(map(abs, late.values())) < _MIN_OFFSET_SECS and min(late.values()) > 0:
                cause = f"the receiver is late{self._remedy}"
            else:
                cause = "the recorder's clock is wrong by about as much"
            self._warn(f"{source}: reception minus GNSS time is {listed}: {cause}", None)

    def _dated(self, source: str, receiver: _Receiver, utc: Utc, received_ns: int) -> int | None:
        if utc.day is None:
            return nearest_ns(utc.clock_ns, received_ns)
        utc_ns = utc.day * DAY_NS + utc.clock_ns
        count = rollovers(utc_ns, received_ns)
        corrected_ns = utc_ns + count * ROLLOVER_NS
        if count and not receiver.rollovers:
            self._warn(
                f"{source}: date {_day(utc_ns)} is {count * 1024} weeks early (rollover of the GPS "
                f"week), corrected to {_day(corrected_ns)}",
                received_ns,
            )
        receiver.rollovers = count
        if abs(received_ns - corrected_ns) < _MAX_DATE_ERROR_NS:
            return corrected_ns
        if not receiver.contradicts:
            receiver.contradicts = True
            self._warn(
                f"{source}: date {_day(utc_ns)} contradicts the time of reception "
                f"{_day(received_ns)}; its times are not used",
                received_ns,
            )
        return None


def _day(time_ns: int) -> str:
    return f"{datetime.fromtimestamp(time_ns // 10**9, UTC):%Y-%m-%d}"
