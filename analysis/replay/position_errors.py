"""White noise of measured positions that stands for their errors of some seconds as well.

The errors of a receiver or of a tracking system last longer than the interval between two fixes:
differences of consecutive fixes do not show them, and a filter that takes many such fixes as
independent believes their mean too much. The means over some seconds show these errors, once the
ship's own motion is subtracted.
"""

from math import sqrt

import numpy as np

from analysis.signals.signal_stats import SignalStats
from shiplog.types import FloatArray

MAX_MEAN_SECS = 10.0  # longer means contain the errors of speed and heading
MAX_TURN = 0.1  # rad, in the time of a mean: sway and errors of the speed change little meanwhile
MIN_MEANS = 20
MIN_SHARE = 0.5  # of a full number of fixes, for a mean to count
MIN_EXCESS, MIN_EXCESS_STDS = 0.2, 2.0  # of variance over that of consecutive fixes
VARIANCE_ERROR = 2.15  # relative, times √n: of a variance from n third differences of white noise


def position_noise(stats: SignalStats, output: str, white_std: float) -> float:
    """Return the white noise of a fix whose means over some seconds err as those measured.

    The dead-reckoned track, by speed and heading, is subtracted first. Third differences of the
    means then show neither a current nor an error of the speed, which are linear in time.

    Parameters
    ----------
    stats
        The statistics of the signals, whose first part has ``compass``, ``speed`` and the output.
    output
        ``north`` or ``east``.
    white_std
        The white noise by the third differences of consecutive fixes, m.

    Returns
    -------
    float
        Standard deviation, m; `white_std` where the means err no more than by that, or where there
        are too few of them.
    """
    values, dt = stats.head[output], stats.dt_secs
    at = np.flatnonzero(np.isfinite(values))
    errors = values[at] - _dead_reckoned(stats, output)[at]
    interval = float(np.median(np.diff(at))) * dt
    secs = min(MAX_MEAN_SECS, MAX_TURN / max(stats.yaw_rate_rms, MAX_TURN / MAX_MEAN_SECS))
    count = secs / interval
    if count < 1 / MIN_SHARE:
        return white_std
    numbers = (at * dt / secs).astype(np.int64)
    counts = np.bincount(numbers)
    sums = np.bincount(numbers, errors)
    enough = counts >= max(MIN_SHARE * count, 1)
    means = np.where(enough, sums / np.maximum(counts, 1), np.nan)
    thirds = np.diff(means, 3) / sqrt(20.0)
    thirds = thirds[np.isfinite(thirds)]
    if len(thirds) < MIN_MEANS:
        return white_std
    std = float(np.sqrt(count * np.mean(thirds**2)))
    least = 1 + MIN_EXCESS + MIN_EXCESS_STDS * VARIANCE_ERROR / sqrt(len(thirds))
    return std if std**2 > least * white_std**2 else white_std


def _dead_reckoned(stats: SignalStats, output: str) -> FloatArray:
    """Return north or east (n,) of the track by speed and heading alone, m."""
    instants = np.arange(len(stats.head))
    heading, speed = (
        np.interp(instants, instants[known], values[known])
        for values in (stats.head["compass"], stats.head["speed"])
        for known in (np.isfinite(values),)
    )
    velocity = speed * (np.cos(heading) if output == "north" else np.sin(heading))
    steps = (velocity[1:] + velocity[:-1]) * stats.dt_secs / 2
    return np.concatenate(([0.0], np.cumsum(steps)))
