"""Whether innovations are as large as the filter expects, and white."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from shiplog.types import FloatArray

LAGS = 20
SIGNIFICANCE = 0.01


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
    def white(self) -> bool:
        """Whether the test at 1 % finds nothing against whiteness."""
        return not self.whiteness_p < SIGNIFICANCE

    @property
    def consistent(self) -> bool:
        """Whether the innovations are as large as the filter expects."""
        low, high = self.expected
        return low <= self.normalised_squared <= high


def judge(
    name: str, unit: str, innovations: FloatArray, innovation_stds: FloatArray
) -> OutputResiduals:
    """Judge one output's innovations, (n,) with NaN where nothing was measured."""
    seen = np.isfinite(innovations)
    e, count = innovations[seen], int(seen.sum())
    squared = (e / innovation_stds[seen]) ** 2
    low, high = (float(chi2.ppf(q, count)) / count for q in (0.005, 0.995))
    return OutputResiduals(
        name,
        unit,
        count,
        float(np.sqrt(np.mean(e**2))),
        float(np.mean(squared)),
        (low, high),
        whiteness(innovations),
    )


def whiteness(innovations: FloatArray, lags: int = LAGS) -> float:
    """The p-value of a portmanteau test for autocorrelation up to `lags` samples.

    Each autocovariance is scaled by its own sampling error, sum(e_t^2 e_{t-k}^2), so that noise
    that is white but not equally strong throughout (a share of the yaw rate, say) is not called
    coloured; pairs of which one is missing are left out. Source: Lobato, Nankervis and Savin,
    "Testing for autocorrelation using a modified Box-Pierce Q test", 2001.
    """
    e = innovations - np.nanmean(innovations)
    statistic, used = 0.0, 0
    for lag in range(1, lags + 1):
        products = e[lag:] * e[:-lag]
        products = products[np.isfinite(products)]
        spread = float(np.sum(products**2))
        if len(products) >= 2 * lags and spread > 0:
            statistic += float(np.sum(products)) ** 2 / spread
            used += 1
    return float(chi2.sf(statistic, used)) if used else float("nan")
