"""Noise model of the residuals of a fit: white, proportional to the output, and slow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

MIN_WHITE_SHARE = 0.02  # of the rms noise: the least standard deviation of any sample
FINE_WHITE_SHARE = 0.005  # the same in the last reweighting, where no slow noise remains
SLOW_STD_ERRORS = 4.0  # a smaller mean autocovariance is not significant
AUTOCOVARIANCE_LAGS = 5  # over which it is averaged
SPIKE_RATIO = 10.0  # of a squared difference to its variance, at which it is capped
VARIANCE_ITERATIONS = 12


@dataclass(frozen=True)
class ResidualNoise:
    """Noise of one output: the variance of a sample is ``white^2 + (relative y)^2 + slow^2``.

    Attributes
    ----------
    white
        Standard deviation of the white part, in the output's SI unit.
    relative
        Standard deviation of a white part in proportion to the output y, as a share of y.
    slow
        Standard deviation of the slow part, in the output's SI unit.
    slow_secs
        How long the slow part persists, s: all samples within this time count as one.
    """

    white: float
    relative: float
    slow: float
    slow_secs: float

    def stds(self, level: FloatArray, interval_secs: float) -> tuple[FloatArray, FloatArray]:
        """Compute the standard deviations of samples.

        Parameters
        ----------
        level
            (n,) the predicted output.
        interval_secs
            Between samples, s.

        Returns
        -------
        effective, typical
            (n,) each, as in `ResidualStd`. The effective variance holds the slow part as many
            times as there are samples in `slow_secs`.

        Examples
        --------
        >>> import numpy as np
        >>> noise = ResidualNoise(white=0.0, relative=0.0, slow=0.1, slow_secs=4.0)
        >>> [float(each[0].round(6)) for each in noise.stds(np.zeros(1), interval_secs=1.0)]
        [0.2, 0.1]
        """
        # velocities over ground have no level between blocks of fixes, but an absolute noise only
        white = self.white**2 + (self.relative * np.nan_to_num(level)) ** 2
        samples = max(self.slow_secs / interval_secs, 1.0)
        return np.sqrt(white + self.slow**2 * samples), np.sqrt(white + self.slow**2)


@dataclass(frozen=True, eq=False)
class OutputResiduals:
    """The residuals of one output of one segment, at the samples that were measured.

    Attributes
    ----------
    residual
        (k,) measured minus predicted.
    level
        (k,) the predicted output.
    interval_secs
        The median interval between samples, s.
    """

    residual: FloatArray
    level: FloatArray
    interval_secs: float

    @classmethod
    def of(cls, residual: FloatArray, level: FloatArray, dt: float) -> "OutputResiduals":
        """Select the measured samples of a column on a clock, (n,), NaN where not measured."""
        at = np.flatnonzero(np.isfinite(residual))
        return cls(residual[at], level[at], interval_secs(residual, dt))


def interval_secs(values: FloatArray, dt: float) -> float:
    """Return the median interval, s, between the finite values of a column on a clock."""
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    return float(np.median(steps)) * dt if len(steps) else dt


def fit_residual_noise(
    segments: Sequence[OutputResiduals],
    *,
    proportional: bool,
    least: float,
    share: float = MIN_WHITE_SHARE,
) -> ResidualNoise:
    """Estimate the noise of one output from its residuals in all segments.

    The white parts are estimated from the differences of neighbouring residuals, the slow part from
    the autocovariance.

    Parameters
    ----------
    segments
        The residuals of each segment.
    proportional
        Whether to estimate a part in proportion to the output.
    least
        Lower limit of the white standard deviation: no instrument is more precise.
    share
        The same limit as a share of the rms white noise.

    Returns
    -------
    ResidualNoise
        The noise.
    """
    white, relative = _white(segments, proportional=proportional)
    levels = np.concatenate([each.level for each in segments])
    rms = float(np.sqrt(np.mean(white**2 + (relative * levels) ** 2))) if len(levels) else 0.0
    white = max(white, share * rms, least)
    stds = [np.sqrt(white**2 + (relative * each.level) ** 2) for each in segments]
    slow, secs = _slow(segments, stds)
    return ResidualNoise(white, relative, slow, secs)


def _white(segments: Sequence[OutputResiduals], *, proportional: bool) -> tuple[float, float]:
    """Estimate the constant and the proportional white noise from differences of neighbours.

    Half the squared difference has the expectation ``white^2 + (relative y)^2``. The line through
    them is fitted by maximum likelihood, as iterated weighted least squares.
    """
    steps = np.concatenate([np.diff(each.residual) for each in segments])
    pairs = [(each.level[1:] ** 2 + each.level[:-1] ** 2) / 2 for each in segments]
    squares = np.concatenate(pairs)
    valid = np.isfinite(squares)
    variances, squares = steps[valid] ** 2 / 2, squares[valid]
    if not len(variances):
        return 0.0, 0.0
    fitted = np.full(len(variances), max(np.median(variances) * 2, 1e-300))
    constant, slope = float(np.mean(variances)), 0.0
    for _ in range(VARIANCE_ITERATIONS):
        capped, weight = np.minimum(variances, SPIKE_RATIO * fitted), fitted**-2.0
        constant, slope = _line(squares if proportional else None, capped, weight)
        fitted = np.maximum(constant + slope * squares, 1e-6 * np.mean(fitted))
    return float(np.sqrt(constant)), float(np.sqrt(slope))


def _line(x: FloatArray | None, y: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """Return intercept and slope of a weighted line, neither negative; slope 0 without x."""
    total, mean_y = float(np.sum(weight)), float(np.average(y, weights=weight))
    if x is None:
        return mean_y, 0.0
    mean_x = float(np.average(x, weights=weight))
    variance = float(np.sum(weight * (x - mean_x) ** 2))
    slope = float(np.sum(weight * (x - mean_x) * (y - mean_y))) / variance if variance > 0 else 0.0
    if slope <= 0 or total == 0:
        return mean_y, 0.0
    if mean_y - slope * mean_x < 0:
        return 0.0, float(np.sum(weight * x * y) / np.sum(weight * x * x))
    return mean_y - slope * mean_x, slope


def _slow(segments: Sequence[OutputResiduals], stds: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the standard deviation of the slow part and how long it persists, s.

    Its variance is the mean autocovariance at the first lags; it persists for twice the lag at
    which the autocovariance has fallen to 1/e.
    """
    pairs = [
        (each, std) for each, std in zip(segments, stds, strict=True) if len(each.residual) > 1
    ]
    segments, stds = [each for each, _ in pairs], [std for _, std in pairs]
    step = min((each.interval_secs for each in segments), default=1.0)
    longest = max((len(each.residual) * each.interval_secs for each in segments), default=0.0) / 4
    count = min(AUTOCOVARIANCE_LAGS, int(longest / step + 1e-9))
    first = [_autocovariance(segments, stds, lag * step) for lag in range(1, count + 1)]
    if not first:
        return 0.0, step
    variance = float(np.mean([c for c, _ in first]))
    error = float(np.sqrt(np.mean([e**2 for _, e in first]) / len(first)))
    if variance < SLOW_STD_ERRORS * error:
        return 0.0, step
    lag = step
    while lag < longest and _autocovariance(segments, stds, lag)[0] > variance / np.e:
        lag = max(lag + step, lag * 1.1)
    return float(np.sqrt(variance)), 2.0 * lag


def _autocovariance(
    segments: Sequence[OutputResiduals], stds: Sequence[FloatArray], lag_secs: float
) -> tuple[float, float]:
    """Return the weighted autocovariance at a lag and its standard error under white noise."""
    total = weights = 0.0
    for each, std in zip(segments, stds, strict=True):
        lag = round(lag_secs / each.interval_secs)
        if lag < 1:  # its samples are further apart than the lag
            continue
        weight = 1 / (std[lag:] * std[:-lag]) ** 2
        total += float(np.sum(weight * each.residual[lag:] * each.residual[:-lag]))
        weights += float(np.sum(weight))
    return (total / weights, weights**-0.5) if weights > 0 else (0.0, 1.0)
