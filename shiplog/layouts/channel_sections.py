"""Parser of the sections of channels and positions, which all layouts have in common."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar

from shiplog.errors import UsageError
from shiplog.toml_text import unknown_key
from shiplog.units import CATALOGUE, GEOGRAPHIC, UNITS, conversion_factor, did_you_mean

from .layout import DEGREES_MINUTES, HEMISPHERES, ROLES, VELOCITIES, Column

_COLUMN_KEYS = ("unit", "sign", "positive", "interpolation")


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
    parser = SectionParser(sections, where)
    return parser.columns()


class SectionParser:
    """The channel sections of one layout file, parsed one after the other, and their errors.

    This is the parser of numbered columns without a header; those of other layouts extend it.

    Parameters
    ----------
    table
        The parsed TOML.
    where
        Name of the file, for messages.

    Attributes
    ----------
    errors
        The errors found so far.
    found
        The columns found so far, by role.
    """

    place_key: ClassVar[str] = "column"
    place_words: ClassVar[str] = "a number from 1 or the name of a header"
    top_keys: ClassVar[tuple[str, ...]] = ()
    position_texts: ClassVar[tuple[str, ...]] = HEMISPHERES

    def __init__(self, table: Mapping[str, Any], where: str) -> None:
        self.table, self.where = table, where
        self.errors: list[str] = []
        self.found: dict[str, Column] = {}

    # ---- what a layout of another kind has instead

    def parse_top(self, key: str, value: object) -> None:
        """Parse the value of one of `top_keys`."""

    def parse_time(self, section: Mapping[str, Any]) -> None:
        """Parse the section of the time."""

    def further_keys(self, role: str) -> tuple[str, ...]:  # noqa: ARG002
        """Return the keys that a section has beside those of its columns."""
        return ()

    def parse_further(self, role: str, section: Mapping[str, Any]) -> None:
        """Parse these keys."""

    def is_special_unit(self, name: str, unit: object) -> bool:  # noqa: ARG002
        """Whether a unit states how a quantity is represented, not its size."""
        return False

    def is_place(self, place: object) -> bool:
        """Whether a value can be the place of a column."""
        number = isinstance(place, int) and not isinstance(place, bool) and place >= 1
        return number or (isinstance(place, str) and bool(place))

    # ---- the sections

    def columns(self) -> tuple[Mapping[str, Column], list[str]]:
        """Return the columns of a file without a section of time, and all errors."""
        for key, value in self.table.items():
            if not isinstance(value, dict):
                self.errors.append(unknown_key(key, CATALOGUE))
            elif key.partition(".")[0] == "position":
                self.parse_position(key, value)
            else:
                self.parse_channel(key, value)
        self.find_shared_columns()
        return self.found, self.errors

    def parse_file(self) -> None:
        """Parse the values of the top level, the time, and the sections of channels."""
        for key, value in self.table.items():
            if key in self.top_keys:
                self.parse_top(key, value)
            elif not isinstance(value, dict):
                known = key in ROLES
                self.errors.append(
                    f"[{key}] must be a section" if known
                    else unknown_key(key, (*self.top_keys, *ROLES))
                )  # fmt: skip
            elif key == "time":
                self.parse_time(value)
            elif key.partition(".")[0] == "position":
                self.parse_position(key, value)
            else:
                self.parse_channel(key, value)

    def parse_channel(self, key: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of a quantity: its own, and one for each source that is named."""
        for name, source, columns in _sources(key, section):
            self._parse_column(name, source, columns)

    def _parse_column(self, name: str, source: str, section: Mapping[str, Any]) -> None:
        """Parse the column of one quantity from one source."""
        role = f"{name}.{source}" if source else name
        if name not in ROLES and not isinstance(section.get("positive"), str):
            cause = unknown_key(name, (*self.top_keys, *ROLES))
            self.errors.append(
                f"{cause}; a quantity that shiplog does not know needs `positive`, its sense in "
                "words"
            )
            return
        if "/" in role or not name or not role.isprintable():
            self.errors.append(f"[{role}] must have a name without '/'")
        if source and name in VELOCITIES:
            self.errors.append(f"[{role}] cannot have a source")
        self.check_keys(role, section, (self.place_key, *_COLUMN_KEYS, *self.further_keys(role)))
        self.require(role, section, (self.place_key, "unit"))
        self.parse_further(role, section)
        if isinstance(section.get("sign", 1), bool) or section.get("sign", 1) not in (1, -1):
            self.errors.append(f"{role}.sign must be 1 or -1, got {section['sign']!r}")
        if section.get("interpolation", "hold") not in ("hold", "linear"):
            self.errors.append(
                f"{role}.interpolation must be 'hold' or 'linear', got {section['interpolation']!r}"
            )
        unit = section.get("unit")
        if (
            unit is not None
            and not self.is_special_unit(name, unit)
            and (name in ROLES or not isinstance(unit, str) or not unit)
        ):
            self.check_unit(f"{role}.unit", unit, ROLES.get(name))
        kept = ("interpolation",) if name in ROLES else ("interpolation", "positive")
        metadata = {key: str(section[key]) for key in kept if key in section}
        column = Column(0, str(unit), section.get("sign", 1), metadata)
        self.add(role, f"{role}.{self.place_key}", section.get(self.place_key), column)

    def parse_position(self, key: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of the positions: of one receiver, or of each that is named."""
        for _, source, columns in _sources(key, section):
            self._parse_receiver(source, columns)

    def _parse_receiver(self, source: str, section: Mapping[str, Any]) -> None:
        """Parse the columns of a position: in metres, or geographic."""
        plane, globe = ("north", "east"), GEOGRAPHIC[:2]
        suffix = f".{source}" if source else ""
        label = f"position{suffix}"
        if "/" in source or not label.isprintable():
            self.errors.append(f"[{label}] must have a name without '/'")
        places = (*plane, *GEOGRAPHIC, *self.position_texts)
        self.check_keys(label, section, (*places, "unit", *self.further_keys(label)))
        geographic = any(name in section for name in (*GEOGRAPHIC, *HEMISPHERES))
        if geographic and any(name in section for name in plane):
            self.errors.append(f"[{label}] mixes north and east with latitude and longitude")
        self.require(label, section, (*(globe if geographic else plane), "unit"))
        unit = section.get("unit")
        if unit is not None and not (geographic and unit == DEGREES_MINUTES):
            self.check_unit(f"{label}.unit", unit, "rad" if geographic else "m")
        self.parse_further(label, section)
        if len([name for name in HEMISPHERES if name in section]) == 1:
            self.errors.append(f"[{label}] needs both {' and '.join(HEMISPHERES)}")
        for name in (*GEOGRAPHIC, *HEMISPHERES) if geographic else plane:
            of_column = "m" if name == "altitude" else str(unit)
            place = section.get(name)
            self.add(f"{name}{suffix}", f"{label}.{name}", place, Column(0, of_column))

    # ---- checks

    def add(self, role: str, label: str, place: object, column: Column) -> None:
        """Add a column at its place, which is checked."""
        if place is None:
            return
        if not self.is_place(place):
            self.errors.append(f"{label} must be {self.place_words}, got {place!r:.60}")
            return
        metadata = column.metadata
        self.found[role] = Column(place, column.unit, column.sign, metadata)  # type: ignore[arg-type]

    def require(self, role: str, section: Mapping[str, Any], keys: Iterable[str]) -> None:
        """Check that a section has some keys."""
        self.errors += [f"[{role}] lacks {key}" for key in keys if key not in section]

    def check_keys(self, role: str, section: Iterable[str], allowed: Iterable[str]) -> None:
        """Check that a section has no other keys than those allowed."""
        allowed = tuple(allowed)
        self.errors += [
            unknown_key(key, allowed, section=role) for key in section if key not in allowed
        ]

    def check_unit(self, label: str, unit: object, si: str | None) -> None:
        """Check that a unit can be converted to an SI unit."""
        if not isinstance(unit, str) or si is None:
            self.errors.append(f"{label} must be a unit such as 'm/s', got {unit!r:.60}")
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
            self.errors.append(f"{label}: {text.replace(';', ',')}")

    def find_shared_columns(self) -> None:
        """Check that no column has two roles."""
        taken: dict[int | str, str] = {}
        for role, column in self.found.items():
            if column.place in taken:
                self.errors.append(
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
