"""What is off in a fit: how large, how large in proportion, and how long it stays off."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

LEAST_SHARE = 0.02  # of the usual noise: no sample is believed to have less
FINEST_SHARE = 0.005  # the same when all that stays off was found
SURE = 4.0  # standard errors: a smaller autocovariance is none
LAGS = 5  # of which it is taken


@dataclass(frozen=True)
class ResidualNoise:
    """Of one output: white noise, some of it in proportion to the output, and a slow part.

    A sample's variance is `white`^2 + (`relative` y)^2 + `slow`^2; the slow part stays off for
    `slow_secs`, so that all the samples in so long count as one.
    """

    white: float
    relative: float
    slow: float
    slow_secs: float

    def stds(self, level: FloatArray, interval_secs: float) -> tuple[FloatArray, FloatArray]:
        """The effective and the usual std of samples of that level, (n,) each, so far apart."""
        white = self.white**2 + (self.relative * level) ** 2
        together = max(self.slow_secs / interval_secs, 1.0)
        return np.sqrt(white + self.slow**2 * together), np.sqrt(white + self.slow**2)


@dataclass(frozen=True, eq=False)
class OutputResiduals:
    """What a fit leaves of one output of a segment, sample by sample as they were measured."""

    off: FloatArray  # (k,)
    level: FloatArray  # (k,) as predicted
    interval_secs: float  # from sample to sample, as a rule

    @classmethod
    def of(cls, residual: FloatArray, level: FloatArray, dt: float) -> "OutputResiduals":
        """Of residuals on a clock, (n,), NaN where nothing was measured."""
        at = np.flatnonzero(np.isfinite(residual))
        return cls(residual[at], level[at], interval_secs(residual, dt))


def interval_secs(values: FloatArray, dt: float) -> float:
    """How far apart the known values of a column on a clock are as a rule."""
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    return float(np.median(steps)) * dt if len(steps) else dt


def fit_residual_noise(
    every: Sequence[OutputResiduals],
    *,
    proportional: bool,
    least: float,
    share: float = LEAST_SHARE,
) -> ResidualNoise:
    """The noise of one output, of what is left of it in each segment.

    What changes from sample to sample is white; what stays is slow. `least` is a std below which
    no instrument is believed, nor is any sample to have less than a `share` of the usual.
    """
    white, relative = _white(every, proportional=proportional)
    levels = np.concatenate([left.level for left in every])
    usual = float(np.sqrt(np.mean(white**2 + (relative * levels) ** 2))) if len(levels) else 0.0
    white = max(white, share * usual, least)
    stds = [np.sqrt(white**2 + (relative * left.level) ** 2) for left in every]
    slow, secs = _slow(every, stds)
    return ResidualNoise(white, relative, slow, secs)


def _white(every: Sequence[OutputResiduals], *, proportional: bool) -> tuple[float, float]:
    """Of the differences of neighbours: the noise, and the noise in proportion.

    By likelihood, the variances being sums of squares: iterated least squares, never negative.
    """
    steps = np.concatenate([np.diff(left.off) for left in every])
    pairs = [(left.level[1:] ** 2 + left.level[:-1] ** 2) / 2 for left in every]
    squares = np.concatenate(pairs)
    known = np.isfinite(squares)
    variances, squares = steps[known] ** 2 / 2, squares[known]
    if not len(variances):
        return 0.0, 0.0
    fitted = np.full(len(variances), max(np.median(variances) * 2, 1e-300))
    constant, slope = float(np.mean(variances)), 0.0
    for _ in range(12):
        # beyond ten times what is usual it is a spike
        capped, weight = np.minimum(variances, 10 * fitted), fitted**-2.0
        constant, slope = _line(squares if proportional else None, capped, weight)
        fitted = np.maximum(constant + slope * squares, 1e-6 * np.mean(fitted))
    return float(np.sqrt(constant)), float(np.sqrt(slope))


def _line(x: FloatArray | None, y: FloatArray, weight: FloatArray) -> tuple[float, float]:
    """The weighted line through points, neither its height at zero nor its slope negative."""
    total, mean_y = float(np.sum(weight)), float(np.average(y, weights=weight))
    if x is None:
        return mean_y, 0.0
    mean_x = float(np.average(x, weights=weight))
    spread = float(np.sum(weight * (x - mean_x) ** 2))
    slope = float(np.sum(weight * (x - mean_x) * (y - mean_y))) / spread if spread > 0 else 0.0
    if slope <= 0 or total == 0:
        return mean_y, 0.0
    if mean_y - slope * mean_x < 0:
        return 0.0, float(np.sum(weight * x * y) / np.sum(weight * x * x))
    return mean_y - slope * mean_x, slope


def _slow(every: Sequence[OutputResiduals], stds: Sequence[FloatArray]) -> tuple[float, float]:
    """The std of the part that stays, and for how many seconds it does."""
    pairs = [(left, std) for left, std in zip(every, stds, strict=True) if len(left.off) > 1]
    every, stds = [left for left, _ in pairs], [std for _, std in pairs]
    step = min((left.interval_secs for left in every), default=1.0)
    longest = max((len(left.off) * left.interval_secs for left in every), default=0.0) / 4
    count = min(LAGS, int(longest / step + 1e-9))
    first = [_autocovariance(every, stds, lag * step) for lag in range(1, count + 1)]
    if not first:
        return 0.0, step
    variance = float(np.mean([c for c, _ in first]))
    error = float(np.sqrt(np.mean([e**2 for _, e in first]) / len(first)))
    if variance < SURE * error:
        return 0.0, step
    lag = step
    while lag < longest and _autocovariance(every, stds, lag)[0] > variance / np.e:
        lag = max(lag + step, lag * 1.1)
    return float(np.sqrt(variance)), 2.0 * lag


def _autocovariance(
    every: Sequence[OutputResiduals], stds: Sequence[FloatArray], lag_secs: float
) -> tuple[float, float]:
    """At a lag, those sure of themselves counting for more; and its error if there is none."""
    total = weights = 0.0
    for left, std in zip(every, stds, strict=True):
        lag = round(lag_secs / left.interval_secs)
        if lag < 1:  # its samples are further apart
            continue
        weight = 1 / (std[lag:] * std[:-lag]) ** 2
        total += float(np.sum(weight * left.off[lag:] * left.off[:-lag]))
        weights += float(np.sum(weight))
    return (total / weights, weights**-0.5) if weights > 0 else (0.0, 1.0)
