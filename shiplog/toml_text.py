"""Text of settings files in TOML: parsed safely, and their errors in one message."""

import os
import re
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from .errors import ShiplogError
from .printable import shortened
from .units import did_you_mean

# The TOML parser takes memory by the square of the parts of a dotted key and a level of its stack
# for each list in another: 40 kB of one key took 1.6 GB. A layout of 600 channels has 100 kB.
MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 20  # of lists and inline tables, and of the parts of a dotted key
MAX_KEY_PARTS = 10_000  # of all keys and sections together
MAX_KEY_CHARACTERS = 400  # messages show keys, and compare them with those that are known
MAX_ERROR_CHARACTERS = 600  # of an error: its place is before the value of the file that it shows
MAX_LISTED_ERRORS = 30
MAX_INTEGER = 1 << 63  # the largest that TOML has, and one

_PART = r"""(?:[\w-]++|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+')"""
# Comments and texts of several lines; dotted keys (a number or a text may look like one); brackets.
_TOKENS = re.compile(
    r"""(?s)\#[^\n]*+|"{3}(?:[^"\\]++|\\.|"(?!""))*+"{0,5}|'{3}(?:[^']++|'(?!''))*+'{0,5}"""
    rf"""|(?P<key>{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*+)(?P<end>[ \t]*+[=\]])?+"""
    r"|(?P<opened>[\[{])|(?P<closed>[\]}])"
)


def read_toml_text(
    path: str | os.PathLike[str], kind: str, error: type[ShiplogError], missing: str = ""
) -> str:
    """Read the text of a settings file, at most as much as `parse_toml` accepts and a character.

    Parameters
    ----------
    path
        The file.
    kind
        The kind of file, such as ``layout file``.
    error
        The class of the errors.
    missing
        What to report where there is no such file; by default that it cannot be read.

    Raises
    ------
    error
        The file cannot be read.
    """
    try:
        with Path(path).open(encoding="utf-8") as file:
            return file.read(MAX_CHARACTERS + 1)
    except (OSError, UnicodeDecodeError) as cause:
        if missing and isinstance(cause, FileNotFoundError):
            raise error(f"{missing}: {path}") from None
        reason = getattr(cause, "strerror", None) or cause
        raise error(f"cannot read the {kind} ({reason}); name another: {path}") from cause


def parse_toml(text: str, where: str, kind: str, error: type[ShiplogError]) -> dict[str, Any]:
    """Parse TOML of a bounded size.

    Parameters
    ----------
    text
        The text of a file.
    where
        Name of the file, for messages.
    kind
        The kind of file, such as ``layout file``.
    error
        The class of the errors.

    Raises
    ------
    error
        The text is no TOML, or too long or too deeply nested for a file of this kind.

    Examples
    --------
    >>> from shiplog.errors import VesselError
    >>> parse_toml("length = 320.0", "ship.toml", "vessel file", VesselError)
    {'length': 320.0}
    """
    if excess := _excess(text):
        raise error(f"{excess} for a {kind}; simplify it, or name another: {where}")
    try:
        table = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError) as cause:
        reason = shortened(" ".join(str(cause).split()), MAX_ERROR_CHARACTERS)
        raise error(f"not a TOML file ({reason}); correct that line: {where}") from cause
    if excess := _excess_of_values(table):
        raise error(f"{excess} for a {kind}; correct it: {where}")
    return table


def _excess(text: str) -> str:
    """Return what in a text is too much to be parsed, or an empty text."""
    if len(text) > MAX_CHARACTERS:
        return f"longer than {MAX_CHARACTERS} characters, too long"
    depth = parts = 0
    for match in _TOKENS.finditer(text):
        if key := match["key"]:
            count = len(re.findall(_PART, key)) if "." in key else 1
            depth -= (match["end"] or "").endswith("]")
            if match["end"] or count > 2:  # a number has two
                parts += count
            if count > MAX_DEPTH:
                return f"a key of {count} parts, nested too deeply"
        depth += bool(match["opened"]) - bool(match["closed"])
        if depth > MAX_DEPTH:
            return f"more than {MAX_DEPTH} lists in each other, nested too deeply"
    return f"keys of {parts} parts together, too many" if parts > MAX_KEY_PARTS else ""


def _excess_of_values(table: dict[str, Any]) -> str:
    """Return the key or the integer of a parsed file that is too long, or an empty text."""
    values: list[Any] = [table]
    while values:
        value = values.pop()
        if isinstance(value, dict):
            if key := next((key for key in value if len(key) > MAX_KEY_CHARACTERS), ""):
                return f"a key of {len(key)} characters ({key[:20]}...), too long"
            values += value.values()
        elif isinstance(value, list):
            values += value
        elif isinstance(value, int) and not -MAX_INTEGER <= value < MAX_INTEGER:
            return f"an integer of {value.bit_length()} bits, too large"
    return ""


def list_errors(errors: Sequence[str], kind: str, where: str) -> str:
    """Return the message that lists the errors of a file.

    Examples
    --------
    >>> list_errors(["[yaw] lacks T1"], "vessel file", "ship.toml")
    'one error in the vessel file: [yaw] lacks T1: ship.toml'
    """
    count = "one error" if len(errors) == 1 else f"{len(errors)} errors"
    texts = "; ".join(
        shortened(" ".join(e.split()), MAX_ERROR_CHARACTERS) for e in errors[:MAX_LISTED_ERRORS]
    )
    if len(errors) > MAX_LISTED_ERRORS:
        texts += f"; and {len(errors) - MAX_LISTED_ERRORS} more"
    return f"{count} in the {kind}: {texts}: {where}"


def unknown_key(key: str, allowed: Iterable[str], *, section: str = "") -> str:
    """Return the error for a key of a file that is not known, with the nearest one that is.

    Examples
    --------
    >>> unknown_key("lenght", ["length", "name"])
    "unknown key 'lenght', did you mean 'length'?"
    """
    label = f"{section}.{key}" if section else key
    return f"unknown key {label!r}{did_you_mean(key, allowed).replace(';', ',')}"
