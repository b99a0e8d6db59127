"""The ship from one instant to the next: her states w, w' and v, and how they depend on them."""

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
def predict(
    c: Coefficients,
    x: FloatArray,
    F: FloatArray,
    delta: float,
    delta_dot: float,
    n: float,
    n_dot: float,
    dt: float,
) -> None:
    """One Runge-Kutta step of the ship, and of its derivative by the state into F[:3, :3].

    The rudder and the revolutions move evenly; the wave, beyond the third state, goes by F.
    """
    eye = np.eye(3)
    J, slopes = np.zeros((3, 3)), np.zeros((4, 3, 3))
    rates, at = np.empty((4, 3)), np.empty(3)
    for stage in range(4):
        share = (0.0, 0.5, 0.5, 1.0)[stage]
        h = share * dt
        for i in range(3):
            at[i] = x[i] + (h * rates[stage - 1, i] if stage else 0.0)
        turned, turns = delta + delta_dot * h, n + n_dot * h
        rates[stage, 0] = at[1]
        rates[stage, 1] = yaw_acceleration_rate(c, at[0], at[1], at[2], turns, turned, delta_dot)
        rates[stage, 2] = surge_acceleration(c, at[0], at[2], turns)
        linearise(c, at, turned, delta_dot, turns, J)
        for i in range(3):
            for j in range(3):
                slopes[stage, i, j] = J[i, j]
                if stage:
                    for m in range(3):
                        slopes[stage, i, j] += h * J[i, m] * slopes[stage - 1, m, j]
    for i in range(3):
        x[i] += dt / 6 * (rates[0, i] + 2 * rates[1, i] + 2 * rates[2, i] + rates[3, i])
        for j in range(3):
            sum_of = slopes[0, i, j] + 2 * slopes[1, i, j] + 2 * slopes[2, i, j] + slopes[3, i, j]
            F[i, j] = eye[i, j] + dt / 6 * sum_of
    _turn_wave(x, F)


@compiled
def _turn_wave(x: FloatArray, F: FloatArray) -> None:
    size = len(x)
    if size > 3:
        turned = np.zeros(size)
        for i in range(3, size):
            for j in range(3, size):
                turned[i] += F[i, j] * x[j]
        for i in range(3, size):
            x[i] = turned[i]


@compiled
def linearise(
    c: Coefficients, x: FloatArray, delta: float, delta_dot: float, n: float, J: FloatArray
) -> None:
    """The derivatives of w', w'' and v' by w, w' and v, into J (3, 3)."""
    w, v = x[0], x[2]
    J[0, 1] = 1.0
    J[1, 0] = yaw_stiffness(c, w)
    J[1, 1] = c.a
    J[1, 2] = rudder_effect_rate(c, v, 1.0, n, 0.0) * (c.d * delta + c.e * delta_dot)
    J[2, 0], J[2, 2] = 2 * c.f * w, 2 * c.g * v


@compiled
def tell(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    delta: float,
    delta_dot: float,
    n: float,
    row: FloatArray,
) -> None:
    """w, w', w'', v, v' and their variances, (10,); what is no state follows from the model."""
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
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += slope[i] * P[i, j] * slope[j]
    return total


@compiled
def tell_all(
    c: Coefficients,
    states: FloatArray,
    covariances: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
) -> FloatArray:
    """`tell` of a chunk, (n, 10); `delta` is one longer."""
    rows = np.empty((len(states), 10))
    for k in range(len(states)):
        rate = (delta[k + 1] - delta[k]) / dt
        tell(c, states[k], covariances[k], delta[k], rate, n[k], rows[k])
    return rows
