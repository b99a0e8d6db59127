"""The disturbance observer's design: plant and environment as one system, and a gain for it.

A disturbance is what an exosystem puts out, a linear system of known modes and unknown state:
a constant, a ramp, a wave. Source: "Algorithm of ship course control system watcher for assessing
disturbances and noise measurements", eqs (1) to (4). Its "binomial" filtering is Butterworth's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag
from scipy.sparse.csgraph import connected_components

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .arguments import finite, matrix, number, square
from .observability import ComplexArray
from .observer import butterworth_poles
from .placement import HiddenMode, hautus, named, place_multilevel, self_conjugate
from .riccati import kalman_gain

SAME_MODE = 1e-6  # relative: what counts as one mode before and after a sensor is added


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
        return cls.exponential(1j * number("omega", omega, least=np.finfo(float).tiny))

    @classmethod
    def exponential(cls, rate: complex, degree: int = 0) -> Self:
        """e^{rate t} times a polynomial; `rate` in 1/s, k = degree + 1, or twice that if complex.

        Raises `UsageError` for a rate that is not finite and a degree that is no whole number from
        zero.
        """
        if degree != int(degree) or degree < 0:
            raise UsageError(f"degree is {degree}; expected a whole number from 0")
        rate = complex(rate)
        sigma, omega = finite("rate", [rate.real, rate.imag])
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
class Influence:
    """A disturbance by name, and where it acts: on states' rates of change, on sensors, or both.

    A factor of one on a state makes the disturbance specific (a moment over the inertia), in the
    unit of that state per second; 1 / I makes it the moment itself.
    """

    name: str
    exosystem: Exosystem
    on_state: Mapping[str, float] = field(default_factory=dict)  # the column of Cf
    on_sensor: Mapping[str, float] = field(default_factory=dict)  # the column of Cv


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


@dataclass(frozen=True)
class Clash:
    """A mode that the sensors do not show, what takes part in it and what would show it."""

    mode: complex  # 1/s; of a complex pair the one above
    disturbances: tuple[str, ...]
    states: tuple[str, ...]  # of the plant
    cures: tuple[str, ...]  # measurements, any one of which would do

    def __str__(self) -> str:
        who = " and ".join(repr(name) for name in self.disturbances)
        if len(self.disturbances) == 1 and self.states:
            who += " and the state " + " and ".join(repr(name) for name in self.states)
        elif not self.disturbances:
            who = "the state " + " and ".join(repr(name) for name in self.states)
        verb = "cannot be told apart" if " and " in who else "cannot be seen"
        remedy = f"measure {', or '.join(self.cures)}" if self.cures else "leave some of them out"
        return f"at the mode {named(self.mode)} {who} {verb}; {remedy}"


def disturbance_observer(
    plant: Plant,
    influences: Sequence[Influence],
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
    sensors cannot tell apart, naming them, their mode and a measurement that would: constant
    moment and constant gyro bias, say. Source: the disturbance observer's paper, (3) and (4).
    """
    system = _augmented(plant, influences)
    hidden = _clashes(system)
    if hidden:
        raise UsageError("; ".join(str(clash) for clash in hidden))
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


def clashes(plant: Plant, influences: Sequence[Influence]) -> tuple[Clash, ...]:
    """What the plant's sensors cannot tell apart; empty where `disturbance_observer` has a gain.

    Hautus's test of plant and exosystems together. Raises `UsageError` for what does not fit.
    """
    return _clashes(_augmented(plant, influences))


@dataclass(frozen=True, eq=False)
class _System:
    """Plant and exosystems as one: eq (3)."""

    A: FloatArray  # [A, Cf; 0, Ac]
    B: FloatArray  # [B; 0]
    C: FloatArray  # [C, Cv]
    D: FloatArray  # [0, Cc]
    names: tuple[str, ...]
    states: tuple[str, ...]
    owners: tuple[int, ...]  # of each state the influence, -1 being the plant


def _augmented(plant: Plant, influences: Sequence[Influence]) -> _System:
    A = square("A", plant.A)
    n = len(A)
    B, C = matrix("B", plant.B, rows=n), matrix("C", plant.C, columns=n)
    states, names = list(plant.states), tuple(influence.name for influence in influences)
    for what, given, count in (("states", plant.states, n), ("sensors", plant.sensors, len(C))):
        if len(given) != count or len(set(given)) != count:
            raise UsageError(f"{what} are {', '.join(given)}; expected {count} different names")
    if len(set(names)) != len(names):
        raise UsageError(f"disturbances are {', '.join(names)}; expected different names")
    D, owners = np.zeros((0, n)), [-1] * n
    for k, influence in enumerate(influences):
        Ac = square(f"Ac of {influence.name!r}", influence.exosystem.Ac)
        Cc = matrix(f"Cc of {influence.name!r}", influence.exosystem.Cc, 1, len(Ac))
        Cf = _column(influence.name, influence.on_state, "state", plant.states) @ Cc
        Cv = _column(influence.name, influence.on_sensor, "sensor", plant.sensors) @ Cc
        below = np.zeros((len(A) - n, len(Ac)))
        A = np.block([[A, np.vstack((Cf, below))], [np.zeros((len(Ac), len(A))), Ac]])
        C, D = np.hstack((C, Cv)), block_diag(D, Cc)
        states += [f"{influence.name}[{i}]" for i in range(len(Ac))]
        owners += [k] * len(Ac)
    B = np.vstack((B, np.zeros((len(A) - n, B.shape[1]))))
    return _System(A, B, C, D, names, tuple(states), tuple(owners))


def _column(name: str, factors: Mapping[str, float], kind: str, names: Sequence[str]) -> FloatArray:
    """The factors of a disturbance on the plant's states or sensors, (count, 1)."""
    column = np.zeros((len(names), 1))
    for target, factor in factors.items():
        if target not in names:
            raise UsageError(
                f"{name!r} acts on the {kind} {target!r}; the plant has {', '.join(names)}"
            )
        column[names.index(target)] = float(finite(f"factor of {name!r} on {target!r}", factor))
    return column


def _clashes(system: _System) -> tuple[Clash, ...]:
    return tuple(_clash(system, mode) for mode in hautus(system.A, system.C))


def _clash(system: _System, mode: HiddenMode) -> Clash:
    """Who is in a hidden mode, and what shows it: a state, a state's integral, a disturbance."""
    owners = sorted({system.owners[i] for i in mode.states} - {-1})
    plant = [i for i in mode.states if system.owners[i] == -1]
    cures = []
    for i in plant:
        if _shows(system, np.eye(1, len(system.A), i), mode.value):
            cures.append(f"{system.states[i]!r} by a sensor of its own")
        if _is_rate(system, i) and _shows_integral(system, i, mode.value):
            cures.append(f"the integral of {system.states[i]!r}")
    if not cures:
        itself = [k for k in owners if _shows(system, system.D[[k]], mode.value)]
        cures = [f"{system.names[k]!r} itself" for k in itself]
    return Clash(
        mode.value,
        tuple(system.names[k] for k in owners),
        tuple(system.states[i] for i in plant),
        tuple(cures),
    )


def _shows(system: _System, row: FloatArray, mode: complex) -> bool:
    """Whether a mode is hidden no longer once `row` (1, N) is measured too."""
    return not _hides(system.A, np.vstack((system.C, row)), mode)


def _shows_integral(system: _System, i: int, mode: complex) -> bool:
    """Whether a mode is hidden no longer once the integral of state i is measured too."""
    A = np.block([[system.A, np.zeros((len(system.A), 1))], [np.eye(1, len(system.A), i), 0.0]])
    return not _hides(A, block_diag(system.C, np.eye(1)), mode)


def _hides(A: FloatArray, C: FloatArray, mode: complex) -> bool:
    return any(np.isclose(mode, left.value, rtol=SAME_MODE, atol=1e-9) for left in hautus(A, C))


def _is_rate(system: _System, i: int) -> bool:
    """Whether a state of the plant is no integral of others: nobody measures that of a heading."""
    row = system.A[i, : system.owners.count(-1)]
    return bool(row[i]) or not row.any()


def _channels(system: _System) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
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
            self_conjugate(f"spectrum of channel {k}", part, len(part), stable=True)
            for k, part in enumerate(parts, 1)
        ]
    if spectrum not in ("butterworth", "binomial", "kalman"):
        raise UsageError(
            f"spectrum is {spectrum!r}; expected butterworth, binomial, kalman or poles"
        )
    if spectrum == "kalman":
        return None
    if frequency is None:
        raise UsageError(f"frequency is missing; {spectrum} poles need one in rad/s")
    each = finite("frequency", frequency)
    if each.shape not in ((), (len(sizes),)) or np.any(each <= 0):
        raise UsageError(
            f"frequency is {frequency}; expected a positive one, or one for each of the"
            f" {len(sizes)} channels"
        )
    both = list(zip(sizes, np.broadcast_to(each, len(sizes)).tolist(), strict=True))
    if spectrum == "binomial":
        return [np.full(size, -omega + 0j) for size, omega in both]
    return [butterworth_poles(size, omega).astype(complex) for size, omega in both]


def _intensities(name: str, values: ArrayLike | None, count: int) -> FloatArray:
    """Intensities of white noise, (count,), none of them negative."""
    if values is None:
        raise UsageError(f"{name} is missing; kalman needs its intensities, ({count},)")
    found = finite(name, values)
    if found.shape != (count,) or np.any(found < 0):
        raise UsageError(f"{name} is of shape {found.shape}; expected ({count},), none negative")
    return found
