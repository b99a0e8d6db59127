"""A section of a system file: values checked as they are read, all errors collected."""

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite, nan
from typing import Any

import numpy as np

from shiplog.toml_text import unknown_key
from shiplog.types import FloatArray
from shiplog.units import did_you_mean


class FileSection:
    """A section of a TOML file whose keys are read one by one.

    Each reader returns a value of the right type in any case; what is wrong is appended to the
    errors. `finish` reports the keys that nothing has asked for.

    Parameters
    ----------
    table
        The value of the section in the file.
    label
        Its name, for messages; empty for the top level.
    errors
        The errors of the whole file.
    """

    def __init__(self, table: object, label: str, errors: list[str]) -> None:
        self.label, self.errors = label, errors
        self._known: list[str] = []
        self.table: Mapping[str, Any] = table if isinstance(table, dict) else {}
        if not isinstance(table, dict):
            errors.append(f"[{label}] must be a section")

    def __contains__(self, key: str) -> bool:
        """Whether the section has the key, which is thereby known."""
        self._known.append(key)
        return key in self.table

    def name(self, key: str) -> str:
        """Return the full name of a key, for messages."""
        return f"{self.label}.{key}" if self.label else key

    def number(
        self, key: str, default: float | None = None, *, positive: bool = False, least: float = nan
    ) -> float:
        """Read a number; without a default it is required."""
        if key not in self:
            if default is None:
                self.lacks(key)
            return nan if default is None else default
        value = self.table[key]
        if not _is_number(value):
            self.errors.append(f"{self.name(key)} must be a number, got {value!r}")
        elif positive and value <= 0:
            self.errors.append(f"{self.name(key)} must be positive, got {value:g}")
        elif value < least:
            self.errors.append(f"{self.name(key)} must be at least {least:g}, got {value:g}")
        else:
            return float(value)
        return nan

    def count(self, key: str, default: int | None = None, *, least: int = 1) -> int:
        """Read a whole number not below `least`; without a default it is required."""
        value = self.number(key, default, least=least)
        if isfinite(value) and value % 1:
            self.errors.append(f"{self.name(key)} must be a whole number, got {value:g}")
        return int(value) if isfinite(value) else least

    def text(self, key: str, default: str | None = None, choices: Sequence[str] = ()) -> str:
        """Read a text, one of `choices` if there are any; without a default it is required."""
        if key not in self:
            if default is None:
                self.lacks(key)
            return default or ""
        value = self.table[key]
        if not isinstance(value, str):
            self.errors.append(f"{self.name(key)} must be a text, got {value!r}")
            return default or ""
        if choices and value not in choices:
            hint = did_you_mean(value, choices).replace(";", ",")
            self.errors.append(
                f"{self.name(key)} must be one of {', '.join(choices)}, got {value!r}{hint}"
            )
            return default or ""
        return value

    def flag(self, key: str, *, default: bool = False) -> bool:
        """Read true or false."""
        value = self.table[key] if key in self else default
        if not isinstance(value, bool):
            self.errors.append(f"{self.name(key)} must be true or false, got {value!r}")
        return bool(value)

    def names(self, key: str, allowed: Iterable[str]) -> tuple[str, ...]:
        """Read a list of names, each one of `allowed`; empty where the key is missing."""
        value, allowed = (self.table[key] if key in self else []), list(allowed)
        if not (isinstance(value, list) and all(isinstance(each, str) for each in value)):
            self.errors.append(f"{self.name(key)} must be a list of names, got {value!r}")
            return ()
        self._check_names(key, value, allowed)
        return tuple(each for each in value if each in allowed)

    def numbers(self, key: str) -> FloatArray:
        """Read a list of numbers, (n,); without the key an empty array."""
        value = self.table[key] if key in self else []
        if not (isinstance(value, list) and all(map(_is_number, value))):
            self.errors.append(f"{self.name(key)} must be a list of numbers, got {value!r}")
            return np.zeros(0)
        return np.array(value, dtype=np.float64)

    def by_name(self, key: str, allowed: Iterable[str], *, least: float = nan) -> dict[str, float]:
        """Read a table of numbers by name, each name one of `allowed`; empty without the key."""
        value, allowed = (self.table[key] if key in self else {}), list(allowed)
        if not (isinstance(value, dict) and all(map(_is_number, value.values()))):
            self.errors.append(
                f"{self.name(key)} must have a number for each name, such as "
                f"{{ {allowed[0] if allowed else 'name'} = 1.0 }}, got {value!r}"
            )
            return {}
        self._check_names(key, value, allowed)
        for name, number in value.items():
            if number < least:
                self.errors.append(f"{self.name(key)}.{name} must be at least {least:g}")
        return {name: float(number) for name, number in value.items() if name in allowed}

    def texts(self, key: str) -> dict[str, str]:
        """Read a table of texts by name; empty without the key."""
        value = self.table[key] if key in self else {}
        if not (isinstance(value, dict) and all(isinstance(t, str) for t in value.values())):
            self.errors.append(f"{self.name(key)} must have a text for each name, got {value!r}")
            return {}
        return dict(value)

    def matrix(self, key: str, rows: int | None, columns: int | None) -> FloatArray | None:
        """Read a matrix (rows, columns), `None` being any number; None where it is missing."""
        if key not in self:
            return None
        value = self.table[key]
        is_matrix = isinstance(value, list) and all(
            isinstance(row, list) and all(map(_is_number, row)) for row in value
        )
        if not is_matrix or len({len(row) for row in value}) != 1:
            self.errors.append(
                f"{self.name(key)} must be a list of rows of numbers, all of equal length"
            )
            return None
        array = np.array(value, dtype=np.float64)
        expected = (rows or array.shape[0], columns or array.shape[1])
        if array.shape != expected or not array.size:
            self.errors.append(
                f"{self.name(key)} has {array.shape[0]} × {array.shape[1]} numbers, expected"
                f" {expected[0]} × {expected[1]}"
            )
            return None
        return array

    def section(self, key: str) -> "FileSection":
        """Return the section below this one, such as ``[noise]``; an empty one without the key."""
        return FileSection(self.table[key] if key in self else {}, self.name(key), self.errors)

    def sections(self, key: str) -> dict[str, "FileSection"]:
        """Return the named sections below this one, such as those of ``[outputs.NAME]``."""
        value = self.table[key] if key in self else {}
        if not isinstance(value, dict):
            self.errors.append(f"[{self.name(key)}.NAME] must be sections")
            return {}
        label = self.name(key)
        return {
            name: FileSection(each, f"{label}.{name}", self.errors) for name, each in value.items()
        }

    def items(self, key: str) -> list["FileSection"]:
        """Return the sections of a list, such as ``[[disturbance]]``."""
        value = self.table[key] if key in self else []
        if not isinstance(value, list):
            self.errors.append(f"{self.name(key)} must be written as [[{self.name(key)}]]")
            return []
        label = self.name(key)
        return [
            FileSection(each, f"{label} {number}", self.errors)
            for number, each in enumerate(value, 1)
        ]

    def lacks(self, key: str) -> None:
        """Report a missing key."""
        self.errors.append(f"[{self.label}] lacks {key}" if self.label else f"{key} is missing")

    def finish(self) -> None:
        """Report the keys that are not known."""
        for key in self.table:
            if key not in self._known:
                self.errors.append(unknown_key(key, self._known, section=self.label))

    def _check_names(self, key: str, given: Iterable[str], allowed: Sequence[str]) -> None:
        for name in given:
            if name not in allowed:
                hint = did_you_mean(name, allowed).replace(";", ",")
                self.errors.append(
                    f"{self.name(key)} names {name!r}{hint}; there are {', '.join(allowed)}"
                )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
