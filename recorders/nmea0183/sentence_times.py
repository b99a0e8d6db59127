"""Times of a file without time stamps, from the UTC times in its own sentences."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime

from recorders.streams.gnss_clock import ROLLOVER_NS, Utc, Warn, nearest_ns, rollovers
from recorders.streams.packets import END_NS, Batches, Packet
from shiplog.errors import LogError, UsageError
from shiplog.tables.printed_times import DAY_NS

from .framing import FramingError, Sentence, parse_sentence, split_packet
from .utc_fields import UTC_READERS, utc_of

MAX_HELD = 200_000  # lines that wait for the next time
_GAP_RATIO, _MIN_GAP_NS = 10, 5 * 10**9  # longer between two times than usual: lines are missing
_MAX_BACK = 10  # times that run backwards one after the other: then the receiver's clock was set
_SECOND_NS = 10**9
_TIMED_LINE = re.compile("|".join(sorted(UTC_READERS)).encode())
_REMEDY = "state the time between its lines with --interval (in s), or record it with time stamps"


@dataclass(frozen=True)
class TimeReference:
    """The sentences whose times a file is given.

    Attributes
    ----------
    talker, formatter
        The kind of sentence.
    first_ns
        The first of its times, ns since 1970-01-01 UTC.
    shift_ns
        What is added to its dates, ns: rollovers of the GPS week.
    warnings
        How the times come about, one line each.
    """

    talker: str
    formatter: str
    first_ns: int
    shift_ns: int
    warnings: tuple[str, ...]


def sentences_of(packets: Sequence[Packet]) -> Iterator[Sentence]:
    """Yield the sentences of packets, without those that are malformed."""
    for packet in packets:
        for line in split_packet(packet.data):
            try:
                yield parse_sentence(line, require_checksum=False)
            except FramingError:
                continue


def _times_of(packets: Sequence[Packet]) -> dict[tuple[str, str], list[Utc]]:
    """Return the times in sentences by talker and formatter."""
    times: dict[tuple[str, str], list[Utc]] = {}
    for sentence in sentences_of([p for p in packets if _TIMED_LINE.search(p.data)]):
        if (utc := _utc(sentence)) is not None:
            times.setdefault((sentence.talker, sentence.formatter), []).append(utc)
    return times


def _utc(sentence: Sentence) -> Utc | None:
    try:
        return utc_of(sentence.formatter, sentence.fields)
    except ValueError:
        return None


def first_day(head: Sequence[Packet]) -> date | None:
    """Return the first date in sentences; None without any."""
    for utcs in _times_of(head).values():
        for utc in utcs:
            if utc.day is not None:
                return _date(utc.day * DAY_NS)
    return None


def find_reference(
    head: Sequence[Packet], day: date | None, today: date | None = None
) -> TimeReference:
    """Choose the sentences whose times a file is given, from its first lines.

    Dated sentences are preferred, then the more frequent.

    Parameters
    ----------
    head
        The first lines of the file.
    day
        The day of the first line, where the user states it.
    today
        The present day, by default that of the clock.

    Raises
    ------
    LogError
        No sentence bears a time.
    UsageError
        The stated day contradicts the dates of the sentences.
    """
    times = _times_of(head)
    if not times:
        raise LogError(
            f"the file has no time: neither stamps before its lines nor UTC times in the sentences "
            f"of its first {len(head)} lines; {_REMEDY}"
        )
    key = max(times, key=lambda k: (sum(utc.day is not None for utc in times[k]), len(times[k])))
    first = next((utc for utc in times[key] if utc.day is not None), times[key][0])
    name = "".join(key)
    source = f"no time stamps: times are those of {name}, interpolated by the order of lines"
    if first.day is None:
        start = midnight_ns(day)
        assumed = (
            () if day else (f"{name} has no date: counted from 1970-01-01; state it with --date",)
        )
        return TimeReference(*key, start + first.clock_ns, 0, (source, *assumed))
    first_ns = first.day * DAY_NS + first.clock_ns
    shift_ns, warnings = _date_shift(name, first_ns, _latest_ns(times), day, today)
    return TimeReference(*key, first_ns + shift_ns, shift_ns, (source, *warnings))


def _latest_ns(times: dict[tuple[str, str], list[Utc]]) -> int:
    days = [utc.day for utcs in times.values() for utc in utcs[:1] if utc.day is not None]
    return max(days, default=0) * DAY_NS


def _date_shift(
    name: str, first_ns: int, latest_ns: int, day: date | None, today: date | None
) -> tuple[int, tuple[str, ...]]:
    """Return the rollovers to add to dates, ns, with warnings."""
    stated_ns = None if day is None else midnight_ns(day)
    reference_ns = latest_ns if stated_ns is None else stated_ns
    count = rollovers(first_ns, reference_ns)
    if stated_ns is not None and abs(first_ns + count * ROLLOVER_NS - stated_ns) > 2 * DAY_NS:
        raise UsageError(f"--date {day} contradicts the date {_date(first_ns)} of {name}")
    if count:
        corrected = _date(first_ns + count * ROLLOVER_NS)
        text = (
            f"{name}: date {_date(first_ns)} is {count * 1024} weeks early (rollover of the GPS "
            f"week), corrected to {corrected}"
        )
        return count * ROLLOVER_NS, (text,)
    now_ns = midnight_ns(today or datetime.now(UTC).date())
    if stated_ns is None and now_ns - first_ns > ROLLOVER_NS:
        text = (
            f"{name}: date {_date(first_ns)} is more than 1024 weeks back; if the receiver's GPS "
            "week has rolled over, state the day with --date"
        )
        return 0, (text,)
    return 0, ()


def midnight_ns(day: date | None) -> int:
    """Return the start of a day, ns since 1970-01-01 UTC; 0 without one."""
    return 0 if day is None else (day - date(1970, 1, 1)).days * DAY_NS


def _date(time_ns: int) -> date:
    return datetime.fromtimestamp(time_ns // _SECOND_NS, UTC).date()


class SentenceTimes:
    """Gives lines the times of one kind of sentence, interpolated by the order of lines.

    Parameters
    ----------
    reference
        The sentences whose times are used.
    warn
        Receives warnings: a gap, or a clock that was set.
    """

    def __init__(self, reference: TimeReference, warn: Warn) -> None:
        self._reference, self._warn = reference, warn
        self._mark = reference.formatter.encode()  # only lines with it are parsed
        self._held: list[Packet] = []  # since the last time, or since the start
        self._first = 0  # the held line whose time is known, once it is
        self._time_ns: int | None = None  # of that line
        self._near_ns = reference.first_ns
        self._line_ns = 0.0  # usual time between lines
        self._usual_ns = 0  # usual time between times
        self._back = 0

    def stamped(self, batches: Batches) -> Batches:
        """Yield the packets with times.

        Raises
        ------
        LogError
            Too many lines follow the first time without another one.
        """
        for batch in batches:
            done: list[Packet] = []
            for packet in batch:
                if self._mark in packet.data and (time_ns := self._time_of(packet)) is not None:
                    done += self._advance(time_ns)
                self._held.append(packet)
                if len(self._held) >= MAX_HELD:
                    done += self._continue()
            yield done
        yield self._finish()

    def _time_of(self, packet: Packet) -> int | None:
        """Return the time of a line of the reference, ns, if it is a new one."""
        for sentence in sentences_of([packet]):
            is_reference = sentence[:2] == (self._reference.talker, self._reference.formatter)
            if is_reference and (utc := _utc(sentence)) is not None:
                return self._accepted(utc)
        return None

    def _accepted(self, utc: Utc) -> int | None:
        if utc.day is None:
            time_ns = nearest_ns(utc.clock_ns, self._near_ns)
        else:
            time_ns = utc.day * DAY_NS + utc.clock_ns + self._reference.shift_ns
        if self._time_ns is None or time_ns > self._time_ns:
            self._back, self._near_ns = 0, time_ns
            return time_ns
        self._back += time_ns < self._time_ns
        if self._back <= _MAX_BACK:
            return None
        self._back, self._near_ns = 0, time_ns
        self._warn(f"the times of {self._reference.formatter} were set back", time_ns)
        return time_ns

    def _advance(self, time_ns: int) -> list[Packet]:
        """Return the held lines, with times up to a new time."""
        if self._time_ns is None:  # lines before the first time wait for the second one
            self._time_ns = time_ns
            self._first = len(self._held)
            return []
        lines, first = len(self._held) - self._first, self._first
        step_ns = time_ns - self._time_ns
        usual_ns = max(_GAP_RATIO * self._usual_ns, _MIN_GAP_NS) if self._usual_ns else DAY_NS
        is_gap = step_ns > usual_ns
        if is_gap:
            self._warn(f"no times for {step_ns * 1e-9:.0f} s: lines may be missing", self._time_ns)
        if not is_gap and step_ns > 0:
            self._usual_ns, self._line_ns = step_ns, step_ns / lines
        done = self._take(first, time_ns)
        self._time_ns, self._first = time_ns, 0
        return done

    def _take(self, first: int, limit_ns: int | None = None) -> list[Packet]:
        """Return the held lines with times; that of the line `first` is known."""
        start_ns, line_ns = self._time_ns or self._near_ns, self._line_ns
        held, self._held = self._held, []
        if limit_ns is None or limit_ns <= start_ns:
            limit_ns = END_NS
        return [
            Packet(packet.data, min(start_ns + round(number * line_ns), limit_ns), packet.origin)
            for number, packet in enumerate(held, -first)
        ]

    def _continue(self) -> list[Packet]:
        """Return the held lines where the next time is overdue, and go on at the usual rate."""
        if self._time_ns is None or not self._usual_ns:
            raise LogError(
                f"{len(self._held)} lines follow one another without a second UTC time; {_REMEDY}"
            )
        self._warn(f"no new time in {len(self._held)} lines: counted on", self._time_ns)
        next_ns = self._time_ns + round(self._line_ns * (len(self._held) - self._first))
        done = self._take(self._first)
        self._time_ns, self._first = next_ns, 0
        return done

    def _finish(self) -> list[Packet]:
        if self._held and not self._usual_ns:
            self._warn(f"all lines have one time: there is no second one; {_REMEDY}", self._near_ns)
        return self._take(self._first)


def even_times(batches: Batches, start_ns: int, interval_secs: float) -> Batches:
    """Yield lines with evenly spaced times.

    Parameters
    ----------
    batches
        Lines without times.
    start_ns
        The time of the first line, ns since 1970-01-01 UTC.
    interval_secs
        The time from a line to the next, s.
    """
    number = 0
    for batch in batches:
        first, number = number, number + len(batch)
        yield [
            packet._replace(received_ns=start_ns + round(i * interval_secs * 1e9))
            for i, packet in enumerate(batch, first)
        ]
