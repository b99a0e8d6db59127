"""A plant joined with its disturbances and shaping filters, and what it reports of its states."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from analysis.design.augmentation import (
    AugmentedPlant,
    DisturbanceInput,
    augment_with_disturbances,
)
from analysis.design.distinguishability import system_ambiguities
from analysis.design.observability import AXIS_TOLERANCE, unobservable_eigenvalues
from analysis.design.shaping import augment_with_shaping
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel
from .system import Linearisation, LinearSystem, SystemDisturbance


@dataclass(frozen=True, eq=False)
class OutputSampling:
    """How the outputs are measured on the clock.

    Attributes
    ----------
    r
        (m,): variance of the noise of one measurement.
    intervals
        (m,): time from one measurement to the next, s.
    dt
        Step of the clock, s.
    """

    r: FloatArray
    intervals: FloatArray
    dt: float


@dataclass(frozen=True, eq=False)
class Quantity:
    """What is reported of the estimate: a state of the plant, a disturbance, or coloured noise.

    Attributes
    ----------
    name, unit
        Name and unit.
    kind
        ``state``, ``disturbance`` or ``noise``.
    row
        (N,): the quantity is row · x̂.
    """

    name: str
    unit: str
    kind: str
    row: FloatArray


def estimator_model(
    system: LinearSystem, sampling: OutputSampling, at: Linearisation | None = None
) -> EstimatorModel:
    """Join plant, disturbances and shaping filters.

    Parameters
    ----------
    system
        The system.
    sampling
        How its outputs are measured.
    at
        The plant at this tick; that of the start by default.
    """
    at = at or system.start()
    augmented = _with_disturbances(system, at)
    A, B, C, W = augmented.A, augmented.B, augmented.C, _driven(system, augmented)
    n, first = len(at.A), len(A)
    for noise in system.shaped:
        on_state = _column(noise.on_state, system.plant.states, len(A))
        on_sensor = _column(noise.on_sensor, system.plant.sensors, len(C))
        place, column = ("state", on_state) if noise.on_state else ("output", on_sensor)
        shaped = augment_with_shaping(A, B, C, column, noise.shaping, at=place)  # type: ignore[arg-type]
        W = block_diag(W, np.zeros((len(shaped.A) - len(A),) * 2)) + shaped.G @ shaped.G.T
        A, B, C = shaped.A, shaped.B, shaped.C
    b = np.concatenate((at.b, np.zeros(len(A) - n)))
    return EstimatorModel(
        A, B[:, : at.B.shape[1]], b, C, system.D, W, sampling.r, sampling.intervals, sampling.dt, n,
        tuple(range(first, len(A))),
    )  # fmt: skip


def quantities(system: LinearSystem, model: EstimatorModel) -> tuple[Quantity, ...]:
    """Return what is reported of the estimate: states, disturbances, coloured noise."""
    N, plant = len(model.A), system.plant
    augmented = _with_disturbances(system, system.start())
    rows = [
        Quantity(name, unit, "state", np.eye(1, N, k)[0])
        for k, (name, unit) in enumerate(zip(plant.states, system.units, strict=True))
    ]
    for k, disturbance in enumerate(system.disturbances):
        row = np.zeros(N)
        row[: augmented.D.shape[1]] = augmented.D[k]
        rows.append(Quantity(disturbance.name, disturbance.unit, "disturbance", row))
    first = len(augmented.A)
    for noise in system.shaped:
        size = len(noise.shaping.denominator) - 1
        factors, names, matrix = (
            (noise.on_state, plant.states, model.A)
            if noise.on_state
            else (noise.on_sensor, plant.sensors, model.C)
        )
        target, factor = next((n, f) for n, f in factors.items() if f)
        row = np.zeros(N)
        row[first : first + size] = matrix[names.index(target), first : first + size] / factor
        rows.append(Quantity(noise.name, noise.unit, "noise", row))
        first += size
    return tuple(rows)


def state_names(system: LinearSystem) -> tuple[str, ...]:
    """Return the names of all N states of the estimator."""
    augmented = _with_disturbances(system, system.start())
    shaped = (
        f"{noise.name}[{i}]"
        for noise in system.shaped
        for i in range(len(noise.shaping.denominator) - 1)
    )
    return (*augmented.states, *shaped)


def require_distinguishable(system: LinearSystem, model: EstimatorModel, at: Linearisation) -> None:
    """Refuse disturbances and states that the outputs cannot separate and that do not decay.

    Parameters
    ----------
    system, model
        The system, and the model joined from it.
    at
        The plant for which the model was joined.

    Raises
    ------
    UsageError
        The message names the mode, what takes part in it, and the measurement that resolves it.
    """
    augmented = _with_disturbances(system, at)
    limit = AXIS_TOLERANCE * float(np.linalg.norm(augmented.A))
    unresolved = [each for each in system_ambiguities(augmented) if each.mode.real >= -limit]
    if unresolved:
        raise UsageError("; ".join(map(str, unresolved)))
    if any(mode.real >= -limit for mode in unobservable_eigenvalues(model.A, model.C)):
        raise UsageError(
            "coloured noise and plant have a mode in common that does not decay and that the "
            "outputs do not show; change the spectrum or measure another state"
        )


def with_spectra(
    system: LinearSystem, parameters: Mapping[str, Mapping[str, float]]
) -> LinearSystem:
    """Return the system with parameters of its spectra replaced, by the name of the noise."""
    shaped = tuple(noise.with_parameters(parameters.get(noise.name, {})) for noise in system.shaped)
    return replace(system, shaped=shaped)


def _with_disturbances(system: LinearSystem, at: Linearisation) -> AugmentedPlant:
    """Augment the plant by its disturbances; a plant without inputs has one of zeros."""
    plant = replace(system.plant, A=at.A, B=at.B if at.B.size else np.zeros((len(at.A), 1)))
    inputs = [_design_input(system, at, each) for each in system.disturbances]
    return augment_with_disturbances(plant, inputs)


def _design_input(
    system: LinearSystem, at: Linearisation, disturbance: SystemDisturbance
) -> DisturbanceInput:
    """Return a disturbance with its action on inputs expressed by states, through B."""
    column = _column(disturbance.on_state, system.plant.states, len(at.A))[:, 0]
    names = [binding.name for binding in system.inputs]
    for name, factor in disturbance.on_input.items():
        column = column + factor * at.B[:, names.index(name)]
    on_state = {
        name: float(value) for name, value in zip(system.plant.states, column, strict=True) if value
    }
    return DisturbanceInput(
        disturbance.name, disturbance.exosystem, on_state, disturbance.on_sensor
    )


def _driven(system: LinearSystem, augmented: AugmentedPlant) -> FloatArray:
    """Return the intensity (N, N) of the white noise on plant and exosystems.

    Of an exosystem its last block is driven: the highest derivative of a polynomial, both states of
    an oscillation.
    """
    N, n = len(augmented.A), len(system.W)
    W = np.zeros((N, N))
    W[:n, :n] = system.W
    for k, disturbance in enumerate(system.disturbances):
        states = [i for i, owner in enumerate(augmented.disturbance_index) if owner == k]
        Ac = disturbance.exosystem.Ac
        block = 2 if len(Ac) > 1 and Ac[-1, -2] else 1
        for i in states[-block:]:
            W[i, i] = disturbance.intensity
    return W


def _column(factors: Mapping[str, float], names: tuple[str, ...], size: int) -> FloatArray:
    """Return factors by name as a column (size, 1); the names are the first entries."""
    column = np.zeros((size, 1))
    for name, factor in factors.items():
        column[names.index(name)] = factor
    return column
