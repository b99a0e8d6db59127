"""Panels: series that share an axis, with a title and limits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import floor, log10
from typing import Literal

import numpy as np

from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, conversion_factor

from .series import Line, Series

WILD_SHARE = 0.01  # of the values at either end, which may lie outside an axis
Corner = Literal["RightTop", "LeftTop", "RightBottom", "LeftBottom"]
CORNERS: tuple[Corner, ...] = ("RightTop", "LeftTop", "RightBottom", "LeftBottom")
CORNER = (0.25, 0.5)  # of the width and the height of a panel: what a legend may cover
CORNER_RATIO = 1.5  # of the points covered in two corners: below it they are alike
MIN_VARIATION = 0.02  # of the largest value
REVIEW_UNITS: Mapping[str, str] = {"yaw_rate": "deg/min"}  # as rate of turn indicators show it


@dataclass(frozen=True, eq=False)
class Panel:
    """Series under one title that share an axis.

    Attributes
    ----------
    name
        The first part of the path of its entities.
    title
        The title, with the unit in brackets.
    series
        The series.
    limits
        The ends of the value axis.
    legend
        Whether the names of the lines are shown.
    """

    name: str
    title: str
    series: tuple[Series, ...]
    limits: tuple[float, float]
    legend: bool = False


def words(name: str) -> str:
    """Return the name of a quantity as words.

    Examples
    --------
    >>> words("yaw_rate")
    'yaw rate'
    """
    return name.replace("_", " ")


def title_of(name: str, unit: str) -> str:
    """Return the title of a panel of a quantity.

    Examples
    --------
    >>> title_of("yaw_rate", "deg/s"), title_of("rpm", "rpm"), title_of("satellites", "1")
    ('yaw rate [deg/s]', 'rpm', 'satellites')
    """
    return words(name) if unit in (name, "1") else f"{words(name)} [{unit}]"


def review_unit(name: str) -> tuple[str, float]:
    """Return the unit in which reviews draw a quantity, and the factor to it from the SI unit.

    Examples
    --------
    >>> review_unit("rudder")[0], review_unit("yaw_rate")[0]
    ('deg', 'deg/min')
    """
    unit = REVIEW_UNITS.get(name, CATALOGUE[name].display_unit)
    return unit, conversion_factor(CATALOGUE[name].unit, unit)


def range_text(*arrays: FloatArray) -> str:
    """Return the lowest and the highest of some values in words; empty where none is finite.

    An axis has grid lines at powers of ten only, without a number where they are close.

    Examples
    --------
    >>> range_text(np.array([1.0, np.nan]), np.array([2.5])), range_text(np.array([80.0]))
    ('1 to 2.5', '80')
    """
    values = np.concatenate(arrays)
    if not np.isfinite(values).any():
        return ""
    lowest, highest = (f"{end(values):.4g}" for end in (np.nanmin, np.nanmax))
    return lowest if lowest == highest else f"{lowest} to {highest}"


def with_range(title: str, *arrays: FloatArray) -> str:
    """Return a title with the range of the values.

    Examples
    --------
    >>> with_range("rpm", np.array([80.0]))
    'rpm: 80'
    """
    text = range_text(*arrays)
    return f"{title}: {text}" if text else title


def with_bounds(axis: tuple[float, float], bound: float) -> tuple[float, float]:
    """Return the limits of an axis, widened to twice a bound that is drawn on both sides of zero.

    Examples
    --------
    >>> with_bounds((-0.1, 7.0), 2.0)
    (-4.0, 7.0)
    """
    return min(axis[0], -2 * bound), max(axis[1], 2 * bound)


def free_corner(panel: Panel) -> Corner:
    """Return a corner of a panel that its lines cross hardly more than any other, for its legend.

    The upper right one is the first choice.
    """
    low, high = panel.limits
    spans = [each.time_secs[[0, -1]] for each in panel.series if len(each.time_secs)]
    if not spans:
        return "RightTop"
    start, end = min(each[0] for each in spans), max(each[1] for each in spans)
    crossings: dict[Corner, float] = dict.fromkeys(CORNERS, 0.0)
    for series in panel.series:
        at = (series.time_secs - start) / max(end - start, 1e-9)
        for line in series.lines:
            level = (line.values - low) / (high - low)
            for corner in crossings:
                beside = at > 1 - CORNER[0] if corner.startswith("Right") else at < CORNER[0]
                depth = 1 - level if corner.endswith("Top") else level
                covered = beside & (depth > 0) & (depth < CORNER[1])
                crossings[corner] += np.count_nonzero(covered) / max(len(at), 1)
    few = CORNER_RATIO * min(crossings.values())
    return next(corner for corner in CORNERS if crossings[corner] <= few)


def varies(values: FloatArray) -> bool:
    """Return whether values differ by more than `MIN_VARIATION`, so that they need a panel.

    Examples
    --------
    >>> varies(np.array([80.0, np.nan, 80.1])), varies(np.array([80.0, 60.0]))
    (False, True)
    """
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > MIN_VARIATION * np.max(np.abs(known)))


def strokes(name: str, spans: FloatArray, levels: tuple[float, float], line: Line) -> Series:
    """Return strokes between two levels.

    Parameters
    ----------
    name
        That of the series.
    spans
        (g, 2) s: each stroke goes from the first of them to the second; equal, it is vertical.
    levels
        The values at both ends.
    line
        Its name, colour and width are those of the strokes.
    """
    spans = spans[np.argsort(spans[:, 0])]
    times = np.column_stack((spans, spans[:, 1])).ravel()
    values = np.tile([*levels, np.nan], len(spans))
    # else a viewer draws the mean of the values at one instant
    return Series(name, times, (replace(line, values=values),), spiky=True)


def thousands(size: float) -> tuple[str, float]:
    """Return a power of a thousand as a prefix of a unit, and the factor that brings `size` near 1.

    Examples
    --------
    >>> prefix, scale = thousands(2.5e-5)
    >>> prefix, round(2.5e-5 * scale, 3)
    ('10⁻⁶ ', 25.0)
    """
    exponent = 3 * floor(log10(size) / 3) if 0 < size < np.inf else 0
    digits = str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return (f"10{digits} " if exponent else ""), 10.0**-exponent


def rounded(value: float, half_width: float) -> str:
    """Format a value with two digits of the half-width of its interval.

    Examples
    --------
    >>> rounded(1.23456, 0.0321)
    '1.235 ± 0.032'
    >>> rounded(1.23456, np.nan)
    'not determined'
    """
    if not (np.isfinite(value) and 0 < half_width < np.inf):
        return "not determined"
    digits = min(max(1 - floor(log10(half_width)), 0), 9)
    return f"{value:.{digits}f} ± {half_width:.{digits}f}"


def limits(*arrays: FloatArray) -> tuple[float, float]:
    """Return the limits of an axis on which a few wild values do not squeeze the rest.

    The axis ends no further beyond the central 98 % of the values than half their range.
    """
    values = np.concatenate([array[np.isfinite(array)] for array in arrays])
    if not len(values):
        return -1.0, 1.0
    low, high = np.quantile(values, (WILD_SHARE, 1 - WILD_SHARE))
    reach = (high - low) / 2
    low, high = max(values.min(), low - reach), min(values.max(), high + reach)
    pad = max(0.03 * (high - low), 0.01 * max(abs(low), abs(high)), 1e-9)
    return float(low - pad), float(high + pad)
