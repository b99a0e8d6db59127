"""Indices of a turning circle.

Source: IMO Resolution MSC.137(76), "Standards for ship manoeuvrability", 2002, section 5.3.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, radians

import numpy as np
from numpy.typing import NDArray

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
MIN_FITTED_ARC = radians(150.0)  # of a circle laid through the positions of a steady turn
COURSE_SECS = 5.0  # to either side, over which the course made good is taken
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
    time_90_secs, time_180_secs, time_270_secs, time_360_secs
        Time from the rudder order to these changes of heading, s.
    speed_90, speed_180, speed_270, speed_360
        Speed at these changes of heading, m/s.
    steady_yaw_rate
        Magnitude over the second half of the time that the rudder is held over, rad/s.
    steady_speed
        Speed through the water over the same time, m/s.
    steady_diameter
        Of a circle through the positions of the last 180°, m; from speed and yaw rate where the
        turn is too short for it.
    drift_angle
        Of the midship point in the steady turn, rad; positive where the bow points inwards.
    """

    advance: float
    transfer: float
    tactical_diameter: float
    time_90_secs: float
    time_180_secs: float
    time_270_secs: float
    time_360_secs: float
    speed_90: float
    speed_180: float
    speed_270: float
    speed_360: float
    steady_yaw_rate: float
    steady_speed: float
    steady_diameter: float
    drift_angle: float


def turning_circle(
    motion: ManoeuvreMotion,
    rudder: FloatArray,
    dt: float,
    *,
    approach: float | None = None,
    execute: float = 0.0,
) -> TurningCircle:
    """Compute the indices of a turning circle.

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
    execute
        The sample of the rudder order, with its fraction.

    Returns
    -------
    TurningCircle
        The indices, positive for a turn to either side.
    """
    hard_over = np.flatnonzero(np.abs(rudder) > HARD_OVER_SHARE * np.max(np.abs(rudder)))
    side = float(np.sign(np.median(rudder[hard_over])))
    steady = hard_over[len(hard_over) // 2 :]
    initial = float(motion.heading[0]) if approach is None else approach
    turned = side * (motion.heading - initial)
    at = {angle: first_crossing(turned, radians(angle)) for angle in (90, 180, 270, 360)}
    samples = np.arange(len(turned))
    ahead = np.array([np.cos(initial), np.sin(initial)])
    abeam = side * np.array([-ahead[1], ahead[0]])
    start = np.array([np.interp(execute, samples, column) for column in motion.positions.T])
    displacement = motion.positions - start

    def value(values: FloatArray, angle: int) -> float:
        return float(np.interp(at[angle], samples, values)) if np.isfinite(at[angle]) else np.nan

    along, across = displacement @ ahead, displacement @ abeam
    yaw_rate = float(np.abs(np.median(motion.yaw_rate[steady])))
    speed = float(np.median(motion.speed[steady]))
    return TurningCircle(
        advance=value(along, 90),
        transfer=value(across, 90),
        tactical_diameter=value(across, 180),
        time_90_secs=(at[90] - execute) * dt,
        time_180_secs=(at[180] - execute) * dt,
        time_270_secs=(at[270] - execute) * dt,
        time_360_secs=(at[360] - execute) * dt,
        speed_90=value(motion.speed, 90),
        speed_180=value(motion.speed, 180),
        speed_270=value(motion.speed, 270),
        speed_360=value(motion.speed, 360),
        steady_yaw_rate=yaw_rate,
        steady_speed=speed,
        steady_diameter=_steady_diameter(motion.positions, turned, 2 * speed / yaw_rate)
        if yaw_rate > 0
        else np.nan,
        drift_angle=side * _drift(motion, steady, dt),
    )


def _steady_diameter(positions: FloatArray, turned: FloatArray, otherwise: float) -> float:
    """Return the diameter of the circle through the positions of the last half turn, m.

    The least-squares circle in its algebraic form (Kåsa, "A circle fitting procedure and its error
    analysis", 1976), which is linear.
    """
    since = max(pi, float(np.max(turned)) - pi)  # the turn is steadiest at its end
    late = np.flatnonzero((turned >= since) & np.isfinite(positions).all(axis=1))
    if not len(late) or turned[late[-1]] - since < MIN_FITTED_ARC:
        return otherwise
    points = positions[late] - positions[late].mean(axis=0)
    matrix = np.column_stack((2 * points, np.ones(len(points))))
    solution = np.linalg.lstsq(matrix, np.sum(points**2, axis=1))[0]
    return float(2 * np.sqrt(solution[2] + solution[0] ** 2 + solution[1] ** 2))


def _drift(motion: ManoeuvreMotion, steady: NDArray[np.int64], dt: float) -> float:
    """Return the mean heading minus course made good through the water, rad."""
    k = max(1, round(COURSE_SECS / dt))
    inner = steady[(steady >= k) & (steady < len(motion.heading) - k)]
    steps = (motion.positions[inner + k] - motion.positions[inner - k]) @ [1, 1j]
    made_good = (steps * np.exp(-1j * motion.heading[inner]))[np.isfinite(steps)]
    return float(-np.angle(np.mean(made_good))) if len(made_good) else np.nan


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
    for key, (name, unit) in NAMES_AND_UNITS.items():
        index = ManoeuvreIndex(name, unit, *(getattr(circle, key) for circle in circles))
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
