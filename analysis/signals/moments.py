"""Mean, variance and extremes of a stream, the same to the last bit however it is cut."""

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray

_COUNT, _FIRST, _MEAN, _SQUARES, _MIN, _MAX = range(6)


class Moments:
    """Of the finite values of a stream, the mean counted from the first of them.

    Source: Welford, "Note on a method for calculating corrected sums of squares", 1962.
    """

    def __init__(self) -> None:
        self._sums = np.array([0.0, 0.0, 0.0, 0.0, np.inf, -np.inf])

    def add(self, values: FloatArray) -> None:
        """Take the next values, (n,)."""
        _accumulate(np.ascontiguousarray(values), self._sums)

    @property
    def count(self) -> int:
        """How many were finite."""
        return int(self._sums[_COUNT])

    @property
    def mean(self) -> float:
        """The mean, NaN of none."""
        return float(self._sums[_FIRST] + self._sums[_MEAN]) if self.count else np.nan

    @property
    def std(self) -> float:
        """The standard deviation about the mean, NaN of none."""
        return float(np.sqrt(self._sums[_SQUARES] / self.count)) if self.count else np.nan

    @property
    def mean_square(self) -> float:
        """The mean of the squares, NaN of none."""
        return float(self._sums[_SQUARES] / self.count + self.mean**2) if self.count else np.nan

    @property
    def min(self) -> float:
        """The least value, NaN of none."""
        return float(self._sums[_MIN]) if self.count else np.nan

    @property
    def max(self) -> float:
        """The greatest value, NaN of none."""
        return float(self._sums[_MAX]) if self.count else np.nan


@compiled
def _accumulate(values: FloatArray, sums: FloatArray) -> None:
    for value in values:
        if np.isfinite(value):
            if sums[_COUNT] == 0:
                sums[_FIRST] = value
            sums[_COUNT] += 1.0
            since = value - sums[_FIRST]
            away = since - sums[_MEAN]
            sums[_MEAN] += away / sums[_COUNT]
            sums[_SQUARES] += away * (since - sums[_MEAN])
            sums[_MIN] = min(sums[_MIN], value)
            sums[_MAX] = max(sums[_MAX], value)
