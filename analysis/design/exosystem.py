"""Disturbance observer: one gain for the plant and the exosystems of its disturbances.

Source: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", eqs (3) and (4). What the paper calls "binomial" filtering is Butterworth's.
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
from .noise_placement import place_for_noise
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
    """The observer x̂' = A x̂ + B u + L (y - C x̂) of plant and exosystems; d̂ = D x̂.

    Attributes
    ----------
    L
        (N, m): the gain.
    A, B, C
        (N, N), (N, inputs) and (m, N): the augmented plant.
    D
        (k, N): the estimated disturbances are D x̂.
    poles
        (N,), 1/s: eigenvalues of A - L C, channel by channel.
    names
        Names of the k disturbances.
    states
        Names of the N states.
    channels
        Indices of the states of each channel.
    """

    L: FloatArray
    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    poles: ComplexArray
    names: tuple[str, ...]
    states: tuple[str, ...]
    channels: tuple[tuple[int, ...], ...]


def disturbance_observer(
    plant: Plant,
    disturbances: Sequence[DisturbanceInput],
    spectrum: ArrayLike = "butterworth",
    *,
    frequency: float | Sequence[float] | None = None,
    state_noise: ArrayLike | None = None,
    sensor_noise: ArrayLike | None = None,
) -> DisturbanceObserver:
    """Design the observer of a plant's states and of its disturbances.

    Uncoupled parts of the augmented plant are channels, designed one by one, in the order of their
    first states. In a channel of several sensors many gains have the poles: with `sensor_noise` it
    is the one of the least noise, otherwise that of `place_multilevel`.

    Parameters
    ----------
    plant
        n states and m sensors.
    disturbances
        The disturbances; plant and exosystems have N states together.
    spectrum
        "butterworth" or "binomial" (all poles at -`frequency`) need `frequency`; poles (N,), 1/s,
        channel by channel, are placed as given; "kalman" computes the gain from the noise.
    frequency
        rad/s: one, or one for each channel.
    state_noise
        (N,): intensity of white noise on the rate of change of each state of plant and exosystems,
        in squared units of the rate times second; for "kalman", and zero by default with poles.
    sensor_noise
        (m,): intensity of white noise of each sensor, in squared units times second; for "kalman",
        optional with poles.

    Raises
    ------
    UsageError
        Matrices or names do not fit, or the sensors cannot distinguish the disturbances, for
        example a constant moment and a constant gyro bias. The message names the disturbances,
        their mode and a measurement that would distinguish them.

    References
    ----------
    "Algorithm of ship course control system watcher ...", (3) and (4).

    Examples
    --------
    A constant specific moment on a yaw rate, both poles at -0.1 1/s:

    >>> ship = Plant(np.zeros((1, 1)), np.zeros((1, 1)), np.eye(1), ("rate",), ("gyro",))
    >>> moment = DisturbanceInput("moment", Exosystem.polynomial(0), on_state={"rate": 1.0})
    >>> disturbance_observer(ship, [moment], "binomial", frequency=0.1).L.round(3).tolist()
    [[0.2], [0.01]]
    """
    system = augment_with_disturbances(plant, disturbances)
    unresolved = system_ambiguities(system)
    if unresolved:
        raise UsageError("; ".join(str(ambiguity) for ambiguity in unresolved))
    N, m = len(system.A), len(system.C)
    channels = _channels(system)
    requested = _requested_poles(spectrum, frequency, [len(states) for states, _ in channels])
    if requested is not None and state_noise is None and sensor_noise is not None:
        state_noise = np.zeros(N)
    L, poles = np.zeros((N, m)), []
    for k, (states, sensors) in enumerate(channels):
        A, C = system.A[np.ix_(states, states)], system.C[np.ix_(sensors, states)]
        if requested is not None and state_noise is None and sensor_noise is None:
            gain, closed_poles = place_multilevel(A, C, requested[k]), requested[k]
        else:
            W = np.diag(_intensities("state_noise", state_noise, N)[states])
            R = np.diag(_intensities("sensor_noise", sensor_noise, m)[sensors])
            gain, closed_poles = _noise_gain(
                A, C, None if requested is None else requested[k], W, R
            )
        L[np.ix_(states, sensors)] = gain
        poles.append(closed_poles)
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
    """Return the state and sensor indices of each uncoupled part of the augmented plant."""
    N = len(system.A)
    linked = np.vstack((system.A, system.C)) != 0
    links = np.hstack((linked, np.zeros((len(linked), len(system.C)))))
    _, part = connected_components(links, directed=False)
    return [
        (np.flatnonzero(part[:N] == own), np.flatnonzero(part[N:] == own))
        for own in dict.fromkeys(part[:N].tolist())
    ]


def _requested_poles(
    spectrum: ArrayLike, frequency: float | Sequence[float] | None, sizes: Sequence[int]
) -> list[ComplexArray] | None:
    """Return the poles of each channel, (size,) each; `None` for a Kalman design."""
    if not isinstance(spectrum, str):
        poles = np.asarray(spectrum)
        if poles.shape != (sum(sizes),):
            raise UsageError(
                f"{poles.size} poles are given; expected {sum(sizes)}, one for each state of the"
                " plant and of the disturbances"
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
    frequencies = as_finite_array("frequency", frequency)
    if frequencies.shape not in ((), (len(sizes),)) or np.any(frequencies <= 0):
        raise UsageError(
            f"frequency is {frequency}; expected a positive one, or one for each of the"
            f" {len(sizes)} channels"
        )
    frequencies = np.broadcast_to(frequencies, len(sizes))
    return [
        POLE_PATTERNS[spectrum](n, omega)
        for n, omega in zip(sizes, frequencies.tolist(), strict=True)
    ]


def _noise_gain(
    A: FloatArray, C: FloatArray, poles: ComplexArray | None, W: FloatArray, R: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Compute the gain (n, m) of a channel of known noise, and its poles; `None`: the optimal."""
    if poles is None:
        kalman = kalman_gain(A, np.eye(len(A)), C, W, R)
        return kalman.gain, kalman.poles
    return place_for_noise(A, C, poles, W, R).gain, poles


def _intensities(name: str, values: ArrayLike | None, size: int) -> FloatArray:
    """Check intensities of white noise: (size,), none of them negative."""
    if values is None:
        raise UsageError(f"{name} is missing; the gain depends on its intensities, ({size},)")
    intensities = as_finite_array(name, values)
    if intensities.shape != (size,) or np.any(intensities < 0):
        raise UsageError(
            f"{name} is of shape {intensities.shape}; expected ({size},), none negative"
        )
    return intensities
