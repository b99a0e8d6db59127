"""Printed dates and day times as nanoseconds: ISO 8601, date orders, time zones."""

import re
from collections.abc import Sequence
from datetime import UTC, tzinfo
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shiplog.layouts.layout import TimeForm
from shiplog.types import FloatArray, TimeArray

if TYPE_CHECKING:  # slow to import: only printed times wait for it
    import pandas as pd

DAY_NS = 86_400 * 10**9
HALF_DAY_NS = DAY_NS // 2
MAX_TIME_CHARACTERS = 64  # of a printed time with its date and zone
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATE = r"(?P<a>\d{1,4})[-./ ](?P<b>\d{1,2}|[A-Za-z]{3,9})[-./ ](?P<c>\d{1,4})"
_PACKED = r"(?P<packed>\d{6}|\d{8})"
_CLOCK = (
    r"(?P<hour>\d{1,2}):?(?P<minute>\d\d)(?::?(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?)?"
    r"(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?\s?(?P<zone>[Zz]|UTC|GMT|[+-]\d\d(?::?\d\d)?)?"
)
_TIME = re.compile(rf"(?:(?:{_DATE}|{_PACKED})(?:[Tt ,]\s?|\s+))?{_CLOCK}")
_ONLY_DATE = re.compile(rf"{_DATE}|{_PACKED}")
_SIX_DIGITS = re.compile(r"([01]\d|2[0-3])[0-5]\d[0-5]\d(\.\d*)?")
_NEEDS = "state time.date_order = 'dmy', 'mdy' or 'ymd'"


class TimeTextError(Exception):
    """A row whose time cannot be read: its index, and the reason with the remedy."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row, self.reason = row, reason


def is_time_text(text: str) -> bool:
    """Whether a cell is a date with a day time or a day time, and not a number.

    Examples
    --------
    >>> is_time_text("2026-03-29T00:55:00Z"), is_time_text("12:00:01.5"), is_time_text("12.5")
    (True, True, False)
    """
    plain = text.strip()
    return bool((":" in plain or "T" in plain.upper()) and _TIME.fullmatch(plain))


def looks_hhmmss(texts: Sequence[str]) -> bool:
    """Whether numbers are day times in six digits, such as 235959.5.

    Examples
    --------
    >>> looks_hhmmss(["235958", "235959"]), looks_hhmmss(["0.5", "1.0"])
    (True, False)
    """
    filled = [text.strip() for text in texts if text.strip()]
    return bool(filled) and all(map(_SIX_DIGITS.fullmatch, filled))


def parse_times(
    texts: list[str], dates: list[str] | None, form: TimeForm
) -> tuple[TimeArray, list[str]]:
    """Convert printed times to nanoseconds since 1970-01-01 UTC.

    A day time without a date passes midnight where it runs backwards by more than half a day. A
    date in its own column that is not advanced at midnight is corrected in the same way.

    Parameters
    ----------
    texts
        (n,) dates with day times, or day times.
    dates
        (n,) dates in a column of their own, or None.
    form
        Zone, date order and start as the layout states them.

    Returns
    -------
    times_ns
        (n,) times.
    warnings
        One line each: a zone or a date that had to be assumed, a zone that the times contradict.

    Raises
    ------
    TimeTextError
        A text is not a time, or its day and month are ambiguous.

    Examples
    --------
    >>> times_ns, _ = parse_times(["23:59:59", "00:00:00"], None, TimeForm(0, UTC))
    >>> int(times_ns[1] - times_ns[0])
    1000000000
    """
    import pandas as pd  # noqa: PLC0415 - slow to import

    parts = _clock_parts(texts)
    clock_ns = _clock_ns(parts)
    warnings: list[str] = []
    dated = parts["date"] != ""
    if dates is None and np.any(dated) and not np.all(dated):
        raise TimeTextError(int(np.argmin(dated)), "has no date, though other rows do")
    if dates is not None or np.any(dated):
        days = _date_days(parts["date"] if dates is None else np.array(dates), form.date_order)
        if dates is not None:
            days = days + _late_dates(days, clock_ns)
    else:
        turns = np.cumsum(np.diff(clock_ns, prepend=clock_ns[:1]) < -HALF_DAY_NS)
        if form.start_ns is None:
            warnings.append("day times without a date, counted from 1970-01-01; state `start`")
        first = pd.Timestamp(form.start_ns or 0, tz="UTC").tz_convert(form.zone or UTC)
        days = turns + (first.tz_localize(None).normalize().value // DAY_NS)
    if form.assumed:
        example = (dates or texts)[0]
        warnings.append(
            f"day and month are assumed in the order {form.date_order}; check it with the first "
            f"date {example!r} and remove time.assumed"
        )
    local_ns = days * DAY_NS + clock_ns
    stated = parts["zone"] != ""
    if np.any(stated):
        if not np.all(stated):
            raise TimeTextError(int(np.argmin(stated)), "has no time zone, though other rows do")
        times_ns = local_ns - _offsets_ns(parts["zone"])
        warnings += _zone_warnings(parts["zone"], local_ns - times_ns, times_ns, form.zone)
        return times_ns, warnings
    if form.zone is None:
        warnings.append(
            "the times have no time zone, read as UTC; state time.zone, such as 'UTC' or "
            "'Europe/Berlin'"
        )
    return _to_utc(local_ns, form.zone or UTC), warnings


def _zone_warnings(
    stated: NDArray[np.str_], offsets_ns: TimeArray, times_ns: TimeArray, zone: tzinfo | None
) -> list[str]:
    """Compare the first printed offset from UTC with that of the zone in the layout."""
    import pandas as pd  # noqa: PLC0415 - slow to import

    if zone is None:
        return []
    local = pd.Timestamp(times_ns[0], tz="UTC").tz_convert(zone).tz_localize(None)
    if local.value - times_ns[0] == offsets_ns[0]:
        return []
    text = f"the times state the zone {stated[0]}, which is used; time.zone = '{zone}' differs"
    return [f"{text} from it: remove time.zone"]


def excel_ns(days: FloatArray, zone: tzinfo | None) -> TimeArray:
    """Convert serial days of a spreadsheet, (n,) since 1899-12-30, to ns since 1970-01-01 UTC."""
    microseconds = np.round((days - 25569.0) * 86_400e6)
    return _to_utc(microseconds.astype(np.int64) * 1000, zone or UTC)


def _match(text: str, row: int, pattern: re.Pattern[str]) -> re.Match[str]:
    """Match the text of a row, or raise the reason why it does not match."""
    match = pattern.fullmatch(text.strip())
    if match is None:
        what = "a time" if pattern is _TIME else "a date"
        empty = "is empty" if not text.strip() else f"{text!r} is not {what}"
        example = "2026-03-29T00:55:00Z or 29.03.2026 00:55:00"
        raise TimeTextError(row, f"{empty}, such as {example}; correct it or remove the line")
    return match


def _clock_parts(texts: list[str]) -> dict[str, NDArray[Any]]:
    """Split each text into its day time and its date; (n,) arrays by name.

    Where all texts have the form of the first one, they are split at its places at once.
    """
    if not texts or max(map(len, texts)) > MAX_TIME_CHARACTERS:
        return _clock_parts_by_row(texts)
    letters = np.array(texts, dtype=str)
    codes = letters.view(np.uint32).reshape(len(texts), -1)
    is_digit = (codes >= ord("0")) & (codes <= ord("9"))
    same = (codes == codes[0]) | (is_digit & is_digit[0])
    if not (np.all(same) and _TIME.fullmatch(texts[0])):
        return _clock_parts_by_row(texts)
    match = _match(texts[0], 0, _TIME)
    parts: dict[str, NDArray[Any]] = {}
    for name in ("hour", "minute", "second", "fraction"):
        first, last = match.span(name)
        digits = codes[:, first : min(last, first + 9)].astype(np.int64) - ord("0")
        parts[name] = digits @ 10 ** np.arange(digits.shape[1])[::-1]
        if name == "fraction":
            parts[name] *= 10 ** (9 - digits.shape[1])
    for name in ("half", "zone"):
        parts[name] = np.full(len(texts), match[name] or "")
    if (match["zone"] or "")[:1] in ("+", "-"):
        parts["zone"] = _cut(codes, *match.span("zone"))
    parts["date"] = _cut(codes, 0, len(_date_text(match)))
    return parts


def _cut(codes: NDArray[np.uint32], first: int, last: int) -> NDArray[np.str_]:
    """Return the same places of each text, (n,)."""
    if first == last:
        return np.full(len(codes), "")
    return np.ascontiguousarray(codes[:, first:last]).view(f"U{last - first}")[:, 0]


def _clock_parts_by_row(texts: list[str]) -> dict[str, NDArray[Any]]:
    """Split texts of several forms."""
    matches = [_match(text, row, _TIME) for row, text in enumerate(texts)]
    parts: dict[str, NDArray[Any]] = {
        name: np.array([int(match[name] or 0) for match in matches], np.int64)
        for name in ("hour", "minute", "second")
    }
    fractions = [int((match["fraction"] or "")[:9].ljust(9, "0")) for match in matches]
    parts["fraction"] = np.array(fractions, np.int64)
    parts |= {n: np.array([m[n] or "" for m in matches], dtype=str) for n in ("half", "zone")}
    parts["date"] = np.array([_date_text(match) for match in matches], dtype=str)
    return parts


def _date_text(match: re.Match[str]) -> str:
    """Return the date before a day time; empty if there is none."""
    end = max(match.end("packed"), match.end("c"))
    return match.string[:end] if end > 0 else ""


def _date_days(dates: NDArray[np.str_], order: str | None) -> TimeArray:
    """Return the day of each row, counted from 1970-01-01; each date is parsed once."""
    import pandas as pd  # noqa: PLC0415 - slow to import

    codes, distinct = pd.factorize(dates.astype(object))
    names = list(_ONLY_DATE.groupindex)
    try:
        rows = [_match(text, row, _ONLY_DATE).group(*names) for row, text in enumerate(distinct)]
        return _days(pd.DataFrame(rows, columns=names, dtype=object), order)[codes]
    except TimeTextError as error:
        raise TimeTextError(int(np.argmax(codes == error.row)), error.reason) from None


def _ints(column: "pd.Series[str]") -> TimeArray:
    return np.array([int(text) if text else 0 for text in column], np.int64)


def _clock_ns(parts: dict[str, NDArray[Any]]) -> TimeArray:
    """Return the time of day of each row, ns."""
    hour, minute, second = (parts[name] for name in ("hour", "minute", "second"))
    half = np.char.lower(parts["half"])
    if np.any(half != ""):
        _require((hour >= 1) & (hour <= 12) | (half == ""), "has an hour beyond 12")
        hour = np.where(half == "", hour, hour % 12) + 12 * (half == "p")
    _require(
        (hour < 24) & (minute < 60) & (second <= 60), "has an hour, minute or second too large"
    )
    result: TimeArray = ((hour * 60 + minute) * 60 + second) * 10**9 + parts["fraction"]
    return result


def _require(good: np.ndarray, reason: str) -> None:
    if not np.all(good):
        raise TimeTextError(int(np.argmin(good)), f"{reason}; correct it or remove the line")


def _days(parts: "pd.DataFrame", order: str | None) -> TimeArray:
    """Return the day of each row, counted from 1970-01-01."""
    if parts["packed"].notna().any():
        parts, order = _unpacked(parts, order)
    named = parts["b"].str.isalpha().to_numpy(bool)
    month_names = [str(text)[:3].lower() for text in parts["b"]]
    _require(~named | np.isin(month_names, MONTHS), "has an unknown month")
    middle = np.array(
        [MONTHS.index(m) + 1 if n else int(m) for m, n in zip(month_names, named, strict=True)],
        np.int64,
    )
    a, c = _ints(parts["a"]), _ints(parts["c"])
    if (parts["a"].str.len() == 4).all():
        order = "ymd"
    elif named.all():
        order = order if order == "ymd" else "dmy"
    elif order is None:
        order = _detected_order(a, middle, parts)
    if order == "mdy":
        year, month, day = c, a, middle
    else:
        year, month, day = (a, middle, c) if order == "ymd" else (c, middle, a)
    year = np.where(year < 70, year + 2000, np.where(year < 100, year + 1900, year))
    _require((month >= 1) & (month <= 12), f"has no month from 1 to 12 in the order {order}")
    months = (year - 1970).astype("datetime64[Y]").astype("datetime64[M]") + (month - 1)
    dates = months.astype("datetime64[D]") + (day - 1)
    _require(
        (day >= 1) & (dates.astype("datetime64[M]") == months), "has a day that does not exist"
    )
    _require((year >= 1970) & (year < 2262), "is before 1970 or after 2262")
    return dates.astype(np.int64)


def _unpacked(parts: "pd.DataFrame", order: str | None) -> "tuple[pd.DataFrame, str]":
    """Split dates without separators: yyyymmdd, or six digits in the order that is stated."""
    import pandas as pd  # noqa: PLC0415 - slow to import

    packed = parts["packed"].fillna("")
    long = packed.str.len() == 8
    if not long.all() and order is None:
        raise TimeTextError(int(np.argmin(long)), f"has a date of six digits; {_NEEDS}")
    if long.all() and order is None:
        order = "ymd"
    year = 4 if long.all() else 2
    widths = {"y": year, "m": 2, "d": 2}
    ends = np.cumsum([widths[letter] for letter in str(order)])
    cut = [packed.str[end - widths[k] : end] for end, k in zip(ends, str(order), strict=True)]
    split = pd.DataFrame(dict(zip("abc", cut, strict=True)))
    return split, str(order)


def _detected_order(first: TimeArray, second: TimeArray, parts: "pd.DataFrame") -> str:
    """Return the order of day and month, from values above 12."""
    if (parts["c"].str.len() < 4).any():
        raise TimeTextError(0, f"has a date whose year is ambiguous; {_NEEDS}")
    day_first, month_first = bool(np.any(first > 12)), bool(np.any(second > 12))
    if day_first == month_first:
        raise TimeTextError(0, f"has a date whose day and month are ambiguous; {_NEEDS}")
    return "dmy" if day_first else "mdy"


def _late_dates(days: TimeArray, clock_ns: TimeArray) -> TimeArray:
    """Return the days to add where the date column did not advance at midnight."""
    if not len(days):
        return days
    changed = np.diff(days, prepend=days[:1]) != 0
    turns = np.cumsum((np.diff(clock_ns, prepend=clock_ns[:1]) < -HALF_DAY_NS) & ~changed)
    group = np.cumsum(changed)
    first = np.flatnonzero(np.diff(group, prepend=-1))
    late: TimeArray = turns - turns[first][group]
    back = np.diff(clock_ns, prepend=clock_ns[:1]) < -HALF_DAY_NS
    for start in first[1:]:  # a date that advanced within a minute before midnight
        later = start + 1 + np.argmax(back[start + 1 :]) if np.any(back[start + 1 :]) else -1
        steps = days[start] - days[start - 1], clock_ns[start] - clock_ns[start - 1]
        is_early = steps[0] == 1 and 0 <= steps[1] < 60e9 and later > 0
        if is_early and group[later] == group[start] and DAY_NS - clock_ns[start] < 60e9:
            late[group == group[start]] -= 1
    return late


def _offsets_ns(zones: NDArray[np.str_]) -> TimeArray:
    """Return the offset from UTC of each row, ns."""
    distinct, codes = np.unique(zones, return_inverse=True)
    minutes = []
    for text in distinct:
        digits = text[1:].replace(":", "").ljust(4, "0")
        size = int(digits[:2]) * 60 + int(digits[2:]) if text[0] in "+-" else 0
        minutes.append(-size if text[0] == "-" else size)
    return np.array(minutes, np.int64)[codes] * (60 * 10**9)


def _to_utc(local_ns: TimeArray, zone: tzinfo) -> TimeArray:
    """Convert local times to UTC, (n,) ns; a repeated hour is resolved by the order of the rows."""
    import pandas as pd  # noqa: PLC0415 - slow to import

    local = pd.DatetimeIndex(local_ns.astype("datetime64[ns]"))
    try:
        summer, winter = (
            local.tz_localize(zone, ambiguous=np.full(len(local), flag), nonexistent="raise")
            .as_unit("ns").asi8 for flag in (True, False)
        )  # fmt: skip
    except Exception as error:  # the exception's type depends on the version of pandas
        raise TimeTextError(
            0, f"begins times of which one does not exist in {zone} ({error}); "
            "the logger's zone may be a fixed offset: time.zone = '+01:00'"
        ) from error  # fmt: skip
    repeated = summer != winter
    if not np.any(repeated):
        return summer
    back = np.diff(local_ns, prepend=local_ns[:1]) < 0
    after = repeated & (np.cumsum(back & repeated) > 0)
    if not np.any(back & repeated) and repeated[0]:
        if repeated[-1] or winter[~repeated][0] - winter[repeated][-1] > 600e9:
            raise TimeTextError(
                0,
                f"is in the hour that {zone} has twice; state an offset: time.zone = '+01:00'",
            )
        after = repeated
    return np.where(after, winter, summer)
