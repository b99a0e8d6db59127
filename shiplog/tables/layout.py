"""Layout files, which describe the columns of a foreign table."""

import codecs
import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import isfinite
from pathlib import Path
from typing import Any

from shiplog.errors import LayoutError, UsageError
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor, did_you_mean

DELIMITERS = {"whitespace": None, ",": ",", ";": ";", "tab": "\t"}
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)

VELOCITIES = ("velocity_north", "velocity_east")
# what a column can hold, with its SI unit: the time, a channel, or an earth-fixed velocity
ROLES = {"time": "s"} | {name: kind.unit for name, kind in CATALOGUE.items()}
ROLES |= dict.fromkeys(VELOCITIES, "m/s")
_KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    # key of the top level: its type, and that type in words
    "name": (str, "a string"),
    "source": (str, "a string"),
    "encoding": (str, "a string"),
    "skip_rows": (int, "a whole number, 0 or more"),
    "delimiter": (str, "one of " + ", ".join(map(repr, DELIMITERS))),
    "decimal_comma": (bool, "true or false"),
    "header": (bool, "true or false"),
    "start": (datetime, "a time with its zone, such as 2008-04-14T00:00:00Z"),
    "froude_scale": ((int, float), "a positive number"),
}
_REBUILDS = {"time": "uniform", "heading": "from yaw_rate"}  # role: the only value of `rebuild`


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    place
        Number of the column, from 1, or its name in the header.
    unit
        Unit of its numbers.
    sign
        1, or -1 where the sign is opposite to the convention of the channel.
    """

    place: int | str
    unit: str
    sign: int = 1


@dataclass(frozen=True)
class Layout:
    """The description of a foreign table.

    Attributes
    ----------
    name
        Name of the layout; by default that of its file.
    where
        File of the layout, for error messages.
    columns
        Columns by role: the name of a channel, "time", "velocity_north", "velocity_east", or a
        component of the position: "north" and "east", or "latitude", "longitude" and "altitude".
    source
        Source of the channels.
    encoding
        Encoding of the text.
    skip_rows
        Number of lines before the header or the first row.
    delimiter
        Key of `DELIMITERS`.
    decimal_comma
        Whether numbers have a decimal comma.
    header
        Whether the first row has the names of the columns.
    start_ns
        Instant of the printed time zero, ns since 1970-01-01 UTC.
    froude_scale
        Length of the ship over that of the model.
    rebuild
        Roles to be rebuilt from a coarse print: some of "time" and "heading".
    """

    name: str
    where: str
    columns: Mapping[str, Column]
    source: str = "table"
    encoding: str = "utf-8"
    skip_rows: int = 0
    delimiter: str = ","
    decimal_comma: bool = False
    header: bool = False
    start_ns: int = 0
    froude_scale: float = 1.0
    rebuild: frozenset[str] = frozenset()


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Load a layout from its TOML file.

    Raises
    ------
    LayoutError
        The file cannot be read or has errors; the message lists all of them.

    Examples
    --------
    >>> layout = load_layout("sample_data/layouts/simman_marin.toml")
    >>> layout.columns["rudder"]
    Column(place=10, unit='deg', sign=-1)
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise LayoutError(f"no such layout file: {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise LayoutError(f"cannot read the layout file ({error}); name another: {path}") from error
    return parse_layout(text, os.fspath(path))


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
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise LayoutError(f"not a TOML file ({error}); correct that line: {where}") from error
    errors: list[str] = []
    top: dict[str, Any] = {}
    columns: dict[str, Column] = {}
    rebuild: set[str] = set()
    for key, value in table.items():
        if key in _KINDS:
            top[key] = _top_value(key, value, errors)
        elif key not in ROLES:
            errors.append(f"unknown key {key!r}{_hint(key, (*_KINDS, *ROLES))}")
        elif not isinstance(value, dict):
            errors.append(f"[{key}] must be a section")
        elif key == "position":
            columns |= _parse_position(value, errors)
        else:
            columns |= _parse_column(key, value, errors)
            rebuild |= {key} & {role for role in _REBUILDS if "rebuild" in value}
    errors += _contradictions(table, top, columns)
    if errors:
        count = "one error" if len(errors) == 1 else f"{len(errors)} errors"
        raise LayoutError(f"{count} in the layout file: {'; '.join(errors)}: {where}")
    start = top.pop("start", EPOCH)
    start_ns = (start - EPOCH) // timedelta(microseconds=1) * 1000
    top = {"name": Path(where).stem} | top
    return Layout(
        where=where, columns=columns, start_ns=start_ns, rebuild=frozenset(rebuild), **top
    )


def _top_value(key: str, value: object, errors: list[str]) -> object:
    """Check a value of the top level."""
    kind, words = _KINDS[key]
    good = isinstance(value, kind) and (kind is bool or not isinstance(value, bool))
    if key == "skip_rows" and good:
        good = value >= 0  # type: ignore[operator]
    elif key == "froude_scale" and good:
        good = isfinite(value) and value > 0  # type: ignore[operator, arg-type]
    elif key == "delimiter":
        good = value in DELIMITERS
    elif key == "start" and isinstance(value, datetime):
        good = value.tzinfo is not None
    elif key == "source" and good:
        good, words = bool(value) and "/" not in str(value), "a string without '/'"
    elif key == "encoding" and good:
        try:
            codecs.lookup(str(value))
        except LookupError:
            good, words = False, "an encoding such as 'utf-8' or 'cp1252'"
    if not good:
        errors.append(f"{key} must be {words}, got {value!s}")
    return value


def _parse_column(role: str, section: Mapping[str, Any], errors: list[str]) -> dict[str, Column]:
    """Parse the column of one role."""
    allowed = ["column", "unit", *(["sign"] if role != "time" else [])]
    allowed += ["rebuild"] if role in _REBUILDS else []
    _check_keys(role, section, allowed, errors)
    errors += [f"[{role}] lacks {key}" for key in ("column", "unit") if key not in section]
    if section.get("sign", 1) not in (1, -1):
        errors.append(f"{role}.sign must be 1 or -1, got {section['sign']!r}")
    if section.get("rebuild", allowed_value := _REBUILDS.get(role)) != allowed_value:
        errors.append(f"{role}.rebuild must be {allowed_value!r}, got {section['rebuild']!r}")
    if "unit" in section:
        _check_unit(f"{role}.unit", section["unit"], ROLES[role], errors)
    return _column_at(role, "column", section, errors)


def _parse_position(section: Mapping[str, Any], errors: list[str]) -> dict[str, Column]:
    """Parse the two or three columns of a position: in metres, or geographic."""
    plane, globe = ("north", "east"), GEOGRAPHIC[:2]
    _check_keys("position", section, [*plane, "unit", *GEOGRAPHIC], errors)
    geographic = any(name in section for name in GEOGRAPHIC)
    if geographic and any(name in section for name in plane):
        errors.append("[position] mixes north and east with latitude and longitude")
    needed = (*globe, "unit") if geographic else (*plane, "unit")
    errors += [f"[position] lacks {key}" for key in needed if key not in section]
    if "unit" in section:
        _check_unit("position.unit", section["unit"], "rad" if geographic else "m", errors)
    columns: dict[str, Column] = {}
    for name in GEOGRAPHIC if geographic else plane:
        unit = "m" if name == "altitude" else section.get("unit")
        columns |= _column_at("position", name, {**section, "unit": unit, "sign": 1}, errors)
    return {place.partition(".")[2]: column for place, column in columns.items()}


def _column_at(
    role: str, key: str, section: Mapping[str, Any], errors: list[str]
) -> dict[str, Column]:
    if key not in section:
        return {}
    label, place = f"{role}.{key}", section[key]
    number = isinstance(place, int) and not isinstance(place, bool) and place >= 1
    if not number and not (isinstance(place, str) and place):
        errors.append(f"{label} must be a number from 1 or the name of a header, got {place!r}")
    name = label if role == "position" else role
    return {name: Column(place, str(section.get("unit")), section.get("sign", 1))}


def _check_keys(role: str, section: Iterable[str], allowed: list[str], errors: list[str]) -> None:
    errors += [f"unknown key '{role}.{k}'{_hint(k, allowed)}" for k in section if k not in allowed]


def _check_unit(label: str, unit: object, si: str, errors: list[str]) -> None:
    try:
        conversion_factor(str(unit), si)
    except UsageError as error:
        errors.append(f"{label}: {str(error).replace(';', ',')}")


def _hint(name: str, allowed: Iterable[str]) -> str:
    return did_you_mean(name, allowed).replace(";", ",")


def _contradictions(
    table: Mapping[str, Any], top: Mapping[str, Any], columns: Mapping[str, Column]
) -> list[str]:
    """Check values that are right by themselves but contradict each other."""
    errors = [] if "time" in table else ["[time] is missing"]
    if not set(table) & (set(ROLES) - {"time"}):
        errors.append(f"no channel is given; possible are {', '.join(CATALOGUE)}".replace(";", ","))
    velocities = [name for name in VELOCITIES if name in table]
    if len(velocities) == 1:
        errors.append(f"[{velocities[0]}] needs the other component, too")
    if velocities and "heading" not in table:
        errors.append("earth-fixed velocities need a [heading], by which they are rotated")
    errors += [f"[{n}] follows from the earth-fixed velocities; remove one of them"
               for n in ("speed", "sway") if velocities and n in table]  # fmt: skip
    heading = table.get("heading")
    if isinstance(heading, dict) and "rebuild" in heading and "yaw_rate" not in table:
        errors.append("heading.rebuild needs a [yaw_rate]")
    if top.get("decimal_comma") and top.get("delimiter", ",") == ",":
        errors.append("decimal_comma cannot be combined with the delimiter ','")
    if "latitude" in columns and "froude_scale" in top:
        errors.append("froude_scale cannot be applied to latitude and longitude")
    taken: dict[int | str, str] = {}
    for role, column in columns.items():
        if isinstance(column.place, str) and not top.get("header"):
            errors.append(f"{role} names the column {column.place!r}, which needs header = true")
        if column.place in taken:
            errors.append(f"{role} and {taken[column.place]} name the same column {column.place}")
        taken[column.place] = role
    return errors
