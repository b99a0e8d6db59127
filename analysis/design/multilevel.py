"""The levels of multi-level pole placement, and every gain that places the poles by them.

Source: Zubov, Mikrin, Oleinik, Ryabchenko, "Algorithms for the synthesis of linear observers for
nonlinear dynamic systems", (2.2) to (2.9). The poles fix the spectrum of each Φ_k of the paper; its
other numbers, and the part of K_k that V_k does not see, are free.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .observability import ComplexArray, format_eigenvalue

OBSERVABILITY_TOLERANCE = 1e-10  # smallest singular value of an observable direction


class _Level(NamedTuple):
    """The transposed pair (A, B) at a level: B = U V, N's rows complete U's columns, V V0 = 0."""

    A: FloatArray
    U: FloatArray
    V_inverse: FloatArray
    V0: FloatArray
    N: FloatArray


class _Share(NamedTuple):
    """The poles of one level.

    Attributes
    ----------
    closes
        Half of a pair whose other half is at the level below.
    pairs
        Complex pairs, each given by one pole.
    reals
        Real poles.
    opens
        Half of a pair whose other half is at the level above.
    """

    closes: complex | None
    pairs: Sequence[complex]
    reals: Sequence[float]
    opens: complex | None


class _Freedom(NamedTuple):
    """The free numbers of one level, with any leading axes; zero in `place_multilevel`.

    Attributes
    ----------
    rotation
        Φ's Schur vectors, by Cayley's transform of a skew matrix.
    coupling
        The entries of Φ's Schur form beside its blocks.
    stretch
        For each pair the logarithm of the ratio of its two axes.
    direction
        Into which states, besides that of a shared pair, the feedback from the level below goes.
    hidden
        The part of K that V does not see.
    """

    rotation: FloatArray
    coupling: FloatArray
    stretch: FloatArray
    direction: FloatArray
    hidden: FloatArray


class _Placed(NamedTuple):
    """A level with its poles.

    Attributes
    ----------
    level, share
        The level and its poles.
    couplings
        (r, r): the entries of Φ's Schur form that can be anything without moving a pole.
    counts
        Of the free numbers, in the order of `_Freedom`.
    """

    level: _Level
    share: _Share
    couplings: NDArray[np.bool_]
    counts: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Multilevel:
    """The levels of an observable pair (A, C) with their poles, that of the last states first."""

    placed: Sequence[_Placed]

    @property
    def freedom(self) -> int:
        """How many numbers the poles leave free: n (m - 1), fewer where a pair is split."""
        return sum(sum(placed.counts) for placed in self.placed)

    def mirrored(self, which: int) -> "Multilevel":
        """Return the levels with a pair turned the other way, at those set in the bits of `which`.

        The states of a pair turn one way or the other, and no rotation maps one on the other where
        a level has no real pole: the free numbers reach the gains of one way only.
        """
        placed, bit = [], 0
        for level in self.placed:
            share = level.share
            if len(share.pairs) * 2 == len(level.couplings):
                if which >> bit & 1:
                    pairs = [share.pairs[0].conjugate(), *share.pairs[1:]]
                    level = level._replace(share=share._replace(pairs=pairs))  # noqa: PLW2901
                bit += 1
            placed.append(level)
        return Multilevel(placed)

    def gain(self, free: FloatArray) -> FloatArray:
        """Compute the gain L of A - L C from the last level up, (2.5) and (2.6).

        With T = B⁻, T (A - B K) = Φ T + Ψ N: the states T x follow Φ, and Ψ is zero except for a
        pair that two levels share. The poles are exact whatever the free numbers are.

        Parameters
        ----------
        free
            (..., freedom).

        Returns
        -------
        FloatArray
            L, (..., n, m).
        """
        batch = free.shape[:-1]
        K, below = np.zeros((*batch, self.placed[0].level.U.shape[1], 0)), np.zeros((*batch, 0))
        start = 0
        for placed in self.placed:
            level = placed.level
            edges = [*accumulate(placed.counts, initial=start)]
            freedom = _Freedom(*(free[..., i:j] for i, j in pairwise(edges)))
            start = edges[-1]
            T = level.U.T + K @ level.N
            Phi, Psi, half = _dynamics(placed, freedom, below, below @ level.N @ level.A @ level.U)
            hidden = freedom.hidden.reshape(*batch, level.V0.shape[1], len(level.A))
            K = level.V_inverse @ (T @ level.A - Phi @ T - Psi @ level.N) + level.V0 @ hidden
            below = (half[..., None, :] @ T)[..., 0, :]
        return np.swapaxes(K, -1, -2)


def decompose(A: FloatArray, C: FloatArray, poles: ComplexArray) -> Multilevel:
    """Decompose an observable pair A (n, n), C (m, n), and distribute n poles over its levels.

    Raises
    ------
    UsageError
        A mode is almost unobservable.
    """
    levels = _levels(A.T, C.T)
    shares = _shares([level.U.shape[1] for level in levels], poles)
    return Multilevel([_with_poles(*pair) for pair in zip(levels[::-1], shares, strict=True)])


def _with_poles(level: _Level, share: _Share) -> _Placed:
    """Count the free numbers of a level.

    The order of Φ's Schur form is: a closing half, pairs, real poles, an opening half. Both halves
    may drive the others, which drive neither: else the halves would not be those of a pair.
    """
    r, closes, opens = level.U.shape[1], share.closes is not None, share.opens is not None
    couplings = np.triu(np.ones((r, r), np.bool_), 1)
    for i in range(closes, closes + 2 * len(share.pairs), 2):
        couplings[i, i + 1] = False
    if closes:
        couplings[0] = False
        couplings[1 : r - opens, 0] = True
    turned = r - closes  # the direction of a closing half is given
    counts = (
        turned * (turned - 1) // 2,
        int(couplings.sum()),
        len(share.pairs),
        turned - opens if closes else 0,
        level.V0.shape[1] * len(level.A),
    )
    return _Placed(level, share, couplings, counts)


def _levels(A: FloatArray, B: FloatArray) -> list[_Level]:
    """Decompose an observable pair, transposed, A (n, n), B (n, m): (2.2), (2.3), (2.9)."""
    levels = []
    while True:
        left, values, right = np.linalg.svd(B)
        rank = int(np.sum(values > OBSERVABILITY_TOLERANCE))
        U, N = left[:, :rank], left[:, rank:].T
        V_inverse, V0 = right[:rank].T / values[:rank], right[rank:].T
        levels.append(_Level(A, U, V_inverse, V0, N))
        if rank == len(A):
            return levels
        if rank == 0:
            raise UsageError(
                f"the mode at {format_eigenvalue(np.linalg.eigvals(A)[0])} is almost unobservable"
                " from the measurements; measure another state"
            )
        A, B = N @ A @ N.T, N @ A @ U


def _shares(sizes: Sequence[int], poles: ComplexArray) -> list[_Share]:
    """Distribute the poles over levels of these sizes, last level first; split few pairs."""
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


def _dynamics(
    placed: _Placed, freedom: _Freedom, below: FloatArray, into_below: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute Φ (..., r, r), Ψ (..., r, k) and the direction (..., r) of an open half.

    Half of a pair σ ± jω is a real σ at the level below, where the coordinate `below` (..., k) has
    the dynamics σ and is driven by `into_below` (..., r) from the states of this level. With σ
    along that direction here and the feedback -ω² over its length from below, the two form
    [σ, g; -ω²/g, σ], whose eigenvalues are σ ± jω.
    """
    share, batch, r = placed.share, into_below.shape[:-1], into_below.shape[-1]
    first = int(share.closes is not None)
    frame, Psi = _rotation(freedom.rotation, r - first), np.zeros((*batch, r, below.shape[-1]))
    M = np.zeros((*batch, r, r))
    M[..., placed.couplings] = freedom.coupling
    if share.closes is not None:
        M[..., 0, 0] = share.closes.real
        turned = np.zeros((*batch, r, r))
        turned[..., 0, 0], turned[..., 1:, 1:] = 1.0, frame
        frame = _reflection(into_below) @ turned
        ahead = np.zeros((*batch, r))
        ahead[..., 0], ahead[..., 1 : 1 + freedom.direction.shape[-1]] = 1.0, freedom.direction
        g = (into_below[..., None, :] @ frame)[..., 0, :1]
        feedback = (frame @ ahead[..., None])[..., 0] * share.closes.imag**2 / g
        Psi = -feedback[..., :, None] * below[..., None, :]
    for k, pole in enumerate(share.pairs):
        i, ratio = first + 2 * k, np.exp(freedom.stretch[..., k])
        M[..., i, i] = M[..., i + 1, i + 1] = pole.real
        M[..., i, i + 1], M[..., i + 1, i] = pole.imag * ratio, -pole.imag / ratio
    ends = [*share.reals, *([share.opens.real] if share.opens is not None else [])]
    for i, value in enumerate(ends, r - len(ends)):
        M[..., i, i] = value
    return frame @ M @ np.swapaxes(frame, -1, -2), Psi, frame[..., -1]


def _rotation(skew: FloatArray, r: int) -> FloatArray:
    """Return the rotation (..., r, r) of r (r - 1) / 2 numbers: Cayley's transform."""
    S = np.zeros((*skew.shape[:-1], r, r))
    S[..., *_above_diagonal(r)] = skew
    S = S - np.swapaxes(S, -1, -2)
    rotation: FloatArray = np.linalg.solve(np.eye(r) + S, np.eye(r) - S)
    return rotation


@cache
def _above_diagonal(r: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.triu_indices(r, 1)


def _reflection(v: FloatArray) -> FloatArray:
    """Return the reflection (..., r, r) that maps the first axis on the line of v (..., r)."""
    length = np.linalg.norm(v, axis=-1)
    normal = v.copy()
    normal[..., 0] += np.copysign(length, v[..., 0])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.eye(v.shape[-1]) - 2 * normal[..., :, None] * normal[..., None, :]
