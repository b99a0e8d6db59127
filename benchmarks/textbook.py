"""The same Kalman filter as ours, as a reader of a textbook writes it: a loop over numpy arrays."""

from math import exp
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

C = np.eye(5)[[0, 3]]  # of w, w', w'', v, v' the yaw rate and the speed are measured
I = np.eye(5)


class Filtered(NamedTuple):
    """A row a sample, the fields as those of `analysis.filters.base.Estimates`."""

    states: FloatArray
    stds: FloatArray
    innovations: FloatArray
    innovation_stds: FloatArray


class Design(NamedTuple):
    """What the filter starts with and keeps."""

    x: FloatArray
    P: FloatArray
    F: FloatArray
    Q: FloatArray
    R: FloatArray
    measured: FloatArray  # (n, 2)


class Input(NamedTuple):
    """Rudder and revolutions at an instant, and how fast they change until the next."""

    delta: float
    delta_dot: float
    n: float
    n_dot: float


def filter_in_numpy(signals: Signals, c: Coefficients, noise: NoiseModel) -> Filtered:
    """Correct, store, predict."""
    x, P, F, Q, R, measured = design(signals, c, noise)
    dt, count = signals.dt_secs, len(measured)
    found = Filtered(*(np.empty((count, size)) for size in (5, 5, 2, 2)))
    last_rate = 0.0
    for k, u in enumerate(inputs(signals)):
        x[2] += kink(c, x, u, last_rate)
        last_rate = u.delta_dot
        innovation = measured[k] - C @ x
        S = C @ P @ C.T + R
        found.innovations[k], found.innovation_stds[k] = innovation, np.sqrt(np.diag(S))
        seen = np.isfinite(innovation)
        if seen.all():
            K = P @ C.T @ np.linalg.inv(S)
            x = x + K @ innovation
            P = (I - K @ C) @ P
        elif seen.any():
            H = C[seen]
            K = P @ H.T @ np.linalg.inv(S[np.ix_(seen, seen)])
            x = x + K @ innovation[seen]
            P = (I - K @ H) @ P
        found.states[k], found.stds[k] = x, np.sqrt(np.diag(P))
        x = runge_kutta(c, x, u, dt)
        P = F @ P @ F.T + Q
    return found


def design(signals: Signals, c: Coefficients, noise: NoiseModel) -> Design:
    """Start, matrices and measurements."""
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
    first = Input(signals["rudder"][0], 0.0, signals["rpm"][0], 0.0)
    _, w_ddot, _, v_dot, _ = derivative(c, np.array([w, 0.0, 0.0, v, 0.0]), first)
    dw, dv = np.nanstd(measured, axis=0) + 1e-9
    rate = abs(c.a) + 1e-3
    P = np.diag([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv]) ** 2
    return Design(np.array([w, 0.0, w_ddot, v, v_dot]), P, F, Q, np.diag(r), measured)


def inputs(signals: Signals) -> list[Input]:
    """Of every sample."""
    delta, n = signals["rudder"], signals["rpm"]
    delta_dot, n_dot = (np.append(np.diff(u), 0.0) / signals.dt_secs for u in (delta, n))
    return [Input(*row) for row in np.column_stack((delta, delta_dot, n, n_dot)).tolist()]


def kink(c: Coefficients, x: FloatArray, u: Input, last_rate: float) -> float:
    """By how much w'' jumps where the rudder starts or stops."""
    ks = c.alpha1 * x[3] + c.alpha2 * u.n * exp(-c.alpha3 * x[3])
    return float(ks * c.e * (u.delta_dot - last_rate))


def derivative(c: Coefficients, x: FloatArray, u: Input) -> FloatArray:
    """x' of the ship: Burylin's A x + B u, the pseudo-inputs written out."""
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


def runge_kutta(c: Coefficients, x: FloatArray, u: Input, dt: float) -> FloatArray:
    """One step, the rudder and the revolutions moving evenly."""
    half = Input(u.delta + u.delta_dot * dt / 2, u.delta_dot, u.n + u.n_dot * dt / 2, u.n_dot)
    end = Input(u.delta + u.delta_dot * dt, u.delta_dot, u.n + u.n_dot * dt, u.n_dot)
    k1 = derivative(c, x, u)
    k2 = derivative(c, x + dt / 2 * k1, half)
    k3 = derivative(c, x + dt / 2 * k2, half)
    k4 = derivative(c, x + dt * k3, end)
    return x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
