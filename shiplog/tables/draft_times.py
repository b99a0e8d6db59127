"""Section of the time in a drafted layout."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray
from shiplog.units import UNITS

from .draft_sample import sample_numbers
from .printed_times import MONTHS, is_time_text, looks_hhmmss

_TIME_WORDS = (
    r"t|time|utc|(utc|gps|gmt|local|log)_time|time_utc|timestamp|datetime|date_time|secs?|seconds|"
    r"clock|elapsed(_time)?|uhrzeit|zeit|zeitstempel|(days|excel)(_time)?"
)
_DATE_WORDS = r"((utc|gps|gmt|local|log)_)?date(_utc)?|day|datum"
SPREADSHEET_DAYS = (25_569.0, 80_000.0)  # 1970 to 2119
_UNIX_UNITS = (("ns", 1e17), ("us", 1e14), ("ms", 1e11))  # Unix times above the number


@dataclass(frozen=True)
class TimeSection:
    """The drafted section `[time]`.

    Attributes
    ----------
    entries
        Values of its keys, such as `column` and `zone`.
    remarks
        What the columns are read as, and what was assumed.
    """

    entries: dict[str, str]
    remarks: tuple[str, ...]


def draft_times(
    columns: Mapping[str, Sequence[str]], words: Mapping[str, tuple[str, str]]
) -> TimeSection | None:
    """Draft the section of the time; None if no column has times.

    Parameters
    ----------
    columns
        Cells of each column, by its header.
    words
        Words and unit of each header.
    """
    texts = [n for n, cells in columns.items() if cells[0] and all(map(is_time_text, cells[:20]))]
    named = [n for n, (text, _) in words.items() if re.fullmatch(_TIME_WORDS, text)]
    dates = [n for n, (text, _) in words.items() if re.fullmatch(_DATE_WORDS, text)]
    dates = [name for name in dates if name not in texts]
    if not texts and not named:
        return None
    name = (texts or named)[0]
    values = sample_numbers(columns[name], comma=True)
    packed = not texts and looks_hhmmss(columns[name]) and (bool(dates) or values[0] > 1e4)
    if not texts and not packed:
        return _numeric(name, words[name][1], values)
    entries, remarks = {"column": name}, []
    if packed:
        entries["unit"] = "hhmmss"
    dated = not packed and re.search(r"\d[-./ ]\w+[-./ ]\d|\d{8}[T ]", columns[name][0])
    if not dated and dates:
        entries["date"] = dates[0]
    printed = columns[entries.get("date", name)]
    if dated or "date" in entries:
        entries |= _date_order(printed)
    else:
        remarks.append(
            f"{name!r}: day times without a date; state `start`, such as 2026-03-29T00:00:00Z"
        )
    if not re.search(r"(Z|UTC|GMT|:\d\d([.,]\d+)?\s?[+-]\d\d(:?\d\d)?)$", columns[name][0]):
        if re.search(r"(?i)\b(utc|gmt)\b|(utc|gmt)_|_(utc|gmt)", name):
            entries["zone"] = "UTC"
        else:
            remarks.append(f"{name!r}: no time zone is printed; UTC is assumed, state time.zone")
    if "assumed" in entries:
        remarks.append(
            f"{entries.get('date', name)!r}: day and month are ambiguous; {entries['date_order']} "
            "is assumed, correct time.date_order and remove time.assumed"
        )
    used = [entries["date"], name] if "date" in entries else [name]
    remarks.append(f"{' and '.join(map(repr, used))}: time (its cells)")
    return TimeSection(entries, tuple(remarks))


def _numeric(name: str, stated: str, values: FloatArray) -> TimeSection:
    """Draft the section of times that are numbers."""
    finite = values[np.isfinite(values)]
    first, last = float(finite[0]), float(finite[-1])
    if stated in UNITS and UNITS[stated][0] == "s":
        unit, basis = stated, "its header"
    else:
        basis = "the size of its numbers; check"
        unit = next((unit for unit, least in _UNIX_UNITS if first > least), "s")
        is_days = SPREADSHEET_DAYS[0] <= first <= SPREADSHEET_DAYS[1]
        if is_days and (last - first) / max(len(values) - 1, 1) < 0.01:
            unit = "excel"
    remarks = (f"{name!r}: time in {unit} ({basis})",)
    return TimeSection({"column": name, "unit": unit}, remarks)


def _date_order(printed: Sequence[str]) -> dict[str, str]:
    """Return the order of day, month and year; `assumed` where the dates do not determine it."""
    first = printed[0]
    if re.match(r"\d{4}[-./ ]|\d{8}(\D|$)", first) or any(m in first.lower() for m in MONTHS):
        return {}
    match = re.match(r"(\d{2})(\d{2})\d{2}(\D|$)|(\d{1,2})[-./ ](\d{1,2})[-./ ]", first)
    if match is None:
        return {}
    pattern = r"(\d\d)(\d\d)\d\d(?:\D|$)" if match[1] else r"(\d{1,2})[-./ ](\d{1,2})[-./ ]"
    pairs = [pair for pair in (re.match(pattern, text) for text in printed) if pair]
    if any(int(pair[2]) > 12 for pair in pairs):
        return {"date_order": "mdy"}
    if any(int(pair[1]) > 12 for pair in pairs):
        return {"date_order": "dmy"}
    return {"date_order": "dmy", "assumed": "date_order"}
