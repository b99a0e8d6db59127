"""Time stamps before the packets of a file, as loggers print them: detected or stated."""

import argparse
import re
from calendar import timegm
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta

from shiplog.errors import LogError, UsageError
from shiplog.tables.printed_times import DAY_NS, HALF_DAY_NS

from .counts import StreamCounts
from .packets import END_NS, Batches, Packet

_SECOND_NS = 10**9
_ZONE = rb"(Z|[+-]\d\d:?\d\d)?"
_CLOCK = rb"\d\d:\d\d:\d\d"
_FRACTION = rb"(?:[.,](\d{1,12}))?"
_END = rb"(?:[ \t,;]+)"  # between the stamp and the packet
_NONE, _AUTO = "none", "auto"
_FEW, _MOST = 0.1, 0.5  # shares of lines with a stamp: chance, and a stamped file


@dataclass(frozen=True)
class StampForm:
    """A form of time stamps.

    Attributes
    ----------
    name
        The name, as an option states it.
    example
        A stamp.
    pattern
        Matches a stamp with what separates it from the packet. Its groups are the whole seconds
        (or the whole units of an epoch), their fraction, and the time zone where it has one.
    unit_ns
        The unit of an epoch, ns; 0 where the stamp is a date or a time of day.
    """

    name: str
    example: str
    pattern: re.Pattern[bytes]
    unit_ns: int = 0


def add_stamp_option(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--stamp``, which states the form of the stamps or has it detected."""
    parser.add_argument(
        "--stamp",
        choices=OPTION_VALUES,
        default="auto",
        help="time stamps before the lines of a file (default: auto, detected)",
    )


def add_date_option(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--date``, which states the day of times without a date."""
    parser.add_argument(
        "--date",
        type=_date,
        metavar="YYYY-MM-DD",
        help="day (UTC) of the first line of a file whose times have no date",
    )


def _date(text: str) -> date:
    try:
        day = date.fromisoformat(text)
    except ValueError:
        day = date.min
    if not 1970 <= day.year < 2262:  # times are 64-bit numbers of ns
        raise UsageError(
            f"--date takes YYYY-MM-DD, such as 2026-05-01, from 1970 to 2261, not {text!r}"
        )
    return day


def _form(name: str, example: str, begin: bytes, *, end: bytes = b"", unit: int = 0) -> StampForm:
    return StampForm(name, example, re.compile(begin + _FRACTION + end + _END), unit)


FORMS = {
    form.name: form
    for form in (
        _form(
            "iso",
            "2014-08-01T00:00:00.124Z",
            rb"(\d{4}-\d\d-\d\d[T ]" + _CLOCK + rb")",
            end=_ZONE,
        ),
        _form("canboat", "2011-11-24-22:42:04.388", rb"(\d{4}-\d\d-\d\d-" + _CLOCK + rb")"),
        _form("clock", "22:42:04.388", rb"(" + _CLOCK + rb")"),
        _form("candump", "(1322174524.388000)", rb"\((\d{9,10})", end=rb"\)", unit=_SECOND_NS),
        _form("s", "1322174524.388", rb"(\d{10})", unit=_SECOND_NS),
        _form("ms", "1322174524388", rb"(\d{13})", unit=10**6),
        _form("us", "1322174524388000", rb"(\d{16})", unit=10**3),
        _form("ns", "1322174524388000000", rb"(\d{19})", unit=1),
    )
}
"""The known forms of time stamps by name."""

_ANY_FORM = re.compile(
    b"|".join(b"(?P<%b>%b)" % (f.name.encode(), f.pattern.pattern) for f in FORMS.values())
)  # its last group is that of a form: no two forms match one line

OPTION_VALUES = (_AUTO, _NONE, *FORMS)
"""The values of an option that states the form of the stamps."""


def find_stamp_form(head: Sequence[Packet], option: str = _AUTO) -> StampForm | None:
    """Return the form of the stamps of a file, from its first lines; None if it has none.

    Parameters
    ----------
    head
        The first lines.
    option
        One of `OPTION_VALUES`; ``auto`` detects the form.

    Raises
    ------
    LogError
        The lines do not have the stated form, or only some of them have a stamp.

    Examples
    --------
    >>> head = [Packet(b"2014-08-01T00:00:00.183000Z $HEHDT,218.53,T*12", -1)]
    >>> find_stamp_form(head).name
    'iso'
    """
    if option == _NONE or not head:
        return None
    matches = Counter(str(m.lastgroup) for p in head if (m := _ANY_FORM.match(p.data)))
    if option != _AUTO:
        if option not in matches:
            raise LogError(
                f"no line begins with a time stamp such as {FORMS[option].example}; "
                f"state another form with --stamp ({', '.join(OPTION_VALUES)})"
            )
        return FORMS[option]
    shares = {name: count / len(head) for name, count in matches.items()}
    found = {name: share for name, share in shares.items() if share > _FEW}
    if not found:
        return None
    best = max(found, key=lambda name: found[name])
    if len(found) > 1 or found[best] < _MOST:
        seen = ", ".join(f"{name} on {share:.0%}" for name, share in found.items())
        raise LogError(
            f"not all lines begin with the same form of time stamp ({seen} of the first "
            f"{len(head)} lines); state it with --stamp ({', '.join(OPTION_VALUES)})"
        )
    return FORMS[best]


class StampReader:
    """Reads the time stamps of consecutive lines.

    Parameters
    ----------
    form
        The form of the stamps.
    first_day
        The day of the first stamp where stamps have no date; by default 1970-01-01.

    Attributes
    ----------
    zone_is_assumed
        Whether a date without a time zone was read as UTC.

    Examples
    --------
    >>> reader = StampReader(FORMS["clock"])
    >>> reader.read(b"23:59:59.5 $HEHDT,1,T")
    (86399500000000, b'$HEHDT,1,T')
    >>> reader.read(b"00:00:00.5 $HEHDT,2,T")  # the next day
    (86400500000000, b'$HEHDT,2,T')
    """

    def __init__(self, form: StampForm, first_day: date | None = None) -> None:
        self._form = form
        self._unit_ns = form.unit_ns or _SECOND_NS
        self._has_zone = form.name == "iso"
        first = first_day or date(1970, 1, 1)
        self._day_ns = timegm(first.timetuple()) * _SECOND_NS
        self._clock_ns = -1  # of the last time of day
        self._last: tuple[bytes, bytes | None] = b"", None  # consecutive lines share their second
        self._last_ns = 0
        self.zone_is_assumed = False

    def read(self, line: bytes) -> tuple[int, bytes] | None:
        """Return the time, ns since 1970-01-01 UTC, and the packet; None without a valid stamp."""
        match = self._form.pattern.match(line)
        if match is None:
            return None
        whole, fraction = match[1], match[2]
        zone = match[3] if self._has_zone else None
        if (whole, zone) != self._last:
            try:
                self._last_ns = self._whole_ns(whole.decode(), zone)
            except (ValueError, OverflowError):
                return None
            self._last = whole, zone
        time_ns = self._last_ns
        if fraction:
            time_ns += int(fraction[:9].ljust(9, b"0")) * self._unit_ns // _SECOND_NS
        return (time_ns, line[match.end() :]) if 0 <= time_ns < END_NS else None

    def _whole_ns(self, whole: str, zone: bytes | None) -> int:
        if self._form.unit_ns:
            return int(whole) * self._form.unit_ns
        if self._form.name == "clock":
            return self._dated_ns(whole)
        if zone is None:
            self.zone_is_assumed = True
        text = f"{whole[:10]}T{whole[11:]}{(zone or b'Z').decode()}"
        return int(datetime.fromisoformat(text).timestamp()) * _SECOND_NS

    def _dated_ns(self, clock: str) -> int:
        """Add the day to a time of day; one that runs backwards by half a day is of the next."""
        time = datetime.strptime(clock, "%H:%M:%S") - datetime(1900, 1, 1)  # noqa: DTZ001, DTZ007
        clock_ns = time // timedelta(seconds=1) * _SECOND_NS
        if self._clock_ns - clock_ns > HALF_DAY_NS:
            self._day_ns += DAY_NS
        elif self._clock_ns >= 0 and clock_ns - self._clock_ns > HALF_DAY_NS:
            self._day_ns -= DAY_NS  # a late line of the day before
        self._clock_ns = clock_ns
        return self._day_ns + clock_ns


def read_stamps(batches: Batches, reader: StampReader, counts: StreamCounts) -> Batches:
    """Move the stamps of lines to their times of reception; lines without one are rejected."""
    for batch in batches:
        read = [(reader.read(packet.data), packet.origin) for packet in batch]
        stamped = [Packet(stamp[1], stamp[0], origin) for stamp, origin in read if stamp]
        counts.reject("no valid time stamp", len(batch) - len(stamped))
        yield stamped
