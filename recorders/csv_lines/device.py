"""Descriptions of devices that send lines of separated values: which field is which channel."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from shiplog.errors import LayoutError
from shiplog.layouts.channel_sections import parse_columns
from shiplog.layouts.layout import DELIMITERS, HEMISPHERES, VELOCITIES, Column
from shiplog.layouts.layout_parser import KIND
from shiplog.toml_text import list_errors, parse_toml, read_toml_text, unknown_key
from shiplog.units import CATALOGUE, GEOGRAPHIC

_TOP_KEYS = ("delimiter", "line")
PARTS_OF_FIX = (*GEOGRAPHIC, *HEMISPHERES)
_LINE_KEYS = ("begins", "source", "fields", "where", "checksum")


@dataclass(frozen=True)
class LineKind:
    """One kind of lines.

    Attributes
    ----------
    begins
        The first field; empty where the lines have no such name and all are of this kind.
    source
        The source of its channels.
    columns
        Columns by role, as in a layout; their places are numbers, from 1.
    fields
        The number of fields; None where it may vary.
    where
        What fields must hold, by number: a unit, a status. Lines with something else are invalid.
    checksum
        Whether the last field is a checksum: the XOR of the characters between the first delimiter
        and this field, in hexadecimal digits, as wind sensors send it.
    """

    begins: str
    source: str
    columns: Mapping[str, Column]
    fields: int | None = None
    where: Mapping[int, str] = field(default_factory=dict)
    checksum: bool = False

    @property
    def receivers(self) -> tuple[str, ...]:
        """The sources of positions; an empty name for the one that states none."""
        roles = [role.partition(".") for role in self.columns]
        return tuple(source for name, _, source in roles if name == "latitude")


@dataclass(frozen=True)
class Device:
    """A device: the kinds of its lines.

    Attributes
    ----------
    kinds
        The kinds by their first field; a single one with an empty name takes all lines.
    delimiter
        What separates fields; None for white space.
    """

    kinds: Mapping[str, LineKind]
    delimiter: str | None = ","


def load_device(path: str | os.PathLike[str]) -> Device:
    """Load the description of a device from its TOML file.

    Raises
    ------
    LayoutError
        The file cannot be read or has errors; the message lists all of them.

    Examples
    --------
    >>> load_device("sample_data/layouts/weather_lines.toml").kinds["WIND"].source
    'anemometer'
    """
    text = read_toml_text(path, KIND, LayoutError, f"no such {KIND}")
    return parse_device(text, os.fspath(path))


def parse_device(text: str, where: str) -> Device:
    """Parse the description of a device.

    Parameters
    ----------
    text
        TOML; docs/stream_formats.md describes the keys.
    where
        Name of the file, for messages.

    Raises
    ------
    LayoutError
        The text has errors; the message lists all of them.
    """
    table = parse_toml(text, where, KIND, LayoutError)
    errors = [unknown_key(key, _TOP_KEYS) for key in table if key not in _TOP_KEYS]
    delimiter = table.get("delimiter", ",")
    if not isinstance(delimiter, str) or delimiter not in DELIMITERS:
        errors.append(f"delimiter must be one of {', '.join(map(repr, DELIMITERS))}")
        delimiter = ","
    lines = table.get("line", [])
    if not isinstance(lines, list) or not lines or not all(isinstance(e, dict) for e in lines):
        errors.append("the kinds of lines are sections [[line]], at least one")
        lines = []
    kinds = [_kind(section, where, errors) for section in lines]
    _find_contradictions(kinds, errors)
    if errors:
        raise LayoutError(list_errors(errors, KIND, where))
    return Device({kind.begins: kind for kind in kinds}, DELIMITERS[delimiter])


def _kind(section: Mapping[str, Any], where: str, errors: list[str]) -> LineKind:
    """Parse one kind of lines; its errors are added."""
    own = {key: value for key, value in section.items() if key in _LINE_KEYS}
    begins = own.get("begins", "")
    label = f"line {begins!r}: " if isinstance(begins, str) and begins else "line: "
    columns, found = parse_columns(
        {key: value for key, value in section.items() if key not in own}, where
    )
    found += [
        f"{role} is no channel of the catalogue"
        for role in columns
        if _quantity(role) in VELOCITIES or _quantity(role) not in (*CATALOGUE, *PARTS_OF_FIX)
    ]
    found += [
        f"{role} names the column {column.place!r}, and lines have no header: state its number"
        for role, column in columns.items()
        if isinstance(column.place, str)
    ]
    if {"north", "east"} & {_quantity(role) for role in columns}:
        found.append("a position is in latitude and longitude")
    if not columns and not found:
        found.append("no channel is given")
    checks: Sequence[tuple[str, bool, str]] = (
        ("begins", isinstance(begins, str) and begins.isprintable(), "a text"),
        ("source", _is_name(own.get("source", "device")), "a text without '/'"),
        ("fields", _is_count(own.get("fields", 1)), "a whole number from 1"),
        ("checksum", isinstance(own.get("checksum", False), bool), "true or false"),
        ("where", _is_where(own.get("where", {})), "texts by number of field, such as {4 = 'M'}"),
    )
    wrong = {key for key, good, _ in checks if not good}
    found += [f"{key} must be {words}" for key, good, words in checks if not good]
    errors += [label + text for text in found]
    good = {key: value for key, value in own.items() if key not in wrong}
    return LineKind(
        good.get("begins", ""),
        good.get("source", good.get("begins") or "device"),
        columns,
        good.get("fields"),
        {int(key): text for key, text in good.get("where", {}).items()},
        good.get("checksum", False),
    )


def _find_contradictions(kinds: Sequence[LineKind], errors: list[str]) -> None:
    """Check that the first field of a line determines its kind, and topics are of one kind."""
    names = [kind.begins for kind in kinds]
    errors += [f"line {name!r} is described twice" for name in {*names} if names.count(name) > 1]
    if "" in names and len(names) > 1:
        errors.append("a line without `begins` takes all lines: no other kind is possible")
    topics = [(kind.source, role) for kind in kinds for role in kind.columns]
    errors += [
        f"two kinds of lines have {role} of {source}: give one another source"
        for source, role in dict.fromkeys(topics)
        if topics.count((source, role)) > 1
    ]
    for kind in kinds:
        places = [c.place for c in kind.columns.values() if isinstance(c.place, int)]
        last = max(places, default=0)
        if kind.fields is not None and last > kind.fields:
            errors.append(f"line {kind.begins!r}: column {last} of {kind.fields} fields")


def _quantity(role: str) -> str:
    return role.partition(".")[0]


def _is_name(value: object) -> bool:
    return isinstance(value, str) and value.isprintable() and bool(value) and "/" not in value


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def _is_where(value: object) -> bool:
    return isinstance(value, dict) and all(
        key.isdecimal() and int(key) >= 1 and isinstance(text, str) for key, text in value.items()
    )
