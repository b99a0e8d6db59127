"""Linear interpolation of a channel at given instants, chunk by chunk."""

import numpy as np

from shiplog.types import Channel, FloatArray


class Interpolator:
    """Linear interpolation between samples that come in chunks.

    A value inside a gap is NaN. Before the first sample and after the last one, their values are
    returned. Where the chunks are cut changes no result.

    Parameters
    ----------
    at
        (n,) instants in s, in ascending order.
    gap_secs
        Longest interval between two samples that is interpolated across.

    Examples
    --------
    >>> import numpy as np
    >>> interpolator = Interpolator(np.array([0.5, 1.5]))
    >>> interpolator.add(np.array([0.0, 1.0, 2.0]), np.array([0.0, 10.0, 30.0]))
    >>> interpolator.result().tolist()
    [5.0, 20.0]
    """

    def __init__(self, at: FloatArray, gap_secs: float = np.inf) -> None:
        self._at, self._gap_secs = at, gap_secs
        self._result = np.full(len(at), np.nan)
        self._done = 0
        self._times, self._values = np.zeros(0), np.zeros(0)  # the last samples added

    def add(self, times: FloatArray, values: FloatArray) -> None:
        """Add the next valid samples.

        Parameters
        ----------
        times
            (m,) s from the same origin as `at`, in ascending order over all chunks.
        values
            (m,) finite values.
        """
        if len(times):
            self._times = np.concatenate((self._times, times))
            self._values = np.concatenate((self._values, values))
            self._interpolate(int(np.searchsorted(self._at, self._times[-1])))
            # keep the sample before those of the last time: more of that time may follow
            kept = max(int(np.searchsorted(self._times, self._times[-1])) - 1, 0)
            self._times, self._values = self._times[kept:], self._values[kept:]

    def result(self) -> FloatArray:
        """Return the values at the instants, (n,), once all samples were added."""
        if len(self._times):
            self._interpolate(len(self._at))
        return self._result

    def _interpolate(self, end: int) -> None:
        """Fill the results up to before instant `end`."""
        if len(self._times) < 2:
            return  # a first sample alone: the instants before it wait for the second
        at = self._at[self._done : end]
        after = np.clip(np.searchsorted(self._times, at), 1, len(self._times) - 1)
        in_gap = self._times[after] - self._times[after - 1] > self._gap_secs
        interpolated = np.interp(at, self._times, self._values)
        self._result[self._done : end] = np.where(in_gap, np.nan, interpolated)
        self._done = max(self._done, end)


def valid_samples(channel: Channel, origin_ns: int) -> tuple[FloatArray, FloatArray]:
    """Return the finite samples of a channel of one value per sample.

    Parameters
    ----------
    channel
        The channel; without `fields`.
    origin_ns
        Instant from which times are counted, ns since 1970.

    Returns
    -------
    times
        (m,) s since `origin_ns`.
    values
        (m,) finite values.
    """
    valid = np.isfinite(channel.values)
    return (channel.measured_ns[valid] - origin_ns) * 1e-9, channel.values[valid]
