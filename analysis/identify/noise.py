"""What is off in a fit: how large, how large in proportion, and how long it stays off."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

from .least_squares import Spread

LEAST_SHARE = 0.05  # of the usual noise: no sample is believed to have less
SURE = 4.0  # standard errors: a smaller autocovariance is none
LAGS = 5  # of which it is taken


@dataclass(frozen=True)
class Noise:
    """Of one output: white noise, some of it in proportion to the output, and a slow part.

    A sample's variance is `white`^2 + (`relative` y)^2 + `slow`^2; the slow part stays off for
    `slow_count` samples, so that so many of them count as one.
    """

    white: float
    relative: float
    slow: float
    slow_count: float

    def spread(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The effective and the usual std of samples of that level, (n,) each."""
        white = self.white**2 + (self.relative * level) ** 2
        effective = white + self.slow**2 * max(self.slow_count, 1.0)
        return np.sqrt(effective), np.sqrt(white + self.slow**2)


def spreads_of(noises: Sequence[Noise], levels: Sequence[FloatArray]) -> list[Spread]:
    """Of each trial, whose predicted outputs are `levels`, (n, c) each."""
    found = []
    for level in levels:
        pairs = [noise.spread(level[:, c]) for c, noise in enumerate(noises)]
        found.append(
            Spread(np.column_stack([p[0] for p in pairs]), np.column_stack([p[1] for p in pairs]))
        )
    return found


def noise_of(
    residuals: Sequence[FloatArray],
    levels: Sequence[FloatArray],
    *,
    proportional: bool,
    least: float,
) -> Noise:
    """The noise of one output, of its residuals over each trial and its levels, (n,) each.

    What changes from sample to sample is white; what stays is slow. `least` is a std below which
    no instrument is believed.
    """
    white, relative = _white(residuals, levels, proportional=proportional)
    everywhere = np.concatenate(
        [level[np.isfinite(r)] for r, level in zip(residuals, levels, strict=True)]
    )
    floor = max(
        LEAST_SHARE * float(np.sqrt(np.mean(white**2 + (relative * everywhere) ** 2))), least
    )
    white = max(white, floor)
    stds = [np.sqrt(white**2 + (relative * level) ** 2) for level in levels]
    slow, count = _slow(residuals, stds)
    return Noise(white, relative, slow, count)


def _white(
    residuals: Sequence[FloatArray], levels: Sequence[FloatArray], *, proportional: bool
) -> tuple[float, float]:
    """Of the differences of neighbours: the noise, and the noise in proportion.

    By likelihood, the variances being sums of squares: iterated least squares, never negative.
    """
    steps = np.concatenate([np.diff(r) for r in residuals])
    squares = np.concatenate([(y[1:] ** 2 + y[:-1] ** 2) / 2 for y in levels])
    known = np.isfinite(steps) & np.isfinite(squares)
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


def _slow(residuals: Sequence[FloatArray], stds: Sequence[FloatArray]) -> tuple[float, float]:
    """The std of the part that stays, and for how many samples it does."""
    longest = max(len(r) for r in residuals) // 4
    first = [_autocovariance(residuals, stds, lag) for lag in range(1, min(LAGS, longest) + 1)]
    if not first:
        return 0.0, 1.0
    variance = float(np.mean([c for c, _ in first]))
    error = float(np.sqrt(np.mean([e**2 for _, e in first]) / len(first)))
    if variance < SURE * error:
        return 0.0, 1.0
    lag = 1
    while lag < longest and _autocovariance(residuals, stds, lag)[0] > variance / np.e:
        lag = max(lag + 1, int(lag * 1.1))
    return float(np.sqrt(variance)), 2.0 * lag


def _autocovariance(
    residuals: Sequence[FloatArray], stds: Sequence[FloatArray], lag: int
) -> tuple[float, float]:
    """At a lag, those sure of themselves counting for more; and its error if there is none."""
    total = weights = 0.0
    for residual, std in zip(residuals, stds, strict=True):
        weight = 1 / (std[lag:] * std[:-lag]) ** 2
        product = residual[lag:] * residual[:-lag]
        known = np.isfinite(product)
        total += float(np.sum((weight * product)[known]))
        weights += float(np.sum(weight[known]))
    return (total / weights, weights**-0.5) if weights > 0 else (0.0, 1.0)
