"""Tests of the innovations: whether they are as large as the filter expects, and white."""

from dataclasses import dataclass
from math import isnan, nan, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.signals.distributions import chi_squared_tail
from analysis.signals.moments import Moments
from shiplog.compiled import compiled
from shiplog.types import FloatArray

LAGS = 20
MIN_MEASUREMENTS = 40  # needed for the whiteness test, and of pairs at each lag
MAX_REJECTED_SHARE = 0.01  # of the measurements; spikes are rarer
SIGNIFICANCE = 0.01
# Innovations that are correlated by less are white for all purposes: a prediction from the
# `LAGS` before them would make their rms about 1 % smaller.
MIN_CORRELATION = 0.05
BAND_99 = 2.576  # standard deviations of a normal distribution: 99 % lie within

# The variance of the normalised innovation squared, times the number of innovations: 2 is that of
# a mean of squared Gaussians. An estimate of the variance by third differences has 2 (1 + 2 (15^2
# + 6^2 + 1) / 20^2) = 4.62, and their ratio, the former being efficient, the difference.
STATED_NOISE_VARIANCE = 2.0
MEASURED_NOISE_VARIANCE = 2 * (1 + 2 * (15**2 + 6**2 + 1) / 20**2) - 2.0


@dataclass(frozen=True)
class ResidualSummary:
    """The size and the whiteness of one output's innovations.

    Attributes
    ----------
    name, unit
        The output and its SI unit.
    count
        The number of innovations, without those rejected by the gate.
    rms
        Root mean square, in `unit`.
    mean_nis
        Mean of the normalised innovation squared, (innovation / expected std)²; 1 if the filter's
        noise is right. NaN where the output is constant: it has no noise to compare with.
    nis_band
        The 99 % band of that mean for white innovations; from 0 where the noise that the filter
        expects is an upper bound.
    whiteness_p
        The p-value of the whiteness test; NaN with too few samples, or for a constant output.
    correlation, correlation_lag_secs
        The autocorrelation of largest magnitude among those of the test, and its lag, s. NaN where
        the test gives no p-value.
    rejected
        The number of measurements rejected by the gate.
    """

    name: str
    unit: str
    count: int
    rms: float
    mean_nis: float
    nis_band: tuple[float, float]
    whiteness_p: float
    correlation: float
    correlation_lag_secs: float
    rejected: int

    @property
    def white(self) -> bool | None:
        """Whether the innovations are white for all purposes; None where it was not tested.

        They are not where the test at 1 % rejects whiteness and the largest correlation is
        `MIN_CORRELATION` or more: in a long log even one of 0.01 is significant.
        """
        if isnan(self.whiteness_p):
            return None
        return self.whiteness_p >= SIGNIFICANCE or abs(self.correlation) < MIN_CORRELATION

    @property
    def judged(self) -> bool:
        """Whether the innovations can be compared with what the filter expects."""
        return not isnan(self.mean_nis)

    @property
    def consistent(self) -> bool:
        """Whether the innovations are as large as the filter expects."""
        low, high = self.nis_band
        return low <= self.mean_nis <= high

    @property
    def small(self) -> bool:
        """Whether the innovations are smaller than those of the noise that the filter expects."""
        return self.judged and self.mean_nis < 2 - self.nis_band[1]

    def gate_warning(self, remedy: str) -> str:
        """Return a warning where the gate rejected more than spikes explain; else empty."""
        share = self.rejected / max(self.rejected + self.count, 1)
        if share <= MAX_REJECTED_SHARE:
            return ""
        return (
            f"{self.name}: the gate rejected {share:.1%} of the samples, too many for spikes: the "
            f"model or the noise set does not fit; {remedy}"
        )


class ResidualTest:
    """Tests one output's innovations, which come in chunks.

    Parameters
    ----------
    name, unit
        The output and its SI unit.
    median_step, dt_secs
        The median number of instants from one measurement to the next, and their distance, s.
    noise_measured
        Whether the noise that the filter expects was estimated from the same log, by its third
        differences (`signal_stats.NoiseLevel`), so that it is itself uncertain.
    noise_is_bound
        Whether that noise is an upper bound: innovations that are smaller contradict nothing.
    constant
        Whether the measured output never changes, as that of a dead sensor: nothing is judged.
    """

    def __init__(
        self,
        name: str,
        unit: str,
        median_step: float,
        dt_secs: float,
        *,
        noise_measured: bool,
        noise_is_bound: bool = False,
        constant: bool = False,
    ) -> None:
        self._name, self._unit, self._noise_measured = name, unit, noise_measured
        self._noise_is_bound, self._constant = noise_is_bound, constant
        self._innovations, self._normalised = Moments(), Moments()
        self._products, self._rejected = _Products(median_step), 0
        self._interval_secs = median_step * dt_secs

    def add(
        self, innovations: FloatArray, innovation_stds: FloatArray, rejected: NDArray[np.bool_]
    ) -> None:
        """Add the next innovations.

        Parameters
        ----------
        innovations
            (n,) in the unit of the output; NaN where nothing was measured.
        innovation_stds
            (n,) the standard deviations that the filter expects.
        rejected
            (n,) whether the gate rejected the measurement.
        """
        self._rejected += int(np.count_nonzero(rejected))
        innovations = np.where(rejected, np.nan, innovations)
        self._innovations.add(innovations)
        self._normalised.add(innovations / innovation_stds)
        self._products.add(innovations)

    def result(self) -> ResidualSummary:
        """Return the summary of all innovations added."""
        count = self._innovations.count
        variance = MEASURED_NOISE_VARIANCE if self._noise_measured else STATED_NOISE_VARIANCE
        half_width = BAND_99 * sqrt(variance / count) if count else float("nan")
        found = self._products.result(self._innovations.mean, count)
        judged = not self._constant
        return ResidualSummary(
            name=self._name,
            unit=self._unit,
            count=count,
            rms=sqrt(self._innovations.mean_square),
            mean_nis=self._normalised.mean_square if judged else nan,
            nis_band=(0.0 if self._noise_is_bound else 1 - half_width, 1 + half_width),
            whiteness_p=found.p if judged else nan,
            correlation=found.largest if judged else nan,
            correlation_lag_secs=found.lag * self._interval_secs if judged else nan,
            rejected=self._rejected,
        )


def assess_innovations(
    name: str,
    unit: str,
    innovations: FloatArray,
    innovation_stds: FloatArray,
    dt_secs: float = 1.0,
    *,
    noise_measured: bool,
) -> ResidualSummary:
    """Test one output's innovations that are all in memory, (n,); see `ResidualTest`."""
    steps = np.diff(np.flatnonzero(np.isfinite(innovations)))
    median_step = float(np.median(steps)) if len(steps) else 1.0
    test = ResidualTest(name, unit, median_step, dt_secs, noise_measured=noise_measured)
    test.add(innovations, innovation_stds, np.zeros(len(innovations), bool))
    return test.result()


class Whiteness(NamedTuple):
    """Result of the whiteness test: significance and size of the correlation.

    Attributes
    ----------
    p
        The p-value; NaN where there are too few measurements, as are the others.
    largest
        The autocorrelation of largest magnitude, -1 to 1.
    lag
        Its lag, in measurements.
    """

    p: float
    largest: float
    lag: float


NOT_TESTED = Whiteness(nan, nan, nan)


def whiteness(innovations: FloatArray) -> Whiteness:
    """Test innovations for autocorrelation up to `LAGS` measurements: a portmanteau test.

    Each autocovariance is scaled by its own sampling error, sum(e_t^2 e_{t-k}^2), so that white
    noise whose strength varies, such as in proportion to the yaw rate, is not taken for coloured.
    The lags are counted in measurements, however rare; pairs across a gap are omitted.

    Parameters
    ----------
    innovations
        (n,) NaN where nothing was measured.

    References
    ----------
    Lobato, Nankervis and Savin, "Testing for autocorrelation using a modified Box-Pierce Q test",
    2001.

    Examples
    --------
    >>> noise = np.random.default_rng(0).standard_normal(1000)
    >>> whiteness(noise).p > 0.01, whiteness(np.cumsum(noise)).p > 0.01
    (True, False)
    >>> whiteness(np.cumsum(noise)).lag
    1
    """
    at = np.flatnonzero(np.isfinite(innovations))
    if len(at) < MIN_MEASUREMENTS:
        return NOT_TESTED
    products = _Products(float(np.median(np.diff(at))))
    products.add(innovations)
    return products.result(float(np.mean(innovations[at])), len(at))


class _Products:
    """Sums over pairs of measurements at each lag, before their mean is known.

    Once the mean m is known, the sums of (a - m) (b - m) and of its square follow from those of ab,
    a + b, their squares and their product. All are taken relative to the first innovation, so that
    they do not cancel where the mean is far from zero.
    """

    def __init__(self, median_step: float) -> None:
        self._median_step = median_step
        self._sums = np.zeros((LAGS, 6))
        self._last, self._numbers = np.zeros(LAGS), np.zeros(LAGS, np.int64)  # ring of measurements
        self._measured = self._count = 0
        self._origin: float | None = None

    def add(self, innovations: FloatArray) -> None:
        """Add the next innovations, (n,)."""
        if self._origin is None and np.isfinite(innovations).any():
            self._origin = float(innovations[np.isfinite(innovations)][0])
        self._measured = _add_products(
            innovations - (self._origin or 0.0), self._count, self._measured, self._median_step,
            self._last, self._numbers, self._sums,
        )  # fmt: skip
        self._count += len(innovations)

    def result(self, m: float, count: int) -> Whiteness:
        """Return the result for `count` innovations of mean `m`."""
        m -= self._origin or 0.0
        pairs, ab, a_plus_b, ab_squared, a_plus_b_squared, both = self._sums.T
        covariance = ab - m * a_plus_b + m**2 * pairs
        sampling_variance = (
            ab_squared + m**2 * a_plus_b_squared + m**4 * pairs
            - 2 * m * both + 2 * m**2 * ab - 2 * m**3 * a_plus_b
        )  # fmt: skip
        used = (pairs >= MIN_MEASUREMENTS) & (sampling_variance > 0)
        if count < MIN_MEASUREMENTS or not used.any():
            return NOT_TESTED
        statistic = float(np.sum(covariance[used] ** 2 / sampling_variance[used]))
        # the mean of the squares of both innovations of each pair, so that no correlation exceeds 1
        squares = a_plus_b_squared / 2 - ab - m * a_plus_b + m**2 * pairs
        correlation = np.divide(covariance, squares, out=np.zeros(LAGS), where=used)
        largest = int(np.argmax(np.abs(correlation)))
        tail = chi_squared_tail(statistic, int(np.count_nonzero(used)))
        return Whiteness(tail, float(correlation[largest]), largest + 1)


@compiled
def _add_products(
    innovations: FloatArray,
    first: int,
    measured: int,
    median_step: float,
    last: FloatArray,
    numbers: NDArray[np.int64],
    sums: FloatArray,
) -> int:
    """Pair each measurement with those in the ring before it; return the number measured so far."""
    for k in range(len(innovations)):
        e = innovations[k]
        if np.isfinite(e):
            for lag in range(1, min(measured, LAGS) + 1):
                before = (measured - lag) % LAGS
                if first + k - numbers[before] <= 1.5 * lag * median_step:
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
