"""Newey-West standard errors of least squares over overlapping rows.

The influence of row t on the coefficients is ``u_t = (X'X)^-1 x_t r_t``, with its residual r_t. The
covariance of the coefficients is the sum of the autocovariances of the influences with Bartlett
weights, over the L rows that overlap,

    V = sum over |j| < L of (1 - |j| / L) sum over t of u_t u_(t+j)'.

Its diagonal is computed as a sum of squares, which is never negative: of the sums of the influences
over every L successive rows, including those that extend beyond the ends, divided by L.

References
----------
W. K. Newey and K. D. West, "A simple, positive semi-definite, heteroskedasticity and
autocorrelation consistent covariance matrix", Econometrica 55, 1987. N. M. Kiefer and T. J.
Vogelsang, "A new asymptotic theory for heteroskedasticity-autocorrelation robust tests",
Econometric Theory 21, 2005.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray


class OverlapSums(NamedTuple):
    """Running sums of the influences on p coefficients; changed in place by `add_rows`.

    Attributes
    ----------
    last
        (overlap, p) the influences of the last rows, in a ring buffer.
    sums
        (p,) the sums of these influences.
    squares
        (p,) the sums of the squares of all such sums so far.
    """

    last: FloatArray
    sums: FloatArray
    squares: FloatArray


def empty_sums(overlap: int, p: int) -> OverlapSums:
    """Return the sums of `p` coefficients before any row; `overlap` rows share data."""
    return OverlapSums(np.zeros((overlap, p)), np.zeros(p), np.zeros(p))


@compiled
def add_rows(
    state: OverlapSums, rows: FloatArray, count: int, values: FloatArray, inverse: FloatArray
) -> None:
    """Add the influences of the next rows.

    Parameters
    ----------
    state
        The running sums; changed in place.
    rows
        (m, p + 1) the next rows ``[X y]``.
    count
        The number of rows added before.
    values
        (p,) the coefficients.
    inverse
        (p, p) ``(X'X)^-1`` of all rows.
    """
    overlap, p = state.last.shape
    for t in range(len(rows)):
        residual = rows[t, p]
        for i in range(p):
            residual -= rows[t, i] * values[i]
        index = (count + t) % overlap
        for i in range(p):
            influence = 0.0
            for j in range(p):
                influence += inverse[i, j] * rows[t, j]
            influence *= residual
            state.sums[i] += influence - state.last[index, i]
            state.squares[i] += state.sums[i] ** 2
            state.last[index, i] = influence


def newey_west_variances(state: OverlapSums, count: int) -> FloatArray:
    """Return the variances of the coefficients over the `count` rows so far, (p,).

    The state is not changed, so that more rows may follow.
    """
    overlap, p = state.last.shape
    final = OverlapSums(*(part.copy() for part in state))
    padding = np.zeros((overlap - 1, p + 1))  # the last sums extend beyond the end
    add_rows(final, padding, count, np.zeros(p), np.zeros((p, p)))
    return np.asarray(final.squares / overlap)


@compiled
def window_variances(
    columns: FloatArray,
    spans: NDArray[np.int64],
    wanted: NDArray[np.bool_],
    values: FloatArray,
    inverses: FloatArray,
    overlap: int,
) -> FloatArray:
    """Compute the variances of the coefficients of k windows, each over its own rows.

    The same sums as `add_rows`, one column at a time, so that the compiler vectorises over rows.

    Parameters
    ----------
    columns
        (p + 1, n) the rows ``[X y]``, transposed.
    spans
        (k, 2) the first row of each window, and the row after its last.
    wanted
        (k,) the windows to compute.
    values
        (p, k) the coefficients of each window.
    inverses
        (p, p, k) ``(X'X)^-1`` of each window.
    overlap
        The number of successive rows that share data.

    Returns
    -------
    variances
        (p, k) the variances; NaN in a window that is not wanted.
    """
    p, k = values.shape
    longest = 0
    for w in range(k):
        longest = max(longest, spans[w, 1] - spans[w, 0])
    residual, influence = np.empty(longest), np.empty(longest + overlap)
    variances = np.full((p, k), np.nan)
    for w in range(k):
        if not wanted[w]:
            continue
        first, end = spans[w, 0], spans[w, 1]
        _residuals(columns, first, end, values, w, residual)
        for i in range(p):
            _unscaled_influences(columns, first, end, inverses, i, w, influence)
            sum_of_squares = _overlap_squares(influence, residual, end - first, overlap)
            variances[i, w] = sum_of_squares / overlap
    return variances


@compiled
def _residuals(
    columns: FloatArray, first: np.int64, end: np.int64, values: FloatArray, w: int,
    residual: FloatArray,
) -> None:  # fmt: skip
    """Write the residuals of window `w` to the start of `residual`."""
    p, n = len(values), end - first
    for t in range(n):
        residual[t] = columns[p, first + t]
    for i in range(p):
        value = values[i, w]
        for t in range(n):
            residual[t] -= value * columns[i, first + t]


@compiled
def _unscaled_influences(
    columns: FloatArray, first: np.int64, end: np.int64, inverses: FloatArray, i: int, w: int,
    influence: FloatArray,
) -> None:  # fmt: skip
    """Write row i of ``(X'X)^-1 X'`` to `influence`: for residuals of one; zeros after it."""
    influence[:] = 0.0
    for j in range(len(inverses)):
        weight = inverses[i, j, w]
        for t in range(end - first):
            influence[t] += weight * columns[j, first + t]


@compiled
def _overlap_squares(
    influence: FloatArray, residual: FloatArray, n: np.int64, overlap: int
) -> float:
    """Sum the squares of the sums of ``influence * residual`` over every `overlap` rows."""
    for t in range(n):
        influence[t] *= residual[t]
    run = squares = 0.0
    for t in range(n + overlap - 1):
        run += influence[t] - (influence[t - overlap] if t >= overlap else 0.0)
        squares += run**2
    return squares


def small_sample_factor(b: FloatArray | float) -> FloatArray:
    """Return the factor that enlarges a standard error where few rows are independent.

    Two enlarged standard errors are a 95 % interval.

    Parameters
    ----------
    b
        The number of rows that overlap, as a share of all rows; larger values count as 1.

    Returns
    -------
    factor
        The ratio of the critical value at 95 % of Kiefer and Vogelsang (2005, Bartlett kernel)
        to that of the normal distribution, 1.96.

    Examples
    --------
    >>> small_sample_factor(0.1).round(3).tolist()
    1.153
    """
    b = np.minimum(b, 1.0)
    return np.asarray((1.96 + b * (2.9694 + b * (0.4160 - b * 0.5324))) / 1.96)
