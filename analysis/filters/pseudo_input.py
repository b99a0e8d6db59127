"""The Kalman filter with pseudo-inputs: Burylin's five-state model, its misprints corrected."""

from typing import NamedTuple

import numpy as np

from analysis.design.pseudo_input_system import pseudo_input_matrices
from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled, overload_for
from shiplog.ships.paper import (
    PAPER_INPUTS,
    Coefficients,
    rudder_effect,
    rudder_effect_rate,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray
from shiplog.vessel.settings import FilterSettings

from .base import FURTHER_SETTINGS, NOISE_SETTINGS, FilterKind
from .core import StepInputs, advance, begin_instant, gain, output_row
from .further_states import CoreModel, arrange
from .kernels import kalman_gain_of_scalar, quadratic_form
from .noise_model import NoiseModel
from .ship_filter import ShipFilter


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


class PseudoInputCore(NamedTuple):
    """The five states of the paper's model.

    A yaw moment and a surge force that are states of the filter count in w'' and v' only where
    these are used or returned: the states w'' and v' are those of the model alone, which do not
    jump with them.

    Attributes
    ----------
    model
        The coefficients of the paper's model.
    jumps
        Whether w'' jumps when the rudder starts or stops.
    last_rate
        (1,): the rate of the rudder in the step before, rad/s; updated.
    """

    model: Coefficients
    jumps: bool
    last_rate: FloatArray


def pseudo_input_filter(
    model: Coefficients, noise: NoiseModel, stats: SignalStats, settings: FilterSettings
) -> ShipFilter:
    """Make a Kalman filter with the five-state model of the identification paper.

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
    core = PseudoInputCore(model, not settings.as_printed, np.zeros(1))
    core_model = _core_model(model, noise, stats)
    return ShipFilter(core, arrange(core_model, None, model, noise, stats, settings.gate), None)


def _core_model(c: Coefficients, noise: NoiseModel, stats: SignalStats) -> CoreModel:
    """Return the model of the covariance, and the state at the start.

    That is the state of the first measurements with w' = 0; w'' and v' follow from the model. The
    standard deviations are those by which the signals vary.
    """
    A, _ = pseudo_input_matrices(c, 1.0)
    per_state = np.repeat(
        noise.process_ratio * noise.measurement_std**2 * stats.interval_secs, (3, 2)
    )
    w, v = stats.first
    delta, n = (stats.head[name][0] for name in PAPER_INPUTS)
    w_ddot = yaw_acceleration_rate(c, w, 0.0, v, n, delta, 0.0)
    dw, dv = stats.std + 1e-9
    rate = abs(c.a) + 1e-3
    stds = np.array([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv])
    return CoreModel(
        A=A,
        W=np.diag(per_state),
        inputs=np.array([[0, 0], [1, 0], [c.a, 0], [0, 1], [0, 0]], np.float64),
        speed=3,
        x=np.array([w, 0.0, w_ddot, v, surge_acceleration(c, w, v, n)]),
        P=np.diag(stds**2),
        constant=True,
    )


@overload_for(begin_instant, PseudoInputCore)
def _begin_instant(core: PseudoInputCore, x: FloatArray, u: StepInputs) -> None:
    """Let w'' jump when the rudder starts or stops."""
    if core.jumps:
        effect = rudder_effect(core.model, x[3], u.n)
        x[2] += effect * core.model.e * (u.delta_dot - core.last_rate[0])
    core.last_rate[0] = u.delta_dot


@overload_for(gain, PseudoInputCore)
def _gain(
    core: PseudoInputCore,
    x: FloatArray,
    Pc: FloatArray,
    S: float,
    u: StepInputs,
    output: int,
    K: FloatArray,
) -> None:
    kalman_gain_of_scalar(Pc, S, K)


@overload_for(output_row, PseudoInputCore)
def _output_row(
    core: PseudoInputCore,
    x: FloatArray,
    P: FloatArray,
    u: StepInputs,
    slopes: FloatArray,
    row: FloatArray,
) -> None:
    for i in range(5):
        row[i], row[5 + i] = x[i], max(P[i, i], 0.0)
    row[2] += u.moment
    row[4] += u.force
    for place, slope in ((2, slopes[0]), (4, slopes[1])):
        slope[place] = 1.0
        row[5 + place] = max(quadratic_form(slope, P), 0.0)


@overload_for(advance, PseudoInputCore)
def _advance(
    core: PseudoInputCore, x: FloatArray, F: FloatArray, B: FloatArray, u: StepInputs, dt: float
) -> None:
    _predict(core.model, x, u, dt)


@compiled
def _predict(c: Coefficients, x: FloatArray, u: StepInputs, dt: float) -> None:
    """Advance x' = A x + B u by a Runge-Kutta step, in place, with constant input rates.

    Moment and force are constant during the step: they add to w'' and v', and these to the rates.
    """
    s = MotionState(x[0], x[1], x[2] + u.moment, x[3], x[4] + u.force)
    k1 = _pushed(motion(c, s, u.delta, u.delta_dot, u.n, u.n_dot), u)
    delta, n = u.delta + u.delta_dot * dt / 2, u.n + u.n_dot * dt / 2
    k2 = _pushed(motion(c, _moved(s, k1, dt / 2), delta, u.delta_dot, n, u.n_dot), u)
    k3 = _pushed(motion(c, _moved(s, k2, dt / 2), delta, u.delta_dot, n, u.n_dot), u)
    delta, n = u.delta + u.delta_dot * dt, u.n + u.n_dot * dt
    k4 = _pushed(motion(c, _moved(s, k3, dt), delta, u.delta_dot, n, u.n_dot), u)
    for i in range(5):
        x[i] += dt / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])


@compiled
def _pushed(rate: MotionState, u: StepInputs) -> MotionState:
    """Return the rates with moment and force."""
    return MotionState(rate.w, rate.w_dot + u.moment, rate.w_ddot, rate.v + u.force, rate.v_dot)


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
    pseudo_input_filter,
    smoothable=True,
    settings=(*NOISE_SETTINGS, "gate", "as_printed", *FURTHER_SETTINGS),
    process_noise="states",
)
