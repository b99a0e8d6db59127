"""Newey and West's (1987) errors of least squares over rows that overlap.

A row's influence on the values is (X'X)^-1 x times its residual. Their covariance is the sum of
the influences' autocovariances under Bartlett's weights: the sum of the squares of the
influences' sums over every run of `overlap` rows, those reaching over the ends too, over
`overlap`. A sum of squares, it is never negative.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray


class OverlapSums(NamedTuple):
    """What is remembered of the rows so far; changed in place."""

    last: FloatArray  # (overlap, p) influences, in a ring
    sums: FloatArray  # (p,) of them
    squares: FloatArray  # (p,) the sum of the squares of such sums


def empty_sums(overlap: int, p: int) -> OverlapSums:
    """Before any row."""
    return OverlapSums(np.zeros((overlap, p)), np.zeros(p), np.zeros(p))


@compiled
def add_rows(
    runs: OverlapSums, rows: FloatArray, count: int, values: FloatArray, inverse: FloatArray
) -> None:
    """The runs that end in the next rows [X y] (m, p + 1), after `count` others.

    `values` (p,) are the regression's, `inverse` (p, p) is of its X'X.
    """
    overlap, p = runs.last.shape
    for t in range(len(rows)):
        residual = rows[t, p]
        for i in range(p):
            residual -= rows[t, i] * values[i]
        at = (count + t) % overlap
        for i in range(p):
            influence = 0.0
            for j in range(p):
                influence += inverse[i, j] * rows[t, j]
            influence *= residual
            runs.sums[i] += influence - runs.last[at, i]
            runs.squares[i] += runs.sums[i] ** 2
            runs.last[at, i] = influence


def newey_west_variances(runs: OverlapSums, count: int) -> FloatArray:
    """Of the values over the `count` rows so far, (p,)."""
    overlap, p = runs.last.shape
    whole = OverlapSums(*(part.copy() for part in runs))
    after = np.zeros((overlap - 1, p + 1))  # the last runs reach over the end
    add_rows(whole, after, count, np.zeros(p), np.zeros((p, p)))
    return np.asarray(whole.squares / overlap)


@compiled
def window_variances(
    columns: FloatArray,
    spans: NDArray[np.int64],
    wanted: NDArray[np.bool_],
    values: FloatArray,
    inverses: FloatArray,
    overlap: int,
) -> FloatArray:
    """Of the values of k windows over their own rows, (p, k); NaN unless `wanted`.

    `columns` (p + 1, n) are [X y]', of which window w holds those from `spans[w, 0]` to before
    `spans[w, 1]`; `values` (p, k) and `inverses` (p, p, k) are its regression's. The same as
    `add_runs`, a column at a time, so that the processor takes several rows at once.
    """
    p, k = values.shape
    longest = 0
    for first, end in spans:
        longest = max(longest, end - first)
    residual, influence = np.empty(longest), np.empty(longest + overlap)
    found = np.full((p, k), np.nan)
    for w in range(k):
        if not wanted[w]:
            continue
        first, end = spans[w]
        _residuals(columns, first, end, values, w, residual)
        for i in range(p):
            _influences(columns, first, end, inverses, i, w, influence)
            found[i, w] = _squares(influence, residual, end - first, overlap) / overlap
    return found


@compiled
def _residuals(
    columns: FloatArray, first: np.int64, end: np.int64, values: FloatArray, w: int,
    residual: FloatArray,
) -> None:  # fmt: skip
    p, n = len(values), end - first
    residual[:n] = columns[p, first:end]
    for i in range(p):
        value, column = values[i, w], columns[i, first:end]
        for t in range(n):
            residual[t] -= value * column[t]


@compiled
def _influences(
    columns: FloatArray, first: np.int64, end: np.int64, inverses: FloatArray, i: int, w: int,
    influence: FloatArray,
) -> None:  # fmt: skip
    """On value i, of residuals of one; zeros behind them."""
    influence[:] = 0.0
    for j in range(len(inverses)):
        weight, column = inverses[i, j, w], columns[j, first:end]
        for t in range(len(column)):
            influence[t] += weight * column[t]


@compiled
def _squares(influence: FloatArray, residual: FloatArray, n: np.int64, overlap: int) -> float:
    """The sum of the squares of the sums over each run."""
    for t in range(n):
        influence[t] *= residual[t]
    run = squares = 0.0
    for t in range(n + overlap - 1):
        run += influence[t] - (influence[t - overlap] if t >= overlap else 0.0)
        squares += run**2
    return squares


def small_sample_factor(b: FloatArray | float) -> FloatArray:
    """What errors are to be enlarged by where rows overlap over a share `b` of them all.

    The 95 % point of Kiefer and Vogelsang (2005) over the Gaussian's.
    """
    b = np.minimum(b, 1.0)
    return np.asarray((1.96 + b * (2.9694 + b * (0.4160 - b * 0.5324))) / 1.96)
