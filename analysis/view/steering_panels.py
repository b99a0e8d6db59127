"""Heading with the rudder over it, as a naval architect draws a zig-zag."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.types import FloatArray

from .panels import Panel, limits, range_text
from .series import BLUE, GREY, ORANGE, Line, Series

MAX_OVERLAID_TURN = 180.0  # deg: up to here the rudder can be read over the heading
HEADING_COLOUR, RUDDER_COLOUR = BLUE, ORANGE
MEASURED_WIDTH, WIDTH = 2.5, 1.5  # of a measured line under a computed one, and of others


def steering_panels(
    origin: str, rudder: Series, headings: Sequence[Series], reference: str = ""
) -> list[Panel]:
    """Return one panel of heading and rudder, or two where the ship turns far.

    The paths of their entities are the same in both: the origin, the quantity, and the series.

    Parameters
    ----------
    origin
        The beginning of these paths.
    rudder
        As of `rudder_series`.
    headings
        As of `heading_series`; without any there is only a rudder.
    reference
        The heading from which headings count, in words; empty where they count from north.
    """
    steered = _range(rudder)
    alone = Panel(f"{origin}/rudder", f"rudder: {steered} [deg]", (rudder,), _limits(rudder))
    if not headings or not _range(*headings):
        return [alone]
    turned = f"heading{f' from {reference}' if reference else ''}: {_range(headings[0])}"
    if _turn(headings) >= MAX_OVERLAID_TURN:
        title, several = f"{turned} [deg]", len(headings) > 1
        heading = Panel(f"{origin}/heading", title, tuple(headings), _limits(*headings), several)
        return [heading, alone]
    drawn = [replace(each, name=f"heading/{each.name}") for each in headings]
    drawn.append(replace(rudder, name=f"rudder/{rudder.name}"))
    title = f"{turned}; rudder: {steered} [deg]"
    return [Panel(origin, title, tuple(drawn), _limits(*drawn), legend=True)]


def heading_series(
    time_secs: FloatArray, measured: FloatArray, simulated: FloatArray | None = None
) -> list[Series]:
    """Return the series of a heading, which is grey where a simulated one is drawn over it.

    Parameters
    ----------
    time_secs
        (n,) s.
    measured, simulated
        (n,) deg.
    """
    if simulated is None:
        line = Line("heading", measured, HEADING_COLOUR, WIDTH)
        return [Series("measured", time_secs, (line,), spiky=True)]
    line = Line("heading, measured", measured, GREY, MEASURED_WIDTH)
    other = Line("heading, simulated", simulated, HEADING_COLOUR, WIDTH)
    return [
        Series("measured", time_secs, (line,), spiky=True),
        Series("simulated", time_secs, (other,)),
    ]


def rudder_series(time_secs: FloatArray, values: FloatArray) -> Series:
    """Return the series of a rudder angle, (n,) deg."""
    line = Line("rudder", values, RUDDER_COLOUR, WIDTH)
    return Series("measured", time_secs, (line,), spiky=True)


def _range(*drawn: Series) -> str:
    return range_text(*(line.values for each in drawn for line in each.lines))


def _limits(*drawn: Series) -> tuple[float, float]:
    return limits(*(line.values for each in drawn for line in each.lines))


def _turn(headings: Sequence[Series]) -> float:
    values = np.concatenate([line.values for each in headings for line in each.lines])
    return float(np.nanmax(values) - np.nanmin(values))
