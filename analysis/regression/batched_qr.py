"""Batches of small triangular least-squares systems: merge, scale, solve, condition number.

The last axis of every array is the system, and every innermost loop runs along it, so that the
compiler vectorises across systems. The result of one system does not depend on the others in its
batch.

A system is the triangular factor ``[R Q'y]`` of a QR decomposition of ``[X y]``, with X (n, p) the
regressors and y (n,) the target. Its least-squares solution solves ``R b = Q'y``.

References
----------
G. H. Golub and C. F. Van Loan, "Matrix Computations", 4th edition, 2013: Householder reflections
(5.1), QR factorisation (5.2), tridiagonalisation of a symmetric matrix (8.3). J. H. Wilkinson, "The
Algebraic Eigenvalue Problem", 1965: Laguerre's method for the eigenvalues of a tridiagonal matrix.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled, inlined
from shiplog.types import FloatArray

MIN_SQUARE_SUM = 1e-290  # a smaller sum of squares is zero: no rotation can be computed from it
MIN_RELATIVE_STEP = 4e-16  # of Laguerre's method; a smaller step is rounding
MAX_FINITE_CONDITION = 2.0**52  # a larger condition number cannot be distinguished from infinity
MAX_LAGUERRE_STEPS = 100  # five are typical; about thirty where eigenvalues coincide


class BatchSolutions(NamedTuple):
    """Least-squares solutions of a batch of k systems with p regressors.

    Attributes
    ----------
    values
        (p, k) the coefficients; zero for a regressor that is zero in all rows.
    conditions
        (k,) 2-norm condition number of X with its columns scaled to unit length; infinite if X is
        singular in double precision.
    inflations
        (p, k) the factor by which the other regressors increase the standard deviation of a
        coefficient, the square root of the variance inflation factor: ``|x_i| sqrt((X'X)^-1_ii)``.
        At least one; zero for a regressor that is zero in all rows.
    inverses
        (p, p, k) ``(X'X)^-1``, with zeros in the row and the column of a regressor that is zero.
    """

    values: FloatArray
    conditions: FloatArray
    inflations: FloatArray
    inverses: FloatArray


def allocate_solutions(k: int, p: int) -> BatchSolutions:
    """Return uninitialised arrays for the solutions of `k` systems with `p` regressors."""
    return BatchSolutions(np.empty((p, k)), np.empty(k), np.empty((p, k)), np.empty((p, p, k)))


def solve_single(factor: FloatArray) -> BatchSolutions:
    """Solve one system.

    Parameters
    ----------
    factor
        (p, p + 1) the factor ``[R Q'y]``; it is not changed.

    Returns
    -------
    solutions
        A batch of one.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.array([[1.0, 0.0], [0.0, 2.0], [1.0, 2.0]])
    >>> factor = np.linalg.qr(np.column_stack((X, X @ [3.0, 4.0])))[1][:2]
    >>> solve_single(factor).values[:, 0].round(6).tolist()
    [3.0, 4.0]
    """
    solutions = allocate_solutions(1, len(factor))
    solve_batch(factor[:, :, None].copy(), 1, 0, solutions)
    return solutions


@compiled
def solve_batch(factors: FloatArray, m: int, first: int, solutions: BatchSolutions) -> None:
    """Solve systems and store their solutions.

    Parameters
    ----------
    factors
        (p, p + 1, n) the factors ``[R Q'y]`` of n systems; overwritten.
    m
        The number of systems to solve: the first m of the n.
    first
        Index in `solutions` of the first of them.
    solutions
        The arrays to write to, of at least ``first + m`` systems.
    """
    p = len(factors)
    units, inverse, value = np.empty((p, m)), np.zeros((p, p, m)), np.empty(m)
    _scale(factors, units)
    _invert(factors, units, inverse)
    gram, inverse_gram = np.zeros((p, p, m)), np.zeros((p, p, m))
    _products(factors, inverse, gram, inverse_gram)
    for i in range(p):
        for s in range(m):
            value[s] = 0.0
        for k in range(i, p):
            for s in range(m):
                value[s] += inverse[i, k, s] * factors[k, p, s]
        for s in range(m):
            solutions.values[i, first + s] = value[s] * units[i, s]
            solutions.inflations[i, first + s] = sqrt(inverse_gram[i, i, s])
        for j in range(i + 1):
            for s in range(m):
                element = inverse_gram[i, j, s] * units[i, s] * units[j, s]
                solutions.inverses[i, j, first + s] = element
                solutions.inverses[j, i, first + s] = element
    largest, inverse_least = np.empty(m), np.empty(m)
    for A, eigenvalues in ((gram, largest), (inverse_gram, inverse_least)):
        _largest_eigenvalues(A, eigenvalues)  # of the inverse: 1 / the smallest of R'R
    for s in range(m):
        condition = sqrt(largest[s] * inverse_least[s])
        is_finite = 0 < condition < MAX_FINITE_CONDITION
        solutions.conditions[first + s] = condition if is_finite else np.inf


@compiled
def merge_factors(factors: FloatArray, others: FloatArray, m: int) -> None:
    """Update factors with the rows of other factors of the same systems.

    ``factors`` becomes the factor of the rows of both, by one Householder reflection for each
    column. The reflections skip the elements below the diagonal of `others`, which are zero.

    Parameters
    ----------
    factors
        (p, p + 1, n) the factors ``[R Q'y]`` to update.
    others
        (p, p + 1, n) the factors to merge into them; overwritten.
    m
        The number of systems to merge: the first m of the n.
    """
    p = len(factors)
    lead, gain, projection = np.empty(m), np.empty(m), np.empty(m)
    for j in range(p):
        _reflection(factors, others, j, lead, gain)
        for k in range(j + 1, p + 1):
            for s in range(m):
                projection[s] = lead[s] * factors[j, k, s]
            for i in range(j + 1):
                for s in range(m):
                    projection[s] += others[i, j, s] * others[i, k, s]
            for s in range(m):
                projection[s] *= gain[s]
                factors[j, k, s] += projection[s] * lead[s]
            for i in range(j + 1):
                for s in range(m):
                    others[i, k, s] += projection[s] * others[i, j, s]


@inlined
def _reflection(
    factors: FloatArray, others: FloatArray, j: int, lead: FloatArray, gain: FloatArray
) -> None:
    """Compute the reflection ``I + gain u u'`` that zeroes column j of `others`.

    `lead` (m,) receives the first element of u, `gain` (m,) the factor; the other elements of u are
    column j of `others`. The diagonal element of `factors` is updated.
    """
    m = len(lead)
    for s in range(m):
        gain[s] = 0.0
    for i in range(j + 1):
        for s in range(m):
            gain[s] += others[i, j, s] ** 2
    for s in range(m):
        diagonal, is_nonzero = factors[j, j, s], gain[s] > MIN_SQUARE_SUM
        norm = sqrt(diagonal**2 + gain[s])
        pivot = -norm if diagonal > 0 else norm
        lead[s] = diagonal - pivot if is_nonzero else 0.0
        gain[s] = 1 / (pivot * lead[s]) if is_nonzero else 0.0
        factors[j, j, s] = pivot if is_nonzero else diagonal


@inlined
def _scale(factors: FloatArray, units: FloatArray) -> None:
    """Scale the columns of R to unit length; `units` (p, m) receives the factors.

    The factor of a column of zeros is zero.
    """
    p, m = units.shape
    for j in range(p):
        for s in range(m):
            units[j, s] = 0.0
        for i in range(j + 1):
            for s in range(m):
                units[j, s] += factors[i, j, s] ** 2
        for s in range(m):
            units[j, s] = 1 / sqrt(units[j, s]) if units[j, s] > MIN_SQUARE_SUM else 0.0
        for i in range(j + 1):
            for s in range(m):
                factors[i, j, s] *= units[j, s]


@inlined
def _invert(factors: FloatArray, units: FloatArray, inverse: FloatArray) -> None:
    """Add R^-1 to the zeros of `inverse` (p, p, m), by back substitution.

    Rows and columns of regressors that are zero stay zero.
    """
    p, m = units.shape
    for j in range(p):
        for s in range(m):
            inverse[j, j, s] = 1 / factors[j, j, s] if units[j, s] > 0 else 0.0
        for i in range(j - 1, -1, -1):
            for k in range(i + 1, j + 1):
                for s in range(m):
                    inverse[i, j, s] -= factors[i, k, s] * inverse[k, j, s]
            for s in range(m):
                inverse[i, j, s] *= inverse[i, i, s]


@inlined
def _products(
    factors: FloatArray, inverse: FloatArray, gram: FloatArray, inverse_gram: FloatArray
) -> None:
    """Add the lower halves of ``R'R`` and ``R^-1 R^-T`` to zeros, both (p, p, m)."""
    p, _, m = inverse.shape
    for i in range(p):
        for j in range(i + 1):
            for k in range(j + 1):
                for s in range(m):
                    gram[i, j, s] += factors[k, i, s] * factors[k, j, s]
            for k in range(i, p):
                for s in range(m):
                    inverse_gram[i, j, s] += inverse[i, k, s] * inverse[j, k, s]


@inlined
def _largest_eigenvalues(A: FloatArray, largest: FloatArray) -> None:
    """Compute the largest eigenvalues of positive semidefinite matrices.

    Only the lower halves of A (p, p, m) are read; A is overwritten. The largest eigenvalue of a
    product M'M is as accurate as M, the smallest is not. The condition number of R is therefore
    computed from the largest eigenvalues of R'R and of its inverse.
    """
    p, _, m = A.shape
    traces = np.zeros(m)
    for i in range(p):
        for s in range(m):
            traces[s] += A[i, i, s]
    for i in range(p):
        for j in range(i + 1):
            for s in range(m):
                A[i, j, s] = A[i, j, s] / traces[s] if traces[s] > 0 else 0.0
    squares = np.empty((p, m))
    _tridiagonalise(A, squares)
    _laguerre(A, squares, largest)
    for s in range(m):
        largest[s] *= traces[s]


@inlined
def _tridiagonalise(A: FloatArray, squares: FloatArray) -> None:
    """Reduce symmetric matrices to tridiagonal form T by Householder reflections.

    The diagonal of T replaces that of A. `squares` (p, m) receives the squared
    subdiagonal: ``squares[i] = T[i, i - 1]^2``, and ``squares[0] = 0``.
    """
    p, _, m = A.shape
    w, gain = np.empty((p, m)), np.empty(m)
    for k in range(p):
        for s in range(m):
            squares[k, s] = 0.0
    for k in range(p - 1):
        for i in range(k + 2, p):
            for s in range(m):
                squares[k + 1, s] += A[i, k, s] ** 2
        for s in range(m):
            lead, is_nonzero = A[k + 1, k, s], squares[k + 1, s] > MIN_SQUARE_SUM
            squares[k + 1, s] += lead**2
            norm = sqrt(squares[k + 1, s])
            pivot = -norm if lead > 0 else norm
            A[k + 1, k, s] = lead - pivot
            gain[s] = 1 / (pivot * (pivot - lead)) if is_nonzero else 0.0
        _reflect_both_sides(A, k, gain, w)


@inlined
def _reflect_both_sides(A: FloatArray, k: int, gain: FloatArray, w: FloatArray) -> None:
    """Apply ``I - gain v v'`` from both sides to B, the block right of and below column k.

    v is stored in column k. With ``w = gain B v - (gain v'(gain B v) / 2) v``, the result is
    ``B - v w' - w v'``; its lower half replaces that of B.
    """
    p, _, m = A.shape
    projection = np.zeros(m)
    for i in range(k + 1, p):
        for s in range(m):
            w[i, s] = 0.0
        for j in range(k + 1, p):
            row, column = max(i, j), min(i, j)
            for s in range(m):
                w[i, s] += A[row, column, s] * A[j, k, s]
        for s in range(m):
            w[i, s] *= gain[s]
            projection[s] += w[i, s] * A[i, k, s]
    for i in range(k + 1, p):
        for s in range(m):
            w[i, s] -= projection[s] * gain[s] / 2 * A[i, k, s]
        for j in range(k + 1, i + 1):
            for s in range(m):
                A[i, j, s] -= A[i, k, s] * w[j, s] + w[i, s] * A[j, k, s]


@inlined
def _laguerre(A: FloatArray, squares: FloatArray, x: FloatArray) -> None:
    """Compute the largest root x (m,) of det(x I - T) by Laguerre's method.

    T is tridiagonal and has trace one, so that x = 1 is an upper bound, from which the method
    converges monotonically. f, g and h are the determinants of the leading submatrices of
    ``x I - T`` and their first two derivatives with respect to x, by the three-term recurrence.
    """
    p, _, m = A.shape
    f, g, h = np.empty((2, m)), np.empty((2, m)), np.empty((2, m))
    for s in range(m):
        x[s] = 1.0
    for _ in range(MAX_LAGUERRE_STEPS):
        for s in range(m):
            f[0, s], g[0, s], h[0, s] = 0.0, 0.0, 0.0
            f[1, s], g[1, s], h[1, s] = 1.0, 0.0, 0.0
        for i in range(p):
            for s in range(m):
                a, b = x[s] - A[i, i, s], squares[i, s]
                next_h = 2 * g[1, s] + a * h[1, s] - b * h[0, s]
                next_g = f[1, s] + a * g[1, s] - b * g[0, s]
                next_f = a * f[1, s] - b * f[0, s]
                f[0, s], g[0, s], h[0, s] = f[1, s], g[1, s], h[1, s]
                f[1, s], g[1, s], h[1, s] = next_f, next_g, next_h
        moving_count = 0
        for s in range(m):
            G = g[1, s] / f[1, s]
            H = G**2 - h[1, s] / f[1, s]
            step = p / (G + sqrt(max(0.0, (p - 1) * (p * H - G**2))))
            moves = f[1, s] > 0 and step > MIN_RELATIVE_STEP * x[s]
            x[s] -= step if moves else 0.0
            moving_count += moves
        if moving_count == 0:
            break
