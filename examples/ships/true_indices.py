"""Indices of manoeuvres from exact trajectories, by the norm's definitions.

IMO Resolution MSC.137(76), "Standards for ship manoeuvrability", 2002. Written apart from the
analysis, so that the two can be compared: nothing is searched for or smoothed, since the execute,
the course and the noise-free motion are known.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEADY_SHARE = 0.2  # the last part of a circle, over which the steady values are means

Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Turn:
    """Motion from the execute on: the heading and the track to the side of the first order.

    `step` is the interval of the n samples, s; `change` the change of heading, rad; `yaw_rate` and
    `speed` are those through the water; `ahead` and `across` the track along the course before the
    execute and at right angles to it, m.
    """

    step: float
    change: Values
    yaw_rate: Values
    speed: Values
    ahead: Values
    across: Values


def turn_from_execute(
    step: float, first: int, side: float, course: float, heading: Values, motion: Values,
    track: NDArray[np.floating[Any]],
) -> Turn:  # fmt: skip
    """Return the turn of a trajectory from its sample `first` on.

    Parameters
    ----------
    step, first
        Interval of the samples, s, and the sample of the execute.
    side
        Of the first order: 1 to starboard, -1 to port.
    course
        Course steered before the execute, rad.
    heading
        (n,) heading, rad, not reduced to a full turn.
    motion
        (n, 3) speed ahead, sway, m/s, and yaw rate, rad/s.
    track
        (n, 2) position north and east, m.
    """
    made = ((track - track[first]) @ [1, 1j] * np.exp(-1j * course))[first:]
    return Turn(
        step,
        (side * (heading - course))[first:],
        side * motion[first:, 2],
        np.hypot(motion[first:, 0], motion[first:, 1]),
        made.real,
        side * made.imag,
    )


def crossing(values: Values, level: float) -> float:
    """Return the sample at which values first reach a level; NaN where they do not."""
    k = int(np.argmax(values >= level))
    if k == 0:
        return np.nan
    return k - 1 + float((level - values[k - 1]) / (values[k] - values[k - 1]))


def _at(sample: float, values: Values) -> float:
    return float(np.interp(sample, np.arange(len(values)), values)) if sample >= 0 else np.nan


def circle_indices(turn: Turn) -> dict[str, float]:
    """Return the indices of a turning circle, SI; NaN for what was not reached."""
    at = {angle: crossing(turn.change, radians(angle)) for angle in (90, 180, 270, 360)}
    steady = slice(-max(1, round(STEADY_SHARE * len(turn.change))), None)
    values = {f"time to {angle}°": k * turn.step for angle, k in at.items()}
    values |= {f"speed at {angle}°": _at(k, turn.speed) for angle, k in at.items()}
    return values | initial_turning(turn, radians(10.0)) | {
        "advance": _at(at[90], turn.ahead),
        "transfer": _at(at[90], turn.across),
        "tactical diameter": _at(at[180], turn.across),
        "steady yaw rate": float(np.mean(turn.yaw_rate[steady])),
        "steady speed": float(np.mean(turn.speed[steady])),
    }  # fmt: skip


def initial_turning(turn: Turn, change: float) -> dict[str, float]:
    """Return time and distance until the heading has changed by an angle, rad."""
    sample = crossing(turn.change, change)
    travelled = np.hypot(np.diff(turn.ahead), np.diff(turn.across))
    return {
        "initial turning time": sample * turn.step,
        "initial turning distance": _at(sample, np.concatenate(([0.0], np.cumsum(travelled)))),
    }


def zigzag_indices(turn: Turn, switch: float, executes: list[int]) -> dict[str, float]:
    """Return the indices of a zig-zag, SI.

    Parameters
    ----------
    turn
        The motion.
    switch
        Change of heading at which the rudder is reversed, rad.
    executes
        Samples of the turn at which it is reversed.
    """
    values = initial_turning(turn, switch)
    for number, (start, stop) in enumerate(pairwise([*executes, len(turn.change)]), 1):
        beyond = (1 if number % 2 else -1) * turn.change[start:stop]
        values[f"overshoot {number}"] = float(np.max(beyond)) - switch
    back = crossing(-turn.change[executes[0] :], 0.0)
    return values | {"reach": (executes[0] + back) * turn.step}
