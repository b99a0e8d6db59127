"""Trials made for the filters: the ship's equations written once more, and their linear part."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import cache
from itertools import pairwise

import numpy as np
from gaussian import LinearRun, held
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag

from analysis.filters.base import Estimates, SmoothableFilter, Trace
from analysis.filters.gains import (
    LinearAxis,
    discrete_gain,
    kalman_poles,
    quality_poles,
    stated_poles,
)
from analysis.filters.noise_model import NoiseModel
from analysis.filters.smoother import SmoothingPass, smooth
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats
from shiplog import Signals
from shiplog.ships.paper import PAPER_INPUTS, Coefficients
from shiplog.vessel.settings import FilterSettings

Following = Mapping[str, float]

FILTERS = ("pseudo-input", "steady-state", "quality", "per-tick", "extended")
SMOOTHABLE = ("pseudo-input", "extended")


POLES = {"steady-state": kalman_poles, "quality": quality_poles, "per-tick": stated_poles}


def designed_gain(settings: FilterSettings, axis: LinearAxis) -> tuple[np.ndarray, np.ndarray]:
    """The gain (k,) of a filter with a designed gain, and its poles from sample to sample."""
    return discrete_gain(axis, POLES[settings.kind](axis, settings))


def signals_of(measured: np.ndarray, delta: np.ndarray, n: np.ndarray, dt: float) -> Signals:
    values = {"yaw_rate": measured[:, 0], "speed": measured[:, 1], "rudder": delta, "rpm": n}
    return Signals(0, dt, values)


def rates(
    c: Coefficients, x: np.ndarray, delta: np.ndarray, delta_dot: np.ndarray, n: np.ndarray
) -> np.ndarray:
    """(..., 3) of w, w' and v, (..., 3): Burylin's (4)."""
    w, w_dot, v = x[..., 0], x[..., 1], x[..., 2]
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * np.abs(w) + c.b3 * w**3
    ks = c.alpha1 * v + c.alpha2 * n * np.exp(-c.alpha3 * v)
    turning = hull + ks * (c.d * delta + c.e * delta_dot)
    return np.stack((w_dot, turning, c.f * w**2 + c.g * v**2 + c.h * n), axis=-1)


def estimates_of(
    c: Coefficients, x: np.ndarray, delta: np.ndarray, n: np.ndarray, dt: float
) -> np.ndarray:
    """w, w', w'', v, v', (n, 5), of w, w', v, (n, 3); the inputs stand still after the last."""
    delta_dot = np.diff(delta, append=delta[-1]) / dt
    turning, driving = np.moveaxis(rates(c, x, delta, delta_dot, n), -1, 0)[1:]
    return np.column_stack((x[:, 0], x[:, 1], turning, x[:, 2], driving))


def sailed(
    c: Coefficients, start: np.ndarray, delta: np.ndarray, n: np.ndarray, dt: float
) -> np.ndarray:
    """(n, 3) of the undisturbed ship, the inputs moving evenly from instant to instant."""
    return _sailed(c, tuple(start), tuple(delta), tuple(n), dt)


@cache
def _sailed(
    c: Coefficients, start: tuple[float], delta: tuple[float], n: tuple[float], dt: float
) -> np.ndarray:
    """Integrate once for all filters that are compared with it."""
    states = [np.array(start, float)]
    for k in range(len(delta) - 1):
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt

        def moving(t: float, x: np.ndarray, k: int = k, u: tuple = (delta_dot, n_dot)) -> object:
            return rates(c, x, delta[k] + u[0] * t, u[0], n[k] + u[1] * t)

        scale = np.array([1e-3, 1e-5, 1.0])
        done = solve_ivp(moving, (0, dt), states[-1], "DOP853", rtol=1e-13, atol=1e-13 * scale)
        states.append(done.y[:, -1])
    path = np.array(states)
    path.flags.writeable = False
    return path


def disturbed(
    c: Coefficients, first: np.ndarray, inputs: np.ndarray, dt: float, noise: np.ndarray
) -> np.ndarray:
    """(m, n, 3) of m ships of one helm, (n, 2), each with the noise (m, n - 1, 3) of its steps."""
    states = [first]
    for k in range(len(inputs) - 1):
        u, u_dot = inputs[k], (inputs[k + 1] - inputs[k]) / dt
        x, slopes = states[-1], [np.zeros_like(first)]
        for share in (0.0, 0.5, 0.5, 1.0):
            delta, n = u + u_dot * share * dt
            slopes.append(rates(c, x + share * dt * slopes[-1], delta, u_dot[0], n))
        moved = dt / 6 * (slopes[1] + 2 * slopes[2] + 2 * slopes[3] + slopes[4])
        states.append(x + moved + noise[:, k])
    return np.stack(states, axis=1)


def straight(c: Coefficients) -> Coefficients:
    """A ship whose equations are linear: no drag, a rudder that feels the propeller alone.

    Its coefficients are floats: with integers among them all loops would be compiled a second time.
    """
    return c._replace(b2=0.0, b3=0.0, f=0.0, g=0.0, alpha1=0.0, alpha3=0.0)


def steered(count: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """A rudder that goes to and fro, and revolutions."""
    t = np.arange(count) * dt
    return np.clip(0.5 * np.sin(2 * np.pi * t / 40), -0.3, 0.3), np.full(count, 80.0)


def five_states(
    c: Coefficients, noise: NoiseModel, stats: SignalStats, delta: np.ndarray, n: np.ndarray
) -> LinearRun:
    """The pseudo-input filter's model of a straight ship at constant revolutions."""
    dt, r = stats.dt_secs, noise.measurement_std**2
    yaw = [[0, 1, 0], [c.b1, c.a, 0], [0, c.b1, c.a]]
    A = block_diag(yaw, np.zeros((2, 2)))
    F, Q = held(A, np.diag(np.repeat(noise.process_ratio * r * stats.interval_secs, (3, 2))), dt)
    dw, dv = stats.std + 1e-9
    rate = abs(c.a) + 1e-3
    P = np.diag([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv]) ** 2
    path = sailed(c, np.array([stats.first[0], 0.0, stats.first[1]]), delta, n, dt)
    return LinearRun(estimates_of(c, path, delta, n, dt), F, Q, P, np.eye(5)[[0, 3]], r)


def pushes(c: Coefficients, noise: NoiseModel, stats: SignalStats) -> np.ndarray:
    """What yaw moment and surge force add to the covariance of w, w' and v in a step, (3, 3)."""
    stiffness = c.b1 + 2 * c.b2 * abs(stats.yaw_rate_rms) + 3 * c.b3 * stats.yaw_rate_rms**2
    A = np.array([[0, 1, 0], [stiffness, c.a, 0], [0, 0, 2 * c.g * stats.median_speed]])
    q = noise.process_ratio * noise.measurement_std**2 * stats.interval_secs
    return held(A, np.diag([0.0, *q]), stats.dt_secs)[1]


def three_states(
    c: Coefficients,
    noise: NoiseModel,
    stats: SignalStats,
    delta: np.ndarray,
    n: np.ndarray,
    stds: np.ndarray | None = None,
) -> LinearRun:
    """The other filters' of a straight ship; the wave's states are two of another basis."""
    dt, r = stats.dt_secs, noise.measurement_std**2
    q = noise.process_ratio * r * stats.interval_secs
    A, C = np.array([[0, 1, 0], [c.b1, c.a, 0], [0, 0, 0]]), np.eye(3)[[0, 2]]
    dw, dv = stats.std + 1e-9 if stds is None else stds
    P = np.diag([dw, (abs(c.a) + 1e-3) * (stats.std[0] + 1e-9), dv]) ** 2
    intensity = np.diag([0.0, *q])
    path = sailed(c, np.array([stats.first[0], 0.0, stats.first[1]]), delta, n, dt)
    wave = noise.wave
    if wave is not None:
        w0, zeta = wave.frequency, wave.damping
        A = block_diag(A, [[0, 1], [-(w0**2), -2 * zeta * w0]])
        intensity = block_diag(intensity, np.diag([0.0, 1.0]))
        P = block_diag(P, np.diag([1 / (4 * zeta * w0**3), 1 / (4 * zeta * w0)]))
        C = np.hstack((C, [[0, np.sqrt(4 * zeta * w0) * wave.std], [0, 0]]))
        path = np.hstack((path, np.zeros((len(path), 2))))
    F, Q = held(A, intensity, dt)
    return LinearRun(path, F, Q, P, C, r)


# the instants from sample to sample of yaw rate and speed, and those missing of each
PATTERNS: dict[str, tuple[tuple[int, int], list[int], list[int]]] = {
    "all": ((1, 1), [], []),
    "holes": ((1, 1), [4, 5, 7], [7, 8]),
    "slow speed": ((1, 3), [2], [6]),
    "slow gyro": ((4, 1), [], [0, 1, 5]),
    "late": ((1, 2), [0, 1, 2], [0]),
}


def measured_as(pattern: str, measured: np.ndarray) -> np.ndarray:
    steps, *missing = PATTERNS[pattern]
    seen = measured.copy()
    for output in range(2):
        seen[np.arange(len(seen)) % steps[output] != 0, output] = np.nan
        seen[missing[output], output] = np.nan
    return seen


def in_chunks(signals: Signals, cuts: list[int]) -> Iterator[tuple[Signals, Following]]:
    """The signals cut at instants, each part with the inputs of the instant after it."""
    edges = [0, *cuts, len(signals)]
    for start, stop in pairwise(edges):
        known = stop < len(signals)
        following = {name: float(signals[name][stop]) for name in PAPER_INPUTS} if known else None
        yield signals.part(start, stop), following or last_inputs(signals)


def smoothed_run(
    filtering: SmoothableFilter, signals: Signals
) -> tuple[Estimates, Trace, tuple[np.ndarray, np.ndarray]]:
    """What the filter made of a whole run, how, and the smoothed states and covariances."""
    estimates, trace = filtering.trace(signals, last_inputs(signals))
    going = SmoothingPass()
    going.add(trace)
    (end,) = going.result()
    return estimates, trace, smooth(trace, end)


def smoothed_in_chunks(
    filters: tuple[SmoothableFilter, SmoothableFilter], signals: Signals, cuts: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Smoothed states and covariances of a run in chunks, in two passes of two equal filters."""
    first, second = filters
    going = SmoothingPass()
    for chunk, following in in_chunks(signals, cuts):
        going.add(first.trace(chunk, following)[1])
    ends = going.result()
    assert len(ends) == len(cuts) + 1
    parts = [
        smooth(second.trace(chunk, following)[1], end)
        for (chunk, following), end in zip(in_chunks(signals, cuts), ends, strict=True)
    ]
    states, covariances = zip(*parts, strict=True)
    return np.concatenate(states), np.concatenate(covariances)


def together(parts: list[Estimates] | list[Trace]) -> Estimates | Trace:
    """Estimates or traces of chunks as one."""
    values = {field.name: [getattr(p, field.name) for p in parts] for field in fields(parts[0])}
    joined = {k: None if v[0] is None else np.concatenate(v) for k, v in values.items()}
    return type(parts[0])(**joined)
