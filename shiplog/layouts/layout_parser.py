"""Parser of layout files: all errors of a file at once, with the nearest known name."""

import codecs
import os
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from math import isfinite
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from shiplog.errors import LayoutError
from shiplog.toml_text import list_errors, parse_toml
from shiplog.units import CATALOGUE

from .channel_sections import SectionParser
from .layout import (
    DATE_ORDERS,
    DELIMITERS,
    VELOCITIES,
    Column,
    Layout,
    TimeForm,
)

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
KIND = "layout file"
TIME_TEXT_UNITS = ("excel", "hhmmss")  # days since 1899-12-30, and day times in six digits
_KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    # key of the top level: its type, and that type in words
    "name": (str, "a string"),
    "source": (str, "a string without '/'"),
    "encoding": (str, "an encoding of text such as 'utf-8' or 'cp1252'"),
    "skip_rows": (int, "a whole number, 0 or more"),
    "comment": (str, "a string such as '#'"),
    "delimiter": (str, "one of " + ", ".join(map(repr, DELIMITERS))),
    "decimal_comma": (bool, "true or false"),
    "header": (bool, "true or false"),
    "start": (datetime, "a time with its zone, such as 2008-04-14T00:00:00Z"),
    "froude_scale": ((int, float), "a positive number"),
}
_REBUILDS = {"time": "uniform", "heading": "from yaw_rate"}  # role: the only value of `rebuild`
_TIME_KEYS = ("column", "unit", "date", "zone", "date_order", "assumed", "rebuild")


def parse_layout(text: str, where: str) -> Layout:
    """Parse the text of a layout file.

    Parameters
    ----------
    text
        TOML; docs/tables.md describes the keys.
    where
        Name of the file, for messages.

    Raises
    ------
    LayoutError
        The text has errors; the message lists all of them.

    Examples
    --------
    >>> text = '''
    ... [time]
    ... column = 1
    ... unit = "s"
    ... [yaw_rate]
    ... column = 2
    ... unit = "deg/s"
    ... '''
    >>> parse_layout(text, "gyro.toml").columns["yaw_rate"].unit
    'deg/s'
    """
    return _LayoutParser(parse_toml(text, where, KIND, LayoutError), where).layout()


class _LayoutParser(SectionParser):
    """The sections of the layout of a table, parsed one after the other, and their errors."""

    top_keys = tuple(_KINDS)

    def __init__(self, table: Mapping[str, Any], where: str) -> None:
        super().__init__(table, where)
        self._top: dict[str, Any] = {}
        self._zone: tzinfo | None = None

    def layout(self) -> Layout:
        """Return the layout, or raise all its errors at once."""
        sections = [section for section in self.table.values() if isinstance(section, dict)]
        if any("field" in section for section in sections):
            raise LayoutError(
                "a layout of an MCAP file, but the file is a table; `shiplog layout FILE` drafts "
                f"one for it: {self.where}"
            )
        self.parse_file()
        self._find_contradictions()
        if self.errors:
            raise LayoutError(list_errors(self.errors, KIND, self.where))
        return self._made()

    def _made(self) -> Layout:
        """Return the layout of sections without errors."""
        top = {"name": Path(os.fspath(self.where)).stem} | self._top
        start = top.pop("start", None)
        start_ns = None if start is None else (start - EPOCH) // timedelta(microseconds=1) * 1000
        section = self.table["time"]
        return Layout(
            where=self.where,
            columns=self.found,
            time=TimeForm(
                start_ns,
                self._zone,
                section.get("date_order"),
                uniform="rebuild" in section,
                assumed="assumed" in section,
            ),
            rebuild_heading="rebuild" in self.table.get("heading", {}),
            **top,
        )  # fmt: skip

    # ---- the top level

    def parse_top(self, key: str, value: object) -> None:
        """Parse a value of the top level."""
        kind, words = _KINDS[key]
        good = isinstance(value, kind) and (kind is bool or not isinstance(value, bool))
        if good:
            good = _TOP_CHECKS.get(key, lambda _: True)(value)
        if not good:
            self.errors.append(f"{key} must be {words}, got {value!s:.60}")
        self._top[key] = value

    # ---- the sections

    def parse_time(self, section: Mapping[str, Any]) -> None:
        self.check_keys("time", section, _TIME_KEYS)
        self.require("time", section, ("column",))
        self._check_rebuild("time", section)
        unit = section.get("unit", "")
        if unit and unit not in TIME_TEXT_UNITS:
            self.check_unit("time.unit", unit, "s")
        if (order := section.get("date_order")) is not None and order not in DATE_ORDERS:
            self.errors.append(
                f"time.date_order must be one of {', '.join(map(repr, DATE_ORDERS))}, got {order!r}"
            )
        if section.get("assumed", "date_order") != "date_order":
            self.errors.append(f"time.assumed must be 'date_order', got {section['assumed']!r}")
        if "zone" in section:
            self._zone = self._parse_zone(section["zone"])
        self.add("time", "time.column", section.get("column"), Column(0, str(unit)))
        self.add("date", "time.date", section.get("date"), Column(0, ""))

    def _parse_zone(self, text: object) -> tzinfo | None:
        """Return a zone given by its name or as an offset such as +02:00."""
        match = re.fullmatch(r"([+-])(\d\d):?(\d\d)", str(text))
        if match and int(match[2]) < 24 and int(match[3]) < 60:
            minutes = int(match[2]) * 60 + int(match[3])
            return timezone(timedelta(minutes=-minutes if match[1] == "-" else minutes))
        if text in ("Z", "UTC", "GMT"):
            return UTC
        try:
            return ZoneInfo(str(text))
        except (OSError, ValueError, LookupError):  # also ZoneInfoNotFoundError
            self.errors.append(
                f"time.zone must be a name such as 'Europe/Berlin', 'UTC' or an offset such as "
                f"'+02:00', got {text!r}"
            )
            return None

    def further_keys(self, role: str) -> tuple[str, ...]:
        """Return `rebuild` for the quantities that can be rebuilt."""
        return ("rebuild",) if role in _REBUILDS else ()

    def parse_further(self, role: str, section: Mapping[str, Any]) -> None:
        """Check `rebuild`."""
        self._check_rebuild(role, section)

    # ---- checks

    def _check_rebuild(self, role: str, section: Mapping[str, Any]) -> None:
        if "rebuild" in section and section["rebuild"] != (only := _REBUILDS.get(role)):
            self.errors.append(f"{role}.rebuild must be {only!r}, got {section['rebuild']!r}")

    def _find_contradictions(self) -> None:
        """Check values that are right by themselves but contradict each other."""
        table, errors = self.table, self.errors
        if "time" not in table:
            errors.append("[time] is missing")
        if not any(isinstance(v, dict) for k, v in table.items() if k != "time"):
            errors.append(f"no channel is given, possible are {', '.join(CATALOGUE)}")
        velocities = [name for name in VELOCITIES if name in table]
        if len(velocities) == 1:
            errors.append(f"[{velocities[0]}] needs the other component, too")
        if velocities and "heading" not in table:
            errors.append("earth-fixed velocities need a [heading], by which they are rotated")
        errors += [f"[{n}] follows from the earth-fixed velocities, remove one of them"
                   for n in ("speed", "sway") if velocities and n in self.found]  # fmt: skip
        heading = table.get("heading")
        if isinstance(heading, dict) and "rebuild" in heading and "yaw_rate" not in table:
            errors.append("heading.rebuild needs a [yaw_rate]")
        if self._top.get("decimal_comma") is True and self._top.get("delimiter", ",") == ",":
            errors.append("decimal_comma cannot be combined with the delimiter ','")
        geographic = any(role.partition(".")[0] == "latitude" for role in self.found)
        if geographic and "froude_scale" in self._top:
            errors.append("froude_scale cannot be applied to latitude and longitude")
        errors += [
            f"{role} names the column {column.place!r}, which needs header = true"
            for role, column in self.found.items()
            if isinstance(column.place, str) and not self._top.get("header")
        ]
        self.find_shared_columns()


def _is_text_encoding(name: str) -> bool:
    """Whether bytes are decoded to text by this name; `hex` and `rot13` are codecs, too."""
    try:
        return codecs.lookup(name)._is_text_encoding and isinstance(b"0".decode(name), str)  # noqa: SLF001 - as bytes.decode does
    except (LookupError, ValueError):
        return name.lower().replace("_", "-") in ("utf-16", "utf-32")


_TOP_CHECKS: dict[str, Any] = {
    # key of the top level: whether a value of the right type is possible
    "skip_rows": lambda value: value >= 0,
    "froude_scale": lambda value: isfinite(value) and value > 0,
    "delimiter": lambda value: value in DELIMITERS,
    "start": lambda value: value.tzinfo is not None,
    "source": lambda value: bool(value) and "/" not in value and value.isprintable(),
    "encoding": _is_text_encoding,
}
