"""Pole placement for observers of several outputs, and Hautus's test of observability.

Source: N. E. Zubov, E. A. Mikrin, A. S. Oleinik, V. N. Ryabchenko, "Algorithms for the synthesis
of linear observers for nonlinear dynamic systems", eqs (2.2) to (2.12). Three formulas are
corrected: (2.10) places A + L C instead of A - L C, (2.7) starts from A instead of its transpose
(in our copy, a scan), and the last Φ is printed as m × m.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_matrix, as_square_matrix
from .multilevel import OBSERVABILITY_TOLERANCE, Multilevel, decompose
from .observability import ComplexArray

MIN_PARTICIPATION = 1e-6  # a state with a smaller component is not part of a mode
CONJUGATE_TOLERANCE = 1e-9  # relative distance of a pole from the conjugate of its partner
CLUSTER_RADIUS = 1e-3  # eigenvalues this close may be one multiple eigenvalue
ROUNDING = 1e-14  # a zero singular value is computed up to this size
MODE_TOLERANCE = 1e-8  # modes this close are the same
MAX_POLYNOMIAL_ERROR = 1e-4  # relative, due to rounding


@dataclass(frozen=True)
class UnobservableMode:
    """An eigenvalue of A that the measurements do not show.

    Attributes
    ----------
    value
        The eigenvalue, 1/s; of a complex pair the one with positive imaginary part, rad/s.
    states
        Indices of the states with a component in the mode.
    """

    value: complex
    states: tuple[int, ...]


def place_multilevel(A: ArrayLike, C: ArrayLike, poles: ArrayLike) -> FloatArray:
    """Compute the observer gain L that gives A - L C the requested poles.

    The system is decomposed into levels: the states that C measures, the states that drive these,
    and so on. Each level is assigned some of the poles, the last level the last ones. A level of
    odd size for which no real pole remains shares a complex pair with the level above. Poles may be
    repeated as often as wanted, and the gain does not depend on the units of the states.

    With several measurements other gains give the same poles, many of them with far less noise:
    where the noise is known, use `place_for_noise`. Uncoupled channels should be placed one by one;
    placed together by this function they become coupled.

    Parameters
    ----------
    A
        (n, n), 1/s.
    C
        (m, n): y = C x.
    poles
        (n,), 1/s: real, or complex with their conjugates.

    Returns
    -------
    FloatArray
        L, (n, m).

    Raises
    ------
    UsageError
        The matrices do not fit; the poles are not n or lack a conjugate; (A, C) is not observable
        (the message names the mode); or rounding moves the poles.

    References
    ----------
    Zubov et al., (2.2) to (2.6), after the transposition of (2.7).

    Examples
    --------
    An observer of a double integrator with both poles at -1 1/s:

    >>> place_multilevel([[0, 1], [0, 0]], [[1, 0]], [-1, -1]).round(6).tolist()
    [[2.0], [1.0]]
    """
    return placements(A, C, poles).plain()


@dataclass(frozen=True, eq=False)
class Placements:
    """All gains that multi-level placement finds for a pair (A, C) and its poles.

    Attributes
    ----------
    A, C
        The pair in natural units.
    units
        (n,): the states are `units` times those of A and C.
    rate
        1/s: A, the poles and the gain in natural units are those in 1/s over `rate`.
    poles
        (n,), in natural units.
    levels
        The decomposition of the pair.
    """

    A: FloatArray
    C: FloatArray
    units: FloatArray
    rate: float
    poles: ComplexArray
    levels: Multilevel

    def plain(self) -> FloatArray:
        """Return the gain (n, m) whose free numbers are zero; raise `UsageError` as `placed`."""
        return self.placed(self.levels.gain(np.zeros(self.levels.freedom)))

    def placed(self, L: FloatArray) -> FloatArray:
        """Convert a gain (n, m) from natural units; raise `UsageError` where its poles moved."""
        error = polynomial_error(self.A - L @ self.C, self.poles)
        if error > MAX_POLYNOMIAL_ERROR:
            raise UsageError(
                f"poles {self.poles.shape}: rounding changes the characteristic polynomial by a"
                f" relative {error:.1g}; with A {self.A.shape} and C {self.C.shape} a mode is"
                " almost unobservable or the scales differ too much: measure more states, or use a"
                " Kalman gain"
            )
        return self.rate * self.units[:, None] * L


def placements(A: ArrayLike, C: ArrayLike, poles: ArrayLike) -> Placements:
    """Decompose an observable pair for `place_multilevel`, with its parameters and errors."""
    A = as_square_matrix("A", A)
    C = as_matrix("C", C, columns=len(A))
    requested = checked_poles("poles", poles, len(A))
    unobservable = unobservable_modes(A, C)
    if unobservable:
        raise UsageError(
            f"A {A.shape} and C {C.shape}: the mode at {format_mode(unobservable[0].value)}"
            " cannot be seen in the measurements; measure another state"
        )
    pair = _natural_units(A, C, float(np.abs(requested).max()))
    requested = requested / pair.rate
    levels = decompose(pair.A, pair.C, requested)
    return Placements(pair.A, pair.C, pair.units, pair.rate, requested, levels)


def unobservable_modes(A: ArrayLike, C: ArrayLike) -> tuple[UnobservableMode, ...]:
    """Compute the modes of x' = A x that y = C x does not show, by Hautus's test.

    A mode λ is unobservable where [A - λ I; C] has a singular value below 1e-10, with A and C
    scaled to natural units: a large inertia (such as 1e12) does not make a mode unobservable.

    Parameters
    ----------
    A
        (n, n), 1/s.
    C
        (m, n).

    Returns
    -------
    tuple of UnobservableMode
        Empty where the pair is observable.

    Raises
    ------
    UsageError
        The matrices do not fit.

    Examples
    --------
    The rate of a double integrator is measured, its position is not:

    >>> unobservable_modes([[0, 1], [0, 0]], [[0, 1]])
    (UnobservableMode(value=0j, states=(0,)),)
    """
    A = as_square_matrix("A", A)
    C = as_matrix("C", C, columns=len(A))
    pair = _natural_units(A, C)
    modes: list[UnobservableMode] = []
    for mode, values, directions in _least_visible(pair.A, pair.C):
        new = all(
            abs(mode * pair.rate - earlier.value) > MODE_TOLERANCE * pair.rate for earlier in modes
        )
        if values[-1] < OBSERVABILITY_TOLERANCE and mode.imag >= 0 and new:
            components = np.linalg.norm(directions[values < OBSERVABILITY_TOLERANCE], axis=0)
            states = tuple(np.flatnonzero(components > MIN_PARTICIPATION).tolist())
            modes.append(UnobservableMode(mode * pair.rate, states))
    return tuple(modes)


def _least_visible(
    A: FloatArray, C: FloatArray
) -> Iterator[tuple[complex, FloatArray, ComplexArray]]:
    """Yield each eigenvalue λ of A, the singular values and right vectors of [A - λ I; C].

    A multiple eigenvalue is computed to half of the digits or less, too few for the test, but the
    mean of its computed values to all digits. Of the means with the neighbouring eigenvalues the
    one with the smallest singular value is taken.
    """
    eigenvalues = np.linalg.eigvals(A).astype(complex)
    for eigenvalue in eigenvalues:
        distance = np.abs(eigenvalues - eigenvalue)
        order = np.argsort(distance, kind="stable")
        nearest = eigenvalues[order][: np.sum(distance < CLUSTER_RADIUS)]
        candidates: list[tuple[complex, FloatArray, ComplexArray]] = []
        for count in range(1, len(nearest) + 1):
            mean = complex(nearest[:count].mean())
            mode = complex(
                *(
                    part if abs(part) > OBSERVABILITY_TOLERANCE else 0.0
                    for part in (mean.real, mean.imag)
                )
            )
            _, values, directions = np.linalg.svd(np.vstack((A - mode * np.eye(len(A)), C)))
            candidates.append((mode, values, directions))
        # among candidates that are zero up to rounding, the mean over the most eigenvalues
        yield min(reversed(candidates), key=lambda item: max(float(item[1][-1]), ROUNDING))


def format_mode(mode: complex) -> str:
    """Format a mode for a message: a decay rate, or a conjugate pair a ± bj, in 1/s."""
    value = complex(mode)
    real = f"{value.real + 0.0:.4g}"
    return real if value.imag == 0 else f"{real} ± {abs(value.imag):.4g}j"


def checked_poles(name: str, poles: ArrayLike, n: int, *, stable: bool = False) -> ComplexArray:
    """Convert `poles` to n finite numbers (n,), complex pairs being exact conjugates.

    Parameters
    ----------
    name
        Name of the argument, for error messages.
    poles
        (n,), 1/s.
    n
        Required number of poles.
    stable
        Reject poles whose real part is not negative.

    Raises
    ------
    UsageError
        The number of poles is not n, a pole is NaN or infinite, has no conjugate, or is not stable.
    """
    try:
        checked = np.asarray(poles).astype(np.complex128)
    except (TypeError, ValueError):
        raise UsageError(f"{name} are not numbers; expected ({n},)") from None
    if checked.shape != (n,):
        raise UsageError(
            f"{name} are of shape {checked.shape}; expected ({n},), one for each state"
        )
    if not np.isfinite(checked).all():
        raise UsageError(
            f"{name}, {checked.shape}, have NaN or infinities; expected finite numbers"
        )
    checked.imag[np.abs(checked.imag) <= CONJUGATE_TOLERANCE * np.abs(checked)] = 0
    lower = list(checked[checked.imag < 0])
    for pole in checked[checked.imag > 0]:
        partner = min(lower, key=lambda other: abs(other - pole.conj()), default=np.inf)
        if abs(partner - pole.conj()) > CONJUGATE_TOLERANCE * abs(pole):
            raise UsageError(_alone(name, checked, pole))
        lower.remove(partner)
    if lower:
        raise UsageError(_alone(name, checked, lower[0]))
    if stable and checked.real.max() >= 0:
        raise UsageError(
            f"{name}, {checked.shape}, go up to {checked.real.max():.4g}; expected"
            " negative real parts"
        )
    return checked


def _alone(name: str, poles: ComplexArray, pole: complex) -> str:
    """Return the message for a pole without its conjugate."""
    return f"{name}, {poles.shape}, have {pole:.4g} without its conjugate; expected both"


def polynomial_error(F: FloatArray, poles: ComplexArray) -> float:
    """Compute the relative difference of the characteristic polynomials of F and of `poles`.

    The largest difference of a coefficient, relative to the largest value this coefficient can have
    for poles of these magnitudes. The poles themselves are no measure: a k-fold pole moves by the
    k-th root of an error.

    Parameters
    ----------
    F
        (n, n).
    poles
        (n,).
    """
    sizes = np.where(poles == 0, 1.0, np.abs(poles))
    return float(np.max(np.abs(np.poly(F) - np.poly(poles)) / np.poly(-sizes)))


class _Pair(NamedTuple):
    """A pair (A, C) in the states z = x / units and the time t · rate; no entry exceeds one."""

    A: FloatArray
    C: FloatArray
    units: FloatArray
    rate: float


def _natural_units(A: FloatArray, C: FloatArray, fastest: float = 0.0) -> _Pair:
    """Scale a pair to units that do not depend on those it came in.

    The unit of a state is such that along the strongest path from it to the measurements every
    factor is one. The unit of time is the spectral radius of |A|, so that no closed path has a gain
    above one, or `fastest` (1/s) if that is larger.
    """
    rate = max(float(np.abs(np.linalg.eigvals(np.abs(A))).max()), fastest) or 1.0
    A = A / rate
    visibility = np.abs(C).max(axis=0)
    for _ in range(len(A)):
        visibility = np.maximum(visibility, (visibility[:, None] * np.abs(A)).max(axis=0))
    units = 1 / np.where(visibility > 0, visibility, 1.0)
    return _Pair(A * units / units[:, None], C * units, units, rate)
