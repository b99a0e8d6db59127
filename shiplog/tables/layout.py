"""The layout file: what the columns of a foreign table are."""

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
ROLES = {"time": "s"} | {name: kind.unit for name, kind in CATALOGUE.items()}
ROLES |= dict.fromkeys(VELOCITIES, "m/s")
_KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    # key of the top level: its type, and that type in words
    "name": (str, "a text"),
    "source": (str, "a text"),
    "encoding": (str, "a text"),
    "skip_rows": (int, "a whole number, 0 or more"),
    "delimiter": (str, "one of " + ", ".join(map(repr, DELIMITERS))),
    "decimal_comma": (bool, "true or false"),
    "header": (bool, "true or false"),
    "start": (datetime, "a time with its zone, as 2008-04-14T00:00:00Z"),
    "froude_scale": ((int, float), "a positive number"),
}
_REBUILDS = {"time": "uniform", "heading": "from yaw_rate"}


@dataclass(frozen=True)
class Column:
    """One column of a table: where it stands (from 1, or its header), its unit and its sign."""

    place: int | str
    unit: str
    sign: int = 1


@dataclass(frozen=True)
class Layout:
    """What a layout file says of a table.

    `columns` has the channels' names as keys, besides "time", "velocity_north", "velocity_east"
    and the components of the position: "north" and "east", or "latitude" and "longitude".
    """

    name: str
    where: str  # the layout's file, for errors
    columns: Mapping[str, Column]
    source: str = "table"
    encoding: str = "utf-8"
    skip_rows: int = 0
    delimiter: str = ","
    decimal_comma: bool = False
    header: bool = False
    start_ns: int = 0  # of the printed time's zero, since 1970-01-01 UTC
    froude_scale: float = 1.0  # ship's length over model's
    rebuild: frozenset[str] = frozenset()  # of "time" and "heading"


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """A layout from its TOML file.

    Raises `LayoutError` with all the faults of the file at once.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise LayoutError(f"no layout file: {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise LayoutError(f"cannot read the layout file ({error}): {path}") from error
    return parse_layout(text, os.fspath(path))


def parse_layout(text: str, where: str) -> Layout:
    """A layout from the text of its file; `where` names it in errors.

    Raises `LayoutError` with all the faults at once.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise LayoutError(f"not a TOML file ({error}); mend that line: {where}") from error
    faults: list[str] = []
    top: dict[str, Any] = {}
    columns: dict[str, Column] = {}
    rebuild = set()
    for key, value in table.items():
        if key in _KINDS:
            top[key] = _top_value(key, value, faults)
        elif key not in ROLES:
            faults.append(f"unknown key {key!r}{_hint(key, (*_KINDS, *ROLES))}")
        elif not isinstance(value, dict):
            faults.append(f"[{key}] must be a section")
        elif key == "position":
            columns |= _position(value, faults)
        else:
            columns |= _section(key, value, faults)
            rebuild |= {key} & {role for role in _REBUILDS if "rebuild" in value}
    faults += _contradictions(table, top, columns)
    if faults:
        count = f"{len(faults)} faults" if len(faults) > 1 else "one fault"
        raise LayoutError(f"{count} in the layout file: {'; '.join(faults)}: {where}")
    start = top.pop("start", EPOCH)
    start_ns = (start - EPOCH) // timedelta(microseconds=1) * 1000
    top = {"name": Path(where).stem} | top
    return Layout(
        where=where, columns=columns, start_ns=start_ns, rebuild=frozenset(rebuild), **top
    )


def _top_value(key: str, value: object, faults: list[str]) -> object:
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
        good, words = bool(value) and "/" not in str(value), "a text without '/'"
    elif key == "encoding" and good:
        try:
            codecs.lookup(str(value))
        except LookupError:
            good, words = False, "an encoding such as 'utf-8' or 'cp1252'"
    if not good:
        faults.append(f"{key} must be {words}, got {value!s}")
    return value


def _section(role: str, said: Mapping[str, Any], faults: list[str]) -> dict[str, Column]:
    """The column of one role; what is wrong with it goes to `faults`."""
    known = ["column", "unit", *(["sign"] if role != "time" else [])]
    known += ["rebuild"] if role in _REBUILDS else []
    _unknown(role, said, known, faults)
    faults += [f"[{role}] lacks {key}" for key in ("column", "unit") if key not in said]
    if said.get("sign", 1) not in (1, -1):
        faults.append(f"{role}.sign must be 1 or -1, got {said['sign']!r}")
    if said.get("rebuild", wanted := _REBUILDS.get(role)) != wanted:
        faults.append(f"{role}.rebuild must be {wanted!r}, got {said['rebuild']!r}")
    if "unit" in said:
        _check_unit(f"{role}.unit", said["unit"], ROLES[role], faults)
    return _column(role, "column", said, faults)


def _position(said: Mapping[str, Any], faults: list[str]) -> dict[str, Column]:
    """The two or three columns of a position: on a plane, or on the globe."""
    plane, globe = ("north", "east"), GEOGRAPHIC[:2]
    _unknown("position", said, [*plane, "unit", *GEOGRAPHIC], faults)
    geographic = any(name in said for name in GEOGRAPHIC)
    if geographic and any(name in said for name in plane):
        faults.append("[position] mixes north and east with latitude and longitude")
    needed = (*globe, "unit") if geographic else (*plane, "unit")
    faults += [f"[position] lacks {key}" for key in needed if key not in said]
    if "unit" in said:
        _check_unit("position.unit", said["unit"], "rad" if geographic else "m", faults)
    columns: dict[str, Column] = {}
    for name in GEOGRAPHIC if geographic else plane:
        unit = "m" if name == "altitude" else said.get("unit")
        columns |= _column("position", name, {**said, "unit": unit, "sign": 1}, faults)
    return {place.partition(".")[2]: column for place, column in columns.items()}


def _column(role: str, key: str, said: Mapping[str, Any], faults: list[str]) -> dict[str, Column]:
    if key not in said:
        return {}
    label, place = f"{role}.{key}", said[key]
    number = isinstance(place, int) and not isinstance(place, bool) and place >= 1
    if not number and not (isinstance(place, str) and place):
        faults.append(f"{label} must be a number from 1 on or a header's name, got {place!r}")
    name = label if role == "position" else role
    return {name: Column(place, str(said.get("unit")), said.get("sign", 1))}


def _unknown(role: str, said: Iterable[str], known: list[str], faults: list[str]) -> None:
    faults += [f"unknown key '{role}.{k}'{_hint(k, known)}" for k in said if k not in known]


def _check_unit(label: str, unit: object, si: str, faults: list[str]) -> None:
    try:
        conversion_factor(str(unit), si)
    except UsageError as error:
        faults.append(f"{label}: {str(error).replace(';', ',')}")


def _hint(name: str, known: Iterable[str]) -> str:
    return did_you_mean(name, known).replace(";", ",")


def _contradictions(
    table: Mapping[str, Any], top: Mapping[str, Any], columns: Mapping[str, Column]
) -> list[str]:
    """What is wrong with a layout as a whole, though each of its values may be right."""
    faults = [] if "time" in table else ["[time] is missing"]
    if not set(table) & (set(ROLES) - {"time"}):
        faults.append(f"no channel is given; known are {', '.join(CATALOGUE)}".replace(";", ","))
    velocities = [name for name in VELOCITIES if name in table]
    if len(velocities) == 1:
        faults.append(f"[{velocities[0]}] is of use only with its other component")
    if velocities and "heading" not in table:
        faults.append("earth-fixed velocities need a [heading] to be turned by")
    faults += [f"[{n}] stands beside earth-fixed velocities, which give it; leave one out"
               for n in ("speed", "sway") if velocities and n in table]  # fmt: skip
    heading = table.get("heading")
    if isinstance(heading, dict) and "rebuild" in heading and "yaw_rate" not in table:
        faults.append("heading.rebuild needs a [yaw_rate]")
    if top.get("decimal_comma") and top.get("delimiter", ",") == ",":
        faults.append("decimal_comma cannot go with the delimiter ','")
    if "latitude" in columns and "froude_scale" in top:
        faults.append("froude_scale cannot be applied to latitude and longitude")
    taken: dict[int | str, str] = {}
    for role, column in columns.items():
        if isinstance(column.place, str) and not top.get("header"):
            faults.append(f"{role} names the column {column.place!r}: that needs header = true")
        if column.place in taken:
            faults.append(f"{role} and {taken[column.place]} name the same column {column.place}")
        taken[column.place] = role
    return faults
