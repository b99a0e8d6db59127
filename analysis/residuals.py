"""Whether innovations are as large as the filter expects, and white."""

from dataclasses import dataclass
from math import isnan, sqrt

import numpy as np
from scipy.stats import chi2

from shiplog.types import FloatArray

LAGS = 20
FEWEST = 40  # measurements, or pairs of them at a lag, to tell anything
SIGNIFICANCE = 0.01

# The variance of the normalised innovation squared, times the number of innovations: 2 is that of
# a mean of squared Gaussians. An estimate of the variance by third differences has 2 (1 + 2 (15^2
# + 6^2 + 1) / 20^2) = 4.62, and their ratio, the former being efficient, the difference.
STATED_NOISE = 2.0
MEASURED_NOISE = 2 * (1 + 2 * (15**2 + 6**2 + 1) / 20**2) - 2.0


@dataclass(frozen=True)
class OutputResiduals:
    """The verdict on one output's innovations."""

    name: str
    unit: str
    count: int
    rms: float
    normalised_squared: float  # mean of (innovation / expected std)^2; 1 if the noise is right
    expected: tuple[float, float]  # the 99 % band of that mean for white innovations
    whiteness_p: float  # NaN with too few samples to tell

    @property
    def white(self) -> bool | None:
        """Whether the test at 1 % finds nothing against it; None: too few samples to tell."""
        return None if isnan(self.whiteness_p) else self.whiteness_p >= SIGNIFICANCE

    @property
    def consistent(self) -> bool:
        """Whether the innovations are as large as the filter expects."""
        low, high = self.expected
        return low <= self.normalised_squared <= high


def judge(
    name: str,
    unit: str,
    innovations: FloatArray,
    innovation_stds: FloatArray,
    *,
    noise_measured: bool,
) -> OutputResiduals:
    """Judge one output's innovations, (n,) with NaN where nothing was measured.

    `noise_measured` says that the noise expected was taken from the same log, by its third
    differences (`kalman.noise_level`), so that it is itself uncertain.
    """
    seen = np.isfinite(innovations)
    e, count = innovations[seen], int(seen.sum())
    squared = (e / innovation_stds[seen]) ** 2
    half = 2.576 * sqrt((MEASURED_NOISE if noise_measured else STATED_NOISE) / count)
    return OutputResiduals(
        name,
        unit,
        count,
        float(np.sqrt(np.mean(e**2))),
        float(np.mean(squared)),
        (1 - half, 1 + half),
        whiteness(innovations),
    )


def whiteness(innovations: FloatArray, lags: int = LAGS) -> float:
    """The p-value of a portmanteau test for autocorrelation up to `lags` measurements.

    Each autocovariance is scaled by its own sampling error, sum(e_t^2 e_{t-k}^2), so that noise
    that is white but not equally strong throughout (a share of the yaw rate, say) is not called
    coloured. The lags are counted in measurements, however seldom they come; pairs across a gap
    are left out. NaN where there are too few. Source: Lobato, Nankervis and Savin, "Testing for
    autocorrelation using a modified Box-Pierce Q test", 2001.
    """
    at = np.flatnonzero(np.isfinite(innovations))
    if len(at) < FEWEST:
        return float("nan")
    e = innovations[at] - np.mean(innovations[at])
    usual = float(np.median(np.diff(at)))
    statistic, used = 0.0, 0
    for lag in range(1, lags + 1):
        near = at[lag:] - at[:-lag] <= 1.5 * lag * usual
        products = (e[lag:] * e[:-lag])[near]
        spread = float(np.sum(products**2))
        if len(products) >= FEWEST and spread > 0:
            statistic += float(np.sum(products)) ** 2 / spread
            used += 1
    return float(chi2.sf(statistic, used)) if used else float("nan")
