"""The states of a filter beside the ship's: waves, disturbances, heading, position, sensor errors.

All have linear dynamics and white noise, but for the heading, which integrates the yaw rate, and
the position. `arrange` puts them after the core's states and makes the constants of the loop.
"""

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, solve_discrete_lyapunov

from analysis.design.discrete import discretise
from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients, yaw_stiffness
from shiplog.types import FloatArray

from .filter_loop import FilterState, System
from .further_steps import ABSENT, Further, NoFurther
from .noise_model import ForceNoise, FurtherModel, NoiseModel

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
class CoreModel:
    """The core's states, linearised for their noise.

    Attributes
    ----------
    A, W
        (c, c): their dynamics, 1/s, and the intensity of their noise.
    inputs
        (c, 2): the columns of yaw moment and surge force.
    speed
        The place of the speed.
    x, P
        (c,) and (c, c): the state at the start and its covariance.
    constant
        Whether A and `inputs` are those of the covariance too; else the loop computes them.
    """

    A: FloatArray
    W: FloatArray
    inputs: FloatArray
    speed: int
    x: FloatArray
    P: FloatArray
    constant: bool


@dataclass(frozen=True, eq=False)
class WaveModel:
    """The shaping filter of a wave in the yaw rate: x' = A x + noise of intensity W; C x."""

    A: FloatArray
    W: FloatArray
    C: FloatArray


@dataclass(frozen=True)
class ShownState:
    """A further estimate: its name, its SI unit, and its standard deviation at the start."""

    name: str
    unit: str
    prior_std: float


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The constants of a filter, its state at the start, and the names of its further estimates."""

    system: System
    further: Further | NoFurther
    state: FilterState
    shown: tuple[ShownState, ...]


@dataclass(frozen=True, eq=False)
class _Part:
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


def arrange(
    core: CoreModel,
    wave: WaveModel | None,
    c: Coefficients,
    noise: NoiseModel,
    stats: SignalStats,
    gate: float,
) -> Arrangement:
    """Arrange the states of a filter, and compute its constants.

    Parameters
    ----------
    core
        The ship's own states.
    wave
        The wave in the yaw rate; None for none.
    c
        The coefficients of the identification paper's model.
    noise
        The noise, and the further states.
    stats
        The statistics of the signals.
    gate
        The largest accepted innovation, in standard deviations.
    """
    model, dt = noise.further, stats.dt_secs
    forces = _force_parts(c, noise, stats)
    linear = [
        *_wave_parts(wave, dt),
        *_heading_error_parts(model),
        *(part for part in forces if part.A.any()),
    ]
    motion = _motion_parts(model, stats)
    static = [*_constant_parts(model), *(part for part in forces if not part.A.any())]
    parts = [*linear, *motion, *static]
    places: dict[str, slice] = {}
    size = len(core.A)
    for part in parts:
        places[part.name] = slice(size, size + len(part.A))
        size += len(part.A)
    A: FloatArray = block_diag(core.A, *(part.A for part in parts))
    W = block_diag(core.W, *(part.W for part in parts))
    count, linear_end = len(core.A), len(core.A) + sum(len(part.A) for part in linear)
    for part in forces:
        A[:count, places[part.name]] = np.outer(core.inputs[:, part.axis or 0], part.C)
    if "heading" in places:
        A[places["heading"], 0] = 1.0
        if wave is not None:
            A[places["heading"], places["wave"]] = wave.C
    F_all, Q = _discretised(A, W, [core.A, *(part.A for part in parts)], dt, joint=bool(model))
    F: FloatArray = np.eye(size)
    F[count:linear_end, count:linear_end] = F_all[count:linear_end, count:linear_end]
    B: FloatArray = np.zeros(
        (count, 2 if model.yaw or model.surge or "rudder" in model.sensors else 0)
    )
    if core.constant:
        F[:count, :count] = F_all[:count, :count]
        B = _input_step(core, dt)[:, : B.shape[1]].copy()
    turn = np.zeros(size)
    if "heading" in places and wave is not None:
        turn[places["wave"]] = F_all[places["heading"], places["wave"]]
    estimates = [part for part in parts if part.shown]
    system = System(
        C=_output_matrix(core, wave, places, size, 2 + len(model.outputs)),
        r=np.concatenate((noise.measurement_std**2, np.square(model.output_stds))),
        gate=gate,
        F=F,
        Q=np.ascontiguousarray(Q),
        B=np.ascontiguousarray(B),
        linear_end=linear_end,
        dynamic=linear_end + len(motion),
        shown=len(estimates),
    )
    shown_at = np.array([places[part.name].start for part in estimates], np.int64)
    further = (
        _places(core, places, _force_rows(forces, places, dt), turn, shown_at)
        if model
        else NoFurther(count)
    )
    state = FilterState(
        np.concatenate([core.x, *(np.r_[part.x, np.zeros(len(part.A) - 1)] for part in parts)]),
        np.ascontiguousarray(block_diag(core.P, *(part.P for part in parts))),
        np.zeros(2 + len(model.outputs), np.int64),
    )
    stds = [float(np.sqrt(part.C @ part.P @ part.C)) for part in estimates]
    shown = [
        ShownState(part.name, part.unit, std) for part, std in zip(estimates, stds, strict=True)
    ]
    return Arrangement(system, further, state, tuple(shown))


def _discretised(
    A: FloatArray, W: FloatArray, blocks: list[FloatArray], dt: float, *, joint: bool
) -> tuple[FloatArray, FloatArray]:
    """Discretise the system, block by block where nothing couples the blocks."""
    if joint:
        return discretise(A, W, dt)
    steps, first = [], 0
    for block in blocks:
        place = slice(first, first + len(block))
        steps.append(discretise(block, W[place, place], dt))
        first += len(block)
    return block_diag(*(F for F, _ in steps)), block_diag(*(Q for _, Q in steps))


def _input_step(core: CoreModel, dt: float) -> FloatArray:
    """Return the derivative (c, 2) of a step of the linearised core by moment and force."""
    c = len(core.A)
    driven = np.zeros((c + 2, c + 2))
    driven[:c, :c], driven[:c, c:] = core.A, core.inputs
    return discretise(driven, np.zeros_like(driven), dt)[0][:c, c:]


def _force_rows(
    forces: list[_Part], places: dict[str, slice], dt: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return `forces`, `mean` and `now` of `Further`."""
    count = sum(len(part.A) for part in forces)
    at, mean, now = np.zeros(count, np.int64), np.zeros((2, count)), np.zeros((2, count))
    first = 0
    for part in forces:
        place, axis = places[part.name], part.axis or 0
        own = slice(first, first + len(part.A))
        at[own] = np.arange(place.start, place.stop)
        mean[axis, own], now[axis, own] = part.mean_row(dt), part.C
        first = own.stop
    return at, mean, now


def _places(
    core: CoreModel,
    places: dict[str, slice],
    rows: tuple[NDArray[np.int64], FloatArray, FloatArray],
    turn: FloatArray,
    shown: NDArray[np.int64],
) -> Further:
    forces, mean, now = rows
    at = {name: place.start for name, place in places.items()}
    return Further(
        core=len(core.A),
        speed=core.speed,
        heading=at.get("heading", ABSENT),
        north=at.get("north", ABSENT),
        log_scale=at.get("log_scale", ABSENT),
        rudder_zero=at.get("rudder", ABSENT),
        current=at.get("current_north", ABSENT),
        drift=at.get("drift_length", ABSENT),
        forces=forces,
        mean=mean,
        now=now,
        turn=turn,
        shown=shown,
    )


def _output_matrix(
    core: CoreModel, wave: WaveModel | None, places: dict[str, slice], size: int, outputs: int
) -> FloatArray:
    """Return C (m, s); the error of the speed's scale enters in the loop."""
    C = np.zeros((outputs, size))
    C[0, 0], C[1, core.speed] = 1.0, 1.0
    if wave is not None:
        C[0, places["wave"]] = wave.C
    rows = {
        "gyro": 0, "log": 1, "heading": 2, "heading_error": 2, "compass": 2, "north": 3, "east": 4,
    }  # fmt: skip
    for name, row in rows.items():
        if name in places:
            C[row, places[name]] = 1.0
    return C


def _wave_parts(wave: WaveModel | None, dt: float) -> list[_Part]:
    """Return the wave in the yaw rate; at the start it is in its steady state."""
    if wave is None:
        return []
    P = solve_discrete_lyapunov(*discretise(wave.A, wave.W, dt))
    return [_Part("wave", "rad/s", wave.A, wave.W, P, wave.C, shown=False)]


def _heading_error_parts(model: FurtherModel) -> list[_Part]:
    """Return the slow error of the heading; at the start it is in its steady state."""
    error = model.heading_error
    if error is None:
        return []
    A, P = np.array([[-1 / error.secs]]), np.array([[error.std**2]])
    return [_Part("heading_error", "rad", A, -2 * A * P, P, np.ones(1), shown=False)]


def _motion_parts(model: FurtherModel, stats: SignalStats) -> list[_Part]:
    """Return heading and position as far as they are measured."""
    priors = {
        "heading": ("rad", FIRST_HEADING_STD, "compass"),
        "north": ("m", FIRST_POSITION_STD, "north"),
        "east": ("m", FIRST_POSITION_STD, "east"),
    }
    zero, one = np.zeros((1, 1)), np.ones(1)
    return [
        _Part(name, unit, zero, zero, np.array([[std**2]]), one, x=_first(stats, output))
        for name, (unit, std, output) in priors.items()
        if output in model.outputs
    ]


def _first(stats: SignalStats, output: str) -> float:
    """Return the first value measured of a further output; 0 where there is none."""
    values = stats.head[output]
    known = values[np.isfinite(values)]
    return float(known[0]) if len(known) else 0.0


def _constant_parts(model: FurtherModel) -> list[_Part]:
    """Return the sensor errors, and the current and the drift length that positions need."""
    walks = {name: SENSOR_WALKS[name] for name in model.sensors}
    if "north" in model.outputs:
        walks |= dict.fromkeys(("current_north", "current_east"), CURRENT_WALK)
        walks["drift_length"] = DRIFT_WALK
    return [
        _Part(
            name,
            walk.unit,
            np.zeros((1, 1)),
            np.array([[walk.hourly_std**2 / HOUR]]),
            np.array([[walk.std**2]]),
            np.ones(1),
        )
        for name, walk in walks.items()
    ]


def _force_parts(c: Coefficients, noise: NoiseModel, stats: SignalStats) -> list[_Part]:
    """Return slow part and wave of the yaw moment and of the surge force."""
    R = noise.measurement_std**2 * stats.interval_secs
    stiffness, damping = yaw_stiffness(c, stats.yaw_rate_rms), 2 * c.g * stats.median_speed
    resistance = max(abs(c.g) * stats.max_speed**2, abs(c.h * stats.median_rpm))
    rudder = abs(c.d) * stats.max_rudder_effect
    axes = (
        ("yaw_moment", "rad/s³", noise.further.yaw, MOMENT_RUDDER * rudder),
        ("surge_force", "m/s²", noise.further.surge, FORCE_SHARE * resistance),
    )
    parts: list[_Part] = []
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
) -> _Part:
    """Return a random walk or a ramp on a plant of so many integrators.

    Of k integrators in all, the optimal filter has Butterworth poles of magnitude ω where the
    intensity of the noise that drives them is ω^(2k) times that of the measurement.
    """
    k = int(force.degree or 0) + 1
    A, W = np.eye(k, k=1), np.zeros((k, k))
    W[-1, -1] = force.frequency ** (2 * (order + k)) * R
    P = np.diag((std * force.frequency ** np.arange(k)) ** 2)
    return _Part(name, unit, A, W, P, np.eye(k)[0], axis=axis)


def _wave_moment(name: str, unit: str, axis: int, frequency: float, R: float, std: float) -> _Part:
    """Return a harmonic of random amplitude; R is the intensity of the noise as seen at its input.

    The error of the optimal filter decays at the root of W/(2 R), which is set to that of the
    disturbance observer.
    """
    A = frequency * np.array([[0.0, 1.0], [-1.0, 0.0]])
    W = 2 * R * (WAVE_DECAY * frequency) ** 2 * np.eye(2)
    return _Part(f"{name}_wave", unit, A, W, std**2 * np.eye(2), np.eye(2)[0], axis=axis)
