"""The first rudder order of a manoeuvre, and operations that all indices share."""

from math import radians

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .smoothing import moving_median

REST_TOLERANCE = radians(0.5)  # a rudder within it is at rest, or held at one angle
REST_SECS = 3.0  # at the start of a run, whose median rudder is the rest position
HELM_SECS = 3.0  # before an order, whose median rudder is the helm that the order ends
SLOW_WINDOWS = 3  # of `HELM_SECS`, over which an angle of an order's size must be steady
ORDER_SHARE = 0.6  # of the largest rudder angle: beyond it the rudder follows the manoeuvre's order
MIN_RUDDER_ORDER = 4 * REST_TOLERANCE  # a smaller deflection is no order
MAX_SPIKE_SECS = 3.0  # a shorter deflection of the rudder is a measurement error
ANGLE_TOLERANCE, ANGLE_TOLERANCE_SHARE = radians(1.5), 0.1  # the larger one decides
APPROACH_SECS = 30.0  # before the first order, over which the approach heading is averaged
SMOOTHING_SHARE = 1 / 6  # of the time from side to side: the half width of a heading's smoothing


def first_execute(rudder: FloatArray, dt: float) -> int | None:
    """Find the last sample before the rudder order that leads to the manoeuvre's angle.

    All indices count from this instant, in the measured and in the simulated run alike: another
    definition changes an advance by some per cent. Smaller helm before it, as it keeps a ship on
    its course, is not part of the manoeuvre.

    Parameters
    ----------
    rudder
        (n,) rad.
    dt
        Sample interval, s.

    Returns
    -------
    int or None
        The sample's number; None where no deflection exceeds `MIN_RUDDER_ORDER`.

    Examples
    --------
    >>> import numpy as np
    >>> first_execute(np.array([0, 0, 0, 0, 0.2, 0.35, 0.35]), dt=1.0)
    3
    """
    rest = float(np.median(rudder[: max(1, round(REST_SECS / dt))]))
    if np.max(np.abs(rudder - rest)) <= MIN_RUDDER_ORDER:
        return None
    ordered = int(np.argmax(np.abs(rudder) > ORDER_SHARE * np.max(np.abs(rudder))))
    towards, window = rudder * np.sign(rudder[ordered]), max(1, round(HELM_SECS / dt))
    for k in range(ordered, 0, -1):
        helm = towards[max(0, k - window) : k + 1]
        longer = towards[max(0, k - SLOW_WINDOWS * window) : k + 1]  # a slow ramp is no helm
        is_small = towards[k] <= MIN_RUDDER_ORDER
        earlier = np.median(helm) if is_small else min(np.median(helm), np.median(longer))
        if towards[k] - earlier <= REST_TOLERANCE:
            return k
    return 0


def remove_spikes(rudder: FloatArray, dt: float) -> FloatArray:
    """Remove deflections shorter than `MAX_SPIKE_SECS` by a running median."""
    return moving_median(rudder, round(MAX_SPIKE_SECS / 2 / dt))


def smooth_heading(heading: FloatArray, half_width: int) -> FloatArray:
    """Smooth a heading, (n,), by a parabola over `half_width` samples to either side.

    A parabola keeps the height of an extreme (Savitzky and Golay, "Smoothing and differentiation
    of data by simplified least squares procedures", 1964).
    """
    from scipy.signal import savgol_filter  # noqa: PLC0415 - slow to import

    return savgol_filter(heading, 1 + 2 * max(1, half_width), 2)


def approach_heading(heading: FloatArray, execute: int, dt: float) -> float:
    """Return the mean heading, rad, over up to `APPROACH_SECS` before the first rudder order."""
    return float(np.mean(heading[max(0, execute - round(APPROACH_SECS / dt)) : execute + 1]))


def same_angle(rudder: FloatArray, angle: float) -> NDArray[np.bool_]:
    """Return which rudder angles, (n,), equal one angle within the tolerance for orders."""
    tolerance = max(ANGLE_TOLERANCE, ANGLE_TOLERANCE_SHARE * abs(angle))
    return np.asarray(np.abs(rudder - angle) <= tolerance)


def first_crossing(values: FloatArray, level: float) -> float:
    """Find where values first reach a level, by linear interpolation between samples.

    Parameters
    ----------
    values
        (n,) such as the change of heading.
    level
        In the same unit.

    Returns
    -------
    float
        The sample number with its fraction; NaN where the level is never reached or where the
        first sample is already beyond it.

    Examples
    --------
    >>> import numpy as np
    >>> first_crossing(np.array([0.0, 1.0, 3.0]), 2.0)
    1.5
    """
    beyond = np.flatnonzero(values >= level)
    if not len(beyond) or beyond[0] == 0:
        return np.nan
    k = int(beyond[0])
    return k - 1 + float((level - values[k - 1]) / (values[k] - values[k - 1]))
