"""Panels of an identified ship: runs, residuals and parameter histories."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from analysis.identification.comparison.history import ParameterHistory, total_duration_secs
from analysis.identification.comparison.paper_scheme import PAPER_METHOD
from analysis.identification.comparison.parameter_ekf import EKF_METHOD
from analysis.identification.comparison.windows import WINDOW_METHOD
from analysis.identification.fit.segment import Segment
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.validation import Validation
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import PAPER_INPUTS
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, conversion_factor

from .decimation import decimated
from .panels import Panel, limits, rounded, thousands
from .series import (
    BLUE,
    CYAN,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Colour,
    Line,
    Series,
    banded,
    measured_line,
)
from .track_chart import TrackChart, make_chart

COLOURS = dict(zip(MODEL_OUTPUTS, (BLUE, ORANGE, CYAN, GREEN), strict=True))
METHODS = {  # by method: the entity's name, in whose alphabetical order they are drawn; the colour
    PAPER_METHOD: ("a_paper", RED),
    EKF_METHOD: ("kalman", BLUE),
    WINDOW_METHOD: ("windows", GREEN),
}
PRIOR_ALPHA = 70  # of 255: opacity of an estimate that is mostly prior
MAX_LAG_SECS, MAX_LAG_SHARE = 300.0, 0.25  # of an autocorrelation; the share is of the run
BAND_SIGMAS = 2.0  # standard deviations of the bounds drawn


@dataclass(frozen=True, eq=False)
class RunSheet:
    """Panels of one segment, measured and simulated.

    Attributes
    ----------
    title
        ``fitted:`` or ``validation:``, and the log's name.
    start_ns
        The segment's start, ns since 1970.
    duration_secs
        Its duration.
    outputs, residuals, inputs
        A panel for each channel.
    correlation
        The autocorrelations of the residuals over the lag.
    lag_secs
        The largest lag.
    track
        The measured and the simulated track; None for a run that was fitted.
    """

    title: str
    start_ns: int
    duration_secs: float
    outputs: tuple[Panel, ...]
    residuals: tuple[Panel, ...]
    inputs: tuple[Panel, ...]
    correlation: Panel
    lag_secs: float
    track: TrackChart | None


def run_sheets(ship: IdentifiedShip) -> Iterator[RunSheet]:
    """Yield a sheet of each segment that was fitted, then of each that was predicted."""
    fit, problem = ship.fit, ship.fit.problem
    for i, segment in enumerate(problem.segments):
        simulated = np.full((len(segment), len(MODEL_OUTPUTS)), np.nan)
        simulated[:, problem.columns] = problem.predicted(fit.minimum.unknowns, i)
        yield _sheet(f"run_{i + 1}", f"fitted: {segment.name}", segment, simulated, ship, None)
    length = ship.vessel.length if ship.vessel else None
    for k, each in enumerate(ship.validations):
        origin, title = f"validation_{k + 1}", f"validation: {each.segment.name}"
        track = _track(each, length)
        yield _sheet(origin, title, each.segment, each.simulated, ship, track)


def _sheet(
    origin: str, title: str, segment: Segment, simulated: FloatArray, ship: IdentifiedShip,
    track: TrackChart | None,
) -> RunSheet:  # fmt: skip
    shown = [
        name
        for i, name in enumerate(MODEL_OUTPUTS)
        if segment.has(name) and np.isfinite(simulated[:, i]).any()
    ]
    fitted = [name for name in ship.fit.problem.outputs if name in shown]
    normalised = {name: _normalised_residual(segment, simulated, ship, name) for name in fitted}
    duration = (len(segment) - 1) * segment.dt_secs
    lag_secs = min(MAX_LAG_SECS, MAX_LAG_SHARE * duration)
    return RunSheet(
        title=title,
        start_ns=segment.signals.start_ns,
        duration_secs=duration,
        outputs=tuple(_output_panel(origin, segment, simulated, name) for name in shown),
        residuals=tuple(_residual_panel(origin, segment, *each) for each in normalised.items()),
        inputs=tuple(_input_panel(origin, segment, name) for name in PAPER_INPUTS),
        correlation=_correlation_panel(origin, segment, normalised, lag_secs),
        lag_secs=lag_secs,
        track=track,
    )


def _output_panel(origin: str, segment: Segment, simulated: FloatArray, name: str) -> Panel:
    column, unit, scale = MODEL_OUTPUTS.index(name), *_display_unit(name)
    at, values = _samples(segment, segment.measured[:, column] * scale)
    measured = Series("measured", at, (Line("measured", values, GREY, 2.5),), spiky=True)
    line = Line("simulated", simulated[:, column] * scale, COLOURS[name], 1.5)
    drawn = Series("simulated", segment.signals.time_secs, (line,))
    title = f"{name.replace('_', ' ')} [{unit}]"
    both = (decimated(measured), decimated(drawn))
    return Panel(f"{origin}/{name}", title, both, limits(values, line.values))


def _samples(segment: Segment, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times and values of the samples, (k,) each, in the time of the whole log."""
    at, samples = measured_line(values, segment.dt_secs)
    return at + segment.signals.time_secs[0], samples


def _display_unit(name: str) -> tuple[str, float]:
    entry = CATALOGUE[name]
    return entry.display_unit, conversion_factor(entry.unit, entry.display_unit)


def _input_panel(origin: str, segment: Segment, name: str) -> Panel:
    unit, scale = _display_unit(name)
    values = segment.signals[name] * scale
    line = Line(name, values, GREEN, 1.5)
    drawn = Series("input", segment.signals.time_secs, (line,), spiky=True)
    title = name if name == unit else f"{name} [{unit}]"
    return Panel(f"{origin}/{name}", title, (decimated(drawn),), limits(values))


def _normalised_residual(
    segment: Segment, simulated: FloatArray, ship: IdentifiedShip, name: str
) -> FloatArray:
    """Return measured minus simulated over the standard deviation of the fit's residual, (n,)."""
    column = MODEL_OUTPUTS.index(name)
    noise = ship.fit.noises[ship.fit.problem.outputs.index(name)]
    _, std = noise.stds(simulated[:, column], segment.dt_secs)
    return np.asarray((segment.measured[:, column] - simulated[:, column]) / std)


def _residual_panel(origin: str, segment: Segment, name: str, normalised: FloatArray) -> Panel:
    at, values = _samples(segment, normalised)
    drawn = Series("normalised", at, (Line("residual", values, COLOURS[name]),), spiky=True)
    bounds = _bounds(segment.signals.time_secs[[0, -1]], BAND_SIGMAS)
    axis = limits(values, np.array([-2.0, 2.0]) * BAND_SIGMAS)
    title = f"{name.replace('_', ' ')} residual [standard deviations]"
    return Panel(f"{origin}/residual_{name}", title, (decimated(drawn), bounds), axis)


def _bounds(ends: FloatArray, bound: float) -> Series:
    """Return two lines at plus and minus a bound, from one end to the other."""
    lines = (Line(f"±{bound:.2g}", np.full(2, sign * bound), GREY) for sign in (1, -1))
    return Series("bounds", ends, tuple(lines))


def _correlation_panel(
    origin: str, segment: Segment, normalised: dict[str, FloatArray], lag_secs: float
) -> Panel:
    """Return the autocorrelations, with the bounds that a white residual's mostly stays within."""
    lags = np.arange(1, max(2, round(lag_secs / segment.dt_secs)))
    series: list[Series] = []
    counts: list[int] = []
    for name, values in normalised.items():
        correlation, count = autocorrelation(values, int(lags[-1]))
        line = Line(name.replace("_", " "), correlation[1:], COLOURS[name], 1.5)
        series.append(decimated(Series(name, lags * segment.dt_secs, (line,))))
        counts.append(count)
    bound = BAND_SIGMAS / np.sqrt(max(min(counts, default=1), 1))
    series.append(_bounds(np.array([0.0, lag_secs]), bound))
    axis = limits(*(line.values for each in series for line in each.lines), np.array([-0.2, 1.0]))
    title = "autocorrelation of the residuals over the lag [s]; grey: ±2σ if white"
    return Panel(f"{origin}/correlation", title, tuple(series), axis)


def autocorrelation(values: FloatArray, max_lag: int) -> tuple[FloatArray, int]:
    """Compute the autocorrelation of values with gaps, about zero and not about their mean.

    A residual with a constant error is thereby shown to be correlated.

    Parameters
    ----------
    values
        (n,); NaN in the gaps.
    max_lag
        The largest lag, in samples.

    Returns
    -------
    correlation
        (max_lag + 1,) by the pairs of which both values are finite; NaN at a lag without any.
    count
        The number of finite values.

    Examples
    --------
    >>> correlation, count = autocorrelation(np.array([1.0, -1.0, 1.0, -1.0]), 2)
    >>> correlation.round(6), count
    (array([ 1., -1.,  1.]), 4)
    """
    finite = np.isfinite(values)
    length = 1 << int(len(values) + max_lag).bit_length()
    sums, pairs = (
        np.fft.irfft(np.abs(np.fft.rfft(x, length)) ** 2, length)[: max_lag + 1]
        for x in (np.where(finite, values, 0.0), finite.astype(float))
    )
    pairs = np.round(pairs)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(pairs > 0, sums / pairs, np.nan)
        return mean / mean[0], int(finite.sum())


def _track(validation: Validation, length: float | None) -> TrackChart | None:
    segment = validation.segment
    heading = None
    if segment.has("heading"):
        heading = segment.measured[:, MODEL_OUTPUTS.index("heading")]
        at = np.flatnonzero(np.isfinite(heading))
        heading = np.interp(np.arange(len(heading)), at, heading[at])
    return make_chart(
        "track, north up: grey measured, blue simulated", validation.measured_track,
        segment.signals.time_secs, heading, length, validation.track,
    )  # fmt: skip


def parameter_panels(ship: IdentifiedShip) -> list[Panel]:
    """Return a panel for each free parameter: its value, its interval, and all its histories."""
    end = total_duration_secs(ship.fit.problem.segments)
    return [_parameter_panel(ship, i, end) for i in range(len(ship.uncertainty.names))]


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
        lines.append(Line(f"{history.method}, mostly prior", prior, faint))
        drawn = np.where(mostly_prior, np.nan, drawn)
        if len(history.values) == 1:
            # a window whose band is higher than the panel carries no information
            drawn = np.where(BAND_SIGMAS * stds > limit[1] / 3, np.nan, drawn)
            lines += banded(history.method, drawn, BAND_SIGMAS * stds * scale, colour)
        else:
            lines.append(Line(history.method, drawn, colour, 1.5))
    return decimated(Series(entity, history.time_secs, tuple(lines)))
