"""The disturbance observer: what acted on the ship that the model does not know.

Plant and exosystem are augmented with a constant but unknown disturbance, and the error's poles
placed on a Butterworth circle. Yaw and surge are designed each for itself; together the placement
would couple them. Source: "Algorithm of ship course control system watcher for assessing
disturbances and noise measurements", eqs (3), (4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.ship import (
    INPUTS,
    Coefficients,
    rudder_effects,
    surge_acceleration,
    yaw_acceleration_rate,
    yaw_stiffness,
)
from shiplog.thinned import Thinned
from shiplog.types import FloatArray, Signals

from .design.observer import Observer, butterworth_poles, discrete_observer
from .gauge import Gauge, gauge
from .inputs import last_inputs
from .kalman import Noise
from .moments import Moments

YAW_FREQUENCY = 0.05  # rad/s, the paper's
SURGE_FREQUENCY = 0.02  # rad/s: surge is slower and its sensor noisier
SETTLING = 5.0  # over the frequency: the paper's transient time
DISTURBANCE_UNITS = {  # in SI, as people read it, and the factor from the one to the other
    "yaw": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "rudder": ("rad", "deg", degrees(1)),
    "surge": ("m/s²", "mm/s²", 1e3),
}


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Specific disturbances on the signals' clock: what they add to the equations of motion."""

    yaw: FloatArray  # (n,) rad/s^3, added to w''
    surge: FloatArray  # (n,) m/s^2, added to v'
    rudder: FloatArray  # (n,) rad: the rudder that would do, at the speed then, what `yaw` does


@dataclass(frozen=True)
class Course:
    """A disturbance over a trial, its first transient left out.

    The standard deviation is what sensor noise leaves once an observer has settled, the ship
    turning as she usually did; an error of the model counts as a disturbance.
    """

    unit: str
    mean: float
    rms: float
    lowest: float
    highest: float
    last: float  # the mean over the settling time at the end
    std: float  # NaN where no rudder would do it
    settling_secs: float  # before it what is seen is the observer's own transient


class ForceObserver:
    """Observes a yaw moment and a surge force in slabs; where nothing is measured they are held.

    The inputs must be known throughout.
    """

    def __init__(self, model: Coefficients, noise: Noise, usual: Gauge) -> None:
        self._model, self._usual = model, usual
        self._turning = yaw_stiffness(model, usual.turning)
        self._interval = float(usual.interval_secs[0])
        yaw = _yaw_observer(model, self._turning, self._interval)
        surge = _surge_observer(model, usual.ahead, float(usual.interval_secs[1]))
        self._gains = yaw.correction, surge.correction
        self._yaw_std = float(yaw.noise_gain[2] * noise.measurement_std[0])
        self._surge_std = float(surge.noise_gain[1] * noise.measurement_std[1])
        self._state = ObserverState(float(usual.first[0]), 0.0, 0.0, float(usual.first[1]), 0.0)
        # a ship without way has a rudder that does nothing: its angle is then not a number
        self._least_steering = 1e-3 * abs(model.d) * usual.steering
        self._steering = Thinned()
        settling = {"yaw": SETTLING / YAW_FREQUENCY, "surge": SETTLING / SURGE_FREQUENCY}
        settling["rudder"] = settling["yaw"]
        self._courses = {
            name: _CourseWatch(secs, usual.count, usual.dt_secs) for name, secs in settling.items()
        }

    def step(self, slab: Signals, following: Mapping[str, float]) -> Disturbance:
        """Observe the next slab; `following` are the inputs at the instant after it."""
        delta, n = (np.append(slab[name], following[name]) for name in INPUTS)
        rows, self._state = _observe(
            self._model, self._state, slab["yaw_rate"], slab["speed"], delta, n, slab.dt_secs,
            *self._gains, self._turning, self._interval,
        )  # fmt: skip
        steering = self._model.d * rudder_effects(self._model, rows[:, 2], slab["rpm"])
        self._steering.add(np.abs(steering))
        works = np.abs(steering) > self._least_steering
        with np.errstate(divide="ignore", invalid="ignore"):
            rudder = np.where(works, rows[:, 1] / steering, np.nan)
        found = Disturbance(yaw=rows[:, 1], surge=rows[:, 3], rudder=rudder)
        for name, watch in self._courses.items():
            watch.add(getattr(found, name))
        return found

    def result(self) -> dict[str, Course]:
        """What was observed, once all was: of `yaw`, `rudder` and `surge`."""
        usual = self._steering.median()
        stds = {
            "yaw": self._yaw_std,
            "rudder": self._yaw_std / usual if usual > 0 else np.nan,
            "surge": self._surge_std,
        }
        return {
            name: self._courses[name].result(std, DISTURBANCE_UNITS[name][0])
            for name, std in stds.items()
        }


def observe_disturbance(
    signals: Signals, model: Coefficients, noise: Noise
) -> tuple[Disturbance, dict[str, Course]]:
    """The disturbance in signals that are all there, and what comes of it; as `ForceObserver`."""
    observing = ForceObserver(model, noise, gauge(signals, model))
    found = observing.step(signals, last_inputs(signals))
    return found, observing.result()


class _CourseWatch:
    """Looks at one disturbance as it is observed."""

    def __init__(self, settling_secs: float, count: int, dt: float) -> None:
        self._settling_secs = settling_secs
        settling = int(settling_secs / dt)
        self._skipped = settling if count > 2 * settling else 0
        self._tail = max(settling, 1)
        self._settled = Moments()
        self._last: FloatArray = np.zeros(0)

    def add(self, values: FloatArray) -> None:
        """Take the next values."""
        values = np.where(np.isfinite(values), values, np.nan)
        self._settled.add(values[self._skipped :])
        self._skipped = max(self._skipped - len(values), 0)
        self._last = np.concatenate((self._last, values))[-self._tail :]

    def result(self, std: float, unit: str) -> Course:
        """What all of them come to."""
        settled, last = self._settled, self._last[np.isfinite(self._last)]
        return Course(
            unit=unit,
            mean=settled.mean,
            rms=float(np.sqrt(settled.mean_square)),
            lowest=settled.lowest,
            highest=settled.highest,
            last=float(np.mean(last)) if len(last) and settled.count else np.nan,
            std=std,
            settling_secs=self._settling_secs,
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


class ObserverState(NamedTuple):
    """The motion and what disturbs it."""

    w: float
    w_dot: float
    moment: float  # rad/s^3
    v: float
    force: float  # m/s^2


@compiled
def _observe(
    c: Coefficients,
    x: ObserverState,
    w_measured: FloatArray,
    v_measured: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    dt: float,
    yaw: FloatArray,
    surge: FloatArray,
    turning: float,
    interval: float,
) -> tuple[FloatArray, ObserverState]:
    """Rows of w, yaw disturbance, v, surge disturbance, (n, 4), and what the next slab begins with.

    The yaw correction was designed for the stiffness `turning`; what w' is given follows the
    stiffness of the moment, so that the poles stay where they were placed. `delta` and `n` are one
    longer than the rest.
    """
    count = len(w_measured)
    rows = np.empty((count, 4))
    w, w_dot, moment, v, force = x
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
        rate = (delta[k + 1] - delta[k]) / dt
        w1 = yaw_acceleration_rate(c, w, w_dot, v, n[k], delta[k], rate) + moment
        v1 = surge_acceleration(c, w, v, n[k]) + force
        w_end, w_dot_end, v_end = w + dt * w_dot, w_dot + dt * w1, v + dt * v1
        w2 = yaw_acceleration_rate(c, w_end, w_dot_end, v_end, n[k + 1], delta[k + 1], rate)
        v2 = surge_acceleration(c, w_end, v_end, n[k + 1])
        w = w + dt * (w_dot + w_dot_end) / 2
        w_dot = w_dot + dt * (w1 + w2 + moment) / 2
        v = v + dt * (v1 + v2 + force) / 2
    return rows, ObserverState(w, w_dot, moment, v, force)
