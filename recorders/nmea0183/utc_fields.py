"""Date and time of day in sentences of GNSS receivers."""

from collections.abc import Callable
from datetime import date
from functools import lru_cache

from recorders.streams.gnss_clock import Utc

from .navigation_sentences import FIX_MODES, has_fix, has_mode, has_valid_rmc
from .sentence_values import Fields, is_valid, text_at

_EPOCH = date(1970, 1, 1).toordinal()
_FIRST_YEAR, _LAST_YEAR = 1970, 2261  # times are 64-bit numbers of ns
_CENTURY_BREAK = "80"  # years of two digits from here on are of the 20th century: GPS began in 1980


def utc_of(formatter: str, fields: Fields) -> Utc | None:
    """Return the time in a sentence; None without a valid one.

    A time without a fix may be that of a receiver's unset clock, and is not used.

    Raises
    ------
    ValueError
        The time or the date is malformed.

    Examples
    --------
    >>> utc_of("ZDA", (b"000000.17", b"01", b"08", b"2014"))
    Utc(clock_ns=170000000, day=16283)
    """
    reader = UTC_READERS.get(formatter)
    return None if reader is None else reader(fields)


@lru_cache(maxsize=64)  # the sentences of a burst share their time
def _clock(text: str) -> int | None:
    """Return the time of day of ``hhmmss.ss``, ns; None where it is empty."""
    if not text:
        return None
    whole, _, fraction = text.partition(".")
    if len(whole) != 6 or not whole.isdecimal() or (fraction and not fraction.isdecimal()):
        raise ValueError(text)
    hour, minute, second = int(whole[:2]), int(whole[2:4]), int(whole[4:])
    if hour > 23 or minute > 59 or second > 60:  # 60 in a leap second
        raise ValueError(text)
    return (hour * 3600 + minute * 60 + second) * 10**9 + int(fraction[:9].ljust(9, "0"))


@lru_cache(maxsize=64)
def _days(day: str, month: str, year: str) -> int:
    if not all(part.isdecimal() and len(part) <= 4 for part in (day, month, year)):
        raise ValueError(day, month, year)
    if not _FIRST_YEAR <= int(year) <= _LAST_YEAR:
        raise ValueError(year)
    return date(int(year), int(month), int(day)).toordinal() - _EPOCH


def _only_clock(text: str, *, valid: bool) -> Utc | None:
    clock_ns = _clock(text)
    return Utc(clock_ns, None) if valid and clock_ns is not None else None


def _rmc(fields: Fields) -> Utc | None:
    clock_ns, text = _clock(text_at(fields, 0)), text_at(fields, 8)
    if clock_ns is None or not has_valid_rmc(fields):
        return None
    if not text:
        return Utc(clock_ns, None)
    if len(text) != 6 or not text.isdecimal():
        raise ValueError(text)
    century = "19" if text[4:] >= _CENTURY_BREAK else "20"
    return Utc(clock_ns, _days(text[:2], text[2:4], century + text[4:]))


def _zda(fields: Fields) -> Utc | None:
    clock_ns = _clock(text_at(fields, 0))
    if clock_ns is None:
        return None
    day, month, year = text_at(fields, 1), text_at(fields, 2), text_at(fields, 3)
    return Utc(clock_ns, _days(day, month, year) if day and month and year else None)


UTC_READERS: dict[str, Callable[[Fields], Utc | None]] = {
    "RMC": _rmc,
    "ZDA": _zda,
    "GGA": lambda f: _only_clock(text_at(f, 0), valid=has_fix(f)),
    "GNS": lambda f: _only_clock(text_at(f, 0), valid=has_mode(f)),
    "GLL": lambda f: _only_clock(text_at(f, 4), valid=is_valid(f, 5) and is_valid(f, 6, FIX_MODES)),
}
"""What reads the time in the fields of each of these sentences, by formatter; as `utc_of`."""
