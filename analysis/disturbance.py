"""The disturbance observer: what acted on the ship that the model does not know.

Plant and exosystem are augmented with a constant but unknown disturbance, and the error's poles
placed on a Butterworth circle. Yaw and surge are designed each for itself; together the placement
would couple them. Source: "Algorithm of ship course control system watcher for assessing
disturbances and noise measurements", eqs (3), (4).
"""

from dataclasses import dataclass

import numpy as np

from shiplog.clock import usual_interval_secs
from shiplog.compiled import compiled
from shiplog.ship import (
    Coefficients,
    rudder_effects,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.types import FloatArray, Signals

from .design import Observer, butterworth_poles, discrete_observer
from .kalman import Noise

YAW_FREQUENCY = 0.05  # rad/s, the paper's
SURGE_FREQUENCY = 0.02  # rad/s: surge is slower and its sensor noisier
SETTLING = 5.0  # over the frequency: the paper's transient time


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Specific disturbances on the signals' clock: what they add to the equations of motion.

    The standard deviations are what sensor noise leaves once an observer has settled, the ship
    turning as she usually did; an error of the model counts as a disturbance. Before the settling
    time what is seen is the observer's own transient.
    """

    yaw: FloatArray  # (n,) rad/s^3, added to w''
    yaw_std: float
    surge: FloatArray  # (n,) m/s^2, added to v'
    surge_std: float
    rudder: FloatArray  # (n,) rad: the rudder that would do, at the speed then, what `yaw` does
    rudder_std: float  # NaN where no rudder would
    yaw_settling_secs: float = SETTLING / YAW_FREQUENCY
    surge_settling_secs: float = SETTLING / SURGE_FREQUENCY


def observe_disturbance(signals: Signals, model: Coefficients, noise: Noise) -> Disturbance:
    """Observe a yaw moment and a surge force; where nothing is measured they are held.

    `rudder` and `rpm` must be known throughout.
    """
    w, v = signals["yaw_rate"], signals["speed"]
    dt = signals.dt_secs
    turning = yaw_stiffness(model, float(np.sqrt(np.nanmean(w**2))))
    interval = usual_interval_secs(w, dt)
    yaw = _yaw_observer(model, turning, interval)
    surge = _surge_observer(model, float(np.nanmedian(v)), usual_interval_secs(v, dt))
    rows = _observe(
        model, w, v, signals["rudder"], signals["rpm"], dt, yaw.correction, surge.correction,
        turning, interval,
    )  # fmt: skip
    # a ship without way has a rudder that does nothing: the equivalent is then not a number
    steering = model.d * rudder_effects(model, rows[:, 2], signals["rpm"])
    with np.errstate(divide="ignore", invalid="ignore"):
        works = np.abs(steering) > 1e-3 * np.max(np.abs(steering))
        rudder = np.where(works, rows[:, 1] / steering, np.nan)
    std_w, std_v = noise.measurement_std
    yaw_std = float(yaw.noise_gain[2] * std_w)
    usual = float(np.median(np.abs(steering)))
    return Disturbance(
        yaw=rows[:, 1],
        yaw_std=yaw_std,
        surge=rows[:, 3],
        surge_std=float(surge.noise_gain[1] * std_v),
        rudder=rudder,
        rudder_std=yaw_std / usual if usual > 0 else np.nan,
    )


def _yaw_observer(c: Coefficients, stiffness: float, interval: float) -> Observer:
    """Of (w, w', m): the yaw moment m constant, the rate measured."""
    A = np.array([[0.0, 1.0, 0.0], [stiffness, c.a, 1.0], [0.0, 0.0, 0.0]])
    C = np.array([[1.0, 0.0, 0.0]])
    return discrete_observer(A, C, butterworth_poles(3, YAW_FREQUENCY), interval)


def _surge_observer(c: Coefficients, speed: float, interval: float) -> Observer:
    """Of (v, s): the surge force s constant, the speed measured."""
    A = np.array([[2 * c.g * speed, 1.0], [0.0, 0.0]])
    C = np.array([[1.0, 0.0]])
    return discrete_observer(A, C, butterworth_poles(2, SURGE_FREQUENCY), interval)


@compiled
def _observe(
    c: Coefficients,
    w_measured: FloatArray,
    v_measured: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    yaw: FloatArray,
    surge: FloatArray,
    turning: float,
    interval: float,
) -> FloatArray:
    """Rows of w, yaw disturbance, v, surge disturbance, (n, 4).

    The yaw correction was designed for the stiffness `turning`; what w' is given follows the
    stiffness of the moment, so that the poles stay where they were placed.
    """
    count = len(delta)
    rows = np.empty((count, 4))
    w, w_dot, moment = w_measured[np.isfinite(w_measured)][0], 0.0, 0.0
    v, force = v_measured[np.isfinite(v_measured)][0], 0.0
    for k in range(count):
        if np.isfinite(w_measured[k]):
            error = w_measured[k] - w
            stiffer = (yaw_stiffness(c, w) - turning) * interval
            w_dot = w_dot + (yaw[1] + stiffer) * error
            w, moment = w + yaw[0] * error, moment + yaw[2] * error
        if np.isfinite(v_measured[k]):
            error = v_measured[k] - v
            v, force = v + surge[0] * error, force + surge[1] * error
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = w, moment, v, force
        # Heun's step of the model, the disturbances constant
        ahead = min(k + 1, count - 1)
        rate = (delta[ahead] - delta[k]) / dt
        w1 = yaw_acceleration_rate(c, w, w_dot, v, n[k], delta[k], rate) + moment
        v1 = surge_acceleration(c, w, v, n[k]) + force
        w_end, w_dot_end, v_end = w + dt * w_dot, w_dot + dt * w1, v + dt * v1
        w2 = yaw_acceleration_rate(c, w_end, w_dot_end, v_end, n[ahead], delta[ahead], rate)
        v2 = surge_acceleration(c, w_end, v_end, n[ahead])
        w = w + dt * (w_dot + w_dot_end) / 2
        w_dot = w_dot + dt * (w1 + w2 + moment) / 2
        v = v + dt * (v1 + v2 + force) / 2
    return rows
