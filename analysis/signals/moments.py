"""Running mean, variance and extremes of a stream of values."""

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray

_COUNT, _FIRST, _MEAN, _SQUARES, _MIN, _MAX = range(6)


class Moments:
    """Mean, variance and extremes of the finite values of a stream.

    Each value is added by itself, so that the results are the same to the last bit however the
    stream is cut into chunks. The mean is counted from the first finite value, which keeps the
    precision of a small variation about a large offset. All results but `count` are NaN before the
    first finite value.

    References
    ----------
    B. P. Welford, "Note on a method for calculating corrected sums of squares and products",
    Technometrics 4 (1962).

    Examples
    --------
    >>> moments = Moments()
    >>> moments.add(np.array([1.0, np.nan, 3.0]))
    >>> moments.count, moments.mean, moments.std
    (2, 2.0, 1.0)
    """

    def __init__(self) -> None:
        self._sums = np.array([0.0, 0.0, 0.0, 0.0, np.inf, -np.inf])

    def add(self, values: FloatArray) -> None:
        """Add the next values, (n,); those that are not finite are ignored."""
        _accumulate(np.ascontiguousarray(values), self._sums)

    @property
    def count(self) -> int:
        """Number of finite values."""
        return int(self._sums[_COUNT])

    @property
    def mean(self) -> float:
        """Mean."""
        return float(self._sums[_FIRST] + self._sums[_MEAN]) if self.count else np.nan

    @property
    def std(self) -> float:
        """Standard deviation about the mean, with divisor n."""
        return float(np.sqrt(self._sums[_SQUARES] / self.count)) if self.count else np.nan

    @property
    def mean_square(self) -> float:
        """Mean of the squares."""
        return float(self._sums[_SQUARES] / self.count + self.mean**2) if self.count else np.nan

    @property
    def min(self) -> float:
        """Smallest value."""
        return float(self._sums[_MIN]) if self.count else np.nan

    @property
    def max(self) -> float:
        """Largest value."""
        return float(self._sums[_MAX]) if self.count else np.nan


@compiled
def _accumulate(values: FloatArray, sums: FloatArray) -> None:
    """Update the six running sums with the values: Welford's recursion."""
    for value in values:
        if np.isfinite(value):
            if sums[_COUNT] == 0:
                sums[_FIRST] = value
            sums[_COUNT] += 1.0
            offset = value - sums[_FIRST]
            deviation = offset - sums[_MEAN]
            sums[_MEAN] += deviation / sums[_COUNT]
            sums[_SQUARES] += deviation * (offset - sums[_MEAN])
            sums[_MIN] = min(sums[_MIN], value)
            sums[_MAX] = max(sums[_MAX], value)
