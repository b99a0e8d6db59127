"""Parser of layout files: all errors of a file at once, with the nearest known name."""

import codecs
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from math import isfinite
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from shiplog.errors import LayoutError, UsageError
from shiplog.toml_text import list_errors, parse_toml, unknown_key
from shiplog.units import CATALOGUE, GEOGRAPHIC, UNITS, conversion_factor, did_you_mean

from .layout import (
    DATE_ORDERS,
    DEGREES_MINUTES,
    DELIMITERS,
    HEMISPHERES,
    ROLES,
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
_COLUMN_KEYS = ("column", "unit", "sign", "positive", "interpolation")
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


def parse_columns(
    sections: Mapping[str, Any], where: str
) -> tuple[Mapping[str, Column], list[str]]:
    """Parse the sections of channels and of a position, without those of a table as a whole.

    Parameters
    ----------
    sections
        The sections by the name of the channel, as in a layout file.
    where
        Name of the file, for messages.

    Returns
    -------
    columns
        Columns by role, as in `Layout.columns`; they are numbered, as there is no header.
    errors
        The errors of all sections.
    """
    parser = _LayoutParser(sections, where)
    return parser.columns()


class _LayoutParser:
    """The sections of one layout file, parsed one after the other, and their errors."""

    def __init__(self, table: Mapping[str, Any], where: str) -> None:
        self._table, self._where = table, where
        self._errors: list[str] = []
        self._top: dict[str, Any] = {}
        self._columns: dict[str, Column] = {}
        self._zone: tzinfo | None = None

    def layout(self) -> Layout:
        """Return the layout, or raise all its errors at once."""
        for key, value in self._table.items():
            if key in _KINDS:
                self._top[key] = self._top_value(key, value)
            elif not isinstance(value, dict):
                known = key in ROLES
                self._errors.append(
                    f"[{key}] must be a section" if known
                    else unknown_key(key, (*_KINDS, *ROLES))
                )  # fmt: skip
            elif key == "time":
                self._parse_time(value)
            elif key.partition(".")[0] == "position":
                self._parse_position(key, value)
            else:
                self._parse_channel(key, value)
        self._find_contradictions()
        if self._errors:
            raise LayoutError(list_errors(self._errors, KIND, self._where))
        return self._made()

    def columns(self) -> tuple[Mapping[str, Column], list[str]]:
        """Return the columns of a file without a section of time, and all errors."""
        for key, value in self._table.items():
            if not isinstance(value, dict):
                self._errors.append(unknown_key(key, CATALOGUE))
            elif key.partition(".")[0] == "position":
                self._parse_position(key, value)
            else:
                self._parse_channel(key, value)
        self._find_shared_columns()
        return self._columns, self._errors

    def _made(self) -> Layout:
        """Return the layout of sections without errors."""
        top = {"name": Path(os.fspath(self._where)).stem} | self._top
        start = top.pop("start", None)
        start_ns = None if start is None else (start - EPOCH) // timedelta(microseconds=1) * 1000
        section = self._table["time"]
        return Layout(
            where=self._where,
            columns=self._columns,
            time=TimeForm(
                start_ns,
                self._zone,
                section.get("date_order"),
                uniform="rebuild" in section,
                assumed="assumed" in section,
            ),
            rebuild_heading="rebuild" in self._table.get("heading", {}),
            **top,
        )  # fmt: skip

    # ---- the top level

    def _top_value(self, key: str, value: object) -> object:
        """Check a value of the top level."""
        kind, words = _KINDS[key]
        good = isinstance(value, kind) and (kind is bool or not isinstance(value, bool))
        if good:
            good = _TOP_CHECKS.get(key, lambda _: True)(value)
        if not good:
            self._errors.append(f"{key} must be {words}, got {value!s:.60}")
        return value

    # ---- the sections

    def _parse_time(self, section: Mapping[str, Any]) -> None:
        self._check_keys("time", section, _TIME_KEYS)
        self._require("time", section, ("column",))
        self._check_rebuild("time", section)
        unit = section.get("unit", "")
        if unit and unit not in TIME_TEXT_UNITS:
            self._check_unit("time.unit", unit, "s")
        if (order := section.get("date_order")) is not None and order not in DATE_ORDERS:
            self._errors.append(
                f"time.date_order must be one of {', '.join(map(repr, DATE_ORDERS))}, got {order!r}"
            )
        if section.get("assumed", "date_order") != "date_order":
            self._errors.append(f"time.assumed must be 'date_order', got {section['assumed']!r}")
        if "zone" in section:
            self._zone = self._parse_zone(section["zone"])
        self._add("time", "time.column", section.get("column"), Column(0, str(unit)))
        self._add("date", "time.date", section.get("date"), Column(0, ""))

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
            self._errors.append(
                f"time.zone must be a name such as 'Europe/Berlin', 'UTC' or an offset such as "
                f"'+02:00', got {text!r}"
            )
            return None

    def _parse_channel(self, key: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of a quantity: its own, and one for each source that is named."""
        for name, source, columns in _sources(key, section):
            self._parse_column(name, source, columns)

    def _parse_column(self, name: str, source: str, section: Mapping[str, Any]) -> None:
        """Parse the column of one quantity from one source."""
        role = f"{name}.{source}" if source else name
        if name not in ROLES and not isinstance(section.get("positive"), str):
            self._errors.append(
                f"{unknown_key(name, (*_KINDS, *ROLES))}; a quantity that shiplog does not know "
                "needs `positive`, its sense in words"
            )
            return
        if "/" in role or not name or not role.isprintable():
            self._errors.append(f"[{role}] must have a name without '/'")
        if source and name in VELOCITIES:
            self._errors.append(f"[{role}] cannot have a source")
        extra = ("rebuild",) if name in _REBUILDS and not source else ()
        self._check_keys(role, section, (*_COLUMN_KEYS, *extra))
        self._require(role, section, ("column", "unit"))
        self._check_rebuild(name, section)
        if isinstance(section.get("sign", 1), bool) or section.get("sign", 1) not in (1, -1):
            self._errors.append(f"{role}.sign must be 1 or -1, got {section['sign']!r}")
        if section.get("interpolation", "hold") not in ("hold", "linear"):
            self._errors.append(
                f"{role}.interpolation must be 'hold' or 'linear', got {section['interpolation']!r}"
            )
        unit = section.get("unit")
        if unit is not None and (name in ROLES or not isinstance(unit, str) or not unit):
            self._check_unit(f"{role}.unit", unit, ROLES.get(name))
        kept = ("interpolation",) if name in ROLES else ("interpolation", "positive")
        metadata = {key: str(section[key]) for key in kept if key in section}
        column = Column(0, str(unit), section.get("sign", 1), metadata)
        self._add(role, f"{role}.column", section.get("column"), column)

    def _parse_position(self, key: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of the positions: of one receiver, or of each that is named."""
        for _, source, columns in _sources(key, section):
            self._parse_receiver(source, columns)

    def _parse_receiver(self, source: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of a position: in metres, or geographic."""
        plane, globe = ("north", "east"), GEOGRAPHIC[:2]
        suffix = f".{source}" if source else ""
        label = f"position{suffix}"
        if "/" in source or not label.isprintable():
            self._errors.append(f"[{label}] must have a name without '/'")
        self._check_keys(label, section, (*plane, "unit", *GEOGRAPHIC, *HEMISPHERES))
        geographic = any(name in section for name in (*GEOGRAPHIC, *HEMISPHERES))
        if geographic and any(name in section for name in plane):
            self._errors.append(f"[{label}] mixes north and east with latitude and longitude")
        self._require(label, section, (*(globe if geographic else plane), "unit"))
        unit = section.get("unit")
        if unit is not None and not (geographic and unit == DEGREES_MINUTES):
            self._check_unit(f"{label}.unit", unit, "rad" if geographic else "m")
        if len([name for name in HEMISPHERES if name in section]) == 1:
            self._errors.append(f"[{label}] needs both {' and '.join(HEMISPHERES)}")
        for name in (*GEOGRAPHIC, *HEMISPHERES) if geographic else plane:
            of_column = "m" if name == "altitude" else str(unit)
            place = section.get(name)
            self._add(f"{name}{suffix}", f"{label}.{name}", place, Column(0, of_column))

    # ---- checks

    def _add(self, role: str, label: str, place: object, column: Column) -> None:
        """Add a column at its place, which is checked."""
        if place is None:
            return
        number = isinstance(place, int) and not isinstance(place, bool) and place >= 1
        if not number and not (isinstance(place, str) and place):
            self._errors.append(
                f"{label} must be a number from 1 or the name of a header, got {place!r:.60}"
            )
            return
        metadata = column.metadata
        self._columns[role] = Column(place, column.unit, column.sign, metadata)  # type: ignore[arg-type]

    def _require(self, role: str, section: Mapping[str, Any], keys: Iterable[str]) -> None:
        self._errors += [f"[{role}] lacks {key}" for key in keys if key not in section]

    def _check_keys(self, role: str, section: Iterable[str], allowed: Iterable[str]) -> None:
        allowed = tuple(allowed)
        self._errors += [
            unknown_key(key, allowed, section=role) for key in section if key not in allowed
        ]

    def _check_rebuild(self, role: str, section: Mapping[str, Any]) -> None:
        if "rebuild" in section and section["rebuild"] != (only := _REBUILDS.get(role)):
            self._errors.append(f"{role}.rebuild must be {only!r}, got {section['rebuild']!r}")

    def _check_unit(self, label: str, unit: object, si: str | None) -> None:
        if not isinstance(unit, str) or si is None:
            self._errors.append(f"{label} must be a unit such as 'm/s', got {unit!r:.60}")
            return
        try:
            conversion_factor(unit, si)
        except UsageError as error:
            if unit not in UNITS:  # of all units, only those of the quantity help
                fitting = [name for name, (base, _) in UNITS.items() if base == si]
                hint = did_you_mean(unit, fitting) or did_you_mean(unit.lower(), fitting)
                text = f"unknown unit {unit!r}{hint}, possible are {', '.join(fitting)}"
            else:
                text = str(error)
            self._errors.append(f"{label}: {text.replace(';', ',')}")

    def _find_contradictions(self) -> None:
        """Check values that are right by themselves but contradict each other."""
        table, errors = self._table, self._errors
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
                   for n in ("speed", "sway") if velocities and n in self._columns]  # fmt: skip
        heading = table.get("heading")
        if isinstance(heading, dict) and "rebuild" in heading and "yaw_rate" not in table:
            errors.append("heading.rebuild needs a [yaw_rate]")
        if self._top.get("decimal_comma") is True and self._top.get("delimiter", ",") == ",":
            errors.append("decimal_comma cannot be combined with the delimiter ','")
        geographic = any(role.partition(".")[0] == "latitude" for role in self._columns)
        if geographic and "froude_scale" in self._top:
            errors.append("froude_scale cannot be applied to latitude and longitude")
        errors += [
            f"{role} names the column {column.place!r}, which needs header = true"
            for role, column in self._columns.items()
            if isinstance(column.place, str) and not self._top.get("header")
        ]
        self._find_shared_columns()

    def _find_shared_columns(self) -> None:
        """Check that no column has two roles."""
        taken: dict[int | str, str] = {}
        for role, column in self._columns.items():
            if column.place in taken:
                self._errors.append(
                    f"{role} and {taken[column.place]} name the same column {column.place}"
                )
            taken[column.place] = role


def _sources(key: str, section: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield the name, the source and the keys of a section, and of each source within it."""
    sources = {name: value for name, value in section.items() if isinstance(value, dict)}
    own = {name: value for name, value in section.items() if name not in sources}
    name, _, source = key.partition(".")  # of a quoted key such as ["rpm.port"]
    if own or not sources:
        yield name, source, own
    for part, value in sources.items():
        yield name, f"{source}.{part}" if source else part, value


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
