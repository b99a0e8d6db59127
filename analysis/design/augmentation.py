"""Exosystems of disturbances, and a plant augmented by them.

A disturbance is the output of an exosystem: a linear system of known modes and unknown state that
generates a constant, a ramp or a wave. Source: "Algorithm of ship course control system watcher
for assessing disturbances and noise measurements", eqs (1) to (3).
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
    """The generator x' = Ac x of a disturbance Cc x: e^{λt} times a polynomial, λ known.

    Attributes
    ----------
    Ac
        (k, k), 1/s.
    Cc
        (1, k).

    Examples
    --------
    A ramp is the output of a double integrator:

    >>> Exosystem.polynomial(1).Ac.tolist()
    [[0.0, 1.0], [0.0, 0.0]]
    """

    Ac: FloatArray
    Cc: FloatArray

    @classmethod
    def polynomial(cls, degree: int) -> Self:
        """Build the exosystem of a constant (degree 0), a ramp (1), a parabola (2), ...

        It has degree + 1 states. Raises `UsageError` as `exponential` does.
        """
        return cls.exponential(0.0, degree)

    @classmethod
    def harmonic(cls, omega: float) -> Self:
        """Build the exosystem of a sinusoid of any amplitude and phase; it has two states.

        `omega` is its frequency, rad/s. Raises `UsageError` unless it is positive.
        """
        return cls.exponential(1j * as_number("omega", omega, least=np.finfo(float).tiny))

    @classmethod
    def exponential(cls, rate: complex, degree: int = 0) -> Self:
        """Build the exosystem of e^{rate t} times a polynomial.

        Parameters
        ----------
        rate
            λ, 1/s; a complex rate σ + jω gives an oscillation of ω rad/s.
        degree
            Degree of the polynomial. The exosystem has degree + 1 states, twice as many for a
            complex rate.

        Raises
        ------
        UsageError
            The rate is not finite, or the degree is not a whole number from zero.
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
    """The plant x' = A x + B u, y = C x, and the names of its states and sensors.

    Attributes
    ----------
    A
        (n, n), 1/s.
    B
        (n, inputs); one column of zeros where there is no input.
    C
        (m, n).
    states
        Names of the n states.
    sensors
        Names of the m sensors.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    states: tuple[str, ...]
    sensors: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class DisturbanceInput:
    """A named disturbance and where it acts: on rates of change of states, on sensors, or both.

    A factor of one on a state makes the disturbance specific (moment over inertia), in the unit of
    that state per second; with the factor 1 / I the disturbance is the moment itself.

    Attributes
    ----------
    name
        Name of the disturbance.
    exosystem
        Its generator.
    on_state
        Factor on the rate of change of each named state: the column of Cf.
    on_sensor
        Factor on each named sensor: the column of Cv.
    """

    name: str
    exosystem: Exosystem
    on_state: Mapping[str, float] = field(default_factory=dict)
    on_sensor: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class AugmentedPlant:
    """Plant and exosystems as one system of N states, eq (3).

    Attributes
    ----------
    A
        (N, N): [A, Cf Cc; 0, Ac].
    B
        (N, inputs): [B; 0].
    C
        (m, N): [C, Cv Cc].
    D
        (k, N): [0, Cc]; the k disturbances are D x.
    names
        Names of the k disturbances.
    states
        Names of the N states.
    disturbance_index
        For each state the index of the disturbance it belongs to; -1 for the plant.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    names: tuple[str, ...]
    states: tuple[str, ...]
    disturbance_index: tuple[int, ...]


def augment_with_disturbances(
    plant: Plant, disturbances: Sequence[DisturbanceInput]
) -> AugmentedPlant:
    """Augment a plant of n states with the exosystems of its disturbances, eq (3).

    The states of the plant come first, then those of each exosystem in turn.

    Raises
    ------
    UsageError
        Matrices do not fit, names are repeated, or a disturbance acts on an unknown state or
        sensor.
    """
    A = as_square_matrix("A", plant.A)
    n = len(A)
    B, C = as_matrix("B", plant.B, rows=n), as_matrix("C", plant.C, columns=n)
    states, names = list(plant.states), tuple(disturbance.name for disturbance in disturbances)
    for kind, given, count in (("states", plant.states, n), ("sensors", plant.sensors, len(C))):
        if len(given) != count or len(set(given)) != count:
            raise UsageError(f"{kind} are {', '.join(given)}; expected {count} different names")
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
    """Return the factors of a disturbance on the named states or sensors, (len(names), 1)."""
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
