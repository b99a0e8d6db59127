"""Disturbances that the sensors of a plant cannot distinguish, and sensors that would."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from shiplog.types import FloatArray

from .augmentation import AugmentedPlant, DisturbanceInput, Plant, augment_with_disturbances
from .placement import UnobservableMode, format_mode, unobservable_modes

MODE_RTOL = 1e-6  # relative: modes this close before and after adding a sensor are the same


@dataclass(frozen=True)
class Ambiguity:
    """An unobservable mode, what takes part in it, and measurements that would resolve it.

    Attributes
    ----------
    mode
        1/s; of a complex pair the one with positive imaginary part.
    disturbances
        Names of the disturbances that take part.
    states
        Names of the plant's states that take part.
    remedies
        Additional measurements; any one of them makes the mode observable.
    """

    mode: complex
    disturbances: tuple[str, ...]
    states: tuple[str, ...]
    remedies: tuple[str, ...]

    def __str__(self) -> str:
        """Describe the ambiguity and its remedies in one line."""
        subject = " and ".join(repr(name) for name in self.disturbances)
        if len(self.disturbances) == 1 and self.states:
            subject += " and the state " + " and ".join(repr(name) for name in self.states)
        elif not self.disturbances:
            subject = "the state " + " and ".join(repr(name) for name in self.states)
        verb = "cannot be distinguished" if " and " in subject else "cannot be seen"
        remedy = (
            f"measure {', or '.join(self.remedies)}" if self.remedies else "leave some of them out"
        )
        return f"at the mode {format_mode(self.mode)} {subject} {verb}; {remedy}"


def ambiguities(plant: Plant, disturbances: Sequence[DisturbanceInput]) -> tuple[Ambiguity, ...]:
    """Return what the sensors of a plant cannot distinguish, by Hautus's test.

    Parameters
    ----------
    plant, disturbances
        As in `disturbance_observer`.

    Returns
    -------
    tuple of Ambiguity
        One for each unobservable mode of the augmented plant; empty where `disturbance_observer`
        can compute a gain.

    Raises
    ------
    UsageError
        Matrices or names do not fit.
    """
    return system_ambiguities(augment_with_disturbances(plant, disturbances))


def system_ambiguities(system: AugmentedPlant) -> tuple[Ambiguity, ...]:
    """Return `ambiguities` of an augmented plant."""
    return tuple(_ambiguity(system, mode) for mode in unobservable_modes(system.A, system.C))


def _ambiguity(system: AugmentedPlant, mode: UnobservableMode) -> Ambiguity:
    """Describe an unobservable mode; try states, their integrals and disturbances as remedies."""
    involved = sorted({system.disturbance_index[i] for i in mode.states} - {-1})
    plant = [i for i in mode.states if system.disturbance_index[i] == -1]
    remedies = []
    for i in plant:
        if _shows(system, np.eye(1, len(system.A), i), mode.value):
            remedies.append(f"{system.states[i]!r} by a sensor of its own")
        if _is_rate(system, i) and _shows_integral(system, i, mode.value):
            remedies.append(f"the integral of {system.states[i]!r}")
    if not remedies:
        measurable = [k for k in involved if _shows(system, system.D[[k]], mode.value)]
        remedies = [f"{system.names[k]!r} itself" for k in measurable]
    return Ambiguity(
        mode.value,
        tuple(system.names[k] for k in involved),
        tuple(system.states[i] for i in plant),
        tuple(remedies),
    )


def _shows(system: AugmentedPlant, row: FloatArray, mode: complex) -> bool:
    """Return whether the mode is observable once `row` (1, N) is measured as well."""
    return not _hides(system.A, np.vstack((system.C, row)), mode)


def _shows_integral(system: AugmentedPlant, i: int, mode: complex) -> bool:
    """Return whether the mode is observable once the integral of state i is measured as well."""
    A = np.block([[system.A, np.zeros((len(system.A), 1))], [np.eye(1, len(system.A), i), 0.0]])
    return not _hides(A, block_diag(system.C, np.eye(1)), mode)


def _hides(A: FloatArray, C: FloatArray, mode: complex) -> bool:
    """Return whether a mode is unobservable from C (m, N)."""
    return any(
        np.isclose(mode, other.value, rtol=MODE_RTOL, atol=1e-9)
        for other in unobservable_modes(A, C)
    )


def _is_rate(system: AugmentedPlant, i: int) -> bool:
    """Return whether a state of the plant is not an integral of others.

    The integral of a heading, for example, is no practical measurement.
    """
    row = system.A[i, : system.disturbance_index.count(-1)]
    return bool(row[i]) or not row.any()
