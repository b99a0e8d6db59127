"""Panels of quantities: the channels of one quantity share a panel, with a line for each source."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import cycle

import numpy as np

from .channel_series import DrawnQuantity
from .panels import Panel, limits, title_of
from .series import BLUE, CYAN, GREEN, GREY, ORANGE, RED, Colour, Series

SOURCE_COLOURS = BLUE, ORANGE, GREEN, RED, CYAN, GREY


def quantity_panel(name: str, quantity: DrawnQuantity, drawn: list[Series]) -> Panel:
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
    return joined_panel(
        f"{name}_{entity_part(quantity.name)}",
        title_of(quantity.name, quantity.display[0]),
        turned_together(drawn, quantity.turn),
        SOURCE_COLOURS if sum(len(each.lines) for each in drawn) > 1 else (),
    )


def joined_panel(
    name: str, title: str, drawn: Sequence[Series], colours: Iterable[Colour] = ()
) -> Panel:
    """Return a panel of series that share an axis, with a legend where it has several lines.

    Parameters
    ----------
    name, title
        Those of the panel.
    drawn
        The series; at least one.
    colours
        A colour for each line, repeated where they are fewer; without any the lines keep theirs.
    """
    lines = [line for each in drawn for line in each.lines]
    drawn = _coloured(drawn, list(colours))
    named = (replace(each, name=f"{i}_{entity_part(each.name)}") for i, each in enumerate(drawn))
    return Panel(
        name, title, tuple(named), limits(*(line.values for line in lines)), legend=len(lines) > 1
    )


def turned_together(drawn: Sequence[Series], turn: float) -> list[Series]:
    """Return angles shifted by whole turns, so that each is nearest to the first.

    Parameters
    ----------
    drawn
        The series, of one line each.
    turn
        A full turn in their unit; 0 for what is no compass angle, which is not shifted.
    """
    return [_turned_to(drawn[0], each, turn) for each in drawn] if turn else list(drawn)


def _turned_to(reference: Series, series: Series, turn: float) -> Series:
    """Return an angle shifted by whole turns, so that it is nearest to a reference."""
    (line,), (other,) = series.lines, reference.lines
    known, other_known = np.isfinite(line.values), np.isfinite(other.values)
    at, other_at = series.time_secs[known], reference.time_secs[other_known]
    difference = line.values[known] - np.interp(at, other_at, other.values[other_known])
    turns = float(np.round(np.median(difference) / turn))
    return replace(series, lines=(replace(line, values=line.values - turn * turns),))


def _coloured(drawn: Sequence[Series], colours: Sequence[Colour]) -> list[Series]:
    """Return the series with the next of the colours for each line."""
    if not colours:
        return list(drawn)
    following = cycle(colours)
    return [
        replace(each, lines=tuple(replace(line, colour=next(following)) for line in each.lines))
        for each in drawn
    ]


def entity_part(text: str) -> str:
    """Return a text as a part of an entity's path, in which Rerun takes few characters."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)


def has_any_value(series: Series) -> bool:
    """Return whether a series has any value."""
    return any(np.isfinite(line.values).any() for line in series.lines)
