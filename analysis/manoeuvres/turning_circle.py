"""Indices of a turning circle.

Source: IMO Resolution MSC.137(76), "Standards for ship manoeuvrability", 2002, section 5.3.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import pi

import numpy as np

from shiplog.types import FloatArray

from .execute import (
    MIN_RUDDER_ORDER,
    SMOOTHING_SHARE,
    approach_heading,
    first_crossing,
    same_angle,
    smooth_heading,
)
from .manoeuvre import ManoeuvreIndex, ManoeuvreMotion

MIN_CIRCLE_TURN = pi / 2  # change of heading with the rudder held
MAX_TURN_BEFORE_HOLD = MIN_CIRCLE_TURN / 2  # until the rudder has reached its angle
HARD_OVER_SHARE = 0.8  # of the largest rudder angle: beyond it the rudder is held over
NAMES_AND_UNITS = {
    "advance": ("advance", "m"),
    "transfer": ("transfer", "m"),
    "tactical_diameter": ("tactical diameter", "m"),
    "time_90_secs": ("time to 90°", "s"),
    "time_180_secs": ("time to 180°", "s"),
    "steady_yaw_rate": ("steady yaw rate", "rad/s"),
    "steady_speed": ("steady speed", "m/s"),
}


@dataclass(frozen=True)
class TurningCircle:
    """The indices of a turning circle; NaN for what was not reached.

    Attributes
    ----------
    advance, transfer
        Distance along and across the approach heading at 90° change of heading, m.
    tactical_diameter
        Distance across it at 180° change of heading, m.
    time_90_secs, time_180_secs
        Time from the rudder order to these changes of heading, s.
    steady_yaw_rate
        Magnitude over the second half of the time that the rudder is held over, rad/s.
    steady_speed
        Speed through the water over the same time, m/s.
    """

    advance: float
    transfer: float
    tactical_diameter: float
    time_90_secs: float
    time_180_secs: float
    steady_yaw_rate: float
    steady_speed: float


def turning_circle(
    motion: ManoeuvreMotion, rudder: FloatArray, dt: float, *, approach: float | None = None
) -> TurningCircle:
    """Compute the indices of a turning circle whose rudder order is at the first sample.

    Parameters
    ----------
    motion
        The ship's motion at n samples.
    rudder
        (n,) rad.
    dt
        Sample interval, s.
    approach
        The approach heading, rad; by default the heading of the first sample, which may be too
        noisy.

    Returns
    -------
    TurningCircle
        The indices, positive for a turn to either side.
    """
    hard_over = np.flatnonzero(np.abs(rudder) > HARD_OVER_SHARE * np.max(np.abs(rudder)))
    side = float(np.sign(np.median(rudder[hard_over])))
    steady = hard_over[len(hard_over) // 2 :]
    heading = motion.heading
    initial = float(heading[0]) if approach is None else approach
    turned = side * (heading - initial)
    ahead = np.array([np.cos(initial), np.sin(initial)])
    abeam = side * np.array([-ahead[1], ahead[0]])
    displacement = motion.positions - motion.positions[0]
    at_90, at_180 = first_crossing(turned, pi / 2), first_crossing(turned, pi)
    samples = np.arange(len(turned))
    along, across = displacement @ ahead, displacement @ abeam
    return TurningCircle(
        advance=float(np.interp(at_90, samples, along)) if np.isfinite(at_90) else np.nan,
        transfer=float(np.interp(at_90, samples, across)) if np.isfinite(at_90) else np.nan,
        tactical_diameter=(
            float(np.interp(at_180, samples, across)) if np.isfinite(at_180) else np.nan
        ),
        time_90_secs=at_90 * dt,
        time_180_secs=at_180 * dt,
        steady_yaw_rate=float(np.abs(np.median(motion.yaw_rate[steady]))),
        steady_speed=float(np.median(motion.speed[steady])),
    )


def held_turn(rudder: FloatArray, execute: int, heading: FloatArray) -> tuple[int, int]:
    """Find how long the rudder is held over in a turning circle.

    Parameters
    ----------
    rudder, heading
        (n,) rad.
    execute
        The sample of the rudder order, as of `first_execute`.

    Returns
    -------
    end
        The sample at which the rudder leaves its angle, or n.
    half_width
        Samples for `smooth_heading`. Both are 0 where the rudder is not held at one angle for a
        turn of `MIN_CIRCLE_TURN`: the run is no turning circle.
    """
    turned = np.abs(heading[execute:] - heading[execute])
    if np.max(turned) < MIN_CIRCLE_TURN:
        return 0, 0
    rudder, quarter = rudder[execute:], int(np.argmax(turned >= MIN_CIRCLE_TURN))
    angle = float(np.median(rudder[quarter // 2 : quarter + 1]))
    held = same_angle(rudder, angle)
    first = int(np.argmax(held))
    released = first + np.flatnonzero(~held[first:])
    end = int(released[0]) if len(released) else len(rudder)
    deflecting = rudder[: first + 1] * np.sign(angle)
    came_back = np.max(np.maximum.accumulate(deflecting) - deflecting) > MIN_RUDDER_ORDER
    if (
        end <= quarter
        or turned[first] > MAX_TURN_BEFORE_HOLD
        or came_back
        or abs(angle) < MIN_RUDDER_ORDER
    ):
        return 0, 0
    return execute + end, round(SMOOTHING_SHARE * quarter)


def turning_circle_indices(
    rudder: FloatArray,
    execute: int,
    measured: ManoeuvreMotion,
    simulated: ManoeuvreMotion,
    dt: float,
) -> Iterator[ManoeuvreIndex]:
    """Compare the indices of a measured and a simulated turning circle.

    Parameters
    ----------
    rudder
        (n,) rad, free of spikes.
    execute
        The sample of the rudder order.
    measured, simulated
        The motion at the same n samples.
    dt
        Sample interval, s.

    Yields
    ------
    ManoeuvreIndex
        Every index that was measured; none if the run is no turning circle.
    """
    end, half_width = held_turn(rudder, execute, measured.heading)
    if not end:
        return
    circles = [
        _smoothed_circle(motion, rudder[:end], execute, half_width, dt)
        for motion in (measured, simulated)
    ]
    for each in fields(TurningCircle):
        name, unit = NAMES_AND_UNITS[each.name]
        index = ManoeuvreIndex(name, unit, *(getattr(circle, each.name) for circle in circles))
        if np.isfinite(index.measured):
            yield index


def _smoothed_circle(
    motion: ManoeuvreMotion, rudder: FloatArray, execute: int, half_width: int, dt: float
) -> TurningCircle:
    """Compute the indices of the samples from `execute` to the end of `rudder`."""
    end = len(rudder)
    heading = smooth_heading(motion.heading[:end], half_width)
    turn = ManoeuvreMotion(
        heading[execute:],
        motion.yaw_rate[execute:end],
        motion.speed[execute:end],
        motion.positions[execute:end],
    )
    approach = approach_heading(heading, execute, dt)
    return turning_circle(turn, rudder[execute:], dt, approach=approach)
