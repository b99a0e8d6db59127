"""Exosystems of disturbances, and a plant augmented by them.

A disturbance is what an exosystem puts out, a linear system of known modes and unknown state:
a constant, a ramp, a wave. Source: "Algorithm of ship course control system watcher for assessing
disturbances and noise measurements", eqs (1) to (3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from scipy.linalg import block_diag

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_finite_array, as_matrix, as_number, as_square_matrix


@dataclass(frozen=True, eq=False)
class Exosystem:
    """x' = Ac x, of which the disturbance is Cc x: e^{λt} times a polynomial, λ known."""

    Ac: FloatArray  # (k, k), 1/s
    Cc: FloatArray  # (1, k)

    @classmethod
    def polynomial(cls, degree: int) -> Self:
        """A constant (0), a ramp (1), a parabola (2), ...; k = degree + 1."""
        return cls.exponential(0.0, degree)

    @classmethod
    def harmonic(cls, omega: float) -> Self:
        """A sinusoid of any amplitude and phase, `omega` in rad/s; its state turns, k = 2."""
        return cls.exponential(1j * as_number("omega", omega, least=np.finfo(float).tiny))

    @classmethod
    def exponential(cls, rate: complex, degree: int = 0) -> Self:
        """e^{rate t} times a polynomial; `rate` in 1/s, k = degree + 1, or twice that if complex.

        Raises `UsageError` for a rate that is not finite and a degree that is no whole number from
        zero.
        """
        if degree != int(degree) or degree < 0:
            raise UsageError(f"degree is {degree}; expected a whole number from 0")
        rate = complex(rate)
        sigma, omega = as_finite_array("rate", [rate.real, rate.imag])
        block = np.array([[sigma, omega], [-omega, sigma]]) if omega else np.array([[sigma]])
        count, size = int(degree) + 1, len(block)
        Ac = np.kron(np.eye(count), block) + np.kron(np.eye(count, k=1), np.eye(size))
        return cls(Ac, np.eye(1, len(Ac)))


@dataclass(frozen=True, eq=False)
class Plant:
    """x' = A x + B u, y = C x, and what its states and sensors are called."""

    A: FloatArray  # (n, n)
    B: FloatArray  # (n, inputs), a column of zeros where there are none
    C: FloatArray  # (m, n)
    states: tuple[str, ...]
    sensors: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class DisturbanceInput:
    """A disturbance by name, and where it acts: on states' rates of change, on sensors, or both.

    A factor of one on a state makes the disturbance specific (a moment over the inertia), in the
    unit of that state per second; 1 / I makes it the moment itself.
    """

    name: str
    exosystem: Exosystem
    on_state: Mapping[str, float] = field(default_factory=dict)  # the column of Cf
    on_sensor: Mapping[str, float] = field(default_factory=dict)  # the column of Cv


@dataclass(frozen=True, eq=False)
class AugmentedPlant:
    """Plant and exosystems as one: eq (3)."""

    A: FloatArray  # [A, Cf; 0, Ac]
    B: FloatArray  # [B; 0]
    C: FloatArray  # [C, Cv]
    D: FloatArray  # [0, Cc]
    names: tuple[str, ...]
    states: tuple[str, ...]
    disturbance_index: tuple[int, ...]  # of each state the influence, -1 being the plant


def augment_with_disturbances(
    plant: Plant, disturbances: Sequence[DisturbanceInput]
) -> AugmentedPlant:
    """Plant, n states, and exosystems as one system; raises `UsageError` for what does not fit."""
    A = as_square_matrix("A", plant.A)
    n = len(A)
    B, C = as_matrix("B", plant.B, rows=n), as_matrix("C", plant.C, columns=n)
    states, names = list(plant.states), tuple(disturbance.name for disturbance in disturbances)
    for what, given, count in (("states", plant.states, n), ("sensors", plant.sensors, len(C))):
        if len(given) != count or len(set(given)) != count:
            raise UsageError(f"{what} are {', '.join(given)}; expected {count} different names")
    if len(set(names)) != len(names):
        raise UsageError(f"disturbances are {', '.join(names)}; expected different names")
    D, disturbance_index = np.zeros((0, n)), [-1] * n
    for k, disturbance in enumerate(disturbances):
        Ac = as_square_matrix(f"Ac of {disturbance.name!r}", disturbance.exosystem.Ac)
        Cc = as_matrix(f"Cc of {disturbance.name!r}", disturbance.exosystem.Cc, 1, len(Ac))
        Cf = _column(disturbance.name, disturbance.on_state, "state", plant.states) @ Cc
        Cv = _column(disturbance.name, disturbance.on_sensor, "sensor", plant.sensors) @ Cc
        below = np.zeros((len(A) - n, len(Ac)))
        A = np.block([[A, np.vstack((Cf, below))], [np.zeros((len(Ac), len(A))), Ac]])
        C, D = np.hstack((C, Cv)), block_diag(D, Cc)
        states += [f"{disturbance.name}[{i}]" for i in range(len(Ac))]
        disturbance_index += [k] * len(Ac)
    B = np.vstack((B, np.zeros((len(A) - n, B.shape[1]))))
    return AugmentedPlant(A, B, C, D, names, tuple(states), tuple(disturbance_index))


def _column(name: str, factors: Mapping[str, float], kind: str, names: Sequence[str]) -> FloatArray:
    """The factors of a disturbance on the plant's states or sensors, (count, 1)."""
    column = np.zeros((len(names), 1))
    for target, factor in factors.items():
        if target not in names:
            raise UsageError(
                f"{name!r} acts on the {kind} {target!r}; the plant has {', '.join(names)}"
            )
        column[names.index(target)] = float(
            as_finite_array(f"factor of {name!r} on {target!r}", factor)
        )
    return column
