"""Indices of a zig-zag: initial turning time, overshoots and period.

Source: IMO Resolution MSC.137(76), "Standards for ship manoeuvrability", 2002, sections 5.3.2 and
5.3.3. An *execute* is the instant at which the rudder is reversed, the *switch heading* the change
of heading at which that is done: 10° in a 10/10 zig-zag.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import radians

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .execute import (
    REST_TOLERANCE,
    SMOOTHING_SHARE,
    approach_heading,
    first_crossing,
    same_angle,
    smooth_heading,
)
from .manoeuvre import ManoeuvreIndex, ManoeuvreMotion

REVERSED_SHARE = 0.5  # of the largest rudder angle, exceeded on either side in a zig-zag
HELD_SHARE = 0.9  # of a side's largest angle and of a hold's samples: the rudder is held
REVERSAL_SECS_TOLERANCE = 2.0  # beyond twice the shortest reversal: longer ones were interrupted
SWITCH_STEP, FINE_SWITCH_STEP = radians(5.0), radians(1.0)  # switch headings are multiples of one
MAX_SWITCH_DELAY = radians(2.0)  # of the heading at an execute beyond the switch heading
SWITCH_SCATTER = radians(2.0)  # of the headings at the executes, noise aside
MAX_OVERSHOOTS = 4


def overshoots(heading: FloatArray, executes: Sequence[int], switch: float) -> FloatArray:
    """Compute the overshoots of a zig-zag from its heading and its executes.

    Parameters
    ----------
    heading
        (n,) change from the approach heading, rad.
    executes
        The k samples at which the rudder was reversed.
    switch
        The switch heading, rad, positive.

    Returns
    -------
    (k - 1,) rad
        How far the heading goes beyond the switch heading after each execute but the last.

    Examples
    --------
    >>> import numpy as np
    >>> overshoots(np.array([0.0, 0.2, 0.3, 0.0, -0.2]), [1, 4], switch=0.2).round(2).tolist()
    [0.1]
    """
    return np.array(
        [float(np.max(np.abs(heading[start:end]))) - switch for start, end in pairwise(executes)]
    )


def rudder_holds(rudder: FloatArray, execute: int) -> list[tuple[int, int]]:
    """Find the intervals in which the rudder is held over, alternately to either side.

    Parameters
    ----------
    rudder
        (n,) rad, free of spikes.
    execute
        The sample of the first rudder order.

    Returns
    -------
    list of (first, last)
        The first and the last sample of each interval.
    """
    size = np.abs(rudder)
    over = execute + np.flatnonzero(size[execute:] > REVERSED_SHARE * np.max(size[execute:]))
    sides = np.split(over, np.flatnonzero(np.diff(np.sign(rudder[over]))) + 1)
    return [_hold(size, side) for side in sides]


def _hold(size: FloatArray, over: NDArray[np.int64]) -> tuple[int, int]:
    """Return the first and the last sample at the median angle of one side."""
    held = over[size[over] > HELD_SHARE * np.max(size[over])]
    angle = np.sort(size[held])[len(held) // 2]
    return int(held[0]), int(held[np.abs(size[held] - angle) <= REST_TOLERANCE][-1])


def is_zigzag(rudder: FloatArray, execute: int, holds: list[tuple[int, int]], dt: float) -> bool:
    """Detect a zig-zag: the rudder goes straight from an angle to its opposite, twice or more.

    The last hold may be cut short by the end of the run.

    Parameters
    ----------
    rudder
        (n,) rad, free of spikes.
    execute
        The sample of the first rudder order.
    holds
        As of `rudder_holds`.
    dt
        Sample interval, s.
    """
    parts = [np.abs(rudder[first : last + 1]) for first, last in holds]
    if len(parts) < 3:
        return False
    levels = np.array([np.median(part) for part in parts])
    angle = float(np.max(levels[:-1]) + np.min(levels[:-1])) / 2  # the rudder may have an offset
    held = all(
        np.mean(same_angle(part, level)) > HELD_SHARE
        for part, level in zip(parts, levels, strict=True)
    )
    reversal_secs = np.diff(np.array([execute, *np.ravel(holds)]))[::2] * dt
    straight = np.max(reversal_secs) <= 2 * np.min(reversal_secs[1:]) + REVERSAL_SECS_TOLERANCE
    return bool(
        held
        and straight
        and np.all(same_angle(levels[:-1], angle))
        and levels[-1] < angle / HELD_SHARE
    )


def zigzag_indices(
    execute: int,
    holds: list[tuple[int, int]],
    measured: ManoeuvreMotion,
    simulated: ManoeuvreMotion,
    dt: float,
) -> Iterator[ManoeuvreIndex]:
    """Compare the indices of a measured and a simulated zig-zag under the same rudder.

    Parameters
    ----------
    execute
        The sample of the first rudder order.
    holds
        The intervals in which the rudder is held, as of `rudder_holds`.
    measured, simulated
        The motion at the same n samples; only the headings are used.
    dt
        Sample interval, s.

    Yields
    ------
    ManoeuvreIndex
        Initial turning time (s), up to `MAX_OVERSHOOTS` overshoots (rad) and period (s); none
        where the executes have no common switch heading.
    """
    headings = (measured.heading, simulated.heading)
    executes = [last for _, last in holds[:-1]]
    half_width = round(SMOOTHING_SHARE * float(np.min(np.diff(executes))))
    smooth = [smooth_heading(heading, half_width) for heading in headings]
    changes = [
        each - approach_heading(heading, execute, dt)
        for each, heading in zip(smooth, headings, strict=True)
    ]
    noise = float(np.std(headings[0] - smooth[0]))
    switch = switch_heading(changes[0][executes], noise)
    if switch is None:
        return
    ends = [*executes[1:], holds[-1][1] + 1]
    side = float(np.sign(changes[0][executes[0]]))
    values = [
        zigzag_values(change, execute, executes, ends[-1], side * switch) for change in changes
    ]
    yield ManoeuvreIndex(
        "initial turning time", "s", *(v["initial turning time"] * dt for v in values)
    )
    for number in range(1, min(len(executes), MAX_OVERSHOOTS) + 1):
        beyond = [v[f"overshoot {number}"] for v in values]
        if all(np.isfinite(beyond)):
            yield ManoeuvreIndex(f"overshoot {number}", "rad", *beyond)
    if np.isfinite(values[0]["period"]):
        yield ManoeuvreIndex("period", "s", *(v["period"] * dt for v in values))


def zigzag_values(
    change: FloatArray, execute: float, executes: Sequence[int], end: int, switch: float
) -> dict[str, float]:
    """Compute the indices of a zig-zag from its heading.

    Parameters
    ----------
    change
        (n,) change from the approach heading, rad, free of noise.
    execute
        The sample of the first order, with its fraction.
    executes
        The samples at which the rudder was reversed.
    end
        The sample after the last one.
    switch
        The switch heading, rad, with the sign of the first turn.

    Returns
    -------
    dict
        In samples ``initial turning time``, ``reach`` (until the heading is the approach heading
        again) and ``period``; in rad ``overshoot 1`` and so on. NaN for what was not reached.

    Examples
    --------
    >>> import numpy as np
    >>> change = 0.3 * np.sin(np.arange(100) / 10)
    >>> values = zigzag_values(change, 0.0, [10, 40, 70], 100, switch=0.2)
    >>> round(values["overshoot 1"], 3), round(values["reach"], 1)
    (0.1, 31.4)
    """
    first = int(execute)
    side, switch = float(np.sign(switch)), abs(switch)
    crossing = first + first_crossing(side * change[first:], switch)
    back = executes[0] + first_crossing(-side * change[executes[0] : end], 0.0)
    values = {
        "initial turning time": crossing - execute,
        "reach": back - execute,
        "period": _period(change[first:end], switch),
    }
    for number, (start, stop) in enumerate(pairwise([*executes, end]), 1):
        beyond = side if number % 2 else -side
        values[f"overshoot {number}"] = _overshoot(beyond * change[start:stop], switch)
    return values


def switch_heading(changes: FloatArray, noise: float) -> float | None:
    """Estimate the change of heading at which the rudder was to be reversed.

    A helmsman is late rather than early: it is the multiple of `SWITCH_STEP` just passed, or else
    the nearest multiple of `FINE_SWITCH_STEP`.

    Parameters
    ----------
    changes
        (k,) changes of heading at the executes, rad.
    noise
        Standard deviation of the heading's noise, rad.

    Returns
    -------
    float or None
        In rad, positive; None where the executes do not alternate or scatter too much.

    Examples
    --------
    >>> import numpy as np
    >>> round(float(np.degrees(switch_heading(np.radians([10.4, -10.9, 10.1]), noise=0.0))), 6)
    10.0
    """
    typical = float(np.median(np.abs(changes)))
    switch = float(np.floor((typical + FINE_SWITCH_STEP) / SWITCH_STEP) * SWITCH_STEP)
    if switch == 0 or typical - switch > MAX_SWITCH_DELAY:
        switch = float(np.round(typical / FINE_SWITCH_STEP) * FINE_SWITCH_STEP)
    alternating = np.all(changes[1:] * changes[:-1] < 0)
    alike = np.all(np.abs(np.abs(changes) - typical) < SWITCH_SCATTER + noise)
    return switch if switch and alternating and alike else None


def _overshoot(heading: FloatArray, switch: float) -> float:
    """Return the largest excess over the switch; NaN where the heading has not come back."""
    greatest = float(np.max(heading))
    return greatest - switch if heading[-1] < greatest - REST_TOLERANCE else np.nan


def _period(change: FloatArray, switch: float) -> float:
    """Return the mean time between like crossings of the approach heading, in samples.

    A crossing goes from half the switch heading on one side to as much on the other, so that noise
    counts none. NaN with fewer than three crossings.
    """
    far = np.flatnonzero(np.abs(change) > switch / 2)
    side = np.sign(change[far])
    crossings = [
        far[k] + first_crossing(-side[k] * change[far[k] : far[k + 1] + 1], 0.0)
        for k in np.flatnonzero(np.diff(side))
    ]
    return (
        float(np.mean(np.subtract(crossings[2:], crossings[:-2]))) if len(crossings) > 2 else np.nan
    )
