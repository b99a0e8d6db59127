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


@compiled
def predict_ship(
    c: Coefficients,
    x: FloatArray,
    F: FloatArray,
    delta: float,
    delta_dot: float,
    n: float,
    n_dot: float,
    dt: float,
) -> None:
    """Advance the state by a Runge-Kutta step of fourth order, and compute the transition matrix.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    x
        (s,) the state w, w', v and those of a wave; changed in place.
    F
        (s, s) the transition matrix. F[:3, :3] is set to the derivative of the step by the ship's
        states; by F[3:, 3:] the states of the wave advance.
    delta, delta_dot
        The rudder angle at the start, rad, and its rate during the step, rad/s.
    n, n_dot
        The revolutions at the start, rpm, and their rate during the step, rpm/s.
    dt
        The time step, s.

    References
    ----------
    The equations of motion: `shiplog.ships.paper`. The derivative of the step follows the
    variational equation through the same stages.
    """
    eye = np.eye(3)
    J, slopes = np.zeros((3, 3)), np.zeros((4, 3, 3))
    rates, stage_x = np.empty((4, 3)), np.empty(3)
    for stage in range(4):
        share = (0.0, 0.5, 0.5, 1.0)[stage]
        h = share * dt
        for i in range(3):
            stage_x[i] = x[i] + (h * rates[stage - 1, i] if stage else 0.0)
        stage_delta, stage_n = delta + delta_dot * h, n + n_dot * h
        w, w_dot, v = stage_x[0], stage_x[1], stage_x[2]
        rates[stage, 0] = w_dot
        rates[stage, 1] = yaw_acceleration_rate(c, w, w_dot, v, stage_n, stage_delta, delta_dot)
        rates[stage, 2] = surge_acceleration(c, w, v, stage_n)
        linearise(c, stage_x, stage_delta, delta_dot, stage_n, J)
        for i in range(3):
            for j in range(3):
                slopes[stage, i, j] = J[i, j]
                if stage:
                    for m in range(3):
                        slopes[stage, i, j] += h * J[i, m] * slopes[stage - 1, m, j]
    for i in range(3):
        x[i] += dt / 6 * (rates[0, i] + 2 * rates[1, i] + 2 * rates[2, i] + rates[3, i])
        for j in range(3):
            total = slopes[0, i, j] + 2 * slopes[1, i, j] + 2 * slopes[2, i, j] + slopes[3, i, j]
            F[i, j] = eye[i, j] + dt / 6 * total
    _advance_wave(x, F)


@compiled
def _advance_wave(x: FloatArray, F: FloatArray) -> None:
    """Multiply the states of the wave by their transition matrix, in place."""
    size = len(x)
    if size > 3:
        advanced = np.zeros(size)
        for i in range(3, size):
            for j in range(3, size):
                advanced[i] += F[i, j] * x[j]
        for i in range(3, size):
            x[i] = advanced[i]


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
def output_row(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    delta: float,
    delta_dot: float,
    n: float,
    row: FloatArray,
) -> None:
    """Compute w, w', w'', v and v' of one instant, and their variances.

    w'' and v' follow from the model, and their variances, to first order, from its derivatives.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    x
        (s,) the state.
    P
        (s, s) its covariance.
    delta, delta_dot, n
        The rudder angle, rad, its rate, rad/s, and the revolutions, rpm.
    row
        (10,) the result: the five states in rad/s^k and m/s^k, then their variances.
    """
    w, w_dot, v = x[0], x[1], x[2]
    J = np.zeros((3, 3))
    linearise(c, x, delta, delta_dot, n, J)
    row[0], row[1], row[3] = w, w_dot, v
    row[2] = yaw_acceleration_rate(c, w, w_dot, v, n, delta, delta_dot)
    row[4] = surge_acceleration(c, w, v, n)
    row[5], row[6], row[8] = P[0, 0], P[1, 1], P[2, 2]
    row[7], row[9] = _variance(J[1], P), _variance(J[2], P)
    for i in range(5, 10):
        row[i] = max(row[i], 0.0)


@compiled
def _variance(slope: FloatArray, P: FloatArray) -> float:
    """Return slope' P slope of the first three states."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += slope[i] * P[i, j] * slope[j]
    return total


@compiled
def output_rows(
    c: Coefficients,
    states: FloatArray,
    covariances: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
) -> FloatArray:
    """Compute `output_row` for each instant of a chunk.

    Parameters
    ----------
    c
        The coefficients of the identification paper's model.
    states, covariances
        (m, s) the states, and (m, s, s) their covariances.
    delta
        (m + 1,) the rudder angle, rad, at each instant and the next one.
    n
        (m,) or more: the revolutions, rpm.
    dt
        The time step, s.

    Returns
    -------
    (m, 10) the five states, then their variances.
    """
    rows = np.empty((len(states), 10))
    for k in range(len(states)):
        rate = (delta[k + 1] - delta[k]) / dt
        output_row(c, states[k], covariances[k], delta[k], rate, n[k], rows[k])
    return rows
