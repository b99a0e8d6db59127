"""Many small triangular systems at once: brought together, scaled, solved, and their condition.

The last axis of every array is the system, and every innermost loop runs along it, so that the
processor takes several at once. What becomes of one does not depend on the others.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray

TINY = 1e-290  # a sum of squares below this is none: the quotients of such are no rotations
MIN_RELATIVE_STEP = 4e-16  # of a step of Laguerre's method, beyond which there is none
MAX_FINITE_CONDITION = 2.0**52  # a condition that the arithmetic cannot tell from an infinite one
MAX_STEPS = 100  # it takes five; some thirty where eigenvalues meet


class BatchSolutions(NamedTuple):
    """Least squares of k systems."""

    values: FloatArray  # (p, k), zero for a column that is zero throughout
    conditions: FloatArray  # (k,) 2-norm, of the columns scaled to unit length; inf if singular
    inflations: FloatArray  # (p, k) how much less sure for what the other columns can do; or zero
    inverses: FloatArray  # (p, p, k) of X'X, with zeros for the columns that are zero throughout


def allocate_solutions(k: int, p: int) -> BatchSolutions:
    """Room for those of `k` systems of `p` columns."""
    return BatchSolutions(np.empty((p, k)), np.empty(k), np.empty((p, k)), np.empty((p, p, k)))


def solve_single(factor: FloatArray) -> BatchSolutions:
    """One system [R Q'y] (p, p + 1)."""
    found = allocate_solutions(1, len(factor))
    solve(factor[:, :, None].copy(), 1, 0, found)
    return found


@compiled
def solve(factors: FloatArray, m: int, first: int, found: BatchSolutions) -> None:
    """The first `m` of the systems [R Q'y] (p, p + 1, n) into `found` from `first` on.

    `factors` is used up.
    """
    p = len(factors)
    units, inverse, value = np.empty((p, m)), np.zeros((p, p, m)), np.empty(m)
    _scale(factors, units)
    _invert(factors, units, inverse)
    gram, inverse_gram = np.zeros((p, p, m)), np.zeros((p, p, m))
    _products(factors, inverse, gram, inverse_gram)
    for i in range(p):
        value[:] = 0.0
        for k in range(i, p):
            for l in range(m):
                value[l] += inverse[i, k, l] * factors[k, p, l]
        for l in range(m):
            found.values[i, first + l] = value[l] * units[i, l]
            found.inflations[i, first + l] = sqrt(inverse_gram[i, i, l])
        for j in range(i + 1):
            for l in range(m):
                element = inverse_gram[i, j, l] * units[i, l] * units[j, l]
                found.inverses[i, j, first + l] = element
                found.inverses[j, i, first + l] = element
    greatest, least = np.empty(m), np.empty(m)
    _greatest_eigenvalues(gram, greatest)
    _greatest_eigenvalues(inverse_gram, least)  # the reciprocal of the least of R'R
    for l in range(m):
        condition = sqrt(greatest[l] * least[l])
        found.conditions[first + l] = condition if 0 < condition < MAX_FINITE_CONDITION else np.inf


@compiled
def merge_factors(factors: FloatArray, others: FloatArray, m: int) -> None:
    """The rows of `others` into `factors`, both [R Q'y] (p, p + 1, n); of the first `m` systems.

    By Householder's reflections, which need not touch what is zero in both. `others` is used up.
    """
    p = len(factors)
    lead, gain, along = np.empty(m), np.empty(m), np.empty(m)
    for j in range(p):
        _reflection(factors, others, j, lead, gain)
        for k in range(j + 1, p + 1):
            for l in range(m):
                along[l] = lead[l] * factors[j, k, l]
            for i in range(j + 1):
                for l in range(m):
                    along[l] += others[i, j, l] * others[i, k, l]
            for l in range(m):
                along[l] *= gain[l]
                factors[j, k, l] += along[l] * lead[l]
            for i in range(j + 1):
                for l in range(m):
                    others[i, k, l] += along[l] * others[i, j, l]


@compiled
def _reflection(
    factors: FloatArray, others: FloatArray, j: int, lead: FloatArray, gain: FloatArray
) -> None:
    """I + gain u u' that brings column j of `others` to nothing; `lead` is the first of u."""
    m = len(lead)
    gain[:] = 0.0
    for i in range(j + 1):
        for l in range(m):
            gain[l] += others[i, j, l] ** 2
    for l in range(m):
        diagonal, turns = factors[j, j, l], gain[l] > TINY
        norm = sqrt(diagonal**2 + gain[l])
        pivot = -norm if diagonal > 0 else norm
        lead[l] = diagonal - pivot if turns else 0.0
        gain[l] = 1 / (pivot * lead[l]) if turns else 0.0
        factors[j, j, l] = pivot if turns else diagonal


@compiled
def _scale(factors: FloatArray, units: FloatArray) -> None:
    """The columns of R to unit length; `units` (p, m) is by what, or zero for one without any."""
    p, m = units.shape
    for j in range(p):
        units[j] = 0.0
        for i in range(j + 1):
            for l in range(m):
                units[j, l] += factors[i, j, l] ** 2
        for l in range(m):
            units[j, l] = 1 / sqrt(units[j, l]) if units[j, l] > TINY else 0.0
        for i in range(j + 1):
            for l in range(m):
                factors[i, j, l] *= units[j, l]


@compiled
def _invert(factors: FloatArray, units: FloatArray, inverse: FloatArray) -> None:
    """R^-1 (p, p, m), with zeros for the columns that are zero throughout."""
    p, m = units.shape
    for j in range(p):
        for l in range(m):
            inverse[j, j, l] = 1 / factors[j, j, l] if units[j, l] > 0 else 0.0
        for i in range(j - 1, -1, -1):
            for k in range(i + 1, j + 1):
                for l in range(m):
                    inverse[i, j, l] -= factors[i, k, l] * inverse[k, j, l]
            for l in range(m):
                inverse[i, j, l] *= inverse[i, i, l]


@compiled
def _products(
    factors: FloatArray, inverse: FloatArray, gram: FloatArray, inverse_gram: FloatArray
) -> None:
    """The lower halves of R'R and of its inverse, both (p, p, m), added to zeros."""
    p, _, m = inverse.shape
    for i in range(p):
        for j in range(i + 1):
            for k in range(j + 1):
                for l in range(m):
                    gram[i, j, l] += factors[k, i, l] * factors[k, j, l]
            for k in range(i, p):
                for l in range(m):
                    inverse_gram[i, j, l] += inverse[i, k, l] * inverse[j, k, l]


@compiled
def _greatest_eigenvalues(A: FloatArray, greatest: FloatArray) -> None:
    """Of symmetric matrices without negative ones; lower halves A (p, p, m), used up.

    The greatest eigenvalue of a product M'M is as accurate as M is, unlike the least: hence the
    condition of R from R'R and from the product of its inverse.
    """
    p, _, m = A.shape
    traces = np.zeros(m)
    for i in range(p):
        for l in range(m):
            traces[l] += A[i, i, l]
    for i in range(p):
        for j in range(i + 1):
            for l in range(m):
                A[i, j, l] = A[i, j, l] / traces[l] if traces[l] > 0 else 0.0
    squares = np.empty((p, m))
    _tridiagonalise(A, squares)
    _laguerre(A, squares, greatest)
    for l in range(m):
        greatest[l] *= traces[l]


@compiled
def _tridiagonalise(A: FloatArray, squares: FloatArray) -> None:
    """Householder's reflections from both sides: the diagonal stays in A.

    `squares` (p, m) are those of the elements beside it, of which the first is none.
    """
    p, _, m = A.shape
    w, gain = np.empty((p, m)), np.empty(m)
    squares[0] = 0.0
    for k in range(p - 1):
        below = squares[k + 1]
        below[:] = 0.0
        for i in range(k + 2, p):
            for l in range(m):
                below[l] += A[i, k, l] ** 2
        for l in range(m):
            lead, turns = A[k + 1, k, l], below[l] > TINY
            below[l] += lead**2
            norm = sqrt(below[l])
            pivot = -norm if lead > 0 else norm
            A[k + 1, k, l] = lead - pivot
            gain[l] = 1 / (pivot * (pivot - lead)) if turns else 0.0
        _reflect_both_sides(A, k, gain, w)


@compiled
def _reflect_both_sides(A: FloatArray, k: int, gain: FloatArray, w: FloatArray) -> None:
    """What is right of and below column k, B, of which v is in that column: B - v w' - w v'.

    w = gain B v - (gain v'(gain B v) / 2) v.
    """
    p, _, m = A.shape
    along = np.zeros(m)
    for i in range(k + 1, p):
        w[i] = 0.0
        for j in range(k + 1, p):
            row, column = max(i, j), min(i, j)
            for l in range(m):
                w[i, l] += A[row, column, l] * A[j, k, l]
        for l in range(m):
            w[i, l] *= gain[l]
            along[l] += w[i, l] * A[i, k, l]
    for i in range(k + 1, p):
        for l in range(m):
            w[i, l] -= along[l] * gain[l] / 2 * A[i, k, l]
        for j in range(k + 1, i + 1):
            for l in range(m):
                A[i, j, l] -= A[i, k, l] * w[j, l] + w[i, l] * A[j, k, l]


@compiled
def _laguerre(A: FloatArray, squares: FloatArray, x: FloatArray) -> None:
    """The greatest root x (m,) of det(x I - T), T of trace one, by Laguerre's method from above.

    f, g and h are the determinants of T's leading parts, and their two derivatives.
    """
    p, _, m = A.shape
    f, g, h = np.empty((2, m)), np.empty((2, m)), np.empty((2, m))
    x[:] = 1.0
    for _ in range(MAX_STEPS):
        f[0], f[1] = 0.0, 1.0
        g[:] = 0.0
        h[:] = 0.0
        for i in range(p):
            for l in range(m):
                a, b = x[l] - A[i, i, l], squares[i, l]
                next_h = 2 * g[1, l] + a * h[1, l] - b * h[0, l]
                next_g = f[1, l] + a * g[1, l] - b * g[0, l]
                next_f = a * f[1, l] - b * f[0, l]
                f[0, l], g[0, l], h[0, l] = f[1, l], g[1, l], h[1, l]
                f[1, l], g[1, l], h[1, l] = next_f, next_g, next_h
        moving = 0
        for l in range(m):
            G = g[1, l] / f[1, l]
            H = G**2 - h[1, l] / f[1, l]
            step = p / (G + sqrt(max(0.0, (p - 1) * (p * H - G**2))))
            moves = f[1, l] > 0 and step > MIN_RELATIVE_STEP * x[l]
            x[l] -= step if moves else 0.0
            moving += moves
        if moving == 0:
            break
