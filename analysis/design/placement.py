"""Pole placement for observers of several outputs, and Hautus's test of observability.

Source: Zubov, Mikrin, Oleinik, Ryabchenko, "Algorithms for the synthesis of linear observers for
nonlinear dynamic systems", eqs (2.2) to (2.12). As printed (2.10) places A + L C, (2.7) starts from
A and not its transpose, and the last Φ is m × m; here each is as it must be.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_matrix, as_square_matrix
from .observability import ComplexArray

OBSERVABILITY_TOLERANCE = 1e-10  # smallest singular value of an observable direction
MIN_PARTICIPATION = 1e-6  # a state with a smaller component is not part of a mode
CONJUGATE_TOLERANCE = 1e-9  # relative distance of a pole from its partner's conjugate
CLUSTER_RADIUS = 1e-3  # eigenvalues this near may be one defective one
ROUNDING = 1e-14  # computed size of a singular value that is zero
MODE_TOLERANCE = 1e-8  # modes this near are the same
MAX_POLYNOMIAL_ERROR = 1e-4  # relative, due to rounding


@dataclass(frozen=True)
class UnobservableMode:
    """An eigenvalue that the measurements do not show; of a complex pair the one above."""

    value: complex  # rad/s
    states: tuple[int, ...]  # those that move in it


def place_multilevel(A: ArrayLike, C: ArrayLike, poles: ArrayLike) -> FloatArray:
    """The gain L (n, m) that gives A - L C the poles asked for, each as often as it is asked for.

    A (n, n), C (m, n), poles (n,) real or complex with their conjugates, 1/s. The system is taken
    apart in levels: what C shows, what moves that, and so on; each level is given some of the
    poles, the last level the last ones. A level of odd size that no real pole is left for shares a
    pair with the level above. The gain does not depend on the units of the states. With several
    measurements there are other gains with the same poles: channels that have nothing to do with
    each other are better placed each for itself, else they are coupled.

    Raises `UsageError` for matrices that do not fit, poles that are not n or lack a conjugate, a
    pair (A, C) that is not observable, naming the mode, and where rounding leaves the poles
    somewhere else. Source: Zubov et al., (2.2) to (2.6), after the transposition of (2.7).
    """
    A = as_square_matrix("A", A)
    C = as_matrix("C", C, columns=len(A))
    wanted = checked_poles("poles", poles, len(A))
    hidden = unobservable_modes(A, C)
    if hidden:
        raise UsageError(
            f"A {A.shape} and C {C.shape}: the mode at {format_mode(hidden[0].value)} cannot be"
            " seen in the measurements; measure another state"
        )
    pair = _natural_units(A, C, float(np.abs(wanted).max()))
    L = _placed(pair.A, pair.C, wanted / pair.rate)
    missed = polynomial_error(pair.A - L @ pair.C, wanted / pair.rate)
    if missed > MAX_POLYNOMIAL_ERROR:
        raise UsageError(
            f"poles {wanted.shape}: rounding leaves the characteristic polynomial off by"
            f" {missed:.1g}; A {A.shape} and C {C.shape} hardly show a mode, or are too uneven:"
            " measure more, or take a Kalman gain"
        )
    return pair.rate * pair.units[:, None] * L


def unobservable_modes(A: ArrayLike, C: ArrayLike) -> tuple[UnobservableMode, ...]:
    """The modes of x' = A x that y = C x does not show; none where the pair is observable.

    A (n, n), C (m, n). A mode λ is hidden where [A - λ I; C] has a direction of singular value
    below 1e-10, A and C being scaled to natural units: an inertia of 1e12 hides nothing. Raises
    `UsageError` for matrices that do not fit. Source: Hautus's test, at every eigenvalue.
    """
    A = as_square_matrix("A", A)
    C = as_matrix("C", C, columns=len(A))
    pair = _natural_units(A, C)
    found: list[UnobservableMode] = []
    for mode, shown, directions in _least_visible(pair.A, pair.C):
        new = all(
            abs(mode * pair.rate - known.value) > MODE_TOLERANCE * pair.rate for known in found
        )
        if shown[-1] < OBSERVABILITY_TOLERANCE and mode.imag >= 0 and new:
            moved = np.linalg.norm(directions[shown < OBSERVABILITY_TOLERANCE], axis=0)
            states = tuple(np.flatnonzero(moved > MIN_PARTICIPATION).tolist())
            found.append(UnobservableMode(mode * pair.rate, states))
    return tuple(found)


def _least_visible(
    A: FloatArray, C: FloatArray
) -> Iterator[tuple[complex, FloatArray, ComplexArray]]:
    """At each eigenvalue λ of A: λ, the singular values and the right vectors of [A - λ I; C].

    A multiple eigenvalue is computed to a half of the digits or less, too few for the test, but
    the mean of its computed values to all: of the means with its neighbours the one C shows least.
    """
    eigenvalues = np.linalg.eigvals(A).astype(complex)
    for eigenvalue in eigenvalues:
        away = np.abs(eigenvalues - eigenvalue)
        nearest = eigenvalues[np.argsort(away, kind="stable")][: np.sum(away < CLUSTER_RADIUS)]
        tried: list[tuple[complex, FloatArray, ComplexArray]] = []
        for count in range(1, len(nearest) + 1):
            mean = complex(nearest[:count].mean())
            mode = complex(
                *(
                    part if abs(part) > OBSERVABILITY_TOLERANCE else 0.0
                    for part in (mean.real, mean.imag)
                )
            )
            _, shown, directions = np.linalg.svd(np.vstack((A - mode * np.eye(len(A)), C)))
            tried.append((mode, shown, directions))
        # of those that rounding alone keeps from zero the mean of the most
        yield min(reversed(tried), key=lambda one: max(float(one[1][-1]), ROUNDING))


def format_mode(mode: complex) -> str:
    """A mode as a message says it: a decay rate, or a pair of conjugates, in 1/s."""
    value = complex(mode)
    real = f"{value.real + 0.0:.4g}"
    return real if value.imag == 0 else f"{real} ± {abs(value.imag):.4g}j"


def checked_poles(name: str, poles: ArrayLike, n: int, *, stable: bool = False) -> ComplexArray:
    """`poles` as n finite numbers (n,) that a real matrix can have, conjugates to the bit.

    Raises `UsageError` for another number of them, NaN, one without its conjugate, and where they
    must be stable one that is not.
    """
    try:
        found = np.asarray(poles).astype(np.complex128)
    except (TypeError, ValueError):
        raise UsageError(f"{name} are no numbers; expected ({n},)") from None
    if found.shape != (n,):
        raise UsageError(f"{name} are of shape {found.shape}; expected ({n},), one for each state")
    if not np.isfinite(found).all():
        raise UsageError(f"{name}, {found.shape}, have NaN or infinities; expected finite numbers")
    found.imag[np.abs(found.imag) <= CONJUGATE_TOLERANCE * np.abs(found)] = 0
    lower = list(found[found.imag < 0])
    for pole in found[found.imag > 0]:
        partner = min(lower, key=lambda other: abs(other - pole.conj()), default=np.inf)
        if abs(partner - pole.conj()) > CONJUGATE_TOLERANCE * abs(pole):
            raise UsageError(_alone(name, found, pole))
        lower.remove(partner)
    if lower:
        raise UsageError(_alone(name, found, lower[0]))
    if stable and found.real.max() >= 0:
        raise UsageError(
            f"{name}, {found.shape}, go up to {found.real.max():.4g}; expected negative real parts"
        )
    return found


def _alone(name: str, poles: ComplexArray, pole: complex) -> str:
    return f"{name}, {poles.shape}, have {pole:.4g} without its conjugate; expected both"


def polynomial_error(F: FloatArray, poles: ComplexArray) -> float:
    """How far the characteristic polynomial of F (n, n) is from that of `poles` (n,), relative.

    The largest difference of a coefficient, as a part of what the coefficient is at most for poles
    of those sizes. Poles are no measure: a k-fold one moves by the k-th root of an error.
    """
    sizes = np.where(poles == 0, 1.0, np.abs(poles))
    return float(np.max(np.abs(np.poly(F) - np.poly(poles)) / np.poly(-sizes)))


class _Pair(NamedTuple):
    """A pair whose states are z = x / units and whose time is t · rate: no number beyond one."""

    A: FloatArray
    C: FloatArray
    units: FloatArray
    rate: float


def _natural_units(A: FloatArray, C: FloatArray, fastest: float = 0.0) -> _Pair:
    """The pair in units that do not depend on those it came in.

    A state's unit is such that along the strongest path from it to the measurements every factor is
    one. Time's is the spectral radius of |A|, which lets no path grow by going round; `fastest`,
    1/s, if that is more.
    """
    rate = max(float(np.abs(np.linalg.eigvals(np.abs(A))).max()), fastest) or 1.0
    A = A / rate
    seen = np.abs(C).max(axis=0)
    for _ in range(len(A)):
        seen = np.maximum(seen, (seen[:, None] * np.abs(A)).max(axis=0))
    units = 1 / np.where(seen > 0, seen, 1.0)
    return _Pair(A * units / units[:, None], C * units, units, rate)


class _Level(NamedTuple):
    """The transposed pair (A, B) at a level: B = U V, and N whose rows complete U's columns."""

    A: FloatArray
    U: FloatArray
    V_inverse: FloatArray
    N: FloatArray


def _levels(A: FloatArray, B: FloatArray) -> list[_Level]:
    """The levels of an observable pair, transposed, A (n, n) and B (n, m): (2.2), (2.3), (2.9)."""
    levels = []
    while True:
        left, values, right = np.linalg.svd(B)
        rank = int(np.sum(values > OBSERVABILITY_TOLERANCE))
        U, N = left[:, :rank], left[:, rank:].T
        levels.append(_Level(A, U, right[:rank].T / values[:rank], N))
        if rank == len(A):
            return levels
        if rank == 0:
            raise UsageError(
                f"the mode at {format_mode(np.linalg.eigvals(A)[0])} can hardly be seen in the"
                " measurements; measure another state"
            )
        A, B = N @ A @ N.T, N @ A @ U


class _Share(NamedTuple):
    """The poles of one level."""

    closes: complex | None  # half of a pair, the other half being at the level below
    pairs: Sequence[complex]
    reals: Sequence[float]
    opens: complex | None  # half of a pair, the other half being at the level above


def _shares(sizes: Sequence[int], poles: ComplexArray) -> list[_Share]:
    """The poles of levels of those sizes, the last level first: pairs whole as far as they fit."""
    reals = [float(pole.real) for pole in poles if pole.imag == 0]
    pairs = [complex(pole) for pole in poles if pole.imag > 0]
    shares: list[_Share] = []
    half: complex | None = None
    for size in reversed(sizes):
        closes, half = half, None
        room = size - (closes is not None)
        own = []
        if room % 2:
            if reals:
                own.append(reals.pop())
            else:
                half = pairs.pop()
        whole = [pairs.pop() for _ in range(min(room // 2, len(pairs)))]
        own += [reals.pop() for _ in range(2 * (room // 2 - len(whole)))]
        shares.append(_Share(closes, whole, own, half))
    return shares


def _placed(A: FloatArray, C: FloatArray, poles: ComplexArray) -> FloatArray:
    """L of `place_multilevel`, from the last level up: (2.5), (2.6).

    With T = B⁻, T (A - B K) = Φ T + Ψ N: what T sees moves by Φ, but for a pair that is shared.
    """
    levels = _levels(A.T, C.T)
    K = np.zeros((levels[-1].U.shape[1], 0))
    below = np.zeros(0)
    for level, share in zip(
        reversed(levels), _shares([x.U.shape[1] for x in levels], poles), strict=True
    ):
        T = level.U.T + K @ level.N
        Phi, Psi, half = _dynamics(share, below, below @ level.N @ level.A @ level.U)
        K = level.V_inverse @ (T @ level.A - Phi @ T - Psi @ level.N)
        below = half @ T
    return K.T


def _dynamics(
    share: _Share, below: FloatArray, into_below: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Φ (r, r) and Ψ (r, k) of a level of r states, k below it, and the direction of an open half.

    Half of a pair σ ± jω is a real σ at the level below: `below` (k,) moves by σ, and by
    `into_below` (r,) of this level's states. Given σ along that direction here, and -ω² over its
    length back from below, the two make [σ, g; -ω²/g, σ], whose eigenvalues are σ ± jω.
    """
    r = len(into_below)
    frame, Psi = np.eye(r), np.zeros((r, len(below)))
    blocks = []
    if share.closes is not None:
        frame = np.linalg.qr(into_below[:, None], mode="complete")[0]
        along = frame[:, 0]
        Psi = -np.outer(along, below) * share.closes.imag**2 / (into_below @ along)
        blocks.append(np.array([[share.closes.real]]))
    blocks += [np.array([[p.real, p.imag], [-p.imag, p.real]]) for p in share.pairs]
    blocks += [np.array([[p]]) for p in share.reals]
    if share.opens is not None:
        blocks.append(np.array([[share.opens.real]]))
    return frame @ block_diag(*blocks) @ frame.T, Psi, frame[:, -1]
