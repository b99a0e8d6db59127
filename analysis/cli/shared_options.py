"""Options that replay and identify share: how their logs are read, and the review they show."""

import argparse
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.console import print_line
from shiplog.cli.options import (
    add_cut_options,
    add_derive_option,
    add_source_option,
    assigned_numbers,
    assigned_sources,
)
from shiplog.errors import UsageError

if TYPE_CHECKING:
    from analysis.replay.reading_options import ReadingOptions
    from shiplog.screening import StatedDelays


def add_reading_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that state how logs are read; `reading_options` and `open_cut` apply them."""
    parser.add_argument(
        "--vessel", help="a preset or a vessel.toml, instead of the one that the log carries"
    )
    parser.add_argument(
        "--length",
        type=float,
        metavar="METRES",
        help="length between perpendiculars, such as 320; precedes that of the vessel file",
    )
    add_source_option(parser)
    add_derive_option(parser)
    parser.add_argument(
        "--sensor-delay",
        metavar="DELAYS",
        help="correct the times of late sensors: auto, or seconds such as heading=1.2,speed=0.4; "
        "auto estimates heading against yaw rate and speed against fixes",
    )
    parser.add_argument(
        "--strict", action="store_true", help="refuse a log with a contradiction in unit or sign"
    )
    add_cut_options(parser)


def reading_options(arguments: argparse.Namespace) -> "ReadingOptions":
    """Return the options that state how logs are read; the vessel file is loaded.

    Raises
    ------
    UsageError
        A source is not given as ``CHANNEL=SOURCE``, or a delay not as ``CHANNEL=SECONDS``.
    VesselError
        The vessel file cannot be read or has errors.
    """
    from analysis.replay.reading_options import ReadingOptions
    from shiplog.vessel.vessel_parser import load_vessel

    sources = assigned_sources(arguments.source)
    vessel = load_vessel(arguments.vessel)[0] if arguments.vessel else None
    derive = tuple(arguments.derive)
    delays = _sensor_delays(arguments.sensor_delay)
    return ReadingOptions(vessel, arguments.length, sources, arguments.strict, derive, delays)


def _sensor_delays(text: str | None) -> "StatedDelays":
    if text is None:
        return {}
    if text == "auto":
        return "auto"
    return assigned_numbers(text.split(","), "--sensor-delay", "heading=1.2,speed=0.4, or auto")


def add_antenna_option(parser: argparse.ArgumentParser) -> None:
    """Add the option that places the position's antenna; `antenna_place` applies it."""
    parser.add_argument(
        "--antenna",
        metavar="FORWARD,STARBOARD",
        help="place of the position's antenna from the midship point, m, such as --antenna=-45,2.5",
    )


def antenna_place(text: str | None) -> tuple[float, float]:
    """Return the place of the antenna ahead and to starboard of midship, m.

    Raises
    ------
    UsageError
        It is not two numbers.
    """
    numbers = finite_numbers(text, "--antenna", "-45,2.5") or (0.0, 0.0)
    if len(numbers) != 2:
        raise UsageError(f"--antenna takes two numbers, such as -45,2.5, not {text!r}")
    return numbers[0], numbers[1]


def finite_numbers(text: str | None, option: str, example: str) -> tuple[float, ...]:
    """Parse the finite numbers of an option, separated by commas; none where it is not given.

    Raises
    ------
    UsageError
        Something is no finite number.
    """
    try:
        numbers = tuple(float(word) for word in text.split(",")) if text else ()
    except ValueError:
        numbers = (nan,)
    if not all(map(isfinite, numbers)):
        raise UsageError(f"{option} takes numbers, such as {example}, not {text!r}")
    return numbers


def show_review(path: str | Path, *, view: bool) -> None:
    """Print where the review is, and open it in the Rerun viewer if asked to."""
    print_line(f"review: {path} (open it with: rerun {path})", to_stderr=True)
    if view:
        from analysis.view.viewer import view_review

        view_review(path)
