"""States from signals: the Kalman filter with pseudo-inputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from shiplog.compiled import compiled
from shiplog.settings import FilterSettings
from shiplog.ship import (
    INPUTS,
    OUTPUTS,
    Coefficients,
    rudder_effect,
    rudder_effect_rate,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray, Signals

from .design.discrete import discretise
from .design.pseudo_input import pseudo_input_matrices
from .gauge import Gauge, gauge
from .inputs import last_inputs

STATES = ("yaw_rate", "yaw_acceleration", "yaw_jerk", "speed", "surge_acceleration")
OUTPUT_STATES = (0, 3)  # where the outputs stand among the states: C of y = C x
PAPER_RATIO = 0.01 / 400  # Burylin's Q over his R: no default trusts the model more


@dataclass(frozen=True, eq=False)
class Noise:
    """What the filter is told of noise."""

    measurement_std: FloatArray  # (2,) of one sample of yaw rate, rad/s, and speed, m/s
    process_ratio: FloatArray  # (2,) of yaw and surge: process over measurement intensity, 1/s^2
    measured: tuple[bool, bool] = (False, False)  # whether the former was taken from the log
    tuned: bool = False  # whether the latter was


@dataclass(frozen=True, eq=False)
class Estimates:
    """The filter's account of a trial, on the signals' clock."""

    states: FloatArray  # (n, 5): w, w', w'', v, v' in rad/s^k and m/s^k
    stds: FloatArray  # (n, 5) of the same
    innovations: FloatArray  # (n, 2), NaN where nothing was measured
    innovation_stds: FloatArray  # (n, 2), as the filter expects them


class FilterState(NamedTuple):
    """x of the paper's five-state model."""

    w: float
    w_dot: float
    w_ddot: float
    v: float
    v_dot: float


class Filter:
    """The five-state model of the identification paper, filtering yaw rate and speed in slabs.

    The mean is propagated by the exact nonlinear derivative (A x + B u with corrected
    pseudo-inputs, `design.pseudo_input_matrices`), the covariance by A, as the paper has it. Where
    an output is NaN there is no correction; the inputs must be known throughout.
    Source: Burylin, eqs (4)-(6).
    """

    def __init__(self, model: Coefficients, noise: Noise, usual: Gauge) -> None:
        A, _ = pseudo_input_matrices(model, 1.0)
        self._model, self._r = model, noise.measurement_std**2
        per_state = np.repeat(noise.process_ratio * self._r * usual.interval_secs, (3, 2))
        F, Q = discretise(A, np.diag(per_state), usual.dt_secs)
        self._F, self._Q = np.ascontiguousarray(F), np.ascontiguousarray(Q)
        self._x, self._P = _start(model, usual)
        self._last_rate = 0.0  # of the rudder

    def step(self, slab: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next slab; `following` are the inputs at the instant after it."""
        measured = np.column_stack([slab[name] for name in OUTPUTS])
        delta, n = (np.append(slab[name], following[name]) for name in INPUTS)
        rows, self._x, self._P, self._last_rate = _filter(
            self._model, self._x, self._P, self._F, self._Q, measured, self._r, delta, n,
            slab.dt_secs, self._last_rate,
        )  # fmt: skip
        return Estimates(rows[:, :5], np.sqrt(rows[:, 5:10]), rows[:, 10:12], np.sqrt(rows[:, 12:]))


def filter_states(signals: Signals, model: Coefficients, noise: Noise) -> Estimates:
    """Filter signals that are all there; as `Filter`."""
    following = last_inputs(signals)
    return Filter(model, noise, gauge(signals, model)).step(signals, following)


def noise_of(usual: Gauge, model: Coefficients, settings: FilterSettings) -> Noise:
    """The noise a vessel file states, and from the log what it leaves open.

    The measurement noise shows in the third differences of a signal, where the ship's motion does
    not; the process noise is what makes the innovations most likely.
    """
    given = (settings.yaw_rate_std, settings.speed_std)
    stds = np.array([a if b is None else b for a, b in zip(usual.noise, given, strict=True)])
    measured = (given[0] is None, given[1] is None)
    if settings.process_ratio is not None:
        return Noise(stds, np.full(2, settings.process_ratio), measured)
    of_head = gauge(usual.head, model)
    ratio = np.full(2, PAPER_RATIO)
    for output in range(2):
        ratio[output] = _likeliest_ratio(usual.head, of_head, model, stds, ratio, output)
    return Noise(stds, ratio, measured, tuned=True)


def _likeliest_ratio(
    signals: Signals,
    usual: Gauge,
    model: Coefficients,
    stds: FloatArray,
    ratio: FloatArray,
    output: int,
) -> float:
    following = last_inputs(signals)

    def unlikelihood(log_ratio: float) -> float:
        trial = ratio.copy()
        trial[output] = 10.0**log_ratio
        estimates = Filter(model, Noise(stds, trial), usual).step(signals, following)
        e, s = estimates.innovations[:, output], estimates.innovation_stds[:, output]
        score = float(np.nansum((e / s) ** 2 + 2 * np.log(s)))
        return score if np.isfinite(score) else 1e300

    best = minimize_scalar(
        unlikelihood, bounds=(np.log10(PAPER_RATIO), 8.0), method="bounded", options={"xatol": 0.02}
    )
    return float(10.0**best.x)


def _start(c: Coefficients, usual: Gauge) -> tuple[FilterState, FloatArray]:
    """The first values measured, their rates from the model at rest; as unsure as they vary."""
    w, v = usual.first
    delta, n = (usual.head[name][0] for name in INPUTS)
    w_ddot = yaw_acceleration_rate(c, w, 0.0, v, n, delta, 0.0)
    start = FilterState(w, 0.0, w_ddot, v, surge_acceleration(c, w, v, n))
    dw, dv = usual.spread + 1e-9
    rate = abs(c.a) + 1e-3
    spread = np.array([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv])
    return start, np.diag(spread**2)


@compiled
def _filter(
    c: Coefficients,
    x: FilterState,
    P: FloatArray,
    F: FloatArray,
    Q: FloatArray,
    measured: FloatArray,
    r: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    last_rate: float,
) -> tuple[FloatArray, FilterState, FloatArray, float]:
    """Rows of the state, its variances, the innovations and their variances, (n, 14).

    And what the next slab begins with: x, P and the rudder's rate. `delta` and `n` are one longer.
    """
    count = len(measured)
    rows = np.empty((count, 14))
    P, FP = P.copy(), np.empty((5, 5))
    for k in range(count):
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt
        # a rudder that starts or stops makes w'' jump
        jump = rudder_effect(c, x.v, n[k]) * c.e * (delta_dot - last_rate)
        x = FilterState(x.w, x.w_dot, x.w_ddot + jump, x.v, x.v_dot)
        last_rate = delta_dot
        for output, state in enumerate(OUTPUT_STATES):
            S = P[state, state] + r[output]
            innovation = measured[k, output] - x[state]
            rows[k, 10 + output], rows[k, 12 + output] = innovation, S
            if np.isfinite(innovation):
                K = P[:, state] / S
                x = _corrected(x, K, innovation)
                _subtract_outer(P, K, P[state].copy())
        for i in range(5):
            rows[k, 5 + i] = max(P[i, i], 0.0)
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4] = x
        x = _predicted(c, x, delta[k], delta_dot, n[k], n_dot, dt)
        _propagate(P, F, Q, FP)
    return rows, x, P, last_rate


@compiled
def _subtract_outer(P: FloatArray, K: FloatArray, row: FloatArray) -> None:
    """P - K row, in place."""
    for i in range(5):
        for j in range(5):
            P[i, j] -= K[i] * row[j]


@compiled
def _propagate(P: FloatArray, F: FloatArray, Q: FloatArray, FP: FloatArray) -> None:
    """F P F' + Q in place, symmetric; `FP` is room to work in."""
    for i in range(5):
        for j in range(5):
            FP[i, j] = 0.0
            for k in range(5):
                FP[i, j] += F[i, k] * P[k, j]
    for i in range(5):
        for j in range(i + 1):
            P[i, j] = Q[i, j]
            for k in range(5):
                P[i, j] += FP[i, k] * F[j, k]
            P[j, i] = P[i, j]


@compiled
def _corrected(x: FilterState, K: FloatArray, innovation: float) -> FilterState:
    return _moved(x, FilterState(K[0], K[1], K[2], K[3], K[4]), innovation)


@compiled
def _predicted(
    c: Coefficients,
    x: FilterState,
    delta: float,
    delta_dot: float,
    n: float,
    n_dot: float,
    dt: float,
) -> FilterState:
    """One Runge-Kutta step of x' = A x + B u, the rudder and the revolutions moving evenly."""
    middle, end = dt / 2, dt
    k1 = _motion(c, x, delta, delta_dot, n, n_dot)
    half_delta, half_n = delta + delta_dot * middle, n + n_dot * middle
    k2 = _motion(c, _moved(x, k1, middle), half_delta, delta_dot, half_n, n_dot)
    k3 = _motion(c, _moved(x, k2, middle), half_delta, delta_dot, half_n, n_dot)
    end_delta, end_n = delta + delta_dot * end, n + n_dot * end
    k4 = _motion(c, _moved(x, k3, end), end_delta, delta_dot, end_n, n_dot)
    x = _moved(x, k1, dt / 6)
    x = _moved(x, k2, dt / 3)
    x = _moved(x, k3, dt / 3)
    return _moved(x, k4, dt / 6)


@compiled
def _motion(
    c: Coefficients, x: FilterState, delta: float, delta_dot: float, n: float, n_dot: float
) -> FilterState:
    """A x + B u, row by row, with the pseudo-inputs written out."""
    ks = rudder_effect(c, x.v, n)
    ks_dot = rudder_effect_rate(c, x.v, x.v_dot, n, n_dot)
    steering = c.d * delta + c.e * delta_dot
    return FilterState(
        x.w_dot,
        yaw_acceleration_rate(c, x.w, x.w_dot, x.v, n, delta, delta_dot),
        c.a * x.w_ddot + yaw_stiffness(c, x.w) * x.w_dot + ks_dot * steering + ks * c.d * delta_dot,
        surge_acceleration(c, x.w, x.v, n),
        2 * c.f * x.w * x.w_dot + 2 * c.g * x.v * x.v_dot + c.h * n_dot,
    )


@compiled
def _moved(x: FilterState, rate: FilterState, h: float) -> FilterState:
    return FilterState(
        x.w + h * rate.w,
        x.w_dot + h * rate.w_dot,
        x.w_ddot + h * rate.w_ddot,
        x.v + h * rate.v,
        x.v_dot + h * rate.v_dot,
    )
