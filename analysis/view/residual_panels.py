"""Panels of residuals over their standard deviation, and of their autocorrelation."""

import numpy as np

from analysis.identification.fit.segment import Segment
from analysis.identification.identified_ship import IdentifiedShip
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .decimation import decimated
from .panels import Panel, limits, with_bounds, words
from .series import BLUE, CYAN, GREEN, GREY, ORANGE, Line, Series, measured_line

COLOURS = dict(zip(MODEL_OUTPUTS, (BLUE, ORANGE, CYAN, GREEN), strict=True))
MAX_LAG_SECS, MAX_LAG_SHARE = 300.0, 0.25  # of an autocorrelation; the share is of the run
BAND_SIGMAS = 2.0  # standard deviations of the bounds drawn


def residual_panels(
    ship: IdentifiedShip, origin: str, segment: Segment, predicted: FloatArray
) -> tuple[list[Panel], float]:
    """Return the panels of the residuals of a segment, and the largest lag, s.

    Parameters
    ----------
    ship
        The result of `analysis.identify`.
    origin
        The beginning of the paths of their entities.
    segment
        What was measured.
    predicted
        (n, 4) its prediction, in the order of `MODEL_OUTPUTS`, SI.

    Returns
    -------
    panels
        One for each output of `MODEL_OUTPUTS` that was fitted and is measured here; last, their
        autocorrelations over the lag.
    lag_secs
        The largest lag, s.
    """
    outputs = ship.fit.problem.outputs
    names = [name for name in outputs if name in MODEL_OUTPUTS and segment.has(name)]
    normalised = {name: _normalised(ship, segment, predicted, name) for name in names}
    normalised = {name: each for name, each in normalised.items() if np.isfinite(each).any()}
    lag_secs = min(MAX_LAG_SECS, MAX_LAG_SHARE * (len(segment) - 1) * segment.dt_secs)
    panels = [_residual_panel(origin, segment, *each) for each in normalised.items()]
    return [*panels, _correlation_panel(origin, segment, normalised, lag_secs)], lag_secs


def _normalised(
    ship: IdentifiedShip, segment: Segment, predicted: FloatArray, name: str
) -> FloatArray:
    """Return measured minus predicted, over the standard deviation of the fit's residual, (n,)."""
    column = MODEL_OUTPUTS.index(name)
    noise = ship.fit.noises[ship.fit.problem.outputs.index(name)]
    _, std = noise.stds(predicted[:, column], segment.dt_secs)
    return np.asarray((segment.measured[:, column] - predicted[:, column]) / std)


def _residual_panel(origin: str, segment: Segment, name: str, normalised: FloatArray) -> Panel:
    at, values = _samples(segment, normalised)
    drawn = Series("normalised", at, (Line("residual", values, COLOURS[name]),), spiky=True)
    bounds = _bounds(segment.signals.time_secs[[0, -1]], BAND_SIGMAS, "±2σ")
    axis = with_bounds(limits(values), BAND_SIGMAS)
    title = f"{segment.name}: {words(name)} residual / σ"
    return Panel(f"{origin}/residual_{name}", title, (decimated(drawn), bounds), axis, legend=True)


def _samples(segment: Segment, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times and values of the samples, (k,) each, in the time of the whole log."""
    at, samples = measured_line(values, segment.dt_secs)
    return at + segment.signals.time_secs[0], samples


def _bounds(ends: FloatArray, bound: float, name: str) -> Series:
    """Return two lines at plus and minus a bound, from one end to the other."""
    lines = (Line(name, np.full(2, sign * bound), GREY) for sign in (1, -1))
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
        known = np.isfinite(correlation[1:])  # a slow sensor has pairs at few lags
        line = Line(words(name), correlation[1:][known], COLOURS[name], 1.5)
        if known.any():
            series.append(decimated(Series(name, lags[known] * segment.dt_secs, (line,))))
        counts.append(count)
    bound = BAND_SIGMAS / np.sqrt(max(min(counts, default=1), 1))
    series.append(_bounds(np.array([0.0, lag_secs]), bound, "±2σ if white"))
    axis = limits(*(line.values for each in series for line in each.lines), np.array([-0.2, 1.0]))
    title = f"{segment.name}: autocorrelation"
    return Panel(f"{origin}/correlation", title, tuple(series), axis, legend=True)


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
