"""Whether innovations are as large as the filter expects, and white."""

from dataclasses import dataclass
from math import isnan, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from analysis.signals.moments import Moments
from shiplog.compiled import compiled
from shiplog.types import FloatArray

LAGS = 20
FEWEST = 40  # measurements, or pairs of them at a lag, to tell anything
MANY_GATED = 0.01  # of all: spikes are fewer
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
    gated: int  # measurements that were not believed, and are not counted above

    @property
    def white(self) -> bool | None:
        """Whether the test at 1 % finds nothing against it; None: too few samples to tell."""
        return None if isnan(self.whiteness_p) else self.whiteness_p >= SIGNIFICANCE

    @property
    def caution(self) -> str:
        """A warning where more was gated than spikes explain."""
        share = self.gated / max(self.gated + self.count, 1)
        if share <= MANY_GATED:
            return ""
        return (
            f"{self.name}: {share:.1%} of the samples were gated, too many for spikes: the model "
            "or the noise stated does not fit; leave the noise to the log "
            "(filter.process_ratio=auto), tell waves (filter.wave), or widen filter.gate"
        )

    @property
    def consistent(self) -> bool:
        """Whether the innovations are as large as the filter expects."""
        low, high = self.expected
        return low <= self.normalised_squared <= high


class ResidualTest:
    """Judges one output's innovations as they come.

    `usual_step` is the median number of instants from one measurement to the next.
    `noise_measured` says that the noise expected was taken from the same log, by its third
    differences (`signal_stats.NoiseLevel`), so that it is itself uncertain.
    """

    def __init__(self, name: str, unit: str, usual_step: float, *, noise_measured: bool) -> None:
        self._name, self._unit, self._noise_measured = name, unit, noise_measured
        self._innovations, self._normalised = Moments(), Moments()
        self._products, self._gated = _Products(usual_step), 0

    def add(
        self, innovations: FloatArray, innovation_stds: FloatArray, gated: NDArray[np.bool_]
    ) -> None:
        """Take the next innovations, (n,) with NaN where nothing was measured."""
        self._gated += int(np.count_nonzero(gated))
        innovations = np.where(gated, np.nan, innovations)
        self._innovations.add(innovations)
        self._normalised.add(innovations / innovation_stds)
        self._products.add(innovations)

    def result(self) -> OutputResiduals:
        """The verdict on all of them."""
        count = self._innovations.count
        variance = MEASURED_NOISE if self._noise_measured else STATED_NOISE
        half = 2.576 * sqrt(variance / count) if count else float("nan")
        return OutputResiduals(
            self._name,
            self._unit,
            count,
            sqrt(self._innovations.mean_square),
            self._normalised.mean_square,
            (1 - half, 1 + half),
            self._products.whiteness(self._innovations.mean, count),
            self._gated,
        )


def judge(
    name: str,
    unit: str,
    innovations: FloatArray,
    innovation_stds: FloatArray,
    *,
    noise_measured: bool,
) -> OutputResiduals:
    """Judge one output's innovations that are all there, (n,); as `ResidualTest`."""
    steps = np.diff(np.flatnonzero(np.isfinite(innovations)))
    usual_step = float(np.median(steps)) if len(steps) else 1.0
    judging = ResidualTest(name, unit, usual_step, noise_measured=noise_measured)
    judging.add(innovations, innovation_stds, np.zeros(len(innovations), bool))
    return judging.result()


def whiteness(innovations: FloatArray) -> float:
    """The p-value of a portmanteau test for autocorrelation up to `LAGS` measurements.

    Each autocovariance is scaled by its own sampling error, sum(e_t^2 e_{t-k}^2), so that noise
    that is white but not equally strong throughout (a share of the yaw rate, say) is not called
    coloured. The lags are counted in measurements, however seldom they come; pairs across a gap
    are left out. NaN where there are too few. Source: Lobato, Nankervis and Savin, "Testing for
    autocorrelation using a modified Box-Pierce Q test", 2001.
    """
    at = np.flatnonzero(np.isfinite(innovations))
    if len(at) < FEWEST:
        return float("nan")
    products = _Products(float(np.median(np.diff(at))))
    products.add(innovations)
    return products.whiteness(float(np.mean(innovations[at])), len(at))


class _Products:
    """Sums over pairs of measurements at each lag, before their mean is known.

    With it, the sums of (a - m) (b - m) and of its square follow from those of ab, a + b, their
    squares and their product. All are counted from the first innovation, lest they cancel where
    the mean is far from zero.
    """

    def __init__(self, usual_step: float) -> None:
        self._usual = usual_step
        self._sums = np.zeros((LAGS, 6))
        self._last, self._numbers = np.zeros(LAGS), np.zeros(LAGS, np.int64)  # ring of measurements
        self._measured = self._count = 0
        self._origin: float | None = None

    def add(self, innovations: FloatArray) -> None:
        """Take the next innovations."""
        if self._origin is None and np.isfinite(innovations).any():
            self._origin = float(innovations[np.isfinite(innovations)][0])
        self._measured = _add_products(
            innovations - (self._origin or 0.0), self._count, self._measured, self._usual,
            self._last, self._numbers, self._sums,
        )  # fmt: skip
        self._count += len(innovations)

    def whiteness(self, m: float, count: int) -> float:
        """The test's p-value for innovations of that mean; NaN if too few."""
        if count < FEWEST:
            return float("nan")
        m -= self._origin or 0.0
        pairs, ab, a_plus_b, ab_squared, a_plus_b_squared, both = self._sums.T
        covariance = ab - m * a_plus_b + m**2 * pairs
        spread = (
            ab_squared + m**2 * a_plus_b_squared + m**4 * pairs
            - 2 * m * both + 2 * m**2 * ab - 2 * m**3 * a_plus_b
        )  # fmt: skip
        used = (pairs >= FEWEST) & (spread > 0)
        statistic = float(np.sum(covariance[used] ** 2 / spread[used]))
        return float(chdtrc(np.count_nonzero(used), statistic)) if used.any() else float("nan")


@compiled
def _add_products(
    innovations: FloatArray,
    first: int,
    measured: int,
    usual: float,
    last: FloatArray,
    numbers: NDArray[np.int64],
    sums: FloatArray,
) -> int:
    """How many were measured so far; each is paired with those in the ring before it."""
    for k in range(len(innovations)):
        e = innovations[k]
        if np.isfinite(e):
            for lag in range(1, min(measured, LAGS) + 1):
                before = (measured - lag) % LAGS
                if first + k - numbers[before] <= 1.5 * lag * usual:
                    product, total = e * last[before], e + last[before]
                    sums[lag - 1, 0] += 1
                    sums[lag - 1, 1] += product
                    sums[lag - 1, 2] += total
                    sums[lag - 1, 3] += product**2
                    sums[lag - 1, 4] += total**2
                    sums[lag - 1, 5] += product * total
            last[measured % LAGS], numbers[measured % LAGS] = e, first + k
            measured += 1
    return measured
