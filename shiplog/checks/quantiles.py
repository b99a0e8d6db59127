"""Quantiles of a stream too long to be held."""

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

HELD = 1 << 20  # values: more than a day at 10 Hz has
_RUN = 256  # neighbours are kept or left out together, so that choosing costs next to nothing


class Quantiles:
    """The values of a stream, all of them, or of a longer one a part from all over it.

    Which values are kept depends on their numbers in the stream alone, by a hash, never on the
    chunks in which they came or on what they are: between about half of `HELD` and all of it.
    """

    def __init__(self) -> None:
        self._parts: list[FloatArray] = []
        self._kept = self._seen = self._level = 0

    def add(self, values: FloatArray) -> None:
        """Take the next values of the stream, (n,)."""
        first, self._seen = self._seen, self._seen + len(values)
        if self._level:
            runs = np.arange(first // _RUN, -(-self._seen // _RUN))
            chosen = np.repeat(_chosen(runs, self._level), _RUN)
            offset = first % _RUN
            values = values[chosen[offset : offset + len(values)]]
        self._parts.append(np.array(values))
        self._kept += len(values)
        while self._kept > HELD:
            self._thin()

    @property
    def values(self) -> FloatArray:
        """What was kept, in the order of the stream."""
        self._parts = [np.concatenate(self._parts)] if self._parts else [np.zeros(0)]
        return self._parts[0]

    def median(self) -> float:
        """The median of what was kept; NaN of nothing."""
        return float(np.median(self.values)) if self._kept else float("nan")

    def _thin(self) -> None:
        """Leave out about half of the runs kept."""
        runs = np.arange(-(-self._seen // _RUN))
        kept = runs[_chosen(runs, self._level)] if self._level else runs
        self._level += 1
        chosen = np.repeat(_chosen(kept, self._level), _RUN)
        values = self.values
        self._parts = [values[chosen[: len(values)]]]
        self._kept = len(self._parts[0])


def _chosen(runs: NDArray[np.int64], level: int) -> NDArray[np.bool_]:
    """Whether the first `level` bits of each number's hash are zero. Source: Steele, splitmix64."""
    with np.errstate(over="ignore"):
        x = (runs.astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x ^= x >> np.uint64(31)
    chosen: NDArray[np.bool_] = x >> np.uint64(64 - level) == 0
    return chosen
