"""Panels: series that share an axis, with a title and limits."""

from dataclasses import dataclass
from math import floor, log10

import numpy as np

from shiplog.types import FloatArray

from .series import Series

WILD_SHARE = 0.01  # of the values at either end, which may lie outside an axis


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
