"""Cut of a log by measured time: its bounds as people write them, and its samples."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, time, timedelta
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import UsageError

from .arrays import TimeArray
from .channel import Channel
from .event import Event
from .raw_packets import RawPackets

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_DAY_NS = 86_400 * 10**9


@dataclass(frozen=True)
class TimeCut:
    """A part of a log: the samples measured from `start_ns` on and before `end_ns`.

    Attributes
    ----------
    start_ns, end_ns
        The bounds, ns since 1970-01-01 UTC, within the span of the log.
    log_span_ns
        The first and the last time of measurement of the whole log, ns.
    in_force
        Samples of the inputs in force at the start, by topic and fields, for a log in its file.
    """

    start_ns: int
    end_ns: int
    log_span_ns: tuple[int, int]
    in_force: Mapping[tuple[str, tuple[str, ...]], Channel] = field(default_factory=dict)

    def apply(self, channel: Channel) -> Channel:
        """Return the samples of a channel that are within the cut, in their order."""
        times = channel.measured_ns
        rows = np.flatnonzero((times >= self.start_ns) & (times < self.end_ns))
        if len(rows) == len(channel):
            return channel
        if len(rows) and rows[-1] - rows[0] == len(rows) - 1:
            return channel.part(int(rows[0]), int(rows[-1]) + 1)  # without a copy
        return channel.take(rows)

    def events_within(self, events: Iterable[Event]) -> tuple[Event, ...]:
        """Return the events within the cut; one that begins or ends with the log is open there."""
        events = list(events)
        rows = self.rows_within(np.array([event.time_ns for event in events], np.int64))
        return tuple(events[row] for row in rows)

    def packets_within(self, packets: RawPackets) -> RawPackets:
        """Return the raw packets received within the cut, which is open as for events."""
        rows = self.rows_within(packets.received_ns)
        data = tuple(packets.data[row] for row in rows)
        return replace(packets, received_ns=packets.received_ns[rows], data=data)

    def rows_within(self, times: TimeArray) -> NDArray[np.intp]:
        """Return the rows of the times (n,) within the cut, which is open as for events."""
        after = (times >= self.start_ns) | (self.start_ns <= self.log_span_ns[0])
        before = (times < self.end_ns) | (self.end_ns > self.log_span_ns[1])
        return np.flatnonzero(after & before)

    def name_of_part(self, name: str) -> str:
        """Return the name of a log with the bounds of the cut, in s since the log's start.

        Examples
        --------
        >>> TimeCut(10 * 10**9, 25 * 10**9, (0, 60 * 10**9)).name_of_part("zigzag.mcap")
        'zigzag.mcap (10 to 25 s)'
        """
        start, end = (
            f"{round((bound - self.log_span_ns[0]) * 1e-9, 3):.12g}"
            for bound in (self.start_ns, min(self.end_ns, self.log_span_ns[1]))
        )
        return f"{name} ({start} to {end} s)"

    def text(self, name: str) -> str:
        """Return the bounds in UTC, and the span of the whole log, for its metadata."""
        last_ns = min(self.end_ns, self.log_span_ns[1])
        return f"{_utc(self.start_ns)} to {_utc(last_ns)} of {name}, {_span_text(self.log_span_ns)}"


def resolve_cut(
    start: float | str | None, end: float | str | None, span_ns: tuple[int, int], name: str
) -> TimeCut:
    """Return the cut of a log for bounds as people write them.

    Parameters
    ----------
    start, end
        The bounds, as `TrialLog.between` takes them.
    span_ns
        The first and the last time of measurement of the log, ns.
    name
        The name of the log, for messages.

    Raises
    ------
    UsageError
        A bound cannot be read, the end is not after the start, the cut is outside of the log, or a
        time of day occurs on several days of the log.

    Examples
    --------
    >>> cut = resolve_cut(120, -30, (0, 600 * 10**9), "zigzag.mcap")
    >>> cut.start_ns // 10**9, cut.end_ns // 10**9
    (120, 570)
    """
    start_ns = span_ns[0] if start is None else _instant_ns(start, span_ns, name)
    end_ns = span_ns[1] + 1 if end is None else _instant_ns(end, span_ns, name)
    if end_ns <= start_ns:
        raise UsageError(
            f"the cut from {_bound_text(start, 'the start')} to {_bound_text(end, 'the end')} is "
            f"empty, its end is not after its start; {name} has {_span_text(span_ns)}"
        )
    if start_ns > span_ns[1] or end_ns <= span_ns[0]:
        raise empty_cut_error(start, end, span_ns, name)
    return TimeCut(max(start_ns, span_ns[0]), min(end_ns, span_ns[1] + 1), span_ns)


def empty_cut_error(
    start: float | str | None, end: float | str | None, span_ns: tuple[int, int], name: str
) -> UsageError:
    """Return the error for a cut without samples; it states the span of the log."""
    return UsageError(
        f"no samples from {_bound_text(start, 'the start')} to {_bound_text(end, 'the end')}; "
        f"{name} has {_span_text(span_ns)}"
    )


def parse_time_bound(text: str) -> float | str:
    """Return a bound of a cut from its text: a number of s, or the text of a time.

    Raises `UsageError` where it is neither.

    Examples
    --------
    >>> parse_time_bound("-30"), parse_time_bound("12:04:30")
    (-30.0, '12:04:30')
    """
    try:
        secs = float(text)
    except ValueError:
        _parsed_time(text)
        return text
    if not isfinite(secs):
        raise _unreadable(text)
    return secs


def _instant_ns(bound: float | str, span_ns: tuple[int, int], name: str) -> int:
    """Return the instant of a bound, ns since 1970-01-01 UTC."""
    value = parse_time_bound(bound) if isinstance(bound, str) else bound
    if not isinstance(value, str):
        if not isfinite(value):
            raise _unreadable(value)
        return span_ns[value < 0] + round(value * 1e9)
    when = _parsed_time(value)
    if isinstance(when, datetime):
        return _ns_of(when)
    return _day_time_ns(when, value, span_ns, name)


def _parsed_time(text: str) -> datetime | time:
    """Parse a time of day or a date with a time; UTC where the text states no time zone."""
    if ":" not in text:
        try:
            return datetime.combine(date.fromisoformat(text), time(tzinfo=UTC))
        except ValueError:
            raise _unreadable(text) from None
    for parse in (time.fromisoformat, datetime.fromisoformat):
        try:
            when = parse(text)
        except ValueError:
            continue
        return when if when.tzinfo else when.replace(tzinfo=UTC)
    raise _unreadable(text)


def _day_time_ns(when: time, text: str, span_ns: tuple[int, int], name: str) -> int:
    """Return the instant of a time of day in the log, or the one nearest to the log."""
    first_day = (_EPOCH + timedelta(microseconds=span_ns[0] // 1000)).astimezone(when.tzinfo).date()
    first = _ns_of(datetime.combine(first_day, when))
    days = (span_ns[1] - span_ns[0]) // _DAY_NS + 2
    instants = [first + day * _DAY_NS for day in range(-1, days)]
    inside = [at for at in instants if span_ns[0] <= at <= span_ns[1]]
    if len(inside) > 1:
        raise UsageError(
            f"{text} occurs on {len(inside)} days of the log; add the date, such as "
            f"{_utc(inside[0])}; {name} has {_span_text(span_ns)}"
        )
    if inside:
        return inside[0]
    return min(instants, key=lambda at: max(span_ns[0] - at, at - span_ns[1]))


def _ns_of(when: datetime) -> int:
    since = when - _EPOCH
    return (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000


def _unreadable(bound: object) -> UsageError:
    return UsageError(
        f"no time: {bound!r}; give s since the log's start (120), s before its end (-30), a time "
        "of day (12:04:30) or a time in ISO 8601 (2026-05-01T12:04:30Z)"
    )


def _bound_text(bound: float | str | None, default: str) -> str:
    if bound is None:
        return default
    return bound if isinstance(bound, str) else f"{bound:g} s"


def _span_text(span_ns: tuple[int, int]) -> str:
    if span_ns == (0, 0):
        return "no samples"
    secs = (span_ns[1] - span_ns[0]) * 1e-9
    return f"{secs:.1f} s, from {_utc(span_ns[0])} to {_utc(span_ns[1])}"


def _utc(at_ns: int) -> str:
    """Return an instant in UTC, in ISO 8601, to the millisecond where it is no whole second."""
    unit = "s" if at_ns % 10**9 == 0 else "ms"
    return f"{np.datetime64(at_ns, 'ns').astype(f'M8[{unit}]')}Z"
