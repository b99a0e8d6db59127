"""Options that several verbs have, and option texts such as `NAME=VALUE` as values."""

import argparse
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from shiplog.errors import UsageError

from .paths import StrPath

if TYPE_CHECKING:
    from shiplog import LogFile, TrialLog

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


def add_derive_option(parser: argparse.ArgumentParser) -> None:
    """Add the repeatable option ``--derive``."""
    parser.add_argument(
        "--derive",
        action="append",
        default=[],
        metavar="CHANNEL",
        help="derive a channel that a log lacks: yaw_rate from the heading, or speed from the "
        "speed over ground; a warning states its noise",
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


def add_cut_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--from`` and ``--to``, which cut the logs of a verb; `open_cut` applies them."""
    parser.add_argument(
        "--from",
        dest="start",
        metavar="TIME",
        type=_time_bound,
        help="use each log from this time on: s since its start (120), s before its end (-30), "
        "a time of day in UTC (12:04:30) or a time in ISO 8601 (2026-05-01T12:04:30Z)",
    )
    parser.add_argument(
        "--to", dest="end", metavar="TIME", type=_time_bound, help="use each log up to this time"
    )


def open_cut(path: StrPath, arguments: argparse.Namespace) -> "TrialLog | LogFile":
    """Open the part of a log between the bounds of the options ``--from`` and ``--to``."""
    from shiplog.mcap.stream import open_log

    return open_log(path, arguments.start, arguments.end)


def _time_bound(text: str) -> float | str:
    from shiplog.types.time_cut import parse_time_bound

    return parse_time_bound(text)
