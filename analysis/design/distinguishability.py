"""Disturbances that the sensors of a plant cannot distinguish, and sensors that would."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from shiplog.types import FloatArray

from .augmentation import AugmentedPlant, DisturbanceInput, Plant, augment_with_disturbances
from .placement import UnobservableMode, format_mode, unobservable_modes

MODE_RTOL = 1e-6  # relative: what counts as one mode before and after a sensor is added


@dataclass(frozen=True)
class Ambiguity:
    """A mode that the sensors do not show, what takes part in it and what would show it."""

    mode: complex  # 1/s; of a complex pair the one above
    disturbances: tuple[str, ...]
    states: tuple[str, ...]  # of the plant
    remedies: tuple[str, ...]  # measurements, any one of which would do

    def __str__(self) -> str:
        who = " and ".join(repr(name) for name in self.disturbances)
        if len(self.disturbances) == 1 and self.states:
            who += " and the state " + " and ".join(repr(name) for name in self.states)
        elif not self.disturbances:
            who = "the state " + " and ".join(repr(name) for name in self.states)
        verb = "cannot be distinguished" if " and " in who else "cannot be seen"
        remedy = (
            f"measure {', or '.join(self.remedies)}" if self.remedies else "leave some of them out"
        )
        return f"at the mode {format_mode(self.mode)} {who} {verb}; {remedy}"


def ambiguities(plant: Plant, disturbances: Sequence[DisturbanceInput]) -> tuple[Ambiguity, ...]:
    """What the plant's sensors cannot distinguish; empty where `disturbance_observer` has a gain.

    Hautus's test of plant and exosystems together. Raises `UsageError` for what does not fit.
    """
    return system_ambiguities(augment_with_disturbances(plant, disturbances))


def system_ambiguities(system: AugmentedPlant) -> tuple[Ambiguity, ...]:
    """Return `ambiguities` of plant and exosystems that are one system already."""
    return tuple(_ambiguity(system, mode) for mode in unobservable_modes(system.A, system.C))


def _ambiguity(system: AugmentedPlant, mode: UnobservableMode) -> Ambiguity:
    """Who is in a hidden mode, and what shows it: a state, a state's integral, a disturbance."""
    involved = sorted({system.disturbance_index[i] for i in mode.states} - {-1})
    plant = [i for i in mode.states if system.disturbance_index[i] == -1]
    remedies = []
    for i in plant:
        if _shows(system, np.eye(1, len(system.A), i), mode.value):
            remedies.append(f"{system.states[i]!r} by a sensor of its own")
        if _is_rate(system, i) and _shows_integral(system, i, mode.value):
            remedies.append(f"the integral of {system.states[i]!r}")
    if not remedies:
        itself = [k for k in involved if _shows(system, system.D[[k]], mode.value)]
        remedies = [f"{system.names[k]!r} itself" for k in itself]
    return Ambiguity(
        mode.value,
        tuple(system.names[k] for k in involved),
        tuple(system.states[i] for i in plant),
        tuple(remedies),
    )


def _shows(system: AugmentedPlant, row: FloatArray, mode: complex) -> bool:
    """Whether a mode is hidden no longer once `row` (1, N) is measured too."""
    return not _hides(system.A, np.vstack((system.C, row)), mode)


def _shows_integral(system: AugmentedPlant, i: int, mode: complex) -> bool:
    """Whether a mode is hidden no longer once the integral of state i is measured too."""
    A = np.block([[system.A, np.zeros((len(system.A), 1))], [np.eye(1, len(system.A), i), 0.0]])
    return not _hides(A, block_diag(system.C, np.eye(1)), mode)


def _hides(A: FloatArray, C: FloatArray, mode: complex) -> bool:
    return any(
        np.isclose(mode, left.value, rtol=MODE_RTOL, atol=1e-9) for left in unobservable_modes(A, C)
    )


def _is_rate(system: AugmentedPlant, i: int) -> bool:
    """Whether a state of the plant is no integral of others: nobody measures that of a heading."""
    row = system.A[i, : system.disturbance_index.count(-1)]
    return bool(row[i]) or not row.any()
