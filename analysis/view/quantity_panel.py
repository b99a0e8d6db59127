"""Panels of quantities: the channels of one quantity share a panel, with a line for each source."""

import re
from dataclasses import replace
from itertools import cycle

import numpy as np

from .channel_series import Quantity
from .panels import Panel, limits, title_of
from .series import BLUE, CYAN, GREEN, GREY, ORANGE, RED, Series

SOURCE_COLOURS = BLUE, ORANGE, GREEN, RED, CYAN, GREY
LEGEND_SHARE = 0.15  # of an axis, above the values, for each name in the legend


def quantity_panel(name: str, quantity: Quantity, drawn: list[Series]) -> Panel:
    """Return the panel of a quantity, with a colour for each of several lines, and a legend.

    Parameters
    ----------
    name
        The beginning of the path of its entities.
    quantity
        What the series have in common.
    drawn
        The series; at least one.
    """
    if quantity.turn:
        drawn = [_turned_to(drawn[0], each, quantity.turn) for each in drawn]
    lines = [line for each in drawn for line in each.lines]
    low, high = limits(*(line.values for line in lines))
    if len(lines) > 1:
        drawn = _coloured(drawn)
        high += LEGEND_SHARE * len(lines) * (high - low)
    named = (replace(each, name=f"{i}_{entity_part(each.name)}") for i, each in enumerate(drawn))
    return Panel(
        f"{name}_{entity_part(quantity.name)}",
        title_of(quantity.name, quantity.display[0]),
        tuple(named),
        (low, high),
        legend=len(lines) > 1,
    )


def _turned_to(reference: Series, series: Series, turn: float) -> Series:
    """Return an angle shifted by whole turns, so that it is nearest to a reference."""
    (line,), (other,) = series.lines, reference.lines
    known, other_known = np.isfinite(line.values), np.isfinite(other.values)
    at, other_at = series.time_secs[known], reference.time_secs[other_known]
    difference = line.values[known] - np.interp(at, other_at, other.values[other_known])
    turns = float(np.round(np.median(difference) / turn))
    return replace(series, lines=(replace(line, values=line.values - turn * turns),))


def _coloured(drawn: list[Series]) -> list[Series]:
    """Return the series with a colour of its own for each line, as far as there are colours."""
    colours = cycle(SOURCE_COLOURS)
    return [
        replace(each, lines=tuple(replace(line, colour=next(colours)) for line in each.lines))
        for each in drawn
    ]


def entity_part(text: str) -> str:
    """Return a text as a part of an entity's path, in which Rerun takes few characters."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)


def has_values(series: Series) -> bool:
    """Return whether a series has any value."""
    return any(np.isfinite(line.values).any() for line in series.lines)
