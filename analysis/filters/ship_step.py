"""The ship's motion from one instant to the next, with its derivatives.

The states are yaw rate w, rad/s, its derivative w', rad/s², and speed v, m/s; the inputs are the
rudder angle delta, rad, and the revolutions n, rpm.
"""

from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.ships.paper import (
    Coefficients,
    rudder_effect_rate,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray

from .core import StepInputs
from .kernels import quadratic_form


class ShipState(NamedTuple):
    """Yaw rate w, its derivative w' and the speed v; also their rates, and changes of them."""

    w: float
    w_dot: float
    v: float


class ShipSlopes(NamedTuple):
    """The derivatives of w'' by w, w' and v, and those of v' by w and v; the others are 0 or 1."""

    yaw_by_w: float
    yaw_by_w_dot: float
    yaw_by_v: float
    surge_by_w: float
    surge_by_v: float


@compiled
def predict_ship(
    c: Coefficients, x: FloatArray, F: FloatArray, B: FloatArray, u: StepInputs, dt: float
) -> None:
    """Advance the state by a Runge-Kutta step of fourth order, and compute its derivatives.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    x
        (s,) the state, of which the first three, w, w' and v, are changed in place.
    F
        (s, s) the transition matrix. F[:3, :3] is set to the derivative of the step by the ship's
        states.
    B
        (3, 2) set to the derivative of the step by a constant yaw moment and surge force; (3, 0)
        where there are none.
    u
        The inputs at the start, and their rates during the step.
    dt
        The time step, s.

    References
    ----------
    The equations of motion: `shiplog.ships.paper`. The derivative of the step follows the
    variational equation through the same stages.
    """
    s1 = ShipState(x[0], x[1], x[2])
    k1 = _rates(c, s1, u, 0.0)
    s2 = _moved(s1, k1, dt / 2)
    k2 = _rates(c, s2, u, dt / 2)
    s3 = _moved(s1, k2, dt / 2)
    k3 = _rates(c, s3, u, dt / 2)
    s4 = _moved(s1, k3, dt)
    change = _weighted(k1, k2, k3, _rates(c, s4, u, dt), dt)
    x[0], x[1], x[2] = s1.w + change.w, s1.w_dot + change.w_dot, s1.v + change.v
    slopes = (
        _slopes_at(c, s1, u, 0.0), _slopes_at(c, s2, u, dt / 2), _slopes_at(c, s3, u, dt / 2),
        _slopes_at(c, s4, u, dt),
    )  # fmt: skip
    none = ShipState(0.0, 0.0, 0.0)
    for j in range(3):
        start = ShipState(_delta(j, 0), _delta(j, 1), _delta(j, 2))
        change = _variation(slopes, start, none, dt)
        F[0, j], F[1, j] = start.w + change.w, start.w_dot + change.w_dot
        F[2, j] = start.v + change.v
    for j in range(B.shape[1]):
        push = ShipState(0.0, _delta(j, 0), _delta(j, 1))
        change = _variation(slopes, none, push, dt)
        B[0, j], B[1, j], B[2, j] = change.w, change.w_dot, change.v


@compiled
def _delta(i: int, j: int) -> float:
    """Return Kronecker's delta."""
    return 1.0 if i == j else 0.0


@compiled
def _rates(c: Coefficients, s: ShipState, u: StepInputs, h: float) -> ShipState:
    """Return w', w'' and v' at h seconds after the start of the step."""
    delta, n = u.delta + u.delta_dot * h, u.n + u.n_dot * h
    return ShipState(
        s.w_dot,
        yaw_acceleration_rate(c, s.w, s.w_dot, s.v, n, delta, u.delta_dot) + u.moment,
        surge_acceleration(c, s.w, s.v, n) + u.force,
    )


@compiled
def _slopes_at(c: Coefficients, s: ShipState, u: StepInputs, h: float) -> ShipSlopes:
    return ship_slopes(c, s, u.delta + u.delta_dot * h, u.delta_dot, u.n + u.n_dot * h)


@compiled
def _variation(
    slopes: tuple[ShipSlopes, ShipSlopes, ShipSlopes, ShipSlopes],
    start: ShipState,
    push: ShipState,
    dt: float,
) -> ShipState:
    """Return how a step changes by a change of the state at its start and of the rates in it.

    `slopes` are those at the four stages.
    """
    k1 = _linear_rates(slopes[0], start, push)
    k2 = _linear_rates(slopes[1], _moved(start, k1, dt / 2), push)
    k3 = _linear_rates(slopes[2], _moved(start, k2, dt / 2), push)
    return _weighted(k1, k2, k3, _linear_rates(slopes[3], _moved(start, k3, dt), push), dt)


@compiled
def _linear_rates(J: ShipSlopes, s: ShipState, push: ShipState) -> ShipState:
    return ShipState(
        s.w_dot,
        J.yaw_by_w * s.w + J.yaw_by_w_dot * s.w_dot + J.yaw_by_v * s.v + push.w_dot,
        J.surge_by_w * s.w + J.surge_by_v * s.v + push.v,
    )


@compiled
def _moved(s: ShipState, rate: ShipState, h: float) -> ShipState:
    """Return s + h rate."""
    return ShipState(s.w + h * rate.w, s.w_dot + h * rate.w_dot, s.v + h * rate.v)


@compiled
def _weighted(k1: ShipState, k2: ShipState, k3: ShipState, k4: ShipState, dt: float) -> ShipState:
    """Return the change in a step of dt seconds, from the rates at its four stages."""
    return ShipState(
        dt / 6 * (k1.w + 2 * k2.w + 2 * k3.w + k4.w),
        dt / 6 * (k1.w_dot + 2 * k2.w_dot + 2 * k3.w_dot + k4.w_dot),
        dt / 6 * (k1.v + 2 * k2.v + 2 * k3.v + k4.v),
    )


@compiled
def ship_slopes(
    c: Coefficients, s: ShipState, delta: float, delta_dot: float, n: float
) -> ShipSlopes:
    """Compute the derivatives of w'' and v' by w, w' and v.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    s
        w, w' and v.
    delta, delta_dot, n
        The rudder angle, rad, its rate, rad/s, and the revolutions, rpm.
    """
    steering = c.d * delta + c.e * delta_dot
    by_speed = rudder_effect_rate(c, s.v, 1.0, n, 0.0) * steering
    return ShipSlopes(yaw_stiffness(c, s.w), c.a, by_speed, 2 * c.f * s.w, 2 * c.g * s.v)


@compiled
def jacobian(slopes: ShipSlopes) -> FloatArray:
    """Return the derivatives (3, 3) of w', w'' and v' by w, w' and v."""
    J = np.zeros((3, 3))
    J[0, 1] = 1.0
    J[1, 0], J[1, 1], J[1, 2] = slopes.yaw_by_w, slopes.yaw_by_w_dot, slopes.yaw_by_v
    J[2, 0], J[2, 2] = slopes.surge_by_w, slopes.surge_by_v
    return J


@compiled
def ship_row(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    u: StepInputs,
    slopes: FloatArray,
    row: FloatArray,
) -> None:
    """Compute w, w', w'', v and v' of one instant, and their variances.

    w'' and v' follow from the model, and their variances, to first order, from its derivatives.
    The parameters are those of `core.output_row`, with the coefficients of the ship for the core.
    """
    s = ShipState(x[0], x[1], x[2])
    J = ship_slopes(c, s, u.delta, u.delta_dot, u.n)
    slopes[0, 0], slopes[0, 1], slopes[0, 2] = J.yaw_by_w, J.yaw_by_w_dot, J.yaw_by_v
    slopes[1, 0], slopes[1, 1], slopes[1, 2] = J.surge_by_w, 0.0, J.surge_by_v
    row[0], row[1], row[3] = s.w, s.w_dot, s.v
    row[2] = yaw_acceleration_rate(c, s.w, s.w_dot, s.v, u.n, u.delta, u.delta_dot) + u.moment
    row[4] = surge_acceleration(c, s.w, s.v, u.n) + u.force
    row[5], row[6], row[8] = P[0, 0], P[1, 1], P[2, 2]
    row[7], row[9] = quadratic_form(slopes[0], P), quadratic_form(slopes[1], P)
    for i in range(5, 10):
        row[i] = max(row[i], 0.0)
