"""Times of GNSS receivers against the times of reception: week rollover, latency, and its jumps."""

import argparse
from collections.abc import Callable, Collection, Iterator
from datetime import UTC, datetime
from typing import NamedTuple

from shiplog.tables.printed_times import DAY_NS, HALF_DAY_NS

from .gnss_receiver import MAX_WAIT_NS, GnssReceiver, HeldMessage, WriteSamples
from .receiver_times import ReceiverTimes

ROLLOVER_NS = 1024 * 7 * DAY_NS  # the GPS week of ten bits begins again at 0
MAX_ROLLOVERS = 2
_MAX_DATE_ERROR_NS = 2 * DAY_NS  # a clock of the recorder that is wrong by less is an offset
_MIN_LATENCY_SECS = 0.2  # reported from here on
_MIN_OFFSET_SECS = 2.0  # no receiver is as late: the clock of the recorder is wrong
_MAX_SOURCES = 64
_SILENCE_NS = 10 * 10**9  # after which another kind of message states the time

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


class GnssClock:
    """The times of all receivers of a stream, and the times of measurement of what they send.

    The times of a receiver are those of its fixes. A message without a time was measured at the
    epoch of its burst, where its source sends bursts of one message of each kind; else before its
    reception by the least recent latency of the receiver, because a message can be delayed and
    never be early. A receiver whose times do not step as its messages come, such as one that states
    the last full second of a clock of its own, does not state the times of its measurements.

    The first messages of a receiver wait until its times show whether they can be used: a change
    from one clock to another in the middle of a log would be a step of its clock.

    Parameters
    ----------
    warn
        Receives warnings: a rollover, a jump, a date that contradicts the times of reception.
    is_applied
        Whether the time of measurement is the receiver's own, rather than that of reception.
    received_is_known
        Whether the times of reception are known; if not, there are no latencies.
    in_bursts
        Whether the sources are talkers of NMEA 0183, which send bursts and may be no receivers.
    clock_kinds
        The kinds of messages that state the time without a fix; they are used only where their
        source sends no others.
    """

    def __init__(
        self,
        warn: Warn,
        *,
        is_applied: bool = False,
        received_is_known: bool = True,
        in_bursts: bool = False,
        clock_kinds: Collection[str] = (),
    ) -> None:
        self._warn = warn
        self._is_applied = is_applied
        self._received_is_known = received_is_known
        self._in_bursts = in_bursts
        self._clock_kinds = clock_kinds
        self._receivers: dict[str, GnssReceiver] = {}

    def set_time(self, source: str, kind: str, utc: Utc, received_ns: int) -> int | None:
        """Take the time in a message, and return it as ns since 1970-01-01 UTC.

        A date that is early by rollovers of the GPS week is corrected. None where the date
        contradicts the time of reception otherwise.
        """
        receiver = self._receiver_of(source, received_ns)
        if receiver is None:
            return None
        utc_ns = self._dated(source, receiver, utc, received_ns)
        if utc_ns is None:
            return None
        if self._becomes_reference(receiver.times, kind, received_ns):
            receiver.times.set_reference(kind)
        if kind == receiver.times.reference:
            receiver.times.set_time(utc_ns, received_ns)
        if self._received_is_known:
            self._compare(source, receiver, kind, (utc_ns, received_ns))
        return utc_ns

    def write_measured(
        self,
        source: str,
        kind: str,
        times: tuple[int, int | None],
        write: WriteSamples,
    ) -> None:
        """Write the samples of a message with their time of measurement, now or when it is known.

        Parameters
        ----------
        source, kind
            The receiver, and the kind of the message.
        times
            The time of reception, ns, and the one in the message, as `set_time` has returned it;
            None where it has none.
        write
            Writes the samples, given the time of measurement, ns. Calls keep their order for each
            source.
        """
        received_ns, stated_ns = times
        receiver = self._receiver_of(source, received_ns) if self._is_applied else None
        if receiver is None or receiver.is_applied is False:
            write(received_ns)
            return
        receiver.add(HeldMessage(kind, received_ns, stated_ns, write))
        if receiver.is_applied is not None:
            receiver.release(in_bursts=self._in_bursts)

    def _receiver_of(self, source: str, received_ns: int) -> GnssReceiver | None:
        """Return a receiver, a new one where there is room for it."""
        receiver = self._receivers.get(source)
        if receiver is None and len(self._receivers) < _MAX_SOURCES:
            receiver = self._receivers[source] = GnssReceiver(received_ns)
        return receiver

    def notes(self) -> Iterator[tuple[str, str]]:
        """Yield the latency of each kind of message, as key and text for the metadata of a log."""
        for source, receiver in self._receivers.items():
            for kind, latency in receiver.latencies.items():
                middle, low, high = latency.quantiles()
                key = f"latency_s.{source}.{kind.strip()}"
                yield key, f"{middle:.3f} (90 % from {low:.3f} to {high:.3f})"

    def finish(self) -> None:
        """Write what waits, and report what the times of the receivers show."""
        for source, receiver in self._receivers.items():
            receiver.decide()
            receiver.release(in_bursts=self._in_bursts)
            if self._is_applied and not (receiver.is_applied or receiver.slips):
                self._report_reception(source, receiver)
            self._report_latency(source, receiver)

    def _report_reception(self, source: str, receiver: GnssReceiver) -> None:
        """Report why the samples of a receiver have the time of reception."""
        if receiver.is_offset:
            cause = "its own differs by more than a latency"
        elif receiver.times.count:
            cause = f"its first time came over {MAX_WAIT_NS // 10**9} s after its first message"
        elif self._in_bursts:
            return  # no receiver
        else:
            cause = "it sends no time"
        self._warn(f"{source}: its samples have the time of reception: {cause}", None)

    def _report_latency(self, source: str, receiver: GnssReceiver) -> None:
        """Report latencies that matter, in one warning."""
        late = {
            kind: middle
            for kind, latency in receiver.latencies.items()
            if abs(middle := latency.quantiles()[0]) > _MIN_LATENCY_SECS
        }
        if not late or receiver.slips:
            return
        listed = ", ".join(f"{kind.strip()} {secs:.2f} s" for kind, secs in late.items())
        if max(map(abs, late.values())) < _MIN_OFFSET_SECS and min(late.values()) > 0:
            cause = "the receiver is late"
            if not self._is_applied:
                cause += "; with --time gnss its samples have its own time"
        else:
            cause = "the recorder's clock is wrong by about as much"
        self._warn(f"{source}: reception minus GNSS time is {listed}: {cause}", None)

    def _becomes_reference(self, times: ReceiverTimes, kind: str, received_ns: int) -> bool:
        """Whether a kind of message states the time of a receiver from here on."""
        if not times.reference or received_ns - times.received_ns >= _SILENCE_NS:
            return True
        return times.reference in self._clock_kinds and kind not in self._clock_kinds

    def _compare(
        self, source: str, receiver: GnssReceiver, kind: str, times: tuple[int, int]
    ) -> None:
        """Compare a time in a message with that of its reception, and warn of a jump or slip."""
        utc_ns, received_ns = times
        if (jump := receiver.latencies[kind].add((received_ns - utc_ns) * 1e-9)) is not None:
            self._warn(
                f"{source}{kind}: reception against GNSS time jumps by {jump:+.2f} s: "
                "the recorder's clock or the receiver was set",
                received_ns,
            )
        slip = receiver.steps[kind].slip(utc_ns, received_ns)
        is_unused = kind in self._clock_kinds and kind != receiver.times.reference
        if slip is None or receiver.slips or is_unused:
            return
        receiver.slips = True
        text = (
            f"{source}{kind}: GNSS time steps by {slip[0]:.2f} s within {slip[1]:.2f} s of "
            "reception: it is not the time of measurement"
        )
        if receiver.is_applied:
            text += "; record or decode it without --time gnss"
        elif self._is_applied:
            text += ", which is that of reception"
        self._warn(text, received_ns)

    def _dated(self, source: str, receiver: GnssReceiver, utc: Utc, received_ns: int) -> int | None:
        if utc.day is None:
            return nearest_ns(utc.clock_ns, received_ns)
        utc_ns = utc.day * DAY_NS + utc.clock_ns
        usual_ns = utc_ns + receiver.rollovers * ROLLOVER_NS  # as the date before it
        if abs(received_ns - usual_ns) < _MAX_DATE_ERROR_NS:
            return usual_ns
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


def add_time_option(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--time``, which applies the times of receivers."""
    parser.add_argument(
        "--time",
        choices=("received", "gnss"),
        default="received",
        help="time of measurement of what GNSS receivers send: that of reception, or the "
        "receiver's own (default: received)",
    )


def _day(time_ns: int) -> str:
    return f"{datetime.fromtimestamp(time_ns // 10**9, UTC):%Y-%m-%d}"
