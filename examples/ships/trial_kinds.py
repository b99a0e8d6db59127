"""Kinds of trials that independent ships sail, and the true indices of each.

The true indices are computed from the noise-free motion by the definitions of the norms, apart from
those of shiplog. Where a definition refers to the end of a manoeuvre, that is the end of the log,
or for speed runs the span of the run that was found.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from math import inf, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind, SailedManoeuvre

from .helmsmen import NewCourse, Programme, RateKeeper, TurnOnce
from .sea_trial import STEP, SailedTrial, Steering, TrialShip, sail

Values = NDArray[np.float64]
CIRCLE_SECS = {"mariner": 1100.0, "kvlcc2": 1400.0, "seiun-maru": 450.0}
ZIGZAG_SECS = {"mariner": 500.0, "kvlcc2": 900.0, "seiun-maru": 400.0}
SPIRAL_DEG = (15, 10, 5, 3, 1, -1, -3, -5, -10, -15, -10, -5, -3, -1, 1, 3, 5, 10, 15)
SPIRAL_RATES = (0.17, 0.12, 0.07, 0.02, -0.02, -0.07, -0.12, -0.17)  # r L/U
DIRECT_PACE, REVERSE_PACE = 6.0, 9.0  # of a level, in ship lengths at the approach speed
STEADY_SHARE = 0.4  # of a level's end, over which rudder and yaw rate are averaged
WEAVE = radians(2.0)  # of a helmsman who steers to a yaw rate
ASTERN_SHARE, REVERSING_SECS = 0.6, 20.0  # of the revolutions; for as many as those ahead
SLOW_SHARE, RAISING_SECS = 0.5, 60.0  # of the revolutions before an acceleration
RUN_SECS = {"mariner": 480.0, "kvlcc2": 900.0, "seiun-maru": 480.0}
MEAN_SECS = 10.0  # before an execute


@dataclass(frozen=True)
class Voyage:
    """A trial that was sailed, and its true indices given what was found in its log."""

    trial: SailedTrial
    true: Callable[[Sequence[SailedManoeuvre]], dict[str, float]]


@dataclass(frozen=True)
class TrialKind:
    """A kind of trial.

    Attributes
    ----------
    expected
        The manoeuvres that are to be found, and no other.
    scored
        Which of them has the indices.
    sail
        Sails it from the approach given, to the side of the approach's angle.
    ships
        The ships that can sail it.
    alternative
        What may be found instead, where the log of both is the same.
    """

    expected: tuple[ManoeuvreKind, ...]
    sail: Callable[[Steering], Voyage]
    scored: int = 0
    ships: tuple[str, ...] = ("mariner", "kvlcc2", "seiun-maru")
    alternative: tuple[ManoeuvreKind, ...] = ()


@dataclass(frozen=True)
class _Motion:
    """The true motion from an execute on, in the axes of the course steered."""

    ship: TrialShip
    secs: float
    change: Values
    ahead: Values
    across: Values
    speed: Values
    surge: Values
    yaw_rate: Values
    travelled: Values

    @classmethod
    def since(cls, trial: SailedTrial, execute: float, course: float, side: float) -> "_Motion":
        first = round(execute / STEP)
        made = ((trial.track - trial.track[first]) @ [1, 1j] * np.exp(-1j * course))[first:]
        return cls(
            trial.ship, execute, side * (trial.heading[first:] - course), made.real,
            side * made.imag, np.hypot(trial.speed, trial.sway)[first:], trial.speed[first:],
            side * trial.yaw_rate[first:],
            np.concatenate(([0.0], np.cumsum(np.abs(np.diff(made))))),
        )  # fmt: skip

    def turning(self, angle: float) -> dict[str, float]:
        at = crossing(self.change, angle)
        return {
            "initial turning time": at * STEP,
            "initial turning distance": value_at(at, self.travelled),
        }


def crossing(values: Values, level: float) -> float:
    """Return the sample at which values first reach a level; NaN where they do not."""
    k = int(np.argmax(values >= level))
    if k == 0:
        return np.nan
    return k - 1 + float((level - values[k - 1]) / (values[k] - values[k - 1]))


def value_at(sample: float, values: Values) -> float:
    """Return values, (n,), at a sample with its fraction; NaN at NaN."""
    return float(np.interp(sample, np.arange(len(values)), values)) if sample >= 0 else np.nan


def _motion(trial: SailedTrial, approach: Steering) -> _Motion:
    return _Motion.since(trial, approach.execute, approach.course, float(np.sign(approach.angle)))


def turning_circle(approach: Steering) -> Voyage:
    """Sail a turning circle at 35°."""
    steering = replace(approach, angle=approach.side * radians(35.0))
    trial = sail(approach.ship, steering, CIRCLE_SECS[approach.ship.name], course=approach.course)

    def true(_found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        motion = _motion(trial, steering)
        values = motion.turning(radians(10.0))
        at = {angle: crossing(motion.change, radians(angle)) for angle in (90, 180, 270, 360)}
        for angle, k in at.items():
            values[f"time to {angle}°"] = k * STEP
            values[f"speed at {angle}°"] = value_at(k, motion.speed)
        values["advance"] = value_at(at[90], motion.ahead)
        values["transfer"] = value_at(at[90], motion.across)
        values["tactical diameter"] = value_at(at[180], motion.across)
        return values

    return Voyage(trial, true)


def zigzag(approach: Steering, angle_deg: float) -> Voyage:
    """Sail a zig-zag of equal rudder angle and switch heading."""
    angle = radians(angle_deg)
    steering = replace(approach, angle=approach.side * angle, switch=angle)
    trial = sail(approach.ship, steering, ZIGZAG_SECS[approach.ship.name], course=approach.course)

    def true(_found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        motion = _motion(trial, steering)
        change, first = motion.change, round(steering.execute / STEP)
        values = motion.turning(angle)
        edges = [round(time / STEP) - first for time in steering.executes] + [len(change)]
        for number, (start, stop) in enumerate(pairwise(edges), 1):
            beyond = (1 if number % 2 else -1) * change[start:stop]
            values[f"overshoot {number}"] = float(np.max(beyond)) - angle
        values["reach"] = (edges[0] + crossing(-change[edges[0] :], 0.0)) * STEP
        return values

    return Voyage(trial, true)


def initial_turning(approach: Steering) -> Voyage:
    """Turn with 10° of rudder until the heading has changed by 20°, and steady the ship."""
    steering = replace(approach, angle=approach.side * radians(10.0))
    ship = approach.ship
    orders = TurnOnce(steering, radians(20.0))
    trial = sail(ship, orders, steering.execute + 20 * _pace(ship), course=approach.course)
    return Voyage(trial, lambda _found: _motion(trial, steering).turning(radians(10.0)))


def _pace(ship: TrialShip) -> float:
    """Return the time in which a ship travels its length, s."""
    return ship.length / ship.speed


def pull_out(approach: Steering) -> Voyage:
    """Turn with 20° of rudder to a steady rate, and put the rudder midships."""
    ship, side, execute = approach.ship, approach.side, approach.execute
    out = round(execute + 22 * _pace(ship))
    orders = Programme(approach, [(execute, side * radians(20.0)), (out, 0.0)])
    trial = sail(ship, orders, out + 14 * _pace(ship), course=approach.course)

    def true(_found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        heading, first = side * trial.heading, round(out / STEP)
        back, tail = round(20.0 / STEP), (len(heading) - first) // 4
        return {
            "yaw rate before": float(heading[first] - heading[first - back]) / 20.0,
            "residual yaw rate": float(heading[-1] - heading[-1 - tail]) / (tail * STEP),
        }

    return Voyage(trial, true)


def direct_spiral(approach: Steering) -> Voyage:
    """Hold rudder angles from 15° on one side to 15° on the other, and back."""
    ship, secs = approach.ship, round(DIRECT_PACE * _pace(approach.ship))
    times = [approach.execute + k * secs for k in range(len(SPIRAL_DEG) + 1)]
    angles = [approach.side * radians(angle) for angle in SPIRAL_DEG]
    orders = Programme(approach, list(zip(times, angles, strict=False)))
    trial = sail(ship, orders, times[-1], course=approach.course)
    return Voyage(trial, lambda _found: _loop(trial, times))


def reverse_spiral(approach: Steering, *, weaving: bool) -> Voyage:
    """Steer to one yaw rate after another, from one side to the other and back."""
    ship, secs = approach.ship, round(REVERSE_PACE * _pace(approach.ship))
    rates = (*SPIRAL_RATES, *SPIRAL_RATES[-2::-1])
    times = [approach.execute + k * secs for k in range(len(rates) + 1)]
    steps = [
        (time, approach.side * rate / _pace(ship)) for time, rate in zip(times, rates, strict=False)
    ]
    period = 0.6 * _pace(ship)

    def weave(time: float) -> float:
        return WEAVE * sin(2 * pi * time / period) if weaving else 0.0

    trial = sail(ship, RateKeeper(approach, steps, weave), times[-1], course=approach.course)
    return Voyage(trial, lambda _found: _steered_loop(trial, times))


def _points(trial: SailedTrial, times: Sequence[float]) -> Values:
    """Return rudder from neutral and yaw rate at the end of each level, (k, 2)."""
    points = []
    for start, stop in pairwise(times):
        late = slice(round((stop - STEADY_SHARE * (stop - start)) / STEP), round(stop / STEP) + 1)
        turned = trial.heading[late][-1] - trial.heading[late][0]
        rate = turned / ((late.stop - 1 - late.start) * STEP)
        points.append((float(np.mean(trial.rudder[late])) - trial.ship.neutral, rate))
    return np.array(points)


def _loop(trial: SailedTrial, times: Sequence[float]) -> dict[str, float]:
    """Return height and width of the loop of a direct spiral from side to side and back."""
    points = _points(trial, times)
    turn = len(points) // 2
    ways = [points[: turn + 1], points[turn:]]
    rates = [_where_zero(way[:, 0], way[:, 1])[0] for way in ways]
    angles = [_where_zero(way[:, 1], way[:, 0])[0] for way in ways]
    return {"loop height": abs(rates[0] - rates[1]), "loop width": abs(angles[0] - angles[1])}


def _steered_loop(trial: SailedTrial, times: Sequence[float]) -> dict[str, float]:
    """Return height and width of the loop of a reverse spiral; none of a stable ship."""
    points = _points(trial, times)
    count = len(points) // 2
    curve = (points[:count] + points[: -count - 1 : -1]) / 2
    curve = np.vstack((curve, points[count]))
    rates = _where_zero(curve[:, 0], curve[:, 1])
    if len(rates) < 2:
        return {}
    inside = (curve[:, 1] > min(rates)) & (curve[:, 1] < max(rates))
    return {
        "loop height": max(rates) - min(rates),
        "loop width": float(np.ptp(curve[inside, 0])),
    }


def _where_zero(x: Values, y: Values) -> list[float]:
    """Return y wherever x changes its sign."""
    return [
        float(y[k] - x[k] * (y[k + 1] - y[k]) / (x[k + 1] - x[k]))
        for k in np.flatnonzero(x[:-1] * x[1:] <= 0)
    ]


def stopping(approach: Steering) -> Voyage:
    """Reverse the propeller at full speed, with the rudder midships, until the ship has stopped."""
    ship, execute = approach.ship, approach.execute

    def revolutions(time: float) -> float:
        share = 1.0 - max(0.0, time - execute) / REVERSING_SECS
        return max(-ASTERN_SHARE, share) * ship.rpm

    orders = Programme(approach, [(execute, 0.0)])
    trial = sail(
        ship, orders, execute + 34 * _pace(ship), course=approach.course, revolutions=revolutions
    )

    def true(_found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        motion = _Motion.since(trial, execute, approach.course, 1.0)
        at = crossing(-motion.surge, 0.0)
        return {
            "stopping time": at * STEP,
            "track reach": value_at(at, motion.travelled),
            "head reach": value_at(at, motion.ahead),
            "lateral deviation": value_at(at, motion.across),
            "heading change": value_at(at, motion.change),
        }

    return Voyage(trial, true)


@cache
def _slow_speed(ship: TrialShip) -> float:
    """Return the steady speed at the revolutions before an acceleration, m/s."""
    keeper = Steering(ship, inf, 1.0)
    slow = sail(
        ship, keeper, 60 * _pace(ship), revolutions=lambda _: SLOW_SHARE * ship.rpm,
        speed=SLOW_SHARE * ship.speed,
    )  # fmt: skip
    return float(slow.speed[-1])


def acceleration(approach: Steering) -> Voyage:
    """Raise the revolutions to those of full speed, on a straight course."""
    ship, execute = approach.ship, approach.execute

    def revolutions(time: float) -> float:
        raised = (1 - SLOW_SHARE) * max(0.0, time - execute) / RAISING_SECS
        return min(1.0, SLOW_SHARE + raised) * ship.rpm

    orders = NewCourse(approach, approach.course)
    trial = sail(
        ship, orders, execute + 40 * _pace(ship), course=approach.course,
        revolutions=revolutions, speed=_slow_speed(ship),
    )  # fmt: skip

    def true(_found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        motion = _Motion.since(trial, execute, approach.course, 1.0)
        first = round(execute / STEP)
        initial = float(np.mean(trial.speed[first - round(MEAN_SECS / STEP) : first + 1]))
        final = float(np.mean(motion.surge[-(len(motion.surge) // 10) :]))
        at = crossing(motion.surge, initial + 0.9 * (final - initial))
        return {
            "final speed": final,
            "time to 90 % of the speed gain": at * STEP,
            "distance to 90 % of the speed gain": value_at(at, motion.travelled),
        }

    return Voyage(trial, true)


def speed_runs(approach: Steering) -> Voyage:
    """Sail two straight runs on reciprocal courses at equal revolutions."""
    ship, secs = approach.ship, RUN_SECS[approach.ship.name]
    there = replace(approach, execute=secs)
    orders = NewCourse(there, approach.course + approach.side * pi)
    trial = sail(ship, orders, 3.4 * secs, course=approach.course)

    def true(found: Sequence[SailedManoeuvre]) -> dict[str, float]:
        spans = [np.array((each.execute_secs, each.end_secs)) / STEP for each in found[-2:]]
        means = [
            float(np.mean(np.hypot(trial.speed, trial.sway)[round(a) : round(b)])) for a, b in spans
        ]
        return {
            "speed through the water": means[-1],
            "speed by track": means[-1],
            "speed of the double run": float(np.mean(means)),
        }

    return Voyage(trial, true)


CIRCLE, ZIGZAG = ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.ZIGZAG
MMG_SHIPS = ("kvlcc2", "seiun-maru")  # the equations of the Mariner have no propeller
KINDS = {
    "turning circle 35°": TrialKind((CIRCLE,), turning_circle),
    "zig-zag 10°/10°": TrialKind((ZIGZAG,), partial(zigzag, angle_deg=10.0)),
    "zig-zag 20°/20°": TrialKind((ZIGZAG,), partial(zigzag, angle_deg=20.0)),
    "initial turning 10°": TrialKind((ManoeuvreKind.INITIAL_TURNING,), initial_turning),
    "pull-out after a circle 20°": TrialKind((CIRCLE, ManoeuvreKind.PULL_OUT), pull_out, 1),
    "direct spiral": TrialKind((ManoeuvreKind.DIRECT_SPIRAL,), direct_spiral),
    "reverse spiral, moving rudder": TrialKind(
        (ManoeuvreKind.REVERSE_SPIRAL,), partial(reverse_spiral, weaving=True)
    ),
    "reverse spiral, steady rudder": TrialKind(
        (ManoeuvreKind.REVERSE_SPIRAL,),
        partial(reverse_spiral, weaving=False),
        alternative=(ManoeuvreKind.DIRECT_SPIRAL,),
    ),
    "full astern stop": TrialKind((ManoeuvreKind.STOPPING,), stopping, ships=MMG_SHIPS),
    "acceleration": TrialKind((ManoeuvreKind.ACCELERATION,), acceleration, ships=MMG_SHIPS),
    "double speed run": TrialKind((ManoeuvreKind.SPEED_RUN,) * 2, speed_runs, 1),
}
