"""The states of a filter beside the ship's: waves, disturbances, heading, position, sensor errors.

All have linear dynamics and white noise (`further_parts`), but for the heading, which integrates
the yaw rate, and the position. `arrange` puts them after the core's states and makes the constants
of the loop.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from analysis.design.discrete import discretise
from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .filter_loop import FilterState, System
from .further_parts import (
    Part,
    WaveModel,
    constant_parts,
    force_parts,
    heading_error_parts,
    motion_parts,
    wave_parts,
    wind_parts,
)
from .further_steps import ABSENT, Further, NoFurther
from .noise_model import NoiseModel
from .wind_terms import WIND_TERMS


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


@dataclass(frozen=True)
class ShownState:
    """A further estimate: its name, its SI unit, and its standard deviation at the start."""

    name: str
    unit: str
    prior_std: float


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The constants of a filter, its state at the start, and the names of its further estimates.

    `wind` are the names of the terms of the wind, whose regressors are signals of these names.
    """

    system: System
    further: Further | NoFurther
    state: FilterState
    shown: tuple[ShownState, ...]
    wind: tuple[str, ...] = ()


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
    forces, wind = force_parts(c, noise, stats), wind_parts(model, c, stats)
    linear = [
        *wave_parts(wave, dt),
        *heading_error_parts(model),
        *(part for part in forces if part.A.any()),
    ]
    motion = motion_parts(model, stats)
    static = [*constant_parts(model), *(part for part in forces if not part.A.any()), *wind]
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
        (count, 2 if model.yaw or model.surge or wind or "rudder" in model.sensors else 0)
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
        _places(core, places, _force_rows([*forces, *wind], places, dt), turn, shown_at, model.wind)
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
    return Arrangement(system, further, state, tuple(shown), model.wind)


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
    forces: list[Part], places: dict[str, slice], dt: float
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
    wind: tuple[str, ...],
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
        wind_axes=np.array([WIND_TERMS[name].axis for name in wind], np.int64),
        regressors=np.zeros((0, len(wind))),
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
