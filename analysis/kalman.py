"""States from signals: the Kalman filter with pseudo-inputs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from shiplog.clock import usual_interval_secs
from shiplog.compiled import compiled
from shiplog.errors import LogError
from shiplog.ship import (
    Coefficients,
    rudder_effect,
    rudder_effect_rate,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray, Signals
from shiplog.vessel import FilterSettings

from .design import discretise, pseudo_input_matrices

STATES = ("yaw_rate", "yaw_acceleration", "yaw_jerk", "speed", "surge_acceleration")
OUTPUTS = ("yaw_rate", "speed")
OUTPUT_STATES = (0, 3)  # where they stand among the states: C of y = C x
PAPER_RATIO = 0.01 / 400  # Burylin's Q over his R: no default trusts the model more
TUNING_SAMPLES = 50_000  # of a long log are enough to tell how well the model fits


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


def filter_states(signals: Signals, model: Coefficients, noise: Noise) -> Estimates:
    """Filter yaw rate and speed through the five-state model of the identification paper.

    The mean is propagated by the exact nonlinear derivative (A x + B u with corrected
    pseudo-inputs, `design.pseudo_input_matrices`), the covariance by A, as the paper has it. Where
    an output is NaN there is no correction; `rudder` and `rpm` must be known throughout.
    Source: Burylin, eqs (4)-(6).
    """
    measured = np.column_stack([signals[name] for name in OUTPUTS])
    A, _ = pseudo_input_matrices(model, 1.0)
    r = noise.measurement_std**2
    intervals = [usual_interval_secs(signals[name], signals.dt_secs) for name in OUTPUTS]
    per_state = np.repeat(noise.process_ratio * r * intervals, (3, 2))
    F, Q = map(np.ascontiguousarray, discretise(A, np.diag(per_state), signals.dt_secs))
    start, P = _start(model, measured, signals)
    rows = _filter(
        model, start, P, F, Q, measured, r, signals["rudder"], signals["rpm"], signals.dt_secs
    )
    return Estimates(rows[:, :5], np.sqrt(rows[:, 5:10]), rows[:, 10:12], np.sqrt(rows[:, 12:]))


def noise_of(signals: Signals, model: Coefficients, settings: FilterSettings) -> Noise:
    """The noise a vessel file states, and from the log what it leaves open.

    The measurement noise shows in the third differences of a signal, where the ship's motion does
    not; the process noise is what makes the innovations most likely.
    """
    given = (settings.yaw_rate_std, settings.speed_std)
    stds = np.array(
        [
            noise_level(signals[name]) if std is None else std
            for name, std in zip(OUTPUTS, given, strict=True)
        ]
    )
    measured = (given[0] is None, given[1] is None)
    if settings.process_ratio is not None:
        return Noise(stds, np.full(2, settings.process_ratio), measured)
    head = _head(signals, TUNING_SAMPLES)
    ratio = np.full(2, PAPER_RATIO)
    for output in range(2):
        ratio[output] = _likeliest_ratio(head, model, stds, ratio, output)
    return Noise(stds, ratio, measured, tuned=True)


def noise_level(values: FloatArray) -> float:
    """The standard deviation of a signal's white noise, from its third differences, (n,).

    Differences eight times the usual are spikes and not counted. A signal printed to few digits
    has at least the noise of its rounding.
    """
    seen = values[np.isfinite(values)]
    thirds = np.diff(seen, 3) / np.sqrt(20.0)  # white noise of variance s^2 gives 20 s^2
    if not len(thirds):
        raise LogError("fewer than four samples on the common clock; record for longer")
    usual = 1.4826 * float(np.median(np.abs(thirds)))
    kept = thirds[np.abs(thirds) <= 8 * usual] if usual > 0 else thirds
    steps = np.abs(np.diff(seen))
    rounding = float(np.min(steps[steps > 0], initial=np.inf))
    rounding = rounding / np.sqrt(12.0) if np.isfinite(rounding) else 0.0
    floor = max(1e-6 * float(np.std(seen)), 1e-12)
    return max(float(np.sqrt(np.mean(kept**2))), min(rounding, float(np.std(seen))), floor)


def _likeliest_ratio(
    signals: Signals, model: Coefficients, stds: FloatArray, ratio: FloatArray, output: int
) -> float:
    def unlikelihood(log_ratio: float) -> float:
        trial = ratio.copy()
        trial[output] = 10.0**log_ratio
        estimates = filter_states(signals, model, Noise(stds, trial))
        e, s = estimates.innovations[:, output], estimates.innovation_stds[:, output]
        score = float(np.nansum((e / s) ** 2 + 2 * np.log(s)))
        return score if np.isfinite(score) else 1e300

    best = minimize_scalar(
        unlikelihood, bounds=(np.log10(PAPER_RATIO), 8.0), method="bounded", options={"xatol": 0.02}
    )
    return float(10.0**best.x)


def _head(signals: Signals, count: int) -> Signals:
    if len(signals) <= count:
        return signals
    head = {name: values[:count] for name, values in signals.values.items()}
    return Signals(signals.start_ns, signals.dt_secs, head)


def _start(
    c: Coefficients, measured: FloatArray, signals: Signals
) -> tuple[FilterState, FloatArray]:
    """The first values measured, their rates from the model at rest; as unsure as they vary."""
    w, v = (column[np.isfinite(column)][0] for column in measured.T)
    n = signals["rpm"][0]
    w_ddot = yaw_acceleration_rate(c, w, 0.0, v, n, signals["rudder"][0], 0.0)
    start = FilterState(w, 0.0, w_ddot, v, surge_acceleration(c, w, v, n))
    dw, dv = np.nanstd(measured, axis=0) + 1e-9
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
) -> FloatArray:
    """Rows of the state, its variances, the innovations and their variances, (n, 14)."""
    count = len(measured)
    rows = np.empty((count, 14))
    P, FP = P.copy(), np.empty((5, 5))
    last_rate = 0.0
    for k in range(count):
        ahead = min(k + 1, count - 1)
        delta_dot, n_dot = (delta[ahead] - delta[k]) / dt, (n[ahead] - n[k]) / dt
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
    return rows


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
