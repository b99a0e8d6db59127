"""The curve of a spiral: steady yaw rate against rudder, and the loop of an unstable ship.

Source: ITTC Recommended Procedure 7.5-04-02-01, full scale manoeuvring trials; IMO
MSC/Circ.1053, explanatory notes, section 3.4.
"""

import numpy as np

from shiplog.types import FloatArray

from .spirals import MIN_RATE_STEP
from .trial_signals import TrialSignals

STEADY_SHARE = 0.4  # of a level's end, over which yaw rate and rudder are averaged
SAME_RATE = 0.75 * MIN_RATE_STEP  # between yaw rates that are at one level


def spiral_curve(signals: TrialSignals, levels: FloatArray) -> FloatArray:
    """Compute the points of a spiral: mean rudder and yaw rate at the end of each level.

    Parameters
    ----------
    signals
        Without NaN.
    levels
        (k, 3) first and last sample, and level, of each stretch.

    Returns
    -------
    (k, 2)
        Rudder, rad, and yaw rate, rad/s.
    """
    points = np.empty((len(levels), 2))
    for row, (first, last) in enumerate(levels[:, :2].astype(int)):
        late = slice(int(last - STEADY_SHARE * (last - first)), int(last) + 1)
        duration = (late.stop - 1 - late.start) * signals.dt_secs
        turned = signals.heading[late.stop - 1] - signals.heading[late.start]
        points[row] = np.mean(signals.rudder[late]), turned / max(duration, signals.dt_secs)
    return points


def spiral_loop(points: FloatArray) -> tuple[float, float]:
    """Compute the height and the width of the loop of a spiral.

    The height is the difference of the yaw rates at neutral rudder on the way down and on the way
    up; the width is the difference of the rudder angles at which the yaw rate changes its sign.

    Parameters
    ----------
    points
        (k, 2) rudder, rad, and yaw rate, rad/s, in the order sailed.

    Returns
    -------
    height, width
        In rad/s and rad; NaN where the spiral was not sailed both ways.

    Examples
    --------
    >>> import numpy as np
    >>> down = [(0.2, 2.0), (0.0, 1.0), (-0.1, -1.0), (-0.2, -2.0)]
    >>> up = [(0.0, -1.0), (0.1, 1.0), (0.2, 2.0)]
    >>> [round(x, 6) for x in spiral_loop(np.array(down + up))]
    [2.0, 0.1]
    """
    turns = np.flatnonzero(np.diff(np.sign(np.diff(points[:, 0])))) + 1
    if not len(turns):
        return np.nan, np.nan
    branches = [
        points[: turns[0] + 1],
        points[turns[0] : (turns[1] + 1 if len(turns) > 1 else None)],
    ]
    if len(turns) > 1 and len(branches[0]) < 4:  # the first steps only lead to the largest angle
        after = points[turns[1] : (turns[2] + 1 if len(turns) > 2 else None)]
        branches = [branches[1], after]
    if min(len(branch) for branch in branches) < 3:
        return np.nan, np.nan
    rates = [_at_zero(branch[:, 0], branch[:, 1]) for branch in branches]
    angles = [_at_zero(branch[:, 1], branch[:, 0]) for branch in branches]
    return abs(rates[0] - rates[1]), abs(angles[0] - angles[1])


def _at_zero(x: FloatArray, y: FloatArray) -> float:
    """Return y where x changes its sign, by linear interpolation; NaN where it does not."""
    k = np.flatnonzero(np.diff(np.sign(x)))
    if not len(k):
        return np.nan
    at = int(k[0])
    return float(y[at] - x[at] * (y[at + 1] - y[at]) / (x[at + 1] - x[at]))


def steered_loop(points: FloatArray) -> tuple[float, float]:
    """Compute the height and the width of the loop from the curve of a reverse spiral.

    Steered to its yaw rate, an unstable ship shows the whole curve: the rudder is neutral at three
    rates. The height is the difference of the outer ones, the width that of the largest and the
    smallest rudder angle between them.

    Parameters
    ----------
    points
        (k, 2) rudder from neutral, rad, and yaw rate, rad/s.

    Returns
    -------
    height, width
        In rad/s and rad; NaN where the rudder is neutral at one rate: a stable ship has no loop.

    Examples
    --------
    >>> rates = np.array([-3.0, -2.0, -1.0, 0.5, 1.0, 2.0, 3.0])
    >>> curve = np.column_stack((0.01 * (rates**3 - 4 * rates), rates))
    >>> [round(x, 3) for x in steered_loop(curve)]
    [4.0, 0.06]
    """
    order = np.argsort(points[:, 1])
    steps = np.diff(points[order, 1])
    group = np.concatenate(([0], np.cumsum(steps > SAME_RATE)))
    counts = np.bincount(group)
    angles, rates = (np.bincount(group, column) / counts for column in points[order].T)
    crossed = np.flatnonzero(angles[:-1] * angles[1:] <= 0)
    if len(crossed) < 2:
        return np.nan, np.nan
    low, high = (int(k) for k in crossed[[0, -1]])
    lowest, highest = (_at_zero(angles[k : k + 2], rates[k : k + 2]) for k in (low, high))
    return highest - lowest, float(np.ptp(angles[low + 1 : high + 1]))
