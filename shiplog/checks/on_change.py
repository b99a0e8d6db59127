"""Detection of channels that are written only when their value changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import Channel, FloatArray

INTERPOLATION_KEY = "interpolation"  # of a channel's metadata
INTERPOLATIONS = ("hold", "linear")
ORDER_WORDS = ("order", "command", "cmd", "demand", "setpoint", "set_point", "desired", "autopilot")

MAX_SAMPLING_SECS = 10.0  # mean interval beyond which a sensor of an input does not sample
MIN_REGULAR_INTERVALS = 4  # fewer do not show that a channel is sampled regularly
MIN_CHANGES = 3  # fewer do not show that a frequent channel is written on change
REGULAR_SHARE = 0.9  # of the intervals near their median, from which sampling is regular
MAX_UNCHANGED_SHARE = 0.05  # of the samples, which repeat the value before
MIN_CHANGE_RATIO = 0.3  # quantile 0.1 of the changes over their median: 0.19 for Gaussian noise
MAX_STEP_RATIO = 1.5  # change over a long interval, in median changes, if nothing was lost in it


@dataclass(frozen=True)
class HoldStats:
    """A channel that keeps each value until its next sample (zero-order hold).

    Attributes
    ----------
    stated
        Whether the channel's metadata states it; otherwise it was detected.
    longest_secs
        Longest interval between two samples, s.
    largest_step
        Largest change from one sample to the next, in the channel's unit.
    max_rate
        Rate at which the signal moves to a new value, unit/s; infinite for steps. That of the
        steering gear, where the channel is the order of the rudder.
    """

    stated: bool
    longest_secs: float
    largest_step: float
    max_rate: float = np.inf


def stated_interpolation(channel: Channel) -> str:
    """Return the interpolation that the channel's metadata states; empty where it states none.

    Examples
    --------
    >>> times = np.array([0])
    >>> values = np.array([80.0])
    >>> rpm = Channel("rpm", "plc", "rpm", times, times, values, metadata={"interpolation": "hold"})
    >>> stated_interpolation(rpm)
    'hold'
    """
    return channel.metadata.get(INTERPOLATION_KEY, "").strip().lower()


def is_order(source: str) -> bool:
    """Return whether the name of a source is that of an order instead of a measured value.

    Examples
    --------
    >>> is_order("order"), is_order("feedback")
    (True, False)
    """
    return any(word in source.lower() for word in ORDER_WORDS)


def is_written_on_change(
    intervals: FloatArray, changes: FloatArray, gap_secs: float, *, order: bool
) -> bool:
    """Decide whether an input is written only when it changes, or sampled by a clock.

    An input is sampled by a clock if its intervals are regular, those in which it changes included.
    It is written on change if its samples are too few for a sensor; if it repeats its value only at
    the regular intervals of a keep-alive message, but changes between these; or if nearly every
    sample changes the value by a step, never by noise, and the intervals are irregular or change it
    by one step however long they are (a deadband).

    Parameters
    ----------
    intervals
        (n,) intervals between samples, s, all positive.
    changes
        (n,) magnitudes of the changes over these intervals.
    gap_secs
        Longest interval that is not a gap in a sampled channel, s.
    order
        Whether the source is that of an order, which need not change in steps of one size.

    Examples
    --------
    >>> orders = np.array([20.0, 40.0, 40.0, 40.0])
    >>> is_written_on_change(np.array([10.0, 72.8, 174.8, 180.3]), orders, 500.0, order=True)
    True
    >>> is_written_on_change(np.full(200, 3.0), np.full(200, 0.1), 15.0, order=False)
    False
    """
    if not len(intervals):
        return True
    changed = changes > 0
    unchanged_share = 1.0 - float(np.mean(changed))
    in_steps = unchanged_share <= MAX_UNCHANGED_SHARE and (order or _steps_only(changes[changed]))
    typical = float(np.median(intervals))
    if intervals.mean() > MAX_SAMPLING_SECS:
        return in_steps or not _regular(intervals, changed)
    if np.count_nonzero(changed) < MIN_CHANGES:
        return False
    return _has_keep_alive(intervals, changed) or (
        in_steps
        and (_near(intervals, typical, 0.25) < 0.5 or _has_deadband(intervals, changes, gap_secs))
    )


def _near(intervals: FloatArray, typical: float, tolerance: float) -> float:
    """Return the share of the intervals that differ by less than a tolerance from a typical one."""
    return float(np.mean(np.abs(intervals - typical) <= tolerance * typical))


def _steps_only(changes: FloatArray) -> bool:
    """Whether changes are steps: the small ones are not much smaller than the median."""
    if not len(changes):
        return False
    return bool(np.quantile(changes, 0.1) >= MIN_CHANGE_RATIO * np.median(changes))


def _regular(intervals: FloatArray, changed: NDArray[np.bool_]) -> bool:
    """Whether samples come at one interval, those that change the value included."""
    typical = float(np.median(intervals))
    if len(intervals) < MIN_REGULAR_INTERVALS or _near(intervals, typical, 0.05) < REGULAR_SHARE:
        return False
    return not changed.any() or _near(intervals[changed], typical, 0.05) >= 0.5


def _has_keep_alive(intervals: FloatArray, changed: NDArray[np.bool_]) -> bool:
    """Whether values are repeated at one long interval only, and changed within shorter ones."""
    repeated = intervals[~changed]
    if len(repeated) < MIN_REGULAR_INTERVALS:
        return False
    period = float(np.median(repeated))
    return (
        _near(repeated, period, 0.1) >= REGULAR_SHARE
        and _near(intervals[changed], period, 0.1) < 0.5
        and bool(np.median(intervals[changed]) < period)
    )


def _has_deadband(intervals: FloatArray, changes: FloatArray, gap_secs: float) -> bool:
    """Whether there are long intervals, over which the value changes by one step all the same."""
    long = intervals > gap_secs
    if not long.any():
        return False
    limit = MAX_STEP_RATIO * float(np.median(changes))
    return bool(np.mean(changes[long] <= limit) >= REGULAR_SHARE)
