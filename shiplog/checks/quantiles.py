"""Quantiles of a stream that is too long for memory."""

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

MAX_VALUES = 1 << 20  # kept in memory: more than a day at 10 Hz
RUN_LENGTH = 256  # neighbouring values are kept or dropped together, so that the choice is cheap


class Quantiles:
    """A stream of values, whole up to a number of them, beyond that a pseudo-random part of it.

    The part has between about half of this number and all of it. Which values are kept depends
    only on their position in the stream, by a hash: not on the values, nor on where the chunks
    are cut.

    Parameters
    ----------
    most
        The number of values that are kept at the most.

    Examples
    --------
    >>> import numpy as np
    >>> quantiles = Quantiles()
    >>> quantiles.add(np.array([3.0, 1.0]))
    >>> quantiles.add(np.array([2.0]))
    >>> quantiles.median()
    2.0
    """

    def __init__(self, most: int = MAX_VALUES) -> None:
        self._most = most
        self._parts: list[FloatArray] = []
        self._kept = self._added = self._level = 0

    def add(self, values: FloatArray) -> None:
        """Add the next values of the stream, (n,)."""
        first, self._added = self._added, self._added + len(values)
        if self._level:
            runs = np.arange(first // RUN_LENGTH, -(-self._added // RUN_LENGTH))
            keep = np.repeat(_keep_runs(runs, self._level), RUN_LENGTH)
            offset = first % RUN_LENGTH
            values = values[keep[offset : offset + len(values)]]
        self._parts.append(np.array(values))
        self._kept += len(values)
        while self._kept > self._most:
            self._drop_half()

    @property
    def values(self) -> FloatArray:
        """The values kept, (m,), in the order of the stream."""
        self._parts = [np.concatenate(self._parts)] if self._parts else [np.zeros(0)]
        return self._parts[0]

    def median(self) -> float:
        """Return the median of the values kept; NaN without any."""
        return float(np.median(self.values)) if self._kept else float("nan")

    def _drop_half(self) -> None:
        """Drop about half of the runs kept."""
        runs = np.arange(-(-self._added // RUN_LENGTH))
        kept = runs[_keep_runs(runs, self._level)] if self._level else runs
        self._level += 1
        keep = np.repeat(_keep_runs(kept, self._level), RUN_LENGTH)
        values = self.values
        self._parts = [values[keep[: len(values)]]]
        self._kept = len(self._parts[0])


def _keep_runs(runs: NDArray[np.int64], level: int) -> NDArray[np.bool_]:
    """Whether the first `level` bits of the hash of each run's number are zero.

    The hash is splitmix64 (Steele, Lea and Flood, Fast splittable pseudorandom number generators,
    OOPSLA 2014).
    """
    with np.errstate(over="ignore"):
        x = (runs.astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x ^= x >> np.uint64(31)
    keep: NDArray[np.bool_] = x >> np.uint64(64 - level) == 0
    return keep
