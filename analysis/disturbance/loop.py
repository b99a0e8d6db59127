"""The ship's model, what disturbs her, and the correction of both by what is measured."""

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
    """The observer of yaw and surge."""

    yaw: Force
    surge: Force
    turning: float  # 1/s², the stiffness that the yaw correction was designed for
    following: FloatArray  # (2 + k,): what that gains with each 1/s² more
    chord: bool  # whether the stiffness is the chord's, from estimate to measurement


class ObserverState(NamedTuple):
    """The motion and what disturbs it."""

    w: float
    w_dot: float
    v: float
    moment: FloatArray  # (k,) of its exosystems
    force: FloatArray  # likewise
    silences: tuple[float, float]  # instants since yaw rate and speed were measured


def yaw_plant(c: Coefficients, stiffness: float) -> FloatArray:
    """Of (w, w'), (2, 2)."""
    return np.array([[0.0, 1.0], [stiffness, c.a]])


def surge_plant(c: Coefficients, speed: float) -> FloatArray:
    """Of v, (1, 1)."""
    return np.array([[2 * c.g * speed]])


def make_ship_observer(
    c: Coefficients, turning: float, yaw: Force, surge: Force, model: ForceModel, sampling: Sampling
) -> ShipObserver:
    """Of yaw as `force_observer` designed it for the stiffness `turning`, 1/s², and of surge.

    `model` and `sampling` are yaw's. So that its poles stay in a turn, the correction follows the
    stiffness: to first order in the interval that of w' alone. This and the tangent's stiffness do
    for a slow part. A wave has larger gains, and of one sample a second would have an unstable
    pole in a turn; and it begins by shaking the estimate so far from what is measured that the
    tangent corrects too much: in waves of 0.15 deg/s the observer was lost. With a wave therefore
    the whole correction follows, by the chord, at which the error moves as it was designed to.
    """
    following = np.zeros_like(yaw.correction)
    following[1] = sampling.interval_secs
    if model.wave is not None:
        change = model.frequency**2  # 1/s², as much as a turn does; the gain is nearly linear in it
        softer = force_observer(yaw_plant(c, turning - change), model, sampling).force
        following = (yaw.correction - softer.correction) / change
    return ShipObserver(yaw, surge, turning, following, chord=model.wave is not None)


def initial_state(observer: ShipObserver, stats: SignalStats) -> ObserverState:
    """The first values measured, and no disturbance."""
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
    """Rows of v, yaw's slow part and wave, surge's likewise, (5, n), and the next chunk's start.

    `delta` and `n` are one longer than the rest.
    """
    count, (yaw, surge, turning, following, chord) = len(w_measured), observer
    rows, room = np.empty((5, count)), np.empty(max(len(x.moment), len(x.force)))
    w, w_dot, v, moment, force = x.w, x.w_dot, x.v, x.moment.copy(), x.force.copy()
    yaw_silence, surge_silence = x.silences
    for k in range(count):
        yaw_silence, surge_silence = yaw_silence + 1.0, surge_silence + 1.0
        if np.isfinite(w_measured[k]):
            error, yaw_silence = w_measured[k] - w, 0.0
            stiffness = _chord(c, w, w_measured[k]) if chord else yaw_stiffness(c, w)
            stiffer = stiffness - turning
            w = w + (yaw.correction[0] + following[0] * stiffer) * error
            w_dot = w_dot + (yaw.correction[1] + following[1] * stiffer) * error
            for i in range(len(moment)):
                moment[i] += (yaw.correction[2 + i] + following[2 + i] * stiffer) * error
        if np.isfinite(v_measured[k]):
            error, surge_silence = v_measured[k] - v, 0.0
            v = v + surge.correction[0] * error
            for i in range(len(force)):
                force[i] += surge.correction[1 + i] * error
        rows[0, k] = v
        rows[1, k], rows[2, k] = _parts(yaw, moment)
        rows[3, k], rows[4, k] = _parts(surge, force)
        # Heun's step of the model, the disturbances as their mean over it
        m = _advance(yaw, moment, yaw_silence, room)
        s = _advance(surge, force, surge_silence, room)
        rate = (delta[k + 1] - delta[k]) / dt
        w1 = yaw_acceleration_rate(c, w, w_dot, v, n[k], delta[k], rate) + m
        v1 = surge_acceleration(c, w, v, n[k]) + s
        w_end, w_dot_end, v_end = w + dt * w_dot, w_dot + dt * w1, v + dt * v1
        w2 = yaw_acceleration_rate(c, w_end, w_dot_end, v_end, n[k + 1], delta[k + 1], rate)
        v2 = surge_acceleration(c, w_end, v_end, n[k + 1])
        w = w + dt * (w_dot + w_dot_end) / 2
        w_dot = w_dot + dt * (w1 + w2 + m) / 2
        v = v + dt * (v1 + v2 + s) / 2
    return rows, ObserverState(w, w_dot, v, moment, force, (yaw_silence, surge_silence))


@compiled
def _chord(c: Coefficients, w: float, other: float) -> float:
    """How much w'' differs between two yaw rates, by their difference, 1/s^2."""
    bend = abs(w + other) if w * other >= 0 else (w * w + other * other) / abs(w - other)
    return c.b1 + c.b2 * bend + c.b3 * (w * w + w * other + other * other)


@compiled
def _parts(of: Force, x: FloatArray) -> tuple[float, float]:
    """The slow part and the wave of a force's state."""
    slow = wave = 0.0
    for i in range(len(x)):
        slow += of.parts[0, i] * x[i]
        wave += of.parts[1, i] * x[i]
    return slow, wave


@compiled
def _advance(of: Force, x: FloatArray, silence: float, now: FloatArray) -> float:
    """A force's mean until the next instant; its state becomes what it is then, in place.

    `now` is room to work in.
    """
    held = 1 if silence > of.patience else 0
    mean = 0.0
    for i in range(len(x)):
        now[i] = x[i]
        mean += of.mean[held, i] * x[i]
    for i in range(len(x)):
        x[i] = 0.0
        for j in range(len(x)):
            x[i] += of.motion[held, i, j] * now[j]
    return mean
