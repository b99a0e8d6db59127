"""The Kalman filter as a textbook states it, a loop over numpy arrays: the peer of ours.

Burylin's five states w, w', w'', v, v', of which the yaw rate w and the speed v are measured.
"""

from math import exp
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

C = np.eye(5)[[0, 3]]  # the outputs are w and v
I = np.eye(5)


class FilterResult(NamedTuple):
    """States, innovations and their standard deviations, a row for each sample.

    The fields are those of `analysis.filters.base.Estimates`: (n, 5) states, (n, 2) innovations.
    """

    states: FloatArray
    stds: FloatArray
    innovations: FloatArray
    innovation_stds: FloatArray


class FilterSetup(NamedTuple):
    """The initial state x and its covariance P, the matrices F, Q and R, and the measurements."""

    x: FloatArray
    P: FloatArray
    F: FloatArray
    Q: FloatArray
    R: FloatArray
    measured: FloatArray  # (n, 2)


class ShipInput(NamedTuple):
    """Rudder, rad, and propeller rate at an instant, and their derivatives until the next."""

    delta: float
    delta_dot: float
    n: float
    n_dot: float


def filter_in_numpy(signals: Signals, c: Coefficients, noise: NoiseModel) -> FilterResult:
    """Return the estimates of the filter: at each sample correct, store, predict.

    Parameters
    ----------
    signals
        Yaw rate, speed, rudder and revolutions on one clock; NaN where not measured.
    c
        The coefficients of the paper's model.
    noise
        Measurement noise and the ratio of the process noise.
    """
    x, P, F, Q, R, measured = filter_setup(signals, c, noise)
    dt, count = signals.dt_secs, len(measured)
    result = FilterResult(*(np.empty((count, size)) for size in (5, 5, 2, 2)))
    last_rate = 0.0
    for k, u in enumerate(ship_inputs(signals)):
        x[2] += yaw_jump(c, x, u, last_rate)
        last_rate = u.delta_dot
        innovation = measured[k] - C @ x
        S = C @ P @ C.T + R
        result.innovations[k], result.innovation_stds[k] = innovation, np.sqrt(np.diag(S))
        measured_now = np.isfinite(innovation)
        if measured_now.all():
            K = P @ C.T @ np.linalg.inv(S)
            x = x + K @ innovation
            P = (I - K @ C) @ P
        elif measured_now.any():
            H = C[measured_now]
            K = P @ H.T @ np.linalg.inv(S[np.ix_(measured_now, measured_now)])
            x = x + K @ innovation[measured_now]
            P = (I - K @ H) @ P
        result.states[k], result.stds[k] = x, np.sqrt(np.diag(P))
        x = runge_kutta_four(c, x, u, dt)
        P = F @ P @ F.T + Q
    return result


def filter_setup(signals: Signals, c: Coefficients, noise: NoiseModel) -> FilterSetup:
    """Return the initial state, the matrices of the linear model and the measurements (n, 2).

    References
    ----------
    Van Loan, "Computing integrals involving the matrix exponential", 1978: F and Q.
    """
    dt, r = signals.dt_secs, noise.measurement_std**2
    measured = np.column_stack([signals["yaw_rate"], signals["speed"]])
    A = np.zeros((5, 5))
    A[0, 1] = 1
    A[1, :2] = A[2, 1:3] = c.b1, c.a
    intensity = np.diag(np.repeat(noise.process_ratio * r * dt, (3, 2)))
    # Van Loan: F = exp(A dt), and the covariance that white noise adds in dt
    blocks = expm(np.block([[-A, intensity], [np.zeros((5, 5)), A.T]]) * dt)
    F = blocks[5:, 5:].T
    Q = F @ blocks[:5, 5:]
    w, v = (column[np.isfinite(column)][0] for column in measured.T)
    first = ShipInput(signals["rudder"][0], 0.0, signals["rpm"][0], 0.0)
    _, w_ddot, _, v_dot, _ = state_derivative(c, np.array([w, 0.0, 0.0, v, 0.0]), first)
    dw, dv = np.nanstd(measured, axis=0) + 1e-9
    rate = abs(c.a) + 1e-3
    P = np.diag([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv]) ** 2
    return FilterSetup(np.array([w, 0.0, w_ddot, v, v_dot]), P, F, Q, np.diag(r), measured)


def ship_inputs(signals: Signals) -> list[ShipInput]:
    """Return the inputs of the ship at each sample."""
    delta, n = signals["rudder"], signals["rpm"]
    delta_dot, n_dot = (np.append(np.diff(u), 0.0) / signals.dt_secs for u in (delta, n))
    return [ShipInput(*row) for row in np.column_stack((delta, delta_dot, n, n_dot)).tolist()]


def yaw_jump(c: Coefficients, x: FloatArray, u: ShipInput, last_rate: float) -> float:
    """Return the jump of w'' where the rudder starts or stops."""
    ks = c.alpha1 * x[3] + c.alpha2 * u.n * exp(-c.alpha3 * x[3])
    return float(ks * c.e * (u.delta_dot - last_rate))


def state_derivative(c: Coefficients, x: FloatArray, u: ShipInput) -> FloatArray:
    """Return x' of the ship: Burylin's A x + B u, the pseudo-inputs written out."""
    w, w_dot, w_ddot, v, v_dot = x
    slipstream = c.alpha2 * exp(-c.alpha3 * v)
    ks = c.alpha1 * v + slipstream * u.n
    ks_dot = c.alpha1 * v_dot + slipstream * (u.n_dot - c.alpha3 * u.n * v_dot)
    steering = c.d * u.delta + c.e * u.delta_dot
    stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w
    return np.array(
        [
            w_dot,
            c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w * w * w + ks * steering,
            c.a * w_ddot + stiffness * w_dot + ks_dot * steering + ks * c.d * u.delta_dot,
            c.f * w * w + c.g * v * v + c.h * u.n,
            2 * c.f * w * w_dot + 2 * c.g * v * v_dot + c.h * u.n_dot,
        ]
    )


def runge_kutta_four(c: Coefficients, x: FloatArray, u: ShipInput, dt: float) -> FloatArray:
    """Return x one step later, by the classical Runge-Kutta method with linear inputs."""
    half = ShipInput(u.delta + u.delta_dot * dt / 2, u.delta_dot, u.n + u.n_dot * dt / 2, u.n_dot)
    end = ShipInput(u.delta + u.delta_dot * dt, u.delta_dot, u.n + u.n_dot * dt, u.n_dot)
    k1 = state_derivative(c, x, u)
    k2 = state_derivative(c, x + dt / 2 * k1, half)
    k3 = state_derivative(c, x + dt / 2 * k2, half)
    k4 = state_derivative(c, x + dt * k3, end)
    return x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
