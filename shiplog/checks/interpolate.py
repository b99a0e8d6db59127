"""Linear interpolation and hold of a channel at given instants, chunk by chunk."""

import numpy as np

from shiplog.types import Channel, FloatArray


class Interpolator:
    """Linear interpolation between samples that come in chunks, or hold.

    A value inside a gap is NaN. Before the first sample and after the last one, their values are
    returned. Samples of one instant are averaged. Where the chunks are cut changes no result.

    Parameters
    ----------
    at
        (n,) instants in s, in ascending order.
    gap_secs
        Longest interval between two samples that is interpolated across.
    hold
        Whether each value holds until the next sample.

    Examples
    --------
    >>> import numpy as np
    >>> interpolator = Interpolator(np.array([0.5, 1.5]))
    >>> interpolator.add(np.array([0.0, 1.0, 2.0]), np.array([0.0, 10.0, 30.0]))
    >>> interpolator.result().tolist()
    [5.0, 20.0]
    """

    def __init__(self, at: FloatArray, gap_secs: float = np.inf, *, hold: bool = False) -> None:
        self._at, self._gap_secs, self._hold = at, gap_secs, hold
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
            # the value at the last time is not complete: more samples of that time may follow
            complete = int(np.searchsorted(self._times, self._times[-1])) - 1
            if complete >= 0:
                until = self._times[complete]
                self._interpolate(int(np.searchsorted(self._at, until)))
                kept = max(int(np.searchsorted(self._times, until)) - 1, 0)
                self._times, self._values = self._times[kept:], self._values[kept:]

    def result(self) -> FloatArray:
        """Return the values at the instants, (n,), once all samples were added."""
        if len(self._times):
            self._interpolate(len(self._at))
        return self._result

    def _interpolate(self, end: int) -> None:
        """Fill the results up to before instant `end`."""
        at = self._at[self._done : end]
        if self._hold:
            last = np.searchsorted(self._times, at, side="right") - 1
            self._result[self._done : end] = self._values[np.clip(last, 0, None)]
            self._done = max(self._done, end)
            return
        times, values = mean_per_instant(self._times, self._values)
        if len(times) < 2:
            return  # a first sample alone: the instants before it wait for the second
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        in_gap = times[after] - times[after - 1] > self._gap_secs
        interpolated = np.interp(at, times, values)
        self._result[self._done : end] = np.where(in_gap, np.nan, interpolated)
        self._done = max(self._done, end)


def mean_per_instant(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Average the samples of each instant.

    Parameters
    ----------
    times
        (n,) in ascending order; coarse time stamps repeat.
    values
        (n,) finite values.

    Returns
    -------
    times
        (m,) distinct times.
    values
        (m,) means.

    Examples
    --------
    >>> mean_per_instant(np.array([0.0, 1.0, 1.0]), np.array([5.0, 6.0, 8.0]))
    (array([0., 1.]), array([5., 7.]))
    """
    is_first = np.diff(times, prepend=-np.inf) > 0
    if is_first.all():
        return times, values
    starts = np.flatnonzero(is_first)
    counts = np.diff(starts, append=len(times))
    return times[starts], np.add.reduceat(values, starts) / counts


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
