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
from .further_parts import FurtherParts, Part, WaveModel, choose_parts
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
    parts = choose_parts(len(core.A), wave, c, noise, stats)
    places, outputs = parts.places, 2 + len(model.outputs)
    A, W = _dynamics(core, wave, parts)
    blocks = [core.A, *(part.A for part in parts.ordered)]
    F, Q = _discretised(A, W, blocks, dt, joint=bool(model))
    shown = [part for part in parts.ordered if part.shown]
    has_inputs = bool(model.yaw or model.surge or parts.wind or "rudder" in model.sensors)
    system = System(
        C=_output_matrix(core, wave, places, parts.size, outputs),
        r=np.concatenate((noise.measurement_std**2, np.square(model.output_stds))),
        gate=gate,
        F=_constant_transition(core, parts, F),
        Q=np.ascontiguousarray(Q),
        B=_input_columns(core, 2 if has_inputs else 0, dt),
        linear_end=parts.linear_end,
        dynamic=parts.linear_end + len(parts.motion),
        shown=len(shown),
    )
    further: Further | NoFurther = NoFurther(parts.first)
    if model:
        turn = np.zeros(parts.size)
        if "heading" in places and wave is not None:
            turn[places["wave"]] = F[places["heading"], places["wave"]]
        rows = _force_rows([*parts.forces, *parts.wind], places, dt)
        shown_at = np.array([places[part.name].start for part in shown], np.int64)
        further = _places(core, places, rows, turn, shown_at, model.wind)
    return Arrangement(
        system, further, _initial_state(core, parts, outputs), _shown_states(shown), model.wind
    )


def _dynamics(
    core: CoreModel, wave: WaveModel | None, parts: FurtherParts
) -> tuple[FloatArray, FloatArray]:
    """Return the dynamics (s, s) of all states, 1/s, and the intensity (s, s) of their noise."""
    places = parts.places
    A: FloatArray = block_diag(core.A, *(part.A for part in parts.ordered))
    for part in parts.forces:
        A[: parts.first, places[part.name]] = np.outer(core.inputs[:, part.axis or 0], part.C)
    if "heading" in places:
        A[places["heading"], 0] = 1.0
        if wave is not None:
            A[places["heading"], places["wave"]] = wave.C
    return A, block_diag(core.W, *(part.W for part in parts.ordered))


def _constant_transition(core: CoreModel, parts: FurtherParts, F: FloatArray) -> FloatArray:
    """Return the constant part of the transition matrix F (s, s); the loop computes the rest."""
    constant: FloatArray = np.eye(parts.size)
    linear, own = slice(parts.first, parts.linear_end), slice(parts.first)
    constant[linear, linear] = F[linear, linear]
    if core.constant:
        constant[own, own] = F[own, own]
    return constant


def _input_columns(core: CoreModel, columns: int, dt: float) -> FloatArray:
    """Return B of `System`, with as many columns of it as are used; zero where it varies."""
    if not core.constant:
        return np.zeros((len(core.A), columns))
    return np.ascontiguousarray(_input_step(core, dt)[:, :columns])


def _initial_state(core: CoreModel, parts: FurtherParts, outputs: int) -> FilterState:
    further = [np.r_[part.x, np.zeros(len(part.A) - 1)] for part in parts.ordered]
    return FilterState(
        np.concatenate([core.x, *further]),
        np.ascontiguousarray(block_diag(core.P, *(part.P for part in parts.ordered))),
        np.zeros(outputs, np.int64),
    )


def _shown_states(shown: list[Part]) -> tuple[ShownState, ...]:
    """Return the further estimates, with their standard deviations at the start."""
    stds = [float(np.sqrt(part.C @ part.P @ part.C)) for part in shown]
    return tuple(
        ShownState(part.name, part.unit, std) for part, std in zip(shown, stds, strict=True)
    )


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
