"""Panels of an identified ship's parameters: intervals, and histories by each method."""

from dataclasses import replace

import numpy as np

from analysis.identification.comparison.history import ParameterHistory, total_duration_secs
from analysis.identification.comparison.paper_scheme import PAPER_METHOD
from analysis.identification.comparison.parameter_ekf import EKF_METHOD
from analysis.identification.comparison.windows import WINDOW_METHOD
from analysis.identification.identified_ship import IdentifiedShip

from .decimation import decimated
from .panels import Panel, limits, rounded, thousands
from .series import (
    BLUE,
    GREEN,
    GREY,
    RED,
    Colour,
    Line,
    Series,
    banded,
)

METHODS = {  # by method: the entity's name, in whose alphabetical order they are drawn; the colour
    PAPER_METHOD: ("a_paper", RED),
    EKF_METHOD: ("kalman", BLUE),
    WINDOW_METHOD: ("windows", GREEN),
}
PRIOR_ALPHA = 70  # of 255: opacity of an estimate that is mostly prior
BAND_SIGMAS = 2.0  # standard deviations of the bounds drawn


def parameter_panels(ship: IdentifiedShip) -> list[Panel]:
    """Return a panel for each free parameter: its value, its interval, and all its histories."""
    end = total_duration_secs(ship.fit.problem.segments)
    panels = [_parameter_panel(ship, i, end) for i in range(len(ship.uncertainty.names))]
    return [replace(panel, legend=panel is panels[0]) for panel in panels]  # it serves all


def _parameter_panel(ship: IdentifiedShip, i: int, end: float) -> Panel:
    estimates = ship.uncertainty
    name, value, half = estimates.names[i], estimates.values[i], 1.96 * estimates.std[i]
    identifiable = name not in estimates.unidentifiable
    histories = [each for each in ship.histories if name in each.names]
    priors = [each.priors[:, each.names.index(name)] for each in histories if len(each.priors) > 1]
    offset = max([float(np.ptp(each)) / 2 for each in priors], default=abs(value) / 3)
    unit = ship.model.parameter(name).unit
    prefix, scale = ("", 1.0) if unit == "1" else thousands(abs(value))
    interval = _interval(value * scale, half * scale, end, identifiable=identifiable)
    drawn = [_history(each, name, scale, (value, 3 * offset)) for each in histories]
    result = rounded(value * scale, half * scale) if identifiable else "not identifiable"
    title = f"{name} {result}" + ("" if unit == "1" else f" [{prefix}{unit}]")
    axis = limits(np.array([value - 1.4 * offset, value + 1.4 * offset]) * scale)
    return Panel(f"parameter_{name}", title, (interval, *drawn), axis)


def _interval(value: float, half: float, end: float, *, identifiable: bool) -> Series:
    """Return the value by output error with its interval; NaN where it is not identifiable."""
    level = np.full(2, value if identifiable else np.nan)
    lines = banded("output error", level, np.full(2, half), GREY)
    return Series("interval", np.array([0.0, end]), lines)


def _history(
    history: ParameterHistory, name: str, scale: float, limit: tuple[float, float]
) -> Series:
    """Return one method's estimates, faint where they are mostly prior.

    Those further than ``limit[1]`` from ``limit[0]`` are not drawn.
    """
    i, (entity, colour) = history.names.index(name), METHODS[history.method]
    mostly_prior = history.mostly_prior[:, i]
    faint: Colour = (*colour[:3], PRIOR_ALPHA)
    lines: list[Line] = []
    for values, stds in zip(history.values[:, :, i], history.stds[:, :, i], strict=True):
        drawn = np.where(np.abs(values - limit[0]) > limit[1], np.nan, values) * scale
        prior = np.where(mostly_prior, drawn, np.nan)
        drawn = np.where(mostly_prior, np.nan, drawn)
        if len(history.values) == 1:
            # a window whose band is higher than the panel carries no information
            drawn = np.where(BAND_SIGMAS * stds > limit[1] / 3, np.nan, drawn)
            lines += banded(history.method, drawn, BAND_SIGMAS * stds * scale, colour)
        else:
            lines.append(Line(history.method, drawn, colour, 1.5))
        lines.append(Line(history.method, prior, faint))  # the legend has the first of a name
    return decimated(Series(entity, history.time_secs, tuple(lines)))
