"""Whether the yaw rate agrees with the heading: a gyro that is off shows in the long run."""

import numpy as np

from .clock import gap_threshold_secs
from .types import FloatArray, TrialLog
from .units import factor

BLOCKS = 8  # of a record, each telling the bias for itself
SIGNIFICANT = 4.0  # standard errors
LEAST_DRIFT = np.radians(1.0)  # rad over the record: less does not matter


def gyro_bias_warning(log: TrialLog) -> str | None:
    """A sentence if the integrated yaw rate drifts away from the heading, else None.

    The bias is the mean over blocks of the record of the integral's gain on the heading, its error
    their scatter; blocks with a gap in either channel are left out. None where a channel is
    missing, or too little of it is whole.
    """
    biases = _block_biases(log, 1.0)
    contrary = _block_biases(log, -1.0)
    if len(biases) >= BLOCKS // 2 and np.std(contrary) < 0.1 * np.std(biases):
        return f"{log['heading'].topic}: counts to port; set the heading's sign = -1 in the layout"
    if len(biases) < BLOCKS // 2:
        return None
    bias = float(np.mean(biases))
    error = float(np.std(biases, ddof=1)) / np.sqrt(len(biases))
    if abs(bias) < SIGNIFICANT * error or abs(bias) * log.duration_secs < LEAST_DRIFT:
        return None
    per_second, its_error = (x * factor("rad/s", "deg/s") for x in (bias, error))
    return (
        f"{log['yaw_rate'].topic}: off by {per_second:+.4f} ± {2 * its_error:.4f} deg/s "
        "against the heading; a bias passes for a yaw moment and spoils b1, b2, b3 and e"
    )


def _block_biases(log: TrialLog, sign: float) -> FloatArray:
    """How fast the integral of the yaw rate gains on the heading, rad/s, in each whole block."""
    gyro, compass = log.get("yaw_rate"), log.get("heading")
    if gyro is None or compass is None:
        return np.zeros(0)
    rate_known, heading_known = (np.isfinite(c.values) for c in (gyro, compass))
    at = gyro.measured_ns[rate_known] * 1e-9
    compass_at = compass.measured_ns[heading_known] * 1e-9
    if min(len(at), len(compass_at)) < 4 * BLOCKS:
        return np.zeros(0)
    rate, heading = gyro.values[rate_known], sign * np.unwrap(compass.values[heading_known])
    turned = np.concatenate(([0.0], np.cumsum(np.diff(at) * (rate[1:] + rate[:-1]) / 2)))
    start, end = max(at[0], compass_at[0]), min(at[-1], compass_at[-1])
    edges = np.linspace(start, end, BLOCKS + 1)
    gain = np.interp(edges, at, turned) - np.interp(edges, compass_at, heading)
    whole = np.ones(BLOCKS, bool)
    for times, channel in ((at, gyro), (compass_at, compass)):
        for i in np.flatnonzero(np.diff(times) > gap_threshold_secs(channel)):
            first, last = np.searchsorted(edges, times[i : i + 2]) - 1
            whole[max(first, 0) : last + 1] = False
    biases: FloatArray = (np.diff(gain) / np.diff(edges))[whole]
    return biases
