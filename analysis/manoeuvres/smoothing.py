"""Smoothing of signals for the search of manoeuvres, without scipy, whose import takes long.

A replay, which searches for manoeuvres too, would take half as long again to start.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from shiplog.types import FloatArray


def moving_median(values: FloatArray, half: int) -> FloatArray:
    """Return the median of each value and `half` neighbours to either side, (n,).

    Beyond the ends the values are mirrored, as in `scipy.ndimage.median_filter`.
    """
    windows = sliding_window_view(np.pad(values, half, "symmetric"), 1 + 2 * half)
    return np.asarray(np.median(windows, axis=1))


def moving_mean(values: FloatArray, count: int) -> FloatArray:
    """Return the mean of `count` values about each, (n,).

    Beyond the ends the values are mirrored, as in `scipy.ndimage.uniform_filter1d`.
    """
    before = count // 2
    padded = np.pad(values, (before, count - 1 - before), "symmetric")
    sums = np.concatenate(([0.0], np.cumsum(padded)))
    return np.asarray((sums[count:] - sums[:-count]) / count)


def fitted_slope(values: FloatArray, half: int, dt: float) -> FloatArray:
    """Return the slope of a parabola fitted to each value and `half` neighbours, (n,) per s.

    At the ends it is that of the parabola through the first or the last window (Savitzky and Golay,
    "Smoothing and differentiation of data by simplified least squares procedures", 1964).

    Parameters
    ----------
    values
        (n,), more than twice `half` of them.
    half
        The neighbours to either side.
    dt
        Sample interval, s.
    """
    steps = np.arange(-half, half + 1)
    inner = np.convolve(values, -steps / (np.sum(steps**2) * dt), "valid")
    slopes = [
        np.polyval(np.polyder(np.polyfit(steps * dt, window, 2)), steps * dt)
        for window in (values[: len(steps)], values[-len(steps) :])
    ]
    return np.concatenate((slopes[0][:half], inner, slopes[1][half + 1 :]))
