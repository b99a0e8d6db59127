"""What a review draws: an analysis in the units people use, as lines in panels.

Nothing about the ship is computed here, and nothing is known of the program that draws.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import floor, log10

import numpy as np

from shiplog.clock import longest_step_secs, usual_interval_secs
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, factor

from .kalman import OUTPUT_STATES, OUTPUTS
from .pipeline import Analysis
from .sliding import Identification

POINTS = 20_000  # a series: more than a screen has, and quickly drawn
GUIDE = 2.0  # standard deviations, of every band drawn

Colour = tuple[int, int, int, int]
GREY: Colour = (140, 140, 140, 255)
CYAN: Colour = (60, 190, 210, 255)
GREEN: Colour = (76, 175, 80, 255)
BLUE: Colour = (66, 150, 245, 255)  # what is said of yaw
ORANGE: Colour = (245, 140, 40, 255)  # what is said of surge
RED: Colour = (225, 70, 80, 255)


@dataclass(frozen=True, eq=False)
class Line:
    """A named line of a series."""

    name: str
    values: FloatArray  # (n,); NaN is a gap
    colour: Colour
    width: float = 1.0


@dataclass(frozen=True, eq=False)
class Series:
    """Lines that share their times."""

    name: str  # later in the alphabet is drawn on top
    time_secs: FloatArray  # (n,) since the signals' start
    lines: tuple[Line, ...]
    spiky: bool = False  # where many points fall on a pixel, its extremes matter, not its mean


@dataclass(frozen=True, eq=False)
class Panel:
    """Series under one title; they share an axis."""

    name: str
    title: str
    series: tuple[Series, ...]
    limits: tuple[float, float]


def equation_panels(analysis: Analysis) -> tuple[list[Panel], list[Panel]]:
    """The courses over time, of yaw and of surge: row by row they belong side by side."""
    found = analysis.disturbance
    thousandths = 1e3 * factor("rad", "deg")
    yaw = [
        _output(analysis, 0, BLUE),
        _input(analysis, "rudder"),
        _disturbance(
            analysis, "yaw", "0.001 deg/s³", found.yaw * thousandths, found.yaw_std * thousandths
        ),
        _residual(analysis, 0, BLUE),
    ]
    surge = [
        _output(analysis, 1, ORANGE),
        _input(analysis, "rpm"),
        _disturbance(analysis, "surge", "mm/s²", found.surge * 1e3, found.surge_std * 1e3),
        _residual(analysis, 1, ORANGE),
    ]
    return yaw, surge


def coefficient_panels(analysis: Analysis) -> list[Panel]:
    """The history of each coefficient that any window could tell, beside the model's value."""
    model, span = analysis.vessel.coefficients._asdict(), _ends(analysis)
    panels = [
        _coefficient(found, name, model[name], span, colour)
        for found, colour in ((analysis.yaw, BLUE), (analysis.surge, ORANGE))
        for name in found.history.names
    ]
    return [panel for panel in panels if panel is not None]


def _output(analysis: Analysis, output: int, colour: Colour) -> Panel:
    name, state = OUTPUTS[output], OUTPUT_STATES[output]
    signals, unit = analysis.signals, CATALOGUE[name].display_unit
    scale = factor(CATALOGUE[name].unit, unit)
    measured = signals[name] * scale
    value = analysis.estimates.states[:, state] * scale
    spread = GUIDE * analysis.estimates.stds[:, state] * scale
    at, seen = without_blanks(signals.time_secs, measured, signals.dt_secs)
    drawn = _banded("estimate", value, spread, colour)
    series = (
        Series("measured", at, (Line("measured", seen, GREY, 2.5),), spiky=True),
        Series("state", signals.time_secs, drawn, spiky=len(signals) > POINTS),
    )
    return Panel(name, f"{_words(name)} [{unit}]", series, limits(measured, value))


def _input(analysis: Analysis, name: str) -> Panel:
    unit = CATALOGUE[name].display_unit
    values = analysis.signals[name] * factor(CATALOGUE[name].unit, unit)
    line = Line(name, values, GREEN, 1.5)
    series = Series("measured", analysis.signals.time_secs, (line,), spiky=True)
    title = name if name == unit else f"{name} [{unit}]"
    return Panel(name, title, (series,), limits(values))


def _disturbance(analysis: Analysis, name: str, unit: str, values: FloatArray, std: float) -> Panel:
    at, found = analysis.signals.time_secs, analysis.disturbance
    settled = at >= (found.yaw_settling_secs if name == "yaw" else found.surge_settling_secs)
    kept = values[settled] if settled.mean() > 0.5 else values
    guides = _guides(analysis, "±2σ of sensor noise", GUIDE * std)
    line = Line("disturbance", values, RED, 1.5)
    return Panel(
        f"disturbance_{name}",
        f"{name} disturbance [{unit}]",
        (guides, Series("observed", at, (line,))),
        limits(kept, np.array([-1.5, 1.5]) * GUIDE * std),
    )


def _residual(analysis: Analysis, output: int, colour: Colour) -> Panel:
    estimates, signals = analysis.estimates, analysis.signals
    name = analysis.residuals[output].name
    values = estimates.innovations[:, output] / estimates.innovation_stds[:, output]
    at, seen = without_blanks(signals.time_secs, values, signals.dt_secs)
    line = Line("residual", seen, colour)
    return Panel(
        f"residual_{name}",
        f"{_words(name)} residual [expected std]",
        (Series("normalised", at, (line,), spiky=True), _guides(analysis, "±2", GUIDE, "over")),
        limits(values, np.array([-2.0, 2.0]) * GUIDE),
    )


def _coefficient(
    found: Identification, name: str, model: float, span: FloatArray, colour: Colour
) -> Panel | None:
    history, whole = found.history, found.coefficients[name]
    column = history.names.index(name)
    known = np.isfinite(history.values[:, column])
    if not known.any():
        return None
    size = max(abs(model), float(np.median(np.abs(history.values[known, column]))))
    prefix, scale = _thousands(size)
    value = history.values[:, column] * scale
    spread = GUIDE * history.stds[:, column] * scale
    result, doubt = whole.value * scale, GUIDE * whole.std * scale
    axis = _coefficient_limits(value[known], spread[known], result, doubt, model * scale)
    # a window less sure than the panel is high says nothing and would be a vertical stroke
    value = np.where(spread > axis[1] - axis[0], np.nan, value)
    at = history.time_secs
    if len(at) == 1:  # a point has no length: the one window is the whole trial
        at, value, spread = span, np.repeat(value, 2), np.repeat(spread, 2)
    reference = Line("model", np.full(2, model * scale), GREY, 1.5)
    series = (
        Series("model", span, (reference,)),
        Series("window", at, _banded("window", value, spread, colour)),
    )
    said = _rounded(result, doubt) if whole.determined else "not determined"
    title = f"{name} {said} [{prefix}{whole.unit}]"
    return Panel(f"coefficient_{name}", title, series, axis)


def _coefficient_limits(
    value: FloatArray, spread: FloatArray, result: float, doubt: float, model: float
) -> tuple[float, float]:
    """An axis about the whole trial's result, made for the surer half of the windows."""
    surer = ~(spread > np.nanmedian(spread)) if np.isfinite(spread).any() else np.isfinite(value)
    centre = result if np.isfinite(result) else float(np.median(value[surer]))
    reach = 2 * float(np.median(np.abs(value[surer] - centre)))
    reach = np.nanmax([reach + np.nanmax([np.median(spread[surer]), 0.0]), 2 * doubt])
    marks = [centre - reach, centre + reach]
    if abs(model - centre) < 10 * reach:
        marks.append(model)
    return limits(np.array(marks))


def _banded(
    name: str, values: FloatArray, spread: FloatArray, colour: Colour
) -> tuple[Line, Line, Line]:
    """A line over two thin, lighter ones at plus and minus its spread."""
    pale = (*colour[:3], 120)
    band = (Line("±2σ", values + sign * spread, pale) for sign in (1, -1))
    return (*band, Line(name, values, colour, 1.5))  # type: ignore[return-value]


def _guides(analysis: Analysis, name: str, bound: float, series: str = "bounds") -> Series:
    lines = (Line(name, np.full(2, sign * bound), GREY) for sign in (1, -1))
    return Series(series, _ends(analysis), tuple(lines))


def _ends(analysis: Analysis) -> FloatArray:
    return analysis.signals.time_secs[[0, -1]]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _thousands(size: float) -> tuple[str, float]:
    """A power of a thousand for a unit, in words, and the factor that brings `size` near 1."""
    exponent = 3 * floor(log10(size) / 3) if 0 < size < np.inf else 0
    digits = str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return (f"10{digits} " if exponent else ""), 10.0**-exponent


def _rounded(value: float, doubt: float) -> str:
    """A result to two digits of its doubt."""
    if not (np.isfinite(value) and 0 < doubt < np.inf):
        return "not determined"
    digits = min(max(1 - floor(log10(doubt)), 0), 9)
    return f"{value:.{digits}f} ± {doubt:.{digits}f}"


def limits(*courses: FloatArray) -> tuple[float, float]:
    """An axis for courses of any shape, on which a few wild values do not squeeze the rest."""
    values = np.concatenate([course[np.isfinite(course)] for course in courses])
    if not len(values):
        return -1.0, 1.0
    low, high = np.quantile(values, (0.01, 0.99))
    reach = (high - low) / 2
    low, high = max(values.min(), low - reach), min(values.max(), high + reach)
    pad = max(0.03 * (high - low), 0.01 * max(abs(low), abs(high)), 1e-9)
    return float(low - pad), float(high + pad)


def without_blanks(
    time_secs: FloatArray, values: FloatArray, dt_secs: float
) -> tuple[FloatArray, FloatArray]:
    """The measured samples, and one NaN in each gap.

    A slow sensor leaves most instants of the clock blank; its samples shall be joined by a line
    all the same, but not across a gap.
    """
    known = np.isfinite(values)
    at = np.flatnonzero(known)
    longest = longest_step_secs(usual_interval_secs(values, dt_secs)) / dt_secs
    kept = known.copy()
    kept[at[:-1][np.diff(at) > longest] + 1] = True
    return time_secs[kept], values[kept]


def decimated(series: Series, points: int = POINTS) -> Series:
    """The series with about so many points: of each line the extremes in each of equal buckets.

    What is kept stands at its own time. The first point of every gap is kept, and both ends.
    """
    count = len(series.time_secs)
    if count <= points:
        return series
    buckets = max(1, points // (2 * len(series.lines)))
    kept = np.zeros(count, bool)
    kept[[0, -1]] = True
    for line in series.lines:
        for rows in _extremes(line.values, -(-count // buckets)):
            kept[rows] = True
        blank = np.isnan(line.values)
        kept[1:] |= blank[1:] & ~blank[:-1]
    lines = tuple(replace(line, values=line.values[kept]) for line in series.lines)
    return replace(series, time_secs=series.time_secs[kept], lines=lines)


def _extremes(values: FloatArray, size: int) -> Iterator[FloatArray]:
    """The rows of the least and of the greatest value in each `size` rows."""
    padded = np.concatenate((values, np.full(-len(values) % size, np.nan))).reshape(-1, size)
    first = size * np.arange(len(padded))
    for sign in (1, -1):
        rows = first + np.argmin(np.where(np.isnan(padded), np.inf, sign * padded), axis=1)
        yield rows[rows < len(values)]
