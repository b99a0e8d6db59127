"""What the loop of a filter computes for its further states, chosen by the type of `further`.

`NoFurther` is the type for a filter that has none: its functions do nothing, so that such a filter
takes no longer, to compile or to run, for what others can do.
"""

from math import cos, pi, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled, overload_for
from shiplog.ships.paper import rudder_effect
from shiplog.types import FloatArray

from .core import StepInputs

YAW_RATE, SPEED, COMPASS, NORTH, EAST = range(5)  # the outputs; a filter has the first 2, 3 or 5
ABSENT = -1  # the place of a state that a filter does not have


class NoFurther(NamedTuple):
    """No further states."""

    core: int


class Further(NamedTuple):
    """The places and the constants of the further states of a filter of s states.

    Attributes
    ----------
    core
        The number of the core's states.
    speed
        The place of the speed among them.
    heading
        The place of the heading, rad.
    north
        The place of the position north, m; that east follows.
    log_scale, rudder_zero
        The places of these sensor errors.
    current
        The place of the current north, m/s; that east follows.
    drift
        The place of the drift length, m: the sway is minus it times the yaw rate.
    forces
        (q,): the places of the states that give moment and force; the coefficients of the wind are
        the last of them.
    mean, now
        (2, q): their coefficients, for the means of moment and force over a step, and at its start;
        those of the wind are updated at each instant.
    turn
        (s,): the row that gives the heading's change in a step by the wave.
    shown
        (k,): the places of the further estimates.
    wind_axes
        (w,): 0 for each coefficient of the wind that gives a moment, 1 for one that gives a force.
    regressors
        (n, w): what these are multiplied by, at the instants of the chunk and in the steps after.
    """

    core: int
    speed: int
    heading: int
    north: int
    log_scale: int
    rudder_zero: int
    current: int
    drift: int
    forces: NDArray[np.int64]
    mean: FloatArray
    now: FloatArray
    turn: FloatArray
    shown: NDArray[np.int64]
    wind_axes: NDArray[np.int64]
    regressors: FloatArray


def begin_wind(further: Any, k: int) -> None:  # noqa: ANN401
    """Set the coefficients `mean` and `now` of the wind's states to those of an instant k."""
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def acting_at_instant(further: Any, x: FloatArray, u: StepInputs) -> StepInputs:  # noqa: ANN401
    """Return the inputs `u` without the error of the rudder's zero, and with moment and force."""
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def acting_during_step(further: Any, x: FloatArray, u: StepInputs) -> StepInputs:  # noqa: ANN401
    """Return the same with the means of moment and force over the step."""
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def linearise_output(
    further: Any,  # noqa: ANN401
    x: FloatArray,
    c: FloatArray,
    measured: float,
    output: int,
) -> float:
    """Linearise an output about the state: return the measurement y for which y - c' x is right.

    The row c (s,) of the speed gets its derivatives by speed and error of scale; the measured
    heading is taken to be within half a turn of the predicted one.
    """
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def set_slopes(
    further: Any,  # noqa: ANN401
    core: Any,  # noqa: ANN401
    x: FloatArray,
    n: float,
    slopes: FloatArray,
) -> None:
    """Set the derivatives (2, s) of moment and force by the state (s,) at n rpm."""
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def show(further: Any, x: FloatArray, P: FloatArray, row: FloatArray) -> None:  # noqa: ANN401
    """Set the further estimates and their variances, the row (2 k,)."""
    raise NotImplementedError(f"no further states in {type(further).__name__}")


def advance_further(
    further: Any,  # noqa: ANN401
    core: Any,  # noqa: ANN401
    x: FloatArray,
    before: FloatArray,
    F: FloatArray,
    B: FloatArray,
    n: float,
    dt: float,
) -> None:
    """Advance heading and position, in place, and complete the transition matrix F.

    `before` (s,) is the state before the step; the core's states in `x` are those after it.
    """
    raise NotImplementedError(f"no further states in {type(further).__name__}")


@overload_for(begin_wind, NoFurther)
def _begin_no_wind(further: NoFurther, k: int) -> None:
    pass


@overload_for(acting_at_instant, NoFurther)
def _given_at_instant(further: NoFurther, x: FloatArray, u: StepInputs) -> StepInputs:
    return u


@overload_for(acting_during_step, NoFurther)
def _given_during_step(further: NoFurther, x: FloatArray, u: StepInputs) -> StepInputs:
    return u


@overload_for(linearise_output, NoFurther)
def _linear_output(
    further: NoFurther, x: FloatArray, c: FloatArray, measured: float, output: int
) -> float:
    return measured


@overload_for(set_slopes, NoFurther)
def _no_slopes(
    further: NoFurther,
    core: Any,  # noqa: ANN401
    x: FloatArray,
    n: float,
    slopes: FloatArray,
) -> None:
    pass


@overload_for(show, NoFurther)
def _show_nothing(further: NoFurther, x: FloatArray, P: FloatArray, row: FloatArray) -> None:
    pass


@overload_for(advance_further, NoFurther)
def _advance_nothing(
    further: NoFurther,
    core: Any,  # noqa: ANN401
    x: FloatArray,
    before: FloatArray,
    F: FloatArray,
    B: FloatArray,
    n: float,
    dt: float,
) -> None:
    pass


@overload_for(begin_wind, Further)
def _begin_wind(further: Further, k: int) -> None:
    first = len(further.forces) - len(further.wind_axes)
    for j in range(len(further.wind_axes)):
        axis = further.wind_axes[j]
        further.now[axis, first + j] = further.regressors[k, j]
        further.mean[axis, first + j] = further.regressors[k, j]


@overload_for(acting_at_instant, Further)
def _acting_at_instant(further: Further, x: FloatArray, u: StepInputs) -> StepInputs:
    return _acting(further, further.now, x, u)


@overload_for(acting_during_step, Further)
def _acting_during_step(further: Further, x: FloatArray, u: StepInputs) -> StepInputs:
    return _acting(further, further.mean, x, u)


@compiled
def _acting(further: Further, rows: FloatArray, x: FloatArray, u: StepInputs) -> StepInputs:
    delta, moment, force = u.delta, 0.0, 0.0
    for i in range(len(further.forces)):
        moment += rows[0, i] * x[further.forces[i]]
        force += rows[1, i] * x[further.forces[i]]
    if further.rudder_zero >= 0:
        delta -= x[further.rudder_zero]
    return StepInputs(delta, u.delta_dot, u.n, u.n_dot, moment, force)


@overload_for(linearise_output, Further)
def _linearise_output(
    further: Further, x: FloatArray, c: FloatArray, measured: float, output: int
) -> float:
    if output == SPEED and further.log_scale >= 0:
        scale, v = x[further.log_scale], x[further.speed]
        c[further.speed], c[further.log_scale] = 1 + scale, v
        on_plane: float = measured + scale * v
        return on_plane
    if output == COMPASS:
        predicted = 0.0
        for i in range(len(x)):
            predicted += c[i] * x[i]
        difference: float = (measured - predicted + pi) % (2 * pi) - pi
        return predicted + difference
    return measured


@overload_for(set_slopes, Further)
def _set_slopes(
    further: Further,
    core: Any,  # noqa: ANN401
    x: FloatArray,
    n: float,
    slopes: FloatArray,
) -> None:
    for i in range(len(further.forces)):
        place = further.forces[i]
        slopes[0, place], slopes[1, place] = further.now[0, i], further.now[1, i]
    if further.rudder_zero >= 0:
        effect = rudder_effect(core.model, x[further.speed], n)
        slopes[0, further.rudder_zero] = -effect * core.model.d


@overload_for(show, Further)
def _show(further: Further, x: FloatArray, P: FloatArray, row: FloatArray) -> None:
    count = len(further.shown)
    for k in range(count):
        place = further.shown[k]
        row[k], row[count + k] = x[place], max(P[place, place], 0.0)


@overload_for(advance_further, Further)
def _advance_further(
    further: Further,
    core: Any,  # noqa: ANN401
    x: FloatArray,
    before: FloatArray,
    F: FloatArray,
    B: FloatArray,
    n: float,
    dt: float,
) -> None:
    if B.shape[1] > 0:
        for i in range(further.core):
            for j in range(len(further.forces)):
                by_force = B[i, 0] * further.mean[0, j] + B[i, 1] * further.mean[1, j]
                F[i, further.forces[j]] = by_force
            if further.rudder_zero >= 0:
                effect = rudder_effect(core.model, before[further.speed], n)
                F[i, further.rudder_zero] = -B[i, 0] * effect * core.model.d
    if further.heading >= 0:
        _advance_heading(further, x, before, F, dt)
    if further.north >= 0:
        _advance_position(further, x, before, F, dt)


@compiled
def _advance_heading(
    further: Further, x: FloatArray, before: FloatArray, F: FloatArray, dt: float
) -> None:
    """Advance the heading by the integral of the yaw rate, by Hermite's rule, and by the wave."""
    psi, turn = further.heading, further.turn
    x[psi] += dt / 2 * (before[0] + x[0]) + dt**2 / 12 * (before[1] - x[1])
    for j in range(len(x)):
        x[psi] += turn[j] * before[j]
        F[psi, j] = turn[j] + dt / 2 * F[0, j] - dt**2 / 12 * F[1, j]
    F[psi, 0] += dt / 2
    F[psi, 1] += dt**2 / 12
    F[psi, psi] += 1.0


@compiled
def _advance_position(
    further: Further, x: FloatArray, before: FloatArray, F: FloatArray, dt: float
) -> None:
    """Advance the position by the velocity over ground, by the trapezoidal rule.

    North' = v cos psi - u sin psi + current, east' = v sin psi + u cos psi + current, with the sway
    u = -l w.
    """
    size, speed, heading = len(x), further.speed, further.heading
    for axis in range(2):
        place, current = further.north + axis, further.current + axis
        quarter = axis * pi / 2  # east is the north of a heading that is less by a quarter turn
        for j in range(size):
            F[place, j] = 0.0
        for end in range(2):
            state = x if end else before
            w, v, drift = state[0], state[speed], state[further.drift]
            c, s = cos(state[heading] - quarter), sin(state[heading] - quarter)
            x[place] += dt / 2 * (v * c + drift * w * s + state[current])
            by_w, by_heading = drift * s, drift * w * c - v * s
            if end:
                for j in range(size):
                    slope = c * F[speed, j] + by_w * F[0, j] + by_heading * F[heading, j]
                    F[place, j] += dt / 2 * slope
            else:
                F[place, speed] += dt / 2 * c
                F[place, 0] += dt / 2 * by_w
                F[place, heading] += dt / 2 * by_heading
            F[place, further.drift] += dt / 2 * w * s
            F[place, current] += dt / 2
        F[place, place] = 1.0
