"""The Kalman filter with pseudo-inputs: Burylin's five-state model, its misprints corrected."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.design.discrete import discretise
from analysis.design.pseudo_input_system import pseudo_input_matrices
from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled
from shiplog.ships.paper import (
    PAPER_INPUTS,
    PAPER_OUTPUTS,
    Coefficients,
    rudder_effect,
    rudder_effect_rate,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import FilterSettings

from .base import NOISE_SETTINGS, OUTPUT_STATES, STATES, Estimates, FilterKind, Trace
from .kernels import ACCEPTED, REJECTED, copy_matrix, copy_vector, correct, innovate, propagate
from .noise_model import NoiseModel


class MotionState(NamedTuple):
    """The state of the paper's model.

    Attributes
    ----------
    w, w_dot, w_ddot
        The yaw rate and its derivatives, rad/s, rad/s² and rad/s³.
    v, v_dot
        The speed, m/s, and its derivative, m/s².
    """

    w: float
    w_dot: float
    w_ddot: float
    v: float
    v_dot: float


class PseudoInputFilter:
    """A Kalman filter with the five-state model of the identification paper.

    The mean is propagated by the exact nonlinear derivative (A x + B u with the corrected
    pseudo-inputs, `design.pseudo_input_matrices`), the covariance by A, as in the paper. Where an
    output is NaN there is no correction.

    Parameters
    ----------
    model
        The coefficients of the paper's model.
    noise
        The noise that the filter assumes; the process noise drives all states.
    stats
        The statistics of the signals.
    settings
        The settings of ``[filter]``. `as_printed` takes the paper's equations as printed, in which
        w'' does not jump when the rudder starts or stops, so that e cannot be identified; it is
        kept for comparison.

    References
    ----------
    Burylin, eqs (4) to (6).
    """

    def __init__(
        self, model: Coefficients, noise: NoiseModel, stats: SignalStats, settings: FilterSettings
    ) -> None:
        A, _ = pseudo_input_matrices(model, 1.0)
        self.outputs = np.eye(len(STATES))[list(OUTPUT_STATES)]
        self._model, self._r, self._gate = model, noise.measurement_std**2, settings.gate
        self._jumps = not settings.as_printed
        per_state = np.repeat(noise.process_ratio * self._r * stats.interval_secs, (3, 2))
        F, Q = discretise(A, np.diag(per_state), stats.dt_secs)
        self._F, self._Q = np.ascontiguousarray(F), np.ascontiguousarray(Q)
        self._x, self._P = _start(model, stats)
        self._rejected = np.zeros(len(PAPER_OUTPUTS), np.int64)
        self._last_rate = np.zeros(1)  # of the rudder, rad/s

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk.

        Parameters
        ----------
        chunk
            Signals with `PAPER_OUTPUTS` and `PAPER_INPUTS`; an output that is NaN is not used.
        following
            The inputs at the instant after the chunk, by name.
        """
        return self._run(chunk, following, keep=False)[0]

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """Filter the next chunk as `step` does, and return what the smoother needs as well."""
        return self._run(chunk, following, keep=True)

    def to_estimates(
        self,
        chunk: Signals,  # noqa: ARG002 - the states are the filter's own
        following: Mapping[str, float],  # noqa: ARG002
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, None]:
        """Return the states as they are, with their standard deviations.

        Parameters
        ----------
        chunk, following
            As in `step`; not used.
        states, covariances
            (n, 5) the states, and (n, 5, 5) their covariances.

        Returns
        -------
        states, stds
            (n, 5) each; None in place of a wave.
        """
        variances = np.diagonal(covariances, axis1=1, axis2=2)
        return states, np.sqrt(np.maximum(variances, 0.0)), None

    def _run(
        self, chunk: Signals, following: Mapping[str, float], *, keep: bool
    ) -> tuple[Estimates, Trace]:
        measured = np.column_stack([chunk[name] for name in PAPER_OUTPUTS])
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        rows, innovations, rejected, trace = _filter(
            self._model, self._x, self._P, self._F, self._Q, measured, self._r, self._gate,
            self.outputs, delta, n, chunk.dt_secs, self._last_rate, self._jumps, self._rejected,
            keep,
        )  # fmt: skip
        count = len(STATES)
        estimates = Estimates(
            rows[:, :count], np.sqrt(rows[:, count:]), innovations[:, :2],
            np.sqrt(innovations[:, 2:]), rejected,
        )  # fmt: skip
        x, P, K, e, S = trace
        F = np.repeat(self._F[None], len(P), axis=0)
        return estimates, Trace(x, P, F, K, e, S)


def _start(c: Coefficients, stats: SignalStats) -> tuple[FloatArray, FloatArray]:
    """Return the state and its covariance at the start: the first measurements, w' = 0.

    w'' and v' follow from the model; the standard deviations are those by which the signals vary.
    """
    w, v = stats.first
    delta, n = (stats.head[name][0] for name in PAPER_INPUTS)
    w_ddot = yaw_acceleration_rate(c, w, 0.0, v, n, delta, 0.0)
    start = np.array([w, 0.0, w_ddot, v, surge_acceleration(c, w, v, n)])
    dw, dv = stats.std + 1e-9
    rate = abs(c.a) + 1e-3
    stds = np.array([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv])
    return start, np.diag(stds**2)


_TraceArrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@compiled
def _filter(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    F: FloatArray,
    Q: FloatArray,
    measured: FloatArray,
    r: FloatArray,
    gate: float,
    C: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    last_rate: FloatArray,
    jumps: bool,
    rejected_in_a_row: NDArray[np.int64],
    keep: bool,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], _TraceArrays]:
    """Filter a chunk of n instants; `delta` and `n` are one longer.

    `x`, `P`, `last_rate` and `rejected_in_a_row` are updated for the next chunk.

    Returns
    -------
    rows
        (n, 10): the states and their variances.
    innovations
        (n, 4): innovations of yaw rate and speed, and their variances.
    rejected
        (n, 2): which samples were rejected.
    trace
        States, covariances, gains, innovations and variances of `Trace`; empty unless `keep`.
    """
    count, size = len(measured), len(x)
    rows, innovations = np.empty((count, 2 * size)), np.empty((count, 4))
    rejected = np.zeros((count, 2), np.bool_)
    kept = count if keep else 0
    xs, Ps = np.empty((kept, size)), np.empty((kept, size, size))
    Ks, es, Ss = np.zeros((kept, 2, size)), np.zeros((kept, 2)), np.ones((kept, 2))
    FP, Pc = np.empty((size, size)), np.empty(size)
    for k in range(count):
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt
        if jumps:  # w'' jumps when the rudder starts or stops
            x[2] += rudder_effect(c, x[3], n[k]) * c.e * (delta_dot - last_rate[0])
        last_rate[0] = delta_dot
        for output in range(2):
            innovation, S, status = innovate(
                x, P, C[output], r[output], measured[k, output], gate, output, rejected_in_a_row, Pc
            )
            innovations[k, output], innovations[k, 2 + output] = innovation, S
            rejected[k, output] = status == REJECTED
            if status != ACCEPTED:
                continue
            K = Pc / S
            correct(x, P, K, Pc, innovation, S)
            if keep:
                copy_vector(Ks[k, output], K)
                es[k, output], Ss[k, output] = innovation, S
        for i in range(size):
            rows[k, i], rows[k, size + i] = x[i], max(P[i, i], 0.0)
        if keep:
            copy_vector(xs[k], x)
            copy_matrix(Ps[k], P)
        _predict(c, x, delta[k], delta_dot, n[k], n_dot, dt)
        propagate(P, F, Q, FP)
    return rows, innovations, rejected, (xs, Ps, Ks, es, Ss)


@compiled
def _predict(
    c: Coefficients,
    x: FloatArray,
    delta: float,
    delta_dot: float,
    n: float,
    n_dot: float,
    dt: float,
) -> None:
    """Advance x' = A x + B u by a Runge-Kutta step, in place, with constant input rates."""
    s = MotionState(x[0], x[1], x[2], x[3], x[4])
    k1 = motion(c, s, delta, delta_dot, n, n_dot)
    half_delta, half_n = delta + delta_dot * dt / 2, n + n_dot * dt / 2
    k2 = motion(c, _moved(s, k1, dt / 2), half_delta, delta_dot, half_n, n_dot)
    k3 = motion(c, _moved(s, k2, dt / 2), half_delta, delta_dot, half_n, n_dot)
    k4 = motion(c, _moved(s, k3, dt), delta + delta_dot * dt, delta_dot, n + n_dot * dt, n_dot)
    for i in range(5):
        x[i] += dt / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])


@compiled
def motion(
    c: Coefficients, x: MotionState, delta: float, delta_dot: float, n: float, n_dot: float
) -> MotionState:
    """Compute the derivative of the state, A x + B u, with the pseudo-inputs written out.

    Parameters
    ----------
    c
        The coefficients of the paper's model.
    x
        The state.
    delta, delta_dot
        The rudder angle, rad, and its rate, rad/s.
    n, n_dot
        The revolutions, rpm, and their rate, rpm/s.

    References
    ----------
    Burylin, eqs (4) to (6), with the corrected pseudo-inputs.
    """
    ks = rudder_effect(c, x.v, n)
    ks_dot = rudder_effect_rate(c, x.v, x.v_dot, n, n_dot)
    steering = c.d * delta + c.e * delta_dot
    return MotionState(
        x.w_dot,
        yaw_acceleration_rate(c, x.w, x.w_dot, x.v, n, delta, delta_dot),
        c.a * x.w_ddot + yaw_stiffness(c, x.w) * x.w_dot + ks_dot * steering + ks * c.d * delta_dot,
        surge_acceleration(c, x.w, x.v, n),
        2 * c.f * x.w * x.w_dot + 2 * c.g * x.v * x.v_dot + c.h * n_dot,
    )


@compiled
def _moved(x: MotionState, rate: MotionState, h: float) -> MotionState:
    """Return x + h rate."""
    return MotionState(
        x.w + h * rate.w,
        x.w_dot + h * rate.w_dot,
        x.w_ddot + h * rate.w_ddot,
        x.v + h * rate.v,
        x.v_dot + h * rate.v_dot,
    )


PSEUDO_INPUT = FilterKind(
    "pseudo-input",
    PseudoInputFilter,
    smoothable=True,
    settings=(*NOISE_SETTINGS, "gate", "as_printed"),
    process_noise="states",
)
