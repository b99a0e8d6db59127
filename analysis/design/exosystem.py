"""Design of the disturbance observer: a gain for plant and exosystems as one system.

Source: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", eqs (3) and (4). Its "binomial" filtering is Butterworth's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.csgraph import connected_components

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .augmentation import (
    AugmentedPlant,
    DisturbanceInput,
    Exosystem,
    Plant,
    augment_with_disturbances,
)
from .distinguishability import Ambiguity, ambiguities, system_ambiguities
from .luenberger import POLE_PATTERNS
from .matrices import as_finite_array
from .observability import ComplexArray
from .placement import checked_poles, place_multilevel
from .riccati import kalman_gain

__all__ = [
    "Ambiguity",
    "DisturbanceInput",
    "DisturbanceObserver",
    "Exosystem",
    "Plant",
    "ambiguities",
    "disturbance_observer",
]


@dataclass(frozen=True, eq=False)
class DisturbanceObserver:
    """x̂' = A x̂ + B u + L (y - C x̂) of plant and environment, N states; the disturbances are D x̂."""

    L: FloatArray  # (N, m)
    A: FloatArray  # (N, N)
    B: FloatArray  # (N, inputs)
    C: FloatArray  # (m, N)
    D: FloatArray  # (k, N)
    poles: ComplexArray  # (N,), 1/s, channel after channel
    names: tuple[str, ...]  # of the k disturbances
    states: tuple[str, ...]  # of the N states
    channels: tuple[tuple[int, ...], ...]  # the states of each channel


def disturbance_observer(
    plant: Plant,
    disturbances: Sequence[DisturbanceInput],
    spectrum: ArrayLike = "butterworth",
    *,
    frequency: float | Sequence[float] | None = None,
    state_noise: ArrayLike | None = None,
    sensor_noise: ArrayLike | None = None,
) -> DisturbanceObserver:
    """The observer of a plant's states, n, and of what disturbs it, by the exosystems' states.

    Parts that have nothing to do with each other are channels and designed each for itself; they
    come in the order of their first states. `spectrum` is "butterworth" or "binomial" (all poles
    at -`frequency`) of a `frequency` in rad/s, one or one a channel; poles (N,), 1/s, channel after
    channel; or "kalman", with the intensities of white noise `state_noise` (N,), on the rates of
    change of plant and exosystems, and `sensor_noise` (m,), squares of units times second.

    Raises `UsageError` for matrices and names that do not fit, and for disturbances that the
    sensors cannot distinguish, naming them, their mode and a measurement that would: constant
    moment and constant gyro bias, say. Source: the disturbance observer's paper, (3) and (4).
    """
    system = augment_with_disturbances(plant, disturbances)
    hidden = system_ambiguities(system)
    if hidden:
        raise UsageError("; ".join(str(ambiguity) for ambiguity in hidden))
    N, m = len(system.A), len(system.C)
    channels = _channels(system)
    wanted = _wanted(spectrum, frequency, [len(states) for states, _ in channels])
    L, poles = np.zeros((N, m)), []
    for k, (states, sensors) in enumerate(channels):
        A, C = system.A[np.ix_(states, states)], system.C[np.ix_(sensors, states)]
        if wanted is None:
            Q = np.diag(_intensities("state_noise", state_noise, N)[states])
            R = np.diag(_intensities("sensor_noise", sensor_noise, m)[sensors])
            kalman = kalman_gain(A, np.eye(len(A)), C, Q, R)
            gain, found = kalman.gain, kalman.poles
        else:
            gain, found = place_multilevel(A, C, wanted[k]), wanted[k]
        L[np.ix_(states, sensors)] = gain
        poles.append(found)
    return DisturbanceObserver(
        L=L,
        A=system.A,
        B=system.B,
        C=system.C,
        D=system.D,
        poles=np.concatenate(poles),
        names=system.names,
        states=system.states,
        channels=tuple(tuple(states.tolist()) for states, _ in channels),
    )


def _channels(system: AugmentedPlant) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """The states and sensors of each part that nothing connects to another."""
    N = len(system.A)
    linked = np.vstack((system.A, system.C)) != 0
    links = np.hstack((linked, np.zeros((len(linked), len(system.C)))))
    _, part = connected_components(links, directed=False)
    return [
        (np.flatnonzero(part[:N] == own), np.flatnonzero(part[N:] == own))
        for own in dict.fromkeys(part[:N].tolist())
    ]


def _wanted(
    spectrum: ArrayLike, frequency: float | Sequence[float] | None, sizes: Sequence[int]
) -> list[ComplexArray] | None:
    """The poles of each channel; none where the noise decides."""
    if not isinstance(spectrum, str):
        poles = np.asarray(spectrum)
        if poles.shape != (sum(sizes),):
            raise UsageError(
                f"spectrum is of shape {poles.shape}; expected ({sum(sizes)},), a pole for each"
                " state of plant and exosystems"
            )
        parts = np.split(poles, np.cumsum(sizes)[:-1])
        return [
            checked_poles(f"spectrum of channel {k}", part, len(part), stable=True)
            for k, part in enumerate(parts, 1)
        ]
    if spectrum not in (*POLE_PATTERNS, "kalman"):
        raise UsageError(
            f"spectrum is {spectrum!r}; expected butterworth, binomial, kalman or poles"
        )
    if spectrum == "kalman":
        return None
    if frequency is None:
        raise UsageError(f"frequency is missing; {spectrum} poles need one in rad/s")
    each = as_finite_array("frequency", frequency)
    if each.shape not in ((), (len(sizes),)) or np.any(each <= 0):
        raise UsageError(
            f"frequency is {frequency}; expected a positive one, or one for each of the"
            f" {len(sizes)} channels"
        )
    each = np.broadcast_to(each, len(sizes))
    return [
        POLE_PATTERNS[spectrum](n, omega) for n, omega in zip(sizes, each.tolist(), strict=True)
    ]


def _intensities(name: str, values: ArrayLike | None, count: int) -> FloatArray:
    """Intensities of white noise, (count,), none of them negative."""
    if values is None:
        raise UsageError(f"{name} is missing; kalman needs its intensities, ({count},)")
    found = as_finite_array(name, values)
    if found.shape != (count,) or np.any(found < 0):
        raise UsageError(f"{name} is of shape {found.shape}; expected ({count},), none negative")
    return found
