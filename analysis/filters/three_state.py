"""Filters of three states: extended Kalman, steady-state, quality and per-tick.

The states are yaw rate w, its derivative w' and speed v; the other estimates follow from the ship's
equations. The filters differ in their gain: the extended Kalman filter computes the optimal one at
each instant, the steady-state and the quality filter have a constant one (`gains`), and the
per-tick observer places the same poles at each instant for the motion of that instant. The
covariance follows from the same recursion (Joseph's form), which holds for any gain.

A wave in the yaw rate, where one is modelled, adds the two states of its shaping filter. They add
to the measured yaw rate only, so that the estimated yaw rate is the ship's own slow turning.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm, solve_discrete_lyapunov

from analysis.design.discrete import discretise
from analysis.design.observability import ComplexArray
from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled
from shiplog.ships.paper import (
    PAPER_INPUTS,
    PAPER_OUTPUTS,
    Coefficients,
    yaw_stiffness,
)
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import FilterSettings

from .base import NOISE_SETTINGS, WAVE_SETTINGS, Estimates, FilterKind, Trace
from .gains import (
    LinearAxis,
    discrete_gain,
    kalman_poles,
    linear_axes,
    quality_poles,
    relinearised_gain,
    stated_poles,
)
from .kernels import ACCEPTED, REJECTED, copy_matrix, copy_vector, correct, innovate, propagate
from .noise_model import NoiseModel
from .ship_step import linearise, output_row, output_rows, predict_ship

OPTIMAL, CONSTANT, RELINEARISED = range(3)  # kinds of gain
_STATES = 3  # w, w' and v; those of a wave follow
MIN_POLE = 1e-300  # magnitude, so that a pole at zero has a logarithm
HANDOVER_RATIO = 1.5  # the designed gain replaces the optimal one once that is this close to it

PoleDesign = Callable[[LinearAxis, FilterSettings], ComplexArray]


class ThreeStateFilter:
    """A filter of yaw rate and speed with the states w, w' and v.

    Parameters
    ----------
    model
        The coefficients of the identification paper's model.
    noise
        The noise that the filter assumes.
    stats
        The statistics of the signals.
    settings
        The settings of ``[filter]``.
    poles
        The design of the continuous poles of yaw and of surge; None for the optimal gain of the
        extended Kalman filter.
    each_tick
        Place the poles at each instant for the motion of that instant.

    References
    ----------
    The extended Kalman filter: Jazwinski, "Stochastic processes and filtering theory", 1970,
    theorem 8.1. The other gains: see `gains`.
    """

    def __init__(
        self,
        model: Coefficients,
        noise: NoiseModel,
        stats: SignalStats,
        settings: FilterSettings,
        *,
        poles: PoleDesign | None = None,
        each_tick: bool = False,
    ) -> None:
        yaw, surge = linear_axes(model, noise, stats)
        self._model, self._r, self._gate = model, noise.measurement_std**2, settings.gate
        self._wave = _wave_block(yaw, stats.dt_secs)
        size = _STATES + len(self._wave.F)
        self.outputs = np.zeros((len(PAPER_OUTPUTS), size))
        self._yaw_states = [0, 1, *range(_STATES, size)]
        self.outputs[0, self._yaw_states] = yaw.C[0]
        self.outputs[1, 2] = 1.0
        self._Q = _process_noise(model, noise, stats, self._wave)
        self._x, self._P = _start(model, stats, self._wave)
        self._ages = np.zeros(len(PAPER_OUTPUTS))
        self._rejected = np.zeros(len(PAPER_OUTPUTS), np.int64)
        self._constant_gain = np.zeros((len(PAPER_OUTPUTS), size))
        self._poles = np.zeros(size, np.complex128)
        self._interval = stats.interval_secs
        self._settling_secs = np.zeros(len(PAPER_OUTPUTS))
        self._gain = OPTIMAL
        if poles is not None:
            self._gain = RELINEARISED if each_tick else CONSTANT
            self._place(0, yaw, self._yaw_states, poles(yaw, settings))
            self._place(1, surge, [2], poles(surge, settings))
        self._wave_per_sample = np.ascontiguousarray(expm(yaw.A[2:, 2:] * yaw.interval_secs))

    def _place(
        self,
        output: int,
        axis: LinearAxis,
        states: list[int],
        poles: ComplexArray,
    ) -> None:
        """Set the constant gain of an output, and how long its slowest pole takes to settle."""
        gain, discrete_poles = discrete_gain(axis, poles)
        self._constant_gain[output, states], self._poles[states] = gain, discrete_poles
        slowest = float(np.abs(discrete_poles).max())
        self._settling_secs[output] = -axis.interval_secs / np.log(max(slowest, MIN_POLE))

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk; `following` are the inputs at the instant after it."""
        return self._run(chunk, following, keep=False)[0]

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """Filter the next chunk, and return what the smoother needs as well."""
        return self._run(chunk, following, keep=True)

    def to_estimates(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Return w, w', w'', v, v' (n, 5), their standard deviations (n, 5), and the wave (n,)."""
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        rows = output_rows(self._model, states, covariances, delta, n, chunk.dt_secs)
        return rows[:, :5], np.sqrt(rows[:, 5:]), self._wave_rate(states)

    def _run(
        self, chunk: Signals, following: Mapping[str, float], *, keep: bool
    ) -> tuple[Estimates, Trace]:
        measured = np.column_stack([chunk[name] for name in PAPER_OUTPUTS])
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        correction = _Correction(
            self.outputs, self._r, self._gate, self._gain, self._constant_gain,
            self._poles, self._interval, self._settling_secs, self._wave_per_sample,
        )  # fmt: skip
        states, rows, innovations, rejected, trace = _filter(
            self._model, self._x, self._P, self._Q, self._wave.F, correction, measured, delta, n,
            chunk.dt_secs, self._rejected, self._ages, keep,
        )  # fmt: skip
        estimates = Estimates(
            rows[:, :5], np.sqrt(rows[:, 5:]), innovations[:, :2], np.sqrt(innovations[:, 2:]),
            rejected, self._wave_rate(states),
        )  # fmt: skip
        return estimates, Trace(states, *trace)

    def _wave_rate(self, states: FloatArray) -> FloatArray | None:
        """Return the wave's part of the yaw rate (n,), of states (n, s)."""
        c = self.outputs[0, _STATES:]
        return states[:, _STATES:] @ c if len(c) else None


class _Block(NamedTuple):
    """The wave's states from one instant to the next: transition F (k, k) and noise Q (k, k)."""

    F: FloatArray
    Q: FloatArray


def _wave_block(yaw: LinearAxis, dt: float) -> _Block:
    """Discretise the states of yaw beyond w and w', which are the wave's."""
    A, G = yaw.A[2:, 2:], yaw.G[2:]
    if not len(A):
        return _Block(np.zeros((0, 0)), np.zeros((0, 0)))
    F, Q = discretise(A, G @ yaw.Q @ G.T, dt)
    return _Block(np.ascontiguousarray(F), Q)


def _process_noise(
    c: Coefficients, noise: NoiseModel, stats: SignalStats, wave: _Block
) -> FloatArray:
    """Return the covariance (s, s) that the process noise adds from one instant to the next."""
    speed = stats.median_speed
    A = np.array(
        [
            [0.0, 1.0, 0.0],
            [yaw_stiffness(c, stats.yaw_rate_rms), c.a, 0.0],
            [0.0, 0.0, 2 * c.g * speed],
        ]
    )
    q = noise.process_ratio * noise.measurement_std**2 * stats.interval_secs
    _, Q = discretise(A, np.diag([0.0, *q]), stats.dt_secs)
    return np.ascontiguousarray(block_diag(Q, wave.Q))


def _start(c: Coefficients, stats: SignalStats, wave: _Block) -> tuple[FloatArray, FloatArray]:
    """Return the state (s,) and its covariance at the start: the first measurements, and w' zero.

    The standard deviations are those by which the signals vary.
    """
    w, v = stats.first
    dw, dv = stats.std + 1e-9
    stds = np.array([dw, (abs(c.a) + 1e-3) * dw, dv])
    wave_P = solve_discrete_lyapunov(wave.F, wave.Q) if len(wave.F) else wave.Q
    return (
        np.concatenate(([w, 0.0, v], np.zeros(len(wave.F)))),
        np.ascontiguousarray(block_diag(np.diag(stds**2), wave_P)),
    )


class _Correction(NamedTuple):
    """The measurement equation, and the design of the gain.

    Attributes
    ----------
    C
        (2, s): output matrix.
    r
        (2,): variances of the measurement noise.
    gate
        The largest accepted innovation, in standard deviations.
    gain
        `OPTIMAL`, `CONSTANT` or `RELINEARISED`.
    constant_gain
        (2, s): the constant gain of each output.
    poles
        (s,): poles of yaw and of surge from sample to sample.
    interval
        (2,): sampling intervals, s.
    settling
        (2,): time constants of the slowest poles, s.
    wave
        (k, k): transition matrix of the wave from a sample of the yaw rate to the next.
    """

    C: FloatArray
    r: FloatArray
    gate: float
    gain: int
    constant_gain: FloatArray
    poles: NDArray[np.complex128]
    interval: FloatArray
    settling: FloatArray
    wave: FloatArray


_TraceArrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@compiled
def _filter(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    Q: FloatArray,
    wave: FloatArray,
    correction: _Correction,
    measured: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    rejected_in_a_row: NDArray[np.int64],
    ages: FloatArray,
    keep: bool,
) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.bool_], _TraceArrays]:
    """Filter a chunk of n instants; `delta` and `n` are one longer.

    `x`, `P`, `rejected_in_a_row` and `ages` are updated for the next chunk.

    Returns
    -------
    states
        (n, s).
    rows
        (n, 10): w, w', w'', v, v' and their variances.
    innovations
        (n, 4): innovations of yaw rate and speed, and their variances.
    rejected
        (n, 2): which samples were rejected.
    trace
        The arrays of `Trace` after the states; empty unless `keep`.
    """
    count, size = len(measured), len(x)
    xs, rows, innovations = np.empty((count, size)), np.empty((count, 10)), np.empty((count, 4))
    rejected = np.zeros((count, 2), np.bool_)
    kept = count if keep else 0  # rows of the trace
    Ps, Fs = np.empty((kept, size, size)), np.empty((kept, size, size))
    Ks, es, Ss = np.zeros((kept, 2, size)), np.zeros((kept, 2)), np.ones((kept, 2))
    F, FP, Pc = np.zeros((size, size)), np.empty((size, size)), np.empty(size)
    J = np.zeros((3, 3))
    copy_matrix(F[3:, 3:], wave)
    for k in range(count):
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt
        for output in range(2):
            innovation, S, status = innovate(
                x, P, correction.C[output], correction.r[output], measured[k, output],
                correction.gate, output, rejected_in_a_row, Pc,
            )  # fmt: skip
            innovations[k, output], innovations[k, 2 + output] = innovation, S
            rejected[k, output] = status == REJECTED
            if status != ACCEPTED:
                continue
            if correction.gain == RELINEARISED:
                linearise(c, x, delta[k], delta_dot, n[k], J)
            K = _gain(correction, Pc, S, J, output, ages)
            correct(x, P, K, Pc, innovation, S)
            if keep:
                copy_vector(Ks[k, output], K)
                es[k, output], Ss[k, output] = innovation, S
        copy_vector(xs[k], x)
        output_row(c, x, P, delta[k], delta_dot, n[k], rows[k])
        if keep:
            copy_matrix(Ps[k], P)
        predict_ship(c, x, F, delta[k], delta_dot, n[k], n_dot, dt)
        if keep:
            copy_matrix(Fs[k], F)
        propagate(P, F, Q, FP)
    return xs, rows, innovations, rejected, (Ps, Fs, Ks, es, Ss)


@compiled
def _gain(
    correction: _Correction,
    Pc: FloatArray,
    S: float,
    J: FloatArray,
    output: int,
    ages: FloatArray,
) -> FloatArray:
    """Compute the gain (s,) of an output from P c and S = c' P c + r.

    A designed gain assumes that the initial error has decayed. Until then the optimal gain is used:
    until it has fallen to the designed one, or for the time constant of the slowest pole. `ages`
    (2,) are the seconds since the first correction by each output.
    """
    optimal: FloatArray = Pc / S
    if correction.gain == OPTIMAL:
        return optimal
    interval = correction.interval[output]
    designed: FloatArray = correction.constant_gain[output].copy()
    if correction.gain == RELINEARISED:
        designed = relinearised_gain(
            J, correction.wave, correction.C[output], correction.poles, interval, output
        )
    measured = 2 * output  # w or v
    ages[output] += interval
    if optimal[measured] <= HANDOVER_RATIO * designed[measured]:
        ages[output] = np.inf
    return designed if ages[output] > correction.settling[output] else optimal


_SETTINGS = (*NOISE_SETTINGS, "gate", "yaw_bandwidth", "surge_bandwidth", *WAVE_SETTINGS)

EXTENDED = FilterKind("extended", ThreeStateFilter, smoothable=True, settings=_SETTINGS)
STEADY_STATE = FilterKind(
    "steady-state", partial(ThreeStateFilter, poles=kalman_poles), settings=_SETTINGS
)
QUALITY = FilterKind(
    "quality",
    partial(ThreeStateFilter, poles=quality_poles),
    settings=(*_SETTINGS, "shift", "damping"),
)
PER_TICK = FilterKind(
    "per-tick",
    partial(ThreeStateFilter, poles=stated_poles, each_tick=True),
    settings=(*_SETTINGS, "yaw_decay", "surge_decay"),
)
