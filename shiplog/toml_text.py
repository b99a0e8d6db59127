"""Text of settings files in TOML: parsed safely, and their errors in one message."""

import os
import re
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from .errors import ShiplogError
from .units import did_you_mean

MAX_CHARACTERS = 100_000  # the TOML parser needs memory by the square of a hostile text


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
    if len(text) > MAX_CHARACTERS:
        raise error(
            f"{len(text)} characters, too long for a {kind} (at most {MAX_CHARACTERS}); "
            f"name another: {where}"
        )
    if re.search(r"(?:\.[^.\n]{0,80}){60}", text) or re.search(r"(?:[\[{]\s*){60}", text):
        raise error(f"keys or lists nested too deeply for a {kind}; simplify it: {where}")
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as cause:
        reason = " ".join(str(cause).split())
        raise error(f"not a TOML file ({reason}); correct that line: {where}") from cause


def list_errors(errors: Sequence[str], kind: str, where: str) -> str:
    """Return the message that lists the errors of a file.

    Examples
    --------
    >>> list_errors(["[yaw] lacks T1"], "vessel file", "ship.toml")
    'one error in the vessel file: [yaw] lacks T1: ship.toml'
    """
    count = "one error" if len(errors) == 1 else f"{len(errors)} errors"
    texts = "; ".join(" ".join(each.split()) for each in errors)
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
