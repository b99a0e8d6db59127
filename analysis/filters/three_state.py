"""Filters of three states, w, w' and v, by the ship's own equations; what else is told follows.

Their gains differ: the extended Kalman filter finds the best one at each instant, the steady-state
and the quality filter keep one for ever (`gains`), the per-tick observer places the same poles anew
at each instant. All say how unsure they are by the same recursion, which holds for any gain.
A wave in the yaw rate, where asked for, is two states more, seen in the measurement alone: what is
left as yaw rate is the ship's slow turning.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm, solve_discrete_lyapunov

from analysis.design.discrete import discretise
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

from .base import Estimates, Trace
from .gains import LinearAxis, channels, discrete_gain, ticked_gain
from .kernels import BELIEVED, GATED, correct, propagate, weigh
from .noise_model import NoiseModel
from .ship_step import linearise, predict, tell, tell_all

BEST, FIXED, TICKED = range(3)  # gains
_GAINS = {"extended": BEST, "steady-state": FIXED, "quality": FIXED, "per-tick": TICKED}
_STATES = 3  # beside the wave's
TINY = 1e-300  # a pole that forgets at once
NEARLY = 1.5  # times the gain designed for ever, which the best one need not quite fall to


class ThreeStateFilter:
    """Filters yaw rate and speed in chunks; the inputs must be known throughout.

    `settings.chosen` is one of `extended`, `steady-state`, `quality` and `per-tick`.
    Source: the extended Kalman filter is Jazwinski's, "Stochastic processes and filtering theory",
    1970, theorem 8.1; the others are those of `gains`.
    """

    def __init__(
        self, model: Coefficients, noise: NoiseModel, stats: SignalStats, settings: FilterSettings
    ) -> None:
        yaw, surge = channels(model, noise, stats)
        self._model, self._r, self._gate = model, noise.measurement_std**2, settings.gate
        self._wave = _wave_block(yaw, stats.dt_secs)
        size = _STATES + len(self._wave.F)
        self.outputs = np.zeros((len(PAPER_OUTPUTS), size))
        of_yaw = [0, 1, *range(_STATES, size)]
        self.outputs[0, of_yaw] = yaw.C[0]
        self.outputs[1, 2] = 1.0
        self._Q = _process_noise(model, noise, stats, self._wave)
        self._gain = _GAINS[settings.chosen]
        self._x, self._P = _start(model, stats, self._wave)
        self._ages = np.zeros(len(PAPER_OUTPUTS))
        self._off = np.zeros(len(PAPER_OUTPUTS), np.int64)
        self._fixed = np.zeros((len(PAPER_OUTPUTS), size))
        self._poles = np.zeros(size, np.complex128)
        self._interval = stats.interval_secs
        self._forgetting = np.zeros(len(PAPER_OUTPUTS))
        if self._gain != BEST:
            self._design(settings, yaw, surge)
        self._wave_between = np.ascontiguousarray(expm(yaw.A[2:, 2:] * yaw.interval_secs))

    def _design(self, settings: FilterSettings, yaw: LinearAxis, surge: LinearAxis) -> None:
        of_yaw = [0, 1, *range(_STATES, len(self._fixed[0]))]
        for output, channel, states in ((0, yaw, of_yaw), (1, surge, [2])):
            gain, poles = discrete_gain(settings, channel)
            self._fixed[output, states], self._poles[states] = gain, poles
            slowest = float(np.abs(poles).max())
            self._forgetting[output] = -channel.interval_secs / np.log(max(slowest, TINY))

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk; `following` are the inputs at the instant after it."""
        return self._run(chunk, following, keep=False)[0]

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """As `step`, and how it came about."""
        return self._run(chunk, following, keep=True)

    def told(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """w, w', w'', v, v' (n, 5), their standard deviations, and the wave."""
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        rows = tell_all(self._model, states, covariances, delta, n, chunk.dt_secs)
        return rows[:, :5], np.sqrt(rows[:, 5:]), self._seen_wave(states)

    def _run(
        self, chunk: Signals, following: Mapping[str, float], *, keep: bool
    ) -> tuple[Estimates, Trace]:
        measured = np.column_stack([chunk[name] for name in PAPER_OUTPUTS])
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        correction = _Correction(
            self.outputs, self._r, self._gate, self._gain, self._fixed, self._poles,
            self._interval, self._forgetting, self._wave_between,
        )  # fmt: skip
        states, rows, innovations, gated, trace = _filter(
            self._model, self._x, self._P, self._Q, self._wave.F, correction, measured, delta, n,
            chunk.dt_secs, self._off, self._ages, keep,
        )  # fmt: skip
        told = Estimates(
            rows[:, :5], np.sqrt(rows[:, 5:]), innovations[:, :2], np.sqrt(innovations[:, 2:]),
            gated, self._seen_wave(states),
        )  # fmt: skip
        return told, Trace(states, *trace)

    def _seen_wave(self, states: FloatArray) -> FloatArray | None:
        seen = self.outputs[0, _STATES:]
        return states[:, _STATES:] @ seen if len(seen) else None


class _Block(NamedTuple):
    """States that move by themselves, from one instant to the next."""

    F: FloatArray  # (k, k)
    Q: FloatArray  # (k, k)


def _wave_block(yaw: LinearAxis, dt: float) -> _Block:
    """The wave's states are the yaw channel's beyond w and w'."""
    A, G = yaw.A[2:, 2:], yaw.G[2:]
    if not len(A):
        return _Block(np.zeros((0, 0)), np.zeros((0, 0)))
    F, Q = discretise(A, G @ yaw.Q @ G.T, dt)
    return _Block(np.ascontiguousarray(F), Q)


def _process_noise(
    c: Coefficients, noise: NoiseModel, stats: SignalStats, wave: _Block
) -> FloatArray:
    """What is added to the covariance from one instant to the next, (s, s)."""
    speed = stats.ahead
    A = np.array(
        [
            [0.0, 1.0, 0.0],
            [yaw_stiffness(c, stats.turning), c.a, 0.0],
            [0.0, 0.0, 2 * c.g * speed],
        ]
    )
    q = noise.process_ratio * noise.measurement_std**2 * stats.interval_secs
    _, Q = discretise(A, np.diag([0.0, *q]), stats.dt_secs)
    return np.ascontiguousarray(block_diag(Q, wave.Q))


def _start(c: Coefficients, stats: SignalStats, wave: _Block) -> tuple[FloatArray, FloatArray]:
    """The first values measured, not turning faster; as unsure as they vary."""
    w, v = stats.first
    dw, dv = stats.spread + 1e-9
    stds = np.array([dw, (abs(c.a) + 1e-3) * dw, dv])
    of_wave = solve_discrete_lyapunov(wave.F, wave.Q) if len(wave.F) else wave.Q
    return (
        np.concatenate(([w, 0.0, v], np.zeros(len(wave.F)))),
        np.ascontiguousarray(block_diag(np.diag(stds**2), of_wave)),
    )


class _Correction(NamedTuple):
    """What is measured, and by which gain it is taken in."""

    C: FloatArray  # (2, s)
    r: FloatArray  # (2,)
    gate: float
    gain: int
    fixed: FloatArray  # (2, s)
    poles: NDArray[np.complex128]  # (s,) of the yaw's and the surge's states, from sample to sample
    interval: FloatArray  # (2,) s
    forgetting: FloatArray  # (2,) s, that the slowest poles take to it
    wave: FloatArray  # (k, k) from a sample of the yaw rate to the next


_Kept = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


@compiled
def _filter(
    c: Coefficients,
    x: FloatArray,
    P: FloatArray,
    Q: FloatArray,
    wave: FloatArray,
    by: _Correction,
    measured: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    off: NDArray[np.int64],
    ages: FloatArray,
    keep: bool,
) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.bool_], _Kept]:
    """The states (n, s), rows of what is told and its variances, (n, 10), of innovations, (n, 4).

    And what was gated, and, if it is to be kept, the rest of a trace. `x`, `P`, `off` and `ages`
    go on to the next chunk; `delta` and `n` are one longer.
    """
    count, size = len(measured), len(x)
    xs, rows, told = np.empty((count, size)), np.empty((count, 10)), np.empty((count, 4))
    gated = np.zeros((count, 2), np.bool_)
    kept = count if keep else 0
    Ps, Fs = np.empty((kept, size, size)), np.empty((kept, size, size))
    Ks, es, Ss = np.zeros((kept, 2, size)), np.zeros((kept, 2)), np.ones((kept, 2))
    F, FP, Pc = np.zeros((size, size)), np.empty((size, size)), np.empty(size)
    J = np.zeros((3, 3))
    F[3:, 3:] = wave
    for k in range(count):
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt
        for output in range(2):
            innovation, S, verdict = weigh(
                x, P, by.C[output], by.r[output], measured[k, output], by.gate, output, off, Pc
            )
            told[k, output], told[k, 2 + output] = innovation, S
            gated[k, output] = verdict == GATED
            if verdict != BELIEVED:
                continue
            if by.gain == TICKED:
                linearise(c, x, delta[k], delta_dot, n[k], J)
            K = _gain(by, Pc, S, J, output, ages)
            correct(x, P, K, Pc, innovation, S)
            if keep:
                Ks[k, output], es[k, output], Ss[k, output] = K, innovation, S
        xs[k] = x
        tell(c, x, P, delta[k], delta_dot, n[k], rows[k])
        if keep:
            Ps[k] = P
        predict(c, x, F, delta[k], delta_dot, n[k], n_dot, dt)
        if keep:
            Fs[k] = F
        propagate(P, F, Q, FP)
    return xs, rows, told, gated, (Ps, Fs, Ks, es, Ss)


@compiled
def _gain(
    by: _Correction,
    Pc: FloatArray,
    S: float,
    J: FloatArray,
    output: int,
    ages: FloatArray,
) -> FloatArray:
    """The gain (s,) of an output, of which P c and c P c + r are given.

    A gain that is designed is that of a filter which has forgotten its start. Until then it is the
    best one: until that has fallen to it, or for as long as the slowest pole takes to forget.
    `ages` (2,) are the seconds that an output has been taken in.
    """
    best: FloatArray = Pc / S
    if by.gain == BEST:
        return best
    designed: FloatArray = by.fixed[output].copy()
    if by.gain == TICKED:
        designed = ticked_gain(J, by.wave, by.C[output], by.poles, by.interval[output], output)
    measured = 2 * output  # w or v
    ages[output] += by.interval[output]
    if best[measured] <= NEARLY * designed[measured]:
        ages[output] = np.inf
    return designed if ages[output] > by.forgetting[output] else best
