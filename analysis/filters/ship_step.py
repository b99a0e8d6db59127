"""The ship's motion from one instant to the next, with its derivatives.

The states are yaw rate w, rad/s, its derivative w', rad/s², and speed v, m/s; the inputs are the
rudder angle delta, rad, and the revolutions n, rpm.
"""

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
    eye, forced = np.eye(3), B.shape[1] > 0
    J, slopes, pushes = np.zeros((3, 3)), np.zeros((4, 3, 3)), np.zeros((4, 3, 2))
    rates, stage_x = np.empty((4, 3)), np.empty(3)
    for stage in range(4):
        share = (0.0, 0.5, 0.5, 1.0)[stage]
        h = share * dt
        for i in range(3):
            stage_x[i] = x[i] + (h * rates[stage - 1, i] if stage else 0.0)
        delta, n = u.delta + u.delta_dot * h, u.n + u.n_dot * h
        w, w_dot, v = stage_x[0], stage_x[1], stage_x[2]
        rates[stage, 0] = w_dot
        rates[stage, 1] = yaw_acceleration_rate(c, w, w_dot, v, n, delta, u.delta_dot) + u.moment
        rates[stage, 2] = surge_acceleration(c, w, v, n) + u.force
        linearise(c, stage_x, delta, u.delta_dot, n, J)
        _add_slopes(slopes, stage, h, J)
        if forced:
            _add_pushes(pushes, stage, h, J)
    for i in range(3):
        x[i] += dt / 6 * (rates[0, i] + 2 * rates[1, i] + 2 * rates[2, i] + rates[3, i])
        for j in range(3):
            total = slopes[0, i, j] + 2 * slopes[1, i, j] + 2 * slopes[2, i, j] + slopes[3, i, j]
            F[i, j] = eye[i, j] + dt / 6 * total
        for j in range(B.shape[1]):
            total = pushes[0, i, j] + 2 * pushes[1, i, j] + 2 * pushes[2, i, j] + pushes[3, i, j]
            B[i, j] = dt / 6 * total


@compiled
def _add_slopes(slopes: FloatArray, stage: int, h: float, J: FloatArray) -> None:
    """Compute the slopes of a stage, of (4, 3, 3), by the states at the start of the step."""
    for i in range(3):
        for j in range(3):
            slopes[stage, i, j] = J[i, j]
            if stage:
                for m in range(3):
                    slopes[stage, i, j] += h * J[i, m] * slopes[stage - 1, m, j]


@compiled
def _add_pushes(pushes: FloatArray, stage: int, h: float, J: FloatArray) -> None:
    """Compute the slopes of a stage, of (4, 3, 2), by moment and force, which drive w' and v."""
    for i in range(3):
        for j in range(2):
            pushes[stage, i, j] = 1.0 if i == j + 1 else 0.0
            if stage:
                for m in range(3):
                    pushes[stage, i, j] += h * J[i, m] * pushes[stage - 1, m, j]


@compiled
def linearise(
    c: Coefficients, x: FloatArray, delta: float, delta_dot: float, n: float, J: FloatArray
) -> None:
    """Compute the derivatives of w', w'' and v' by w, w' and v.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    x
        (3,) or more: w, w' and v.
    delta, delta_dot, n
        The rudder angle, rad, its rate, rad/s, and the revolutions, rpm.
    J
        (3, 3) the result; elements that are always zero are not written.
    """
    w, v = x[0], x[2]
    J[0, 1] = 1.0
    J[1, 0] = yaw_stiffness(c, w)
    J[1, 1] = c.a
    J[1, 2] = rudder_effect_rate(c, v, 1.0, n, 0.0) * (c.d * delta + c.e * delta_dot)
    J[2, 0], J[2, 2] = 2 * c.f * w, 2 * c.g * v


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
    w, w_dot, v = x[0], x[1], x[2]
    J = np.zeros((3, 3))
    linearise(c, x, u.delta, u.delta_dot, u.n, J)
    row[0], row[1], row[3] = w, w_dot, v
    row[2] = yaw_acceleration_rate(c, w, w_dot, v, u.n, u.delta, u.delta_dot) + u.moment
    row[4] = surge_acceleration(c, w, v, u.n) + u.force
    row[5], row[6], row[8] = P[0, 0], P[1, 1], P[2, 2]
    row[7], row[9] = _variance(J[1], slopes[0], P), _variance(J[2], slopes[1], P)
    for i in range(5, 10):
        row[i] = max(row[i], 0.0)


@compiled
def _variance(ship: FloatArray, further: FloatArray, P: FloatArray) -> float:
    """Return g' P g; of the slope g, the first three are `ship` and the others those of `further`.

    Most of these others are zero.
    """
    total = 0.0
    for i in range(len(further)):
        slope_i = ship[i] if i < 3 else further[i]
        if i >= 3 and slope_i == 0.0:
            continue
        for j in range(len(further)):
            total += slope_i * P[i, j] * (ship[j] if j < 3 else further[j])
    return total
