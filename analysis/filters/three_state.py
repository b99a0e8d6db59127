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
from typing import Any, NamedTuple

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
from .further_parts import WaveModel
from .further_states import CoreModel, arrange
from .gains import (
    LinearAxis,
    discrete_gain,
    kalman_poles,
    linear_axes,
    quality_poles,
    relinearised_gain,
    stated_poles,
)
from .kernels import kalman_gain_of_scalar
from .noise_model import NoiseModel
from .ship_filter import ShipFilter
from .ship_step import ShipState, jacobian, predict_ship, ship_row, ship_slopes

_STATES = 3  # w, w' and v; those of a wave follow
MIN_POLE = 1e-300  # magnitude, so that a pole at zero has a logarithm
HANDOVER_RATIO = 1.5  # the designed gain replaces the optimal one once that is this close to it

PoleDesign = Callable[[LinearAxis, FilterSettings], ComplexArray]


class Handover(NamedTuple):
    """When a designed gain replaces the optimal one.

    Attributes
    ----------
    interval
        (2,): sampling intervals, s.
    settling
        (2,): time constants of the slowest poles, s; infinite where the gain stays the optimal one.
    ages
        (2,): seconds since the first correction by each output; updated.
    """

    interval: FloatArray
    settling: FloatArray
    ages: FloatArray


class ConstantGain(NamedTuple):
    """A gain that is constant after the handover: (2, k), of each output in ship and wave."""

    gain: FloatArray
    handover: Handover


class PlacedGain(NamedTuple):
    """A gain that places the same poles at each instant.

    Attributes
    ----------
    poles
        (k,): poles of yaw and of surge from sample to sample.
    wave
        (k - 3, k - 3): transition matrix of the wave from a sample of the yaw rate to the next.
    outputs
        (2, k): the output matrix.
    handover
        When it replaces the optimal gain.
    """

    poles: NDArray[np.complex128]
    wave: FloatArray
    outputs: FloatArray
    handover: Handover


class ThreeStateCore(NamedTuple):
    """The ship's three states, and the design of their gain.

    The type of `design` chooses the gain in compiled code, so that the loop of a filter compiles
    none but its own.
    """

    model: Coefficients
    design: ConstantGain | PlacedGain


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
    designed, settling = np.zeros_like(outputs), np.full(len(outputs), np.inf)
    discrete_poles = np.zeros(size, np.complex128)
    if poles is not None:
        for output, axis, states in ((0, yaw, yaw_states), (1, surge, [2])):
            placed, at = discrete_gain(axis, poles(axis, settings))
            designed[output, states], discrete_poles[states] = placed, at
            slowest = max(float(np.abs(at).max()), MIN_POLE)
            settling[output] = -axis.interval_secs / np.log(slowest)
    handover = Handover(stats.interval_secs, settling, np.zeros(len(outputs)))
    design: ConstantGain | PlacedGain = ConstantGain(designed, handover)
    if each_tick:
        between = np.ascontiguousarray(expm(wave.A * yaw.interval_secs))
        design = PlacedGain(discrete_poles, between, outputs, handover)
    arrangement = arrange(
        _core_model(model, noise, stats),
        wave if len(wave.A) else None,
        model,
        noise,
        stats,
        settings.gate,
    )
    core = ThreeStateCore(model, design)
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
    core: ThreeStateCore,
    x: FloatArray,
    Pc: FloatArray,
    S: float,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    """Set the optimal gain, or the designed one where that has replaced it."""
    kalman_gain_of_scalar(Pc, S, K)
    if output < len(PAPER_OUTPUTS):
        _replace(core.design, core.model, x, u, output, K)


def _replace(
    design: Any,  # noqa: ANN401
    c: Coefficients,
    x: FloatArray,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    """Replace the optimal gain K (s,) of yaw rate or speed by the designed one, once that holds."""
    raise NotImplementedError(f"no gain for {type(design).__name__}")


@overload_for(_replace, ConstantGain)
def _replace_by_constant(
    design: ConstantGain,
    c: Coefficients,
    x: FloatArray,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    _hand_over(design.handover, design.gain[output], output, K)


@overload_for(_replace, PlacedGain)
def _replace_by_placed(
    design: PlacedGain,
    c: Coefficients,
    x: FloatArray,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    slopes = ship_slopes(c, ShipState(x[0], x[1], x[2]), u.delta, u.delta_dot, u.n)
    placed = relinearised_gain(
        jacobian(slopes), design.wave, design.outputs[output], design.poles,
        design.handover.interval[output], output,
    )  # fmt: skip
    _hand_over(design.handover, placed, output, K)


@compiled
def _hand_over(handover: Handover, designed: FloatArray, output: int, K: FloatArray) -> None:
    """Replace the gain K (s,) by the designed one (k,), once that holds.

    A designed gain assumes that the initial error has decayed. Until then the optimal gain is used:
    until it has fallen to the designed one, or for the time constant of the slowest pole.
    """
    measured = 2 * output  # w or v
    handover.ages[output] += handover.interval[output]
    if K[measured] <= HANDOVER_RATIO * designed[measured]:
        handover.ages[output] = np.inf
    if handover.ages[output] > handover.settling[output]:
        for i in range(len(designed)):
            K[i] = designed[i]


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
