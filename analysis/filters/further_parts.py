"""The further states of a filter, part by part: dynamics, noise, and covariance at the start."""

from dataclasses import dataclass
from itertools import accumulate, pairwise
from math import radians

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from analysis.design.discrete import discretise
from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients, yaw_stiffness
from shiplog.types import FloatArray

from .noise_model import ForceNoise, FurtherModel, NoiseModel
from .wind_terms import WIND_CHANGE, WIND_TERMS, wind_prior_std

HOUR = 3600.0  # s


@dataclass(frozen=True)
class RandomWalk:
    """A quantity that is unknown at the start and changes slowly.

    Attributes
    ----------
    label, unit
        Its name in words, and its SI unit.
    std
        The standard deviation of its value at the start.
    hourly_std
        The standard deviation of its change in an hour.
    """

    label: str
    unit: str
    std: float
    hourly_std: float


# the changes are those of an instrument in use: a fibre gyro drifts less, a cheap one more
SENSOR_WALKS = {
    "gyro": RandomWalk("gyro bias", "rad/s", radians(0.1), radians(5e-4)),
    "log": RandomWalk("speed log bias", "m/s", 0.5, 0.01),
    "log_scale": RandomWalk("speed log scale", "1", 0.05, 1e-3),
    "rudder": RandomWalk("rudder zero", "rad", radians(2.0), radians(0.02)),
    "compass": RandomWalk("compass bias", "rad", radians(2.0), radians(0.05)),
}
CURRENT_WALK = RandomWalk("current", "m/s", 1.0, 0.2)
DRIFT_WALK = RandomWalk("drift length", "m", 100.0, 1e-3)
FIRST_HEADING_STD = radians(30)  # the first heading may have been measured after a turn
FIRST_POSITION_STD = 1e3  # m
MOMENT_RUDDER = radians(10)  # the yaw moment at the start: as of this rudder angle
FORCE_SHARE = 0.3  # of the largest resistance: the surge force at the start
MIN_FORCE = 1e-12  # in SI units: so that no variance is zero where the model has no effect
WAVE_DECAY = 0.2  # of a wave moment's error, over its frequency, as in the disturbance observer


@dataclass(frozen=True, eq=False)
class WaveModel:
    """The shaping filter of a wave in the yaw rate: x' = A x + noise of intensity W; C x."""

    A: FloatArray
    W: FloatArray
    C: FloatArray


@dataclass(frozen=True, eq=False)
class Part:
    """States with linear dynamics of their own, and the quantity C x that they give.

    `axis` is 0 for a yaw moment and 1 for a surge force; `shown` whether its first state, which C x
    is then, is an estimate.
    """

    name: str
    unit: str
    A: FloatArray
    W: FloatArray
    P: FloatArray
    C: FloatArray
    x: float = 0.0
    axis: int | None = None
    shown: bool = True

    def mean_row(self, dt: float) -> FloatArray:
        """Return the row that gives the mean of C x over the step of dt seconds after x."""
        k = len(self.A)
        integrated = np.block([[self.A, np.zeros((k, 1))], [self.C[None], np.zeros((1, 1))]])
        mean: FloatArray = discretise(integrated, np.zeros((k + 1, k + 1)), dt)[0][k, :k] / dt
        return mean


def wave_parts(wave: WaveModel | None, dt: float) -> list[Part]:
    """Return the wave in the yaw rate; at the start it is in its steady state."""
    if wave is None:
        return []
    P = solve_discrete_lyapunov(*discretise(wave.A, wave.W, dt))
    return [Part("wave", "rad/s", wave.A, wave.W, P, wave.C, shown=False)]


def heading_error_parts(model: FurtherModel) -> list[Part]:
    """Return the slow error of the heading; at the start it is in its steady state."""
    error = model.heading_error
    if error is None:
        return []
    A, P = np.array([[-1 / error.secs]]), np.array([[error.std**2]])
    return [Part("heading_error", "rad", A, -2 * A * P, P, np.ones(1), shown=False)]


def motion_parts(model: FurtherModel, stats: SignalStats) -> list[Part]:
    """Return heading and position as far as they are measured."""
    priors = {
        "heading": ("rad", FIRST_HEADING_STD, "compass"),
        "north": ("m", FIRST_POSITION_STD, "north"),
        "east": ("m", FIRST_POSITION_STD, "east"),
    }
    zero, one = np.zeros((1, 1)), np.ones(1)
    return [
        Part(name, unit, zero, zero, np.array([[std**2]]), one, x=_first(stats, output))
        for name, (unit, std, output) in priors.items()
        if output in model.outputs
    ]


def _first(stats: SignalStats, output: str) -> float:
    """Return the first value measured of a further output; 0 where there is none."""
    values = stats.head[output]
    known = values[np.isfinite(values)]
    return float(known[0]) if len(known) else 0.0


def constant_parts(model: FurtherModel) -> list[Part]:
    """Return the sensor errors, and the current and the drift length that positions need."""
    walks = {name: SENSOR_WALKS[name] for name in model.sensors}
    if "north" in model.outputs:
        walks |= dict.fromkeys(("current_north", "current_east"), CURRENT_WALK)
        walks["drift_length"] = DRIFT_WALK
    return [
        Part(
            name,
            walk.unit,
            np.zeros((1, 1)),
            np.array([[walk.hourly_std**2 / HOUR]]),
            np.array([[walk.std**2]]),
            np.ones(1),
        )
        for name, walk in walks.items()
    ]


def wind_parts(model: FurtherModel, c: Coefficients, stats: SignalStats) -> list[Part]:
    """Return the coefficients of the wind, which change by noise alone."""
    parts = []
    for name in model.wind:
        term = WIND_TERMS[name]
        P = np.array([[wind_prior_std(term, c, stats) ** 2]])
        W = P * WIND_CHANGE**2 / HOUR
        parts.append(Part(name, term.unit, np.zeros((1, 1)), W, P, np.ones(1), axis=term.axis))
    return parts


def force_parts(c: Coefficients, noise: NoiseModel, stats: SignalStats) -> list[Part]:
    """Return slow part and wave of the yaw moment and of the surge force."""
    R = noise.measurement_std**2 * stats.interval_secs
    stiffness, damping = yaw_stiffness(c, stats.yaw_rate_rms), 2 * c.g * stats.median_speed
    resistance = max(abs(c.g) * stats.max_speed**2, abs(c.h * stats.median_rpm))
    rudder = abs(c.d) * stats.max_rudder_effect
    axes = (
        ("yaw_moment", "rad/s³", noise.further.yaw, MOMENT_RUDDER * rudder),
        ("surge_force", "m/s²", noise.further.surge, FORCE_SHARE * resistance),
    )
    parts: list[Part] = []
    for axis, (name, unit, force, typical) in enumerate(axes):
        std = typical + MIN_FORCE
        if force is not None and force.degree is not None:
            order = 2 - axis  # integrators from the force to what is measured
            parts.append(_slow_part(name, unit, axis, force, order, float(R[axis]), std))
        if force is not None and force.wave is not None:
            s = 1j * force.wave
            inverse = s**2 - c.a * s - stiffness if axis == 0 else s - damping
            at_input = float(R[axis] * abs(inverse) ** 2)
            parts.append(_wave_moment(name, unit, axis, force.wave, at_input, std))
    return parts


def _slow_part(
    name: str, unit: str, axis: int, force: ForceNoise, order: int, R: float, std: float
) -> Part:
    """Return a random walk or a ramp on a plant of so many integrators.

    Of k integrators in all, the optimal filter has Butterworth poles of magnitude ω where the
    intensity of the noise that drives them is ω^(2k) times that of the measurement.
    """
    k = int(force.degree or 0) + 1
    A, W = np.eye(k, k=1), np.zeros((k, k))
    W[-1, -1] = force.frequency ** (2 * (order + k)) * R
    P = np.diag((std * force.frequency ** np.arange(k)) ** 2)
    return Part(name, unit, A, W, P, np.eye(k)[0], axis=axis)


def _wave_moment(name: str, unit: str, axis: int, frequency: float, R: float, std: float) -> Part:
    """Return a harmonic of random amplitude; R is the intensity of the noise as seen at its input.

    The error of the optimal filter decays at the root of W/(2 R), which is set to that of the
    disturbance observer.
    """
    A = frequency * np.array([[0.0, 1.0], [-1.0, 0.0]])
    W = 2 * R * (WAVE_DECAY * frequency) ** 2 * np.eye(2)
    return Part(f"{name}_wave", unit, A, W, std**2 * np.eye(2), np.eye(2)[0], axis=axis)


@dataclass(frozen=True)
class FurtherParts:
    """The further states of a filter, part by part.

    Attributes
    ----------
    first
        The number of the core's states, which are before them.
    linear
        Parts with linear dynamics of their own: waves, slow errors, forces that decay.
    motion
        Heading and position, which integrate the ship's states.
    static
        Parts that change by noise alone.
    forces, wind
        Those of the linear and static parts that act on the ship.
    """

    first: int
    linear: list[Part]
    motion: list[Part]
    static: list[Part]
    forces: list[Part]
    wind: list[Part]

    @property
    def ordered(self) -> list[Part]:
        """All parts in the order of their states."""
        return [*self.linear, *self.motion, *self.static]

    @property
    def size(self) -> int:
        """The number of all states, with those of the core."""
        return self.first + sum(len(part.A) for part in self.ordered)

    @property
    def linear_end(self) -> int:
        """The place after the last state of the linear parts."""
        return self.first + sum(len(part.A) for part in self.linear)

    @property
    def places(self) -> dict[str, slice]:
        """The places of the states of each part, by its name."""
        ends = [*accumulate((len(part.A) for part in self.ordered), initial=self.first)]
        named = zip(self.ordered, pairwise(ends), strict=True)
        return {part.name: slice(*place) for part, place in named}


def choose_parts(
    first: int,
    wave: WaveModel | None,
    c: Coefficients,
    noise: NoiseModel,
    stats: SignalStats,
) -> FurtherParts:
    """Choose the parts by the model of the further states.

    Parameters
    ----------
    first
        The number of the core's states.
    wave
        The wave in the yaw rate; None for none.
    c
        The coefficients of the identification paper's model.
    noise
        The noise, and the further states.
    stats
        The statistics of the signals.
    """
    model = noise.further
    forces, wind = force_parts(c, noise, stats), wind_parts(model, c, stats)
    decaying = [part for part in forces if part.A.any()]
    lasting = [part for part in forces if not part.A.any()]
    linear = [*wave_parts(wave, stats.dt_secs), *heading_error_parts(model), *decaying]
    static = [*constant_parts(model), *lasting, *wind]
    return FurtherParts(first, linear, motion_parts(model, stats), static, forces, wind)
