"""A channel's values at chosen instants, from chunks."""

import numpy as np

from shiplog.types import Channel, FloatArray


class Interpolator:
    """Linear between a channel's known samples; NaN in a gap; the first and the last beyond them.

    `at` (n,) are seconds, in order. The samples come in the order of their times.
    """

    def __init__(self, at: FloatArray, gap_secs: float = np.inf) -> None:
        self._at, self._gap = at, gap_secs
        self._values = np.full(len(at), np.nan)
        self._done = 0
        self._times, self._seen = np.zeros(0), np.zeros(0)  # the last samples

    def add(self, times: FloatArray, values: FloatArray) -> None:
        """Take the next known samples, (m,) seconds on the scale of `at` and (m,)."""
        if len(times):
            self._times = np.concatenate((self._times, times))
            self._seen = np.concatenate((self._seen, values))
            self._place(int(np.searchsorted(self._at, self._times[-1])))
            # what is at the last time may not be all that is; and the sample before it
            kept = max(int(np.searchsorted(self._times, self._times[-1])) - 1, 0)
            self._times, self._seen = self._times[kept:], self._seen[kept:]

    def result(self) -> FloatArray:
        """The values, (n,), once all samples were added."""
        if len(self._times):
            self._place(len(self._at))
        return self._values

    def _place(self, until: int) -> None:
        if len(self._times) < 2:
            return  # the first sample alone: what is before it waits for the second
        at = self._at[self._done : until]
        after = np.clip(np.searchsorted(self._times, at), 1, len(self._times) - 1)
        gap = self._times[after] - self._times[after - 1] > self._gap
        placed = np.interp(at, self._times, self._seen)
        self._values[self._done : until] = np.where(gap, np.nan, placed)
        self._done = max(self._done, until)


def valid_samples(channel: Channel, origin_ns: int) -> tuple[FloatArray, FloatArray]:
    """The known samples of a channel of scalars: seconds since `origin_ns` and values, (m,)."""
    known = np.isfinite(channel.values)
    return (channel.measured_ns[known] - origin_ns) * 1e-9, channel.values[known]
