"""The loop of the disturbance observer: prediction by the model, correction by each sample.

The states are yaw rate w, its rate w', speed v, and the exosystems of moment and force.
"""

from typing import NamedTuple

import numpy as np

from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled
from shiplog.ships.paper import (
    Coefficients,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray

from .observer_design import Force, ForceModel, Sampling, force_observer


class ShipObserver(NamedTuple):
    """The observer of yaw and surge, as the compiled loop uses it.

    Attributes
    ----------
    yaw, surge
        The designed observers of the yaw moment and the surge force.
    stiffness
        The yaw stiffness dw''/dw, 1/s², for which the yaw correction was designed.
    correction_slope
        Derivative of the yaw correction with respect to the stiffness, (2 + k,).
    chord
        Whether the correction uses the stiffness of the chord from estimate to measurement; else
        that of the tangent at the estimate.
    """

    yaw: Force
    surge: Force
    stiffness: float
    correction_slope: FloatArray
    chord: bool


class ObserverState(NamedTuple):
    """State of the observer between two chunks.

    Attributes
    ----------
    w, w_dot, v
        Yaw rate, rad/s, its rate, rad/s², and speed, m/s.
    moment, force
        States of the exosystems of the yaw moment and the surge force, (k,).
    sample_ages
        Number of instants since yaw rate and speed were last measured.
    """

    w: float
    w_dot: float
    v: float
    moment: FloatArray
    force: FloatArray
    sample_ages: tuple[float, float]


def yaw_plant(c: Coefficients, stiffness: float) -> FloatArray:
    """Return A, (2, 2), of the states (w, w') for a yaw stiffness, 1/s²."""
    return np.array([[0.0, 1.0], [stiffness, c.a]])


def surge_plant(c: Coefficients, speed: float) -> FloatArray:
    """Return A, (1, 1), of v: the resistance g v² linearised at a speed, m/s."""
    return np.array([[2 * c.g * speed]])


def make_ship_observer(
    c: Coefficients,
    stiffness: float,
    yaw: Force,
    surge: Force,
    model: ForceModel,
    sampling: Sampling,
) -> ShipObserver:
    """Combine the observers of yaw and surge, and schedule the yaw correction with the stiffness.

    The poles of the yaw error are to stay where they were placed while the ship turns. To first
    order in the sampling interval only the correction of w' depends on the stiffness; this, with
    the stiffness of the tangent, suffices for a slow part. A wave has larger gains: with one sample
    a second the observer would have an unstable pole in a turn, and its first transient moves the
    estimate so far from the measurement that the tangent corrects too much (in waves of 0.15 deg/s
    the observer diverged). With a wave, therefore, the whole correction depends on the stiffness of
    the chord, for which the error moves as designed.

    Parameters
    ----------
    c
        Coefficients of the ship.
    stiffness
        The yaw stiffness, 1/s², for which `yaw` was designed.
    yaw, surge
        The observers, from `force_observer`.
    model, sampling
        Force model and sampling of yaw.
    """
    correction_slope = np.zeros_like(yaw.correction)
    correction_slope[1] = sampling.interval_secs
    if model.wave is not None:
        change = model.frequency**2  # 1/s², as in a turn; the gain is nearly linear in it
        softer = force_observer(yaw_plant(c, stiffness - change), model, sampling).force
        correction_slope = (yaw.correction - softer.correction) / change
    return ShipObserver(yaw, surge, stiffness, correction_slope, chord=model.wave is not None)


def initial_state(observer: ShipObserver, stats: SignalStats) -> ObserverState:
    """Return the state at the first measured values, without a disturbance."""
    w, v = stats.first.tolist()
    moment, force = (np.zeros(each.mean.shape[1]) for each in (observer.yaw, observer.surge))
    return ObserverState(w, 0.0, v, moment, force, (0.0, 0.0))


@compiled
def observe_chunk(
    c: Coefficients,
    observer: ShipObserver,
    x: ObserverState,
    w_measured: FloatArray,
    v_measured: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
) -> tuple[FloatArray, ObserverState]:
    """Run the observer over a chunk of n instants.

    Parameters
    ----------
    c
        Coefficients of the ship.
    observer, x
        The observer, and its state at the start of the chunk.
    w_measured, v_measured
        Yaw rate, rad/s, and speed, m/s, (n,); NaN where not measured.
    delta, n
        Rudder, rad, and revolutions, 1/min, (n + 1,): up to the instant after the chunk.
    dt
        Time between instants, s.

    Returns
    -------
    rows
        (5, n): speed, slow part and wave of the yaw disturbance, slow part and wave of surge.
    state
        The state at the start of the next chunk.
    """
    count, (yaw, surge, designed_stiffness, correction_slope, chord) = len(w_measured), observer
    rows, work = np.empty((5, count)), np.empty(max(len(x.moment), len(x.force)))
    w, w_dot, v, moment, force = x.w, x.w_dot, x.v, x.moment.copy(), x.force.copy()
    yaw_age, surge_age = x.sample_ages
    for k in range(count):
        yaw_age, surge_age = yaw_age + 1.0, surge_age + 1.0
        if np.isfinite(w_measured[k]):
            error, yaw_age = w_measured[k] - w, 0.0
            stiffness = _chord(c, w, w_measured[k]) if chord else yaw_stiffness(c, w)
            change = stiffness - designed_stiffness
            w = w + (yaw.correction[0] + correction_slope[0] * change) * error
            w_dot = w_dot + (yaw.correction[1] + correction_slope[1] * change) * error
            for i in range(len(moment)):
                moment[i] += (yaw.correction[2 + i] + correction_slope[2 + i] * change) * error
        if np.isfinite(v_measured[k]):
            error, surge_age = v_measured[k] - v, 0.0
            v = v + surge.correction[0] * error
            for i in range(len(force)):
                force[i] += surge.correction[1 + i] * error
        rows[0, k] = v
        rows[1, k], rows[2, k] = _parts(yaw, moment)
        rows[3, k], rows[4, k] = _parts(surge, force)
        # Heun's step of the model, the disturbances as their mean over it
        m = _advance(yaw, moment, yaw_age, work)
        s = _advance(surge, force, surge_age, work)
        rate = (delta[k + 1] - delta[k]) / dt
        w1 = yaw_acceleration_rate(c, w, w_dot, v, n[k], delta[k], rate) + m
        v1 = surge_acceleration(c, w, v, n[k]) + s
        w_end, w_dot_end, v_end = w + dt * w_dot, w_dot + dt * w1, v + dt * v1
        w2 = yaw_acceleration_rate(c, w_end, w_dot_end, v_end, n[k + 1], delta[k + 1], rate)
        v2 = surge_acceleration(c, w_end, v_end, n[k + 1])
        w = w + dt * (w_dot + w_dot_end) / 2
        w_dot = w_dot + dt * (w1 + w2 + m) / 2
        v = v + dt * (v1 + v2 + s) / 2
    return rows, ObserverState(w, w_dot, v, moment, force, (yaw_age, surge_age))


@compiled
def _chord(c: Coefficients, w: float, other: float) -> float:
    """Return the difference of w'' between two yaw rates, divided by theirs, 1/s²."""
    quadratic = abs(w + other) if w * other >= 0 else (w * w + other * other) / abs(w - other)
    return c.b1 + c.b2 * quadratic + c.b3 * (w * w + w * other + other * other)


@compiled
def _parts(design: Force, x: FloatArray) -> tuple[float, float]:
    """Return slow part and wave of a force with the state `x`."""
    slow = wave = 0.0
    for i in range(len(x)):
        slow += design.parts[0, i] * x[i]
        wave += design.parts[1, i] * x[i]
    return slow, wave


@compiled
def _advance(design: Force, x: FloatArray, age: float, work: FloatArray) -> float:
    """Advance a force's state `x` to the next instant, in place, and return its mean until then.

    `age` is the number of instants since the last sample; `work` is overwritten.
    """
    held = 1 if age > design.patience else 0
    mean = 0.0
    for i in range(len(x)):
        work[i] = x[i]
        mean += design.mean[held, i] * x[i]
    for i in range(len(x)):
        x[i] = 0.0
        for j in range(len(x)):
            x[i] += design.motion[held, i, j] * work[j]
    return mean
