"""Trial files: sources, vessel, conditions and output of a recording, as TOML."""

import argparse
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from recorders.streams.format import GROUP, StreamFormat
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import parse_options
from recorders.transports.address import is_live, open_transport
from shiplog.errors import ShiplogError, UsageError
from shiplog.extensions import load_extension
from shiplog.toml_text import list_errors, parse_toml, read_toml_text
from shiplog.types import ReadOnlyMapping
from shiplog.units import did_you_mean

from .conditions import CONDITIONS, trim_contradiction

_KIND = "trial file"
MAX_SOURCES = 64
_SECTIONS = ("output", "vessel", "conditions", "source")
_OUTPUT_KEYS = ("file", "rotate_minutes", "rotate_megabytes", "flush_secs", "fsync_secs")
_SOURCE_KEYS = ("name", "format", "address", "raw")
_RESERVED = ("operator", "recorder")  # sources of events that are of no stream
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")


@dataclass(frozen=True)
class SourceEntry:
    """One source of a trial file.

    Attributes
    ----------
    name
        The name; the topics of the source begin with it, such as ``/heading/gyro.HE``.
    format
        The format of its packets.
    address
        The address of a live source, or the path of a recorded one, relative to the trial file.
    keep_raw
        Whether to record the packets beside the samples; None where the file does not state it.
    options
        The options of the format, parsed.
    """

    name: str
    format: StreamFormat
    address: str
    keep_raw: bool | None
    options: argparse.Namespace


@dataclass(frozen=True)
class TrialFile:
    """A parsed trial file.

    Attributes
    ----------
    path
        The file.
    sources
        At least one source; their names differ.
    output
        The log to write, or None where the file does not state it.
    vessel
        The path or preset of the vessel file, or None.
    conditions
        The conditions of the trial by name, in the units of `CONDITIONS`.
    rotate_minutes, rotate_megabytes
        When to begin a new part of the log; None for never.
    flush_secs, fsync_secs
        How often what was received is made safe from a killed process, and from a power failure;
        None for the default.
    """

    path: Path
    sources: tuple[SourceEntry, ...]
    output: Path | None = None
    vessel: str | None = None
    conditions: Mapping[str, float | str] = field(default_factory=dict)
    rotate_minutes: float | None = None
    rotate_megabytes: float | None = None
    flush_secs: float | None = None
    fsync_secs: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "conditions", ReadOnlyMapping(self.conditions))


def load_trial_file(path: str | os.PathLike[str]) -> TrialFile:
    """Load a trial file.

    Parameters
    ----------
    path
        TOML; docs/recording.md describes the keys.

    Raises
    ------
    UsageError
        The file cannot be read or has errors; the message lists all of them.
    """
    file, name = Path(path), os.fspath(path)
    text = read_toml_text(file, _KIND, UsageError)
    return _Parser(parse_toml(text, name, _KIND, UsageError), file).parse()


class _Parser:
    """The sections of one trial file, parsed one after the other, and their errors."""

    def __init__(self, table: Mapping[str, Any], path: Path) -> None:
        self._table, self._path = table, path
        self._errors: list[str] = []

    def parse(self) -> TrialFile:
        """Return the trial file, or raise all its errors at once."""
        self._check_keys("", self._table, _SECTIONS)
        output = self._section("output", _OUTPUT_KEYS)
        vessel = self._section("vessel", ("file",))
        conditions = self._conditions()
        sources = self._sources()
        output_file = self._text(output, "output.file", required=False)
        vessel_file = self._text(vessel, "vessel.file", required=bool(vessel))
        numbers = [self._positive(output, key) for key in _OUTPUT_KEYS[1:]]
        if self._errors:
            raise UsageError(list_errors(self._errors, _KIND, os.fspath(self._path)))
        return TrialFile(
            self._path,
            tuple(sources),
            self._path.parent / output_file if output_file else None,
            self._vessel(vessel_file),
            conditions,
            *numbers,
        )

    def _vessel(self, name: str) -> str | None:
        """Return the vessel file, relative to the trial file where it lies there, or a preset."""
        beside = self._path.parent / name
        # unlike Path.is_file, false of a name that no disk can have
        return os.fspath(beside) if name and os.path.isfile(beside) else name or None  # noqa: PTH113

    def _section(self, name: str, keys: Iterable[str]) -> Mapping[str, Any]:
        section = self._table.get(name, {})
        if not isinstance(section, dict):
            self._errors.append(f"[{name}] must be a section")
            return {}
        self._check_keys(name, section, keys)
        return section

    def _check_keys(self, where: str, section: Mapping[str, Any], keys: Iterable[str]) -> None:
        known = tuple(keys)
        for key in section:
            if key not in known:
                place = f" in [{where}]" if where else ""
                self._errors.append(f"unknown key {key!r}{place}{did_you_mean(key, known)}")

    def _text(self, section: Mapping[str, Any], path: str, *, required: bool) -> str:
        key = path.rpartition(".")[2]
        value = section.get(key)
        if value is None and not required:
            return ""
        if not isinstance(value, str) or not value or not value.isprintable():
            self._errors.append(f"{path} must be a text in one line")
            return ""
        return value

    def _positive(self, section: Mapping[str, Any], key: str) -> float | None:
        value = section.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1e6:
            self._errors.append(f"output.{key} must be a positive number")
            return None
        return float(value)

    def _conditions(self) -> dict[str, float | str]:
        section = self._section("conditions", CONDITIONS)
        conditions = {
            key: value
            for key, value in section.items()
            if key in CONDITIONS and self._is_condition(key, value)
        }
        if text := trim_contradiction(conditions):
            self._errors.append(f"conditions: {text}")
        return conditions

    def _is_condition(self, key: str, value: object) -> bool:
        condition = CONDITIONS[key]
        lowest, highest = condition.lowest, condition.highest
        if lowest is None or highest is None:
            good, needed = isinstance(value, str) and value.isprintable(), "a text in one line"
        else:
            number = isinstance(value, int | float) and not isinstance(value, bool)
            good = number and lowest <= float(value) <= highest  # type: ignore[arg-type]
            unit = f" {condition.unit}" if condition.unit else ""
            needed = f"a number from {lowest:g} to {highest:g}{unit}"
        if not good:
            self._errors.append(f"conditions.{key} must be {needed}")
        return good

    def _sources(self) -> list[SourceEntry]:
        tables = self._table.get("source")
        if not isinstance(tables, list) or not tables:
            self._errors.append("at least one [[source]] is needed")
            return []
        if len(tables) > MAX_SOURCES:
            self._errors.append(f"{len(tables)} sources; at most {MAX_SOURCES} are possible")
            return []
        entries = [self._source(f"source {n}", table) for n, table in enumerate(tables, start=1)]
        sources = [entry for entry in entries if entry is not None]
        names = [entry.name for entry in sources]
        for name in sorted({name for name in names if names.count(name) > 1}):
            self._errors.append(f"two sources are named {name!r}; give each its own name")
        return sources

    def _source(self, where: str, table: object) -> SourceEntry | None:
        if not isinstance(table, dict):
            self._errors.append(f"{where} must be a section [[source]]")
            return None
        before = len(self._errors)
        name = self._text(table, f"{where}.name", required=True)
        if name and not _NAME.fullmatch(name):
            self._errors.append(f"{where}.name may have letters, digits, _ and - only, at most 32")
        if name in _RESERVED:
            self._errors.append(f"{where}.name {name!r} is that of events of the log; give another")
        where = f"source {name!r}" if name else where
        address = self._text(table, f"{where}.address", required=True)
        keep_raw = table.get("raw")
        if keep_raw is not None and not isinstance(keep_raw, bool):
            self._errors.append(f"{where}.raw must be true or false")
        stream_format = self._format(where, table)
        if stream_format is None:
            return None
        self._check_address(where, stream_format, address)
        options = self._options(where, stream_format, table)
        if options is None or len(self._errors) > before:
            return None
        return SourceEntry(name, stream_format, address, keep_raw, options)

    def _check_address(self, where: str, stream_format: StreamFormat, address: str) -> None:
        """Check the address of a live source; whether a file exists is known when it is opened."""
        clock = ReceptionClock()
        try:
            if stream_format.open_transport(address, clock) is None and is_live(address):
                open_transport(address, clock)
        except UsageError as error:
            self._errors.append(f"{where}: {error}")

    def _format(self, where: str, table: Mapping[str, Any]) -> StreamFormat | None:
        name = self._text(table, f"{where}.format", required=True)
        if not name:
            return None
        try:
            return load_extension(GROUP, name, StreamFormat, "format")
        except ShiplogError as error:
            self._errors.append(f"{where}: {error}")
            return None

    def _options(
        self, where: str, stream_format: StreamFormat, table: Mapping[str, Any]
    ) -> argparse.Namespace | None:
        """Parse the further keys of a source as the options of its format."""
        given = {key: value for key, value in table.items() if key not in _SOURCE_KEYS}
        try:
            return parse_options(stream_format, given, where, _SOURCE_KEYS)
        except UsageError as error:
            self._errors.append(str(error))
            return None
