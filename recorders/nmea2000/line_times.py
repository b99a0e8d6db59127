"""Times of the lines of a file from their stamps, whatever these count from."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from functools import lru_cache

from recorders.streams.counts import StreamCounts
from recorders.streams.packets import END_NS, NO_TIME, Batches, Packet
from shiplog.errors import LogError, UsageError

from .line_formats import LineFormat, StampKind

SECOND_NS = 10**9
DAY_NS = 86400 * SECOND_NS
MAX_BACK_NS = 60 * SECOND_NS  # by which stamps of a whole file may go back: gateways send in bursts
MAX_FRAMES_PER_SEC = 8000  # two buses: 250 kbit/s are some 1900 frames of 8 bytes a second, or 3700
FEW_FRAMES = 2000  # a burst of a gateway that had no connection
MAX_WAITING = 10_000  # lines without a stamp, for the next stamp
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_DATE = re.compile(rb"(\d{4}-\d\d-\d\d)[T\- ](\d\d:\d\d:\d\d)(?:[.,](\d{1,9}))?Z?")


_StampedLine = tuple[Packet, int | None]


class LineTimes:
    """A stage that gives the lines of a file the times of their stamps.

    A line whose stamp differs from those of both lines beside it by more than `MAX_BACK_NS`, or is
    no time, is rejected. A line without a stamp, such as a comment, has the time of the line before
    it. Where stamps are times of day, those that go back begin the next day.

    Parameters
    ----------
    line_format
        The format of the lines.
    start_ns
        The instant of the elapsed time zero, or the date of the first time of day, ns since
        1970-01-01 UTC; None where it is not known, which is warned about.
    counts
        Receives the rejected lines and the warnings.

    Raises
    ------
    UsageError
        A start is given, and the stamps have a date.
    """

    def __init__(self, line_format: LineFormat, start_ns: int | None, counts: StreamCounts) -> None:
        self._format, self._counts = line_format, counts
        dated = line_format.stamp is StampKind.INSTANT
        if dated and start_ns is not None:
            raise UsageError(f"the stamps of {line_format.name} have a date; omit --start")
        self._undated = not dated and start_ns is None
        if line_format.stamp is StampKind.DAY_TIME:
            start_ns = (start_ns or 0) // DAY_NS * DAY_NS
        self._start_ns = start_ns or 0
        self._stamp_ns: int | None = None  # of the line before
        self._time_ns = NO_TIME
        self._first_ns, self._frames = NO_TIME, 0

    def apply(self, batches: Batches) -> Batches:
        """Yield the batches with times.

        Raises
        ------
        LogError
            The stamps cannot be the times of the lines, or there are none.
        """
        held: list[_StampedLine] = []
        for batch in batches:
            lines = held + self._with_stamps(batch)
            # a stamp is judged by the next one: the last lines wait for it
            known = [i for i, (_, stamp) in enumerate(lines) if stamp is not None]
            last = known[-1] if known else 0
            end = last if len(lines) - last < MAX_WAITING else len(lines)
            yield self._with_times(lines, end)
            held = lines[end:]
        if held:
            yield self._with_times(held, len(held))
        if self._first_ns == NO_TIME:
            raise LogError(
                f"no line has a time; log with time stamps, or record {self._format.name} live"
            )

    def _with_stamps(self, batch: Sequence[Packet]) -> list[_StampedLine]:
        """Return the lines with their stamps in ns, without those whose stamp is no time."""
        lines: list[_StampedLine] = []
        parse = _PARSERS[self._format.stamp]
        for packet in batch:
            match = self._format.pattern.fullmatch(packet.data)
            text = match["stamp"] if match else None
            try:
                stamp = parse(text) if text else None
            except ValueError:
                stamp = END_NS
            if stamp is None or 0 <= stamp < END_NS - self._start_ns:
                lines.append((packet, stamp))
            else:
                self._counts.reject("impossible time")
        return lines

    def _with_times(self, lines: Sequence[_StampedLine], end: int) -> list[Packet]:
        """Return the first `end` lines with times."""
        following = _next_known([stamp for _, stamp in lines])
        packets: list[Packet] = []
        for (packet, stamp), after in zip(lines[:end], following, strict=False):
            if stamp is not None and not self._advance(stamp, after):
                self._counts.reject("stamp out of order")
            elif self._time_ns != NO_TIME:
                packets.append(Packet(packet.data, self._time_ns, packet.origin))
            elif after is not None:  # a header
                packets.append(Packet(packet.data, self._instant(after), packet.origin))
            else:
                self._counts.reject("no time stamp")
        self._require_possible()
        return packets

    def _advance(self, stamp: int, following: int | None) -> bool:
        """Set the time to that of the next stamp, unless the stamp is an outlier."""
        before = self._stamp_ns
        if before is None:
            self._begin(stamp)
        elif self._format.stamp is StampKind.INTERVAL:
            if self._time_ns + stamp >= END_NS:
                return False
            self._time_ns += stamp
        else:
            alone = following is not None and abs(following - before) <= MAX_BACK_NS
            if abs(stamp - before) > MAX_BACK_NS and alone:
                return False
            self._time_ns += self._step_ns(stamp - before)
        self._stamp_ns = stamp
        self._frames += 1
        return True

    def _begin(self, stamp: int) -> None:
        """Take the first stamp."""
        self._first_ns = self._time_ns = self._instant(stamp)
        if self._undated:
            self._counts.warn(
                f"the stamps are a {self._format.stamp.value} without a date: the log begins on "
                "1970-01-01; state its date by --start",
                self._time_ns,
            )

    def _instant(self, first_stamp: int) -> int:
        if self._format.stamp is StampKind.INTERVAL:
            return self._start_ns
        return self._start_ns + first_stamp

    def _step_ns(self, step_ns: int) -> int:
        """Return the time from one stamp to the next."""
        if step_ns >= -MAX_BACK_NS or self._format.stamp is StampKind.INSTANT:
            return step_ns
        if self._format.stamp in (StampKind.ELAPSED, StampKind.ELAPSED_MILLIS):
            raise LogError(
                f"the elapsed time begins again after {(self._stamp_ns or 0) / SECOND_NS:.3f} s, "
                "as after a power failure; cut the file there and state the --start of each part"
            )
        if step_ns > -DAY_NS + 12 * 3600 * SECOND_NS:
            back_h = -step_ns / SECOND_NS / 3600
            self._counts.warn(
                f"the time of day goes back by {back_h:.1f} h: taken for the next day",
                self._time_ns,
            )
        return step_ns + DAY_NS

    def _require_possible(self) -> None:
        """Raise an error where a bus cannot carry the lines in the time of their stamps."""
        secs = (self._time_ns - self._first_ns) / SECOND_NS
        if self._frames > FEW_FRAMES + MAX_FRAMES_PER_SEC * max(0.0, secs):
            raise LogError(
                f"the stamps are no times of reception: {self._frames} messages within "
                f"{secs:.3f} s, more than an NMEA 2000 bus can carry; log the bus again"
            )


def _next_known(stamps: Sequence[int | None]) -> list[int | None]:
    """Return for each stamp the first one after it that is known."""
    following: list[int | None] = []
    after: int | None = None
    for stamp in reversed(stamps):
        following.append(after)
        after = after if stamp is None else stamp
    return following[::-1]


def _parse_instant(text: bytes) -> int:
    """Return ns since 1970 of a date and time, or of seconds since then."""
    if match := _DATE.fullmatch(text):
        date, day_time, fraction = match.groups(default=b"0")
        return _instant_ns(date, day_time) + _fraction_ns(fraction.decode())
    return _parse_secs(text)


@lru_cache(4)
def _instant_ns(date: bytes, day_time: bytes) -> int:
    instant = datetime.fromisoformat(f"{date.decode()}T{day_time.decode()}+00:00")
    return (instant - _EPOCH) // timedelta(seconds=1) * SECOND_NS


def _parse_day_time(text: bytes) -> int:
    """Return ns since midnight of hh:mm:ss or hhmmss, with a fraction or without."""
    clock, _, fraction = text.decode().replace(":", "").partition(".")
    hours, minutes, secs = int(clock[:2]), int(clock[2:4]), int(clock[4:6])
    if hours > 23 or minutes > 59 or secs > 60:
        raise ValueError(text)
    return ((hours * 60 + minutes) * 60 + secs) * SECOND_NS + _fraction_ns(fraction or "0")


def _parse_secs(text: bytes) -> int:
    """Return ns of decimal seconds."""
    secs, _, fraction = text.decode().partition(".")
    return int(secs) * SECOND_NS + _fraction_ns(fraction or "0")


def _parse_millis(text: bytes) -> int:
    """Return ns of seconds and milliseconds; iKonvert prints 37 ms after 482 s as 482.37."""
    secs, _, millis = text.partition(b".")
    return int(secs) * SECOND_NS + int(millis) * 10**6


def _fraction_ns(digits: str) -> int:
    return int(f"{digits:0<9}")


_PARSERS = {
    StampKind.INSTANT: _parse_instant,
    StampKind.DAY_TIME: _parse_day_time,
    StampKind.ELAPSED: _parse_secs,
    StampKind.ELAPSED_MILLIS: _parse_millis,
    StampKind.INTERVAL: _parse_secs,
}
