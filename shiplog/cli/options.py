"""Option texts such as `NAME=VALUE` as values."""

import argparse
import re
from collections.abc import Sequence

from shiplog.errors import UsageError

NUMBER = r"([-+]?\d*\.?\d+(?:e[-+]?\d+)?)"  # one group of a regular expression


def assigned_texts(texts: Sequence[str], option: str, example: str) -> dict[str, str]:
    """Parse the ``NAME=TEXT`` texts of a repeatable option.

    Raises `UsageError` that names the option and shows an example.
    """
    for text in texts:
        if not re.fullmatch(r"[^=]+=[^=]+", text):
            raise UsageError(f"{option} takes NAME=VALUE, such as {example}, not {text!r}")
    return dict(text.split("=") for text in texts)


def add_source_option(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--source``, which `assigned_sources` reads."""
    parser.add_argument(
        "--source",
        action="append",
        default=[],
        metavar="CHANNEL=SOURCE",
        help="use this source of a channel that has several, such as yaw_rate=TI",
    )


def assigned_sources(texts: Sequence[str]) -> dict[str, str]:
    """Parse the values of the option ``--source``: the source by the name of its channel."""
    return assigned_texts(texts, "--source", "yaw_rate=TI")


def assigned_numbers(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    """Parse the ``NAME=NUMBER`` texts of a repeatable option.

    Raises `UsageError` that names the option and shows an example.

    Examples
    --------
    >>> assigned_numbers(["T3=0.5"], "--fix", "T3=0.5")
    {'T3': 0.5}
    """
    found = {}
    for name, value in assigned_texts(texts, option, example).items():
        try:
            found[name] = float(value)
        except ValueError:
            raise UsageError(
                f"{option} takes NAME=NUMBER, such as {example}, not {name}={value}"
            ) from None
    return found
