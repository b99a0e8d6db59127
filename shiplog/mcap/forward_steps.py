"""Steps forward of a recorder's clock that a step back by the same size belongs to."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.types import TimeArray

from .clock_steps import (
    MAX_INTERVAL_SPREAD,
    ChannelTimes,
    ClockStep,
    common_steps,
    falling_rows,
    is_steady,
    sampling_interval,
)

MIN_PAUSE_INTERVALS = 8.0  # of a gap in all channels that may be a step forward
MIN_FORWARD_NS = 1_000_000_000  # of a shorter gap, a delay of the recorder is the cause


def pause_rows(times_ns: TimeArray) -> list[int]:
    """Return the rows of a channel after gaps of many sampling intervals.

    Parameters
    ----------
    times_ns
        (n,) times in the order of the file.

    Examples
    --------
    >>> pause_rows(np.array([0, 10, 20, 30, 40, 200, 210, 220]))
    [5]
    """
    interval, spread = sampling_interval(times_ns)
    if not 0.0 < spread + 1.0 <= MAX_INTERVAL_SPREAD * interval:
        return []
    limit = MIN_PAUSE_INTERVALS * interval
    return (np.flatnonzero(np.diff(times_ns) > limit) + 1).tolist()


def returned_steps(channels: Sequence[ChannelTimes]) -> list[tuple[ClockStep, ClockStep]]:
    """Return the steps forward of a clock that was set back by the same size, before or after.

    The clock was ahead or behind for a while. Parts of a file in another order have steps too, but
    successive ones have other sizes: they differ by the length of a part.

    Parameters
    ----------
    channels
        The channels, with their times in the order of the file.

    Returns
    -------
    pairs
        The steps forward and back, whose sizes have the sum zero.
    """
    forward = _common_pauses(channels)
    if not forward:
        return []
    falls = common_steps(channels, [falling_rows(c.times_ns)[0] for c in channels])
    falls = [step for step in falls if not step.steady_names]
    tolerance = max(sampling_interval(c.times_ns)[0] for c in channels if is_steady(c))
    steps = sorted([*forward, *falls], key=lambda step: step.position)
    pairs = []
    last: ClockStep | None = None
    for step in steps:
        if last is not None and abs(last.size_ns + step.size_ns) <= tolerance:
            up, down = (last, step) if last.size_ns > 0 else (step, last)
            pairs.append((replace(up, size_ns=-down.size_ns), down))
            last = None
        else:
            last = step
    return pairs


def _common_pauses(channels: Sequence[ChannelTimes]) -> list[ClockStep]:
    """Return the gaps that all channels of steady rate have in common, as steps forward."""
    steady = [channel for channel in channels if is_steady(channel)]
    rows = [pause_rows(channel.times_ns) for channel in steady]
    if not steady or not all(rows):
        return []
    return [
        step
        for step in common_steps(steady, rows)
        if len(step.names) == len(steady) and step.size_ns > MIN_FORWARD_NS
    ]
