"""Filters of three states: extended Kalman, steady-state, quality and per-tick.

The states are yaw rate w, its derivative w' and speed v; the other estimates follow from the ship's
equations. The filters differ in their gain: the extended Kalman filter computes the optimal one at
each instant, the steady-state and the quality filter have a constant one (`gains`), and the
per-tick observer places the same poles at each instant for the motion of that instant. The
covariance follows from the same recursion (Joseph's form), which holds for any gain.

A wave in the yaw rate, where one is modelled, adds the two states of its shaping filter. They add
to the measured yaw rate only, so that the estimated yaw rate is the ship's own slow turning.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from analysis.design.observability import ComplexArray
from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled, overload_for
from shiplog.ships.paper import PAPER_OUTPUTS, Coefficients, yaw_stiffness
from shiplog.types import FloatArray
from shiplog.vessel.settings import FilterSettings

from .base import FURTHER_SETTINGS, NOISE_SETTINGS, WAVE_SETTINGS, FilterKind
from .core import StepInputs, advance, begin_instant, gain, output_row
from .further_states import CoreModel, WaveModel, arrange
from .gains import (
    LinearAxis,
    discrete_gain,
    kalman_poles,
    linear_axes,
    quality_poles,
    relinearised_gain,
    stated_poles,
)
from .noise_model import NoiseModel
from .ship_filter import ShipFilter
from .ship_step import linearise, predict_ship, ship_row

OPTIMAL, CONSTANT, RELINEARISED = range(3)  # kinds of gain
_STATES = 3  # w, w' and v; those of a wave follow
MIN_POLE = 1e-300  # magnitude, so that a pole at zero has a logarithm
HANDOVER_RATIO = 1.5  # the designed gain replaces the optimal one once that is this close to it

PoleDesign = Callable[[LinearAxis, FilterSettings], ComplexArray]


class ThreeStateCore(NamedTuple):
    """The ship's three states, and the design of their gain.

    Attributes
    ----------
    model
        The coefficients of the identification paper's model.
    kind
        `OPTIMAL`, `CONSTANT` or `RELINEARISED`.
    constant_gain
        (2, k): the constant gain of each output in the states of ship and wave.
    poles
        (k,): poles of yaw and of surge from sample to sample.
    interval
        (2,): sampling intervals, s.
    settling
        (2,): time constants of the slowest poles, s.
    wave
        (k - 3, k - 3): transition matrix of the wave from a sample of the yaw rate to the next.
    outputs
        (2, k): the output matrix.
    ages
        (2,): seconds since the first correction by each output; updated.
    """

    model: Coefficients
    kind: int
    constant_gain: FloatArray
    poles: NDArray[np.complex128]
    interval: FloatArray
    settling: FloatArray
    wave: FloatArray
    outputs: FloatArray
    ages: FloatArray


def three_state_filter(
    model: Coefficients,
    noise: NoiseModel,
    stats: SignalStats,
    settings: FilterSettings,
    *,
    poles: PoleDesign | None = None,
    each_tick: bool = False,
) -> ShipFilter:
    """Make a filter of yaw rate and speed with the states w, w' and v.

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
        extended Kalman filter. States beyond those of ship and wave, and the corrections by further
        measurements, take the optimal gain.
    each_tick
        Place the poles at each instant for the motion of that instant.

    References
    ----------
    The extended Kalman filter: Jazwinski, "Stochastic processes and filtering theory", 1970,
    theorem 8.1. The other gains: see `gains`.
    """
    yaw, surge = linear_axes(model, noise, stats)
    wave = WaveModel(yaw.A[2:, 2:], yaw.G[2:] @ yaw.Q @ yaw.G[2:].T, yaw.C[0, 2:])
    size = _STATES + len(wave.A)
    yaw_states = [0, 1, *range(_STATES, size)]
    outputs = np.zeros((len(PAPER_OUTPUTS), size))
    outputs[0, yaw_states], outputs[1, 2] = yaw.C[0], 1.0
    constant_gain, settling = np.zeros_like(outputs), np.zeros(len(PAPER_OUTPUTS))
    discrete_poles, kind = np.zeros(size, np.complex128), OPTIMAL
    if poles is not None:
        kind = RELINEARISED if each_tick else CONSTANT
        for output, axis, states in ((0, yaw, yaw_states), (1, surge, [2])):
            placed, at = discrete_gain(axis, poles(axis, settings))
            constant_gain[output, states], discrete_poles[states] = placed, at
            slowest = max(float(np.abs(at).max()), MIN_POLE)
            settling[output] = -axis.interval_secs / np.log(slowest)
    core = ThreeStateCore(
        model=model,
        kind=kind,
        constant_gain=constant_gain,
        poles=discrete_poles,
        interval=stats.interval_secs,
        settling=settling,
        wave=np.ascontiguousarray(expm(wave.A * yaw.interval_secs)),
        outputs=outputs,
        ages=np.zeros(len(PAPER_OUTPUTS)),
    )
    arrangement = arrange(
        _core_model(model, noise, stats),
        wave if len(wave.A) else None,
        model,
        noise,
        stats,
        settings.gate,
    )
    return ShipFilter(core, arrangement, wave.C if len(wave.A) else None)


def _core_model(c: Coefficients, noise: NoiseModel, stats: SignalStats) -> CoreModel:
    """Linearise the ship about its typical motion, for the noise of moment and force.

    The state at the start is that of the first measurements, and w' zero; the standard deviations
    are those by which the signals vary.
    """
    A = np.array(
        [
            [0.0, 1.0, 0.0],
            [yaw_stiffness(c, stats.yaw_rate_rms), c.a, 0.0],
            [0.0, 0.0, 2 * c.g * stats.median_speed],
        ]
    )
    q = noise.process_ratio * noise.measurement_std**2 * stats.interval_secs
    w, v = stats.first
    dw, dv = stats.std + 1e-9
    stds = np.array([dw, (abs(c.a) + 1e-3) * dw, dv])
    return CoreModel(
        A=A,
        W=np.diag([0.0, *q]),
        inputs=np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        speed=2,
        x=np.array([w, 0.0, v]),
        P=np.diag(stds**2),
        constant=False,
    )


@overload_for(begin_instant, ThreeStateCore)
def _begin_instant(core: ThreeStateCore, x: FloatArray, u: StepInputs) -> None:
    """Change nothing: the states do not jump."""


@overload_for(advance, ThreeStateCore)
def _advance(
    core: ThreeStateCore, x: FloatArray, F: FloatArray, B: FloatArray, u: StepInputs, dt: float
) -> None:
    predict_ship(core.model, x, F, B, u, dt)


@overload_for(output_row, ThreeStateCore)
def _output_row(
    core: ThreeStateCore,
    x: FloatArray,
    P: FloatArray,
    u: StepInputs,
    slopes: FloatArray,
    row: FloatArray,
) -> None:
    ship_row(core.model, x, P, u, slopes, row)


@overload_for(gain, ThreeStateCore)
def _gain(
    core: ThreeStateCore, x: FloatArray, Pc: FloatArray, S: float, u: StepInputs, output: int
) -> FloatArray:
    return _three_state_gain(core, x, Pc, S, u, output)


@compiled
def _three_state_gain(
    core: ThreeStateCore, x: FloatArray, Pc: FloatArray, S: float, u: StepInputs, output: int
) -> FloatArray:
    """Compute the gain (s,) of an output from P c and S = c' P c + r.

    A designed gain assumes that the initial error has decayed. Until then the optimal gain is used:
    until it has fallen to the designed one, or for the time constant of the slowest pole.
    """
    K: FloatArray = Pc / S
    if core.kind == OPTIMAL or output >= len(core.ages):
        return K
    interval = core.interval[output]
    designed: FloatArray = core.constant_gain[output].copy()
    if core.kind == RELINEARISED:
        J = np.zeros((3, 3))
        linearise(core.model, x, u.delta, u.delta_dot, u.n, J)
        designed = relinearised_gain(
            J, core.wave, core.outputs[output], core.poles, interval, output
        )
    measured = 2 * output  # w or v
    core.ages[output] += interval
    if K[measured] <= HANDOVER_RATIO * designed[measured]:
        core.ages[output] = np.inf
    if core.ages[output] > core.settling[output]:
        for i in range(len(designed)):
            K[i] = designed[i]
    return K


_SETTINGS = (
    *NOISE_SETTINGS, "gate", "yaw_bandwidth", "surge_bandwidth", *WAVE_SETTINGS, *FURTHER_SETTINGS,
)  # fmt: skip

EXTENDED = FilterKind("extended", three_state_filter, smoothable=True, settings=_SETTINGS)
STEADY_STATE = FilterKind(
    "steady-state", partial(three_state_filter, poles=kalman_poles), settings=_SETTINGS
)
QUALITY = FilterKind(
    "quality",
    partial(three_state_filter, poles=quality_poles),
    settings=(*_SETTINGS, "shift", "damping"),
)
PER_TICK = FilterKind(
    "per-tick",
    partial(three_state_filter, poles=stated_poles, each_tick=True),
    settings=(*_SETTINGS, "yaw_decay", "surge_decay"),
)
