"""Least squares over a sliding window, at a cost independent of its length.

No row is ever subtracted (downdated), so no rounding error of rows outside the window remains. The
rows are divided into blocks of the window's length. Of the previous block, the triangular factor of
every suffix is kept; of the current block, one factor grows by Givens rotations. A window is a
suffix of the previous block and the rows of the current block; their two factors are merged into
one. This is a queue made of two stacks.

A tally of a set of rows is its number of known rows and the smallest and the largest excitation.

References
----------
K. Tangwongsan, M. Hirzel, S. Schneider and K.-L. Wu, "General incremental sliding-window
aggregation", Proceedings of the VLDB Endowment 8, 2015. Givens rotations: G. H. Golub and C. F. Van
Loan, "Matrix Computations", 4th edition, 2013, 5.1.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled, inlined
from shiplog.types import FloatArray

from .batched_qr import (
    MIN_SQUARE_SUM,
    BatchSolutions,
    allocate_solutions,
    merge_factors,
    solve_batch,
)

BATCH_SIZE = 120  # windows solved together; a power of two would map them to the same cache lines
CHUNK_ROWS = 8192  # rows processed at once where all are available
EMPTY_TALLY = (0.0, np.inf, -np.inf)


class WindowSolutions(NamedTuple):
    """Least squares of each of k windows with p regressors.

    Attributes
    ----------
    values
        (k, p) the coefficients; NaN for a regressor that is zero in all rows of the window, and in
        a window whose X is singular or that has fewer known rows than coefficients.
    conditions
        (k,) 2-norm condition number of X with its columns scaled to unit length; infinite where
        there are no values.
    """

    values: FloatArray
    conditions: FloatArray


class WindowState(NamedTuple):
    """State of a sliding window of n rows with p regressors; changed in place by `push_rows`.

    Attributes
    ----------
    row_count
        (1,) the number of rows so far.
    rows
        (n, p + 1) the rows ``[X y]`` of the current block.
    suffixes
        (n, p, p + 1) the factor ``[R Q'y]`` of each suffix of the previous block.
    prefix
        (p, p + 1) the factor of the rows of the current block.
    row_tallies
        (n, 3) the tally of each row of the current block.
    suffix_tallies
        (n, 3) the tally of each suffix of the previous block.
    prefix_tally
        (1, 3) the tally of the rows of the current block.
    """

    row_count: NDArray[np.int64]
    rows: FloatArray
    suffixes: FloatArray
    prefix: FloatArray
    row_tallies: FloatArray
    suffix_tallies: FloatArray
    prefix_tally: FloatArray


class RawWindows(NamedTuple):
    """Least squares of k windows, whether or not their rows determine the coefficients.

    Attributes
    ----------
    solutions
        The solution of each window.
    tallies
        (k, 3) the number of known rows, the smallest and the largest excitation of each window.
    """

    solutions: BatchSolutions
    tallies: FloatArray


def sliding_least_squares(X: FloatArray, y: FloatArray, length: int) -> WindowSolutions:
    """Solve the least squares of every window of `length` successive rows.

    Parameters
    ----------
    X
        (m, p) the regressors; p is small.
    y
        (m,) the target. A row that is not finite in X or y occupies a place in its windows and is
        ignored.
    length
        The number of rows in a window.

    Returns
    -------
    windows
        The ``m - length + 1`` windows; the first ends with row ``length - 1``. None if there are
        fewer rows.

    Raises
    ------
    ValueError
        `length` is less than one.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.array([[1.0], [2.0], [3.0], [4.0]])
    >>> sliding_least_squares(X, np.array([2.0, 4.0, 9.0, 12.0]), 2).values[:, 0].round(2).tolist()
    [2.0, 2.69, 3.0]
    """
    p = X.shape[1]
    state, excitation = empty_window(length, p), np.zeros(len(y))
    values: list[FloatArray] = [np.empty((0, p))]
    conditions: list[FloatArray] = [np.empty(0)]
    for start in range(0, len(y), CHUNK_ROWS):
        chunk = slice(start, start + CHUNK_ROWS)
        solutions, tallies = push_rows(state, X[chunk], y[chunk], excitation[chunk])
        is_used = solutions.inflations > 0
        is_determined = np.isfinite(solutions.conditions) & (tallies[:, 0] >= is_used.sum(axis=0))
        values.append(np.where(is_used & is_determined, solutions.values, np.nan).T)
        conditions.append(np.where(is_determined, solutions.conditions, np.inf))
    return WindowSolutions(np.concatenate(values), np.concatenate(conditions))


def empty_window(length: int, p: int) -> WindowState:
    """Return the state of a window of `length` rows with `p` regressors, before any row.

    Raises
    ------
    ValueError
        `length` is less than one.
    """
    if length < 1:
        raise ValueError(f"window of {length} rows; the length must be at least 1")
    empty = np.array([EMPTY_TALLY])
    return WindowState(
        np.zeros(1, np.int64),
        np.zeros((length, p + 1)),
        np.zeros((length, p, p + 1)),
        np.zeros((p, p + 1)),
        np.tile(empty, (length, 1)),
        np.tile(empty, (length, 1)),
        empty.copy(),
    )


def push_rows(
    state: WindowState, X: FloatArray, y: FloatArray, excitation: FloatArray
) -> RawWindows:
    """Add rows, and solve the windows that end in them.

    The windows are the same to the last bit however the rows are divided into chunks.

    Parameters
    ----------
    state
        The window's state; changed in place.
    X
        (m, p) the regressors of the next rows.
    y
        (m,) their target.
    excitation
        (m,) the quantity whose range in a window is reported in the tallies.

    Returns
    -------
    windows
        One window for each row, except for the first ``length - 1`` rows of all.
    """
    rows = np.column_stack((X, y)).astype(np.float64, copy=False)
    is_unknown = ~np.isfinite(rows).all(axis=1)
    tallies = np.column_stack((np.ones(len(y)), excitation, excitation))
    rows[is_unknown], tallies[is_unknown] = 0.0, EMPTY_TALLY
    length, row_count = len(state.rows), int(state.row_count[0])
    k = max(0, row_count + len(y) - length + 1) - max(0, row_count - length + 1)
    windows = RawWindows(allocate_solutions(k, X.shape[1]), np.tile(EMPTY_TALLY, (k, 1)))
    factors, others = np.zeros((2, X.shape[1], X.shape[1] + 1, BATCH_SIZE))
    first = 0
    for start in range(0, len(rows), BATCH_SIZE):
        batch = slice(start, start + BATCH_SIZE)
        m = _push_batch(
            state, rows[batch], tallies[batch], factors, others, windows.tallies[first:]
        )
        if m > 0:
            solve_batch(factors, m, first, windows.solutions)
        first += m
    return windows


@compiled
def rotate_row(factor: FloatArray, rows: FloatArray, t: int) -> None:
    """Update a factor with one row, by Givens rotations.

    Parameters
    ----------
    factor
        (p, p + 1) the factor ``[R Q'y]`` to update.
    rows
        (m, p + 1) or wider: the rows ``[X y]``; further columns are ignored.
    t
        The row to add; overwritten.
    """
    p = len(factor)
    for j in range(p):
        square = factor[j, j] ** 2 + rows[t, j] ** 2
        if rows[t, j] == 0 or square < MIN_SQUARE_SUM:
            continue
        r = sqrt(square)
        c, s = factor[j, j] / r, rows[t, j] / r
        factor[j, j] = r
        for k in range(j + 1, p + 1):
            above, below = factor[j, k], rows[t, k]
            factor[j, k] = c * above + s * below
            rows[t, k] = c * below - s * above


@compiled
def rotate_rows(factor: FloatArray, rows: FloatArray) -> None:
    """Update a factor ``[R Q'y]`` (p, p + 1) with rows ``[X y]`` (m, p + 1), overwritten."""
    for t in range(len(rows)):
        rotate_row(factor, rows, t)


@compiled
def _push_batch(
    state: WindowState,
    rows: FloatArray,
    tallies: FloatArray,
    factors: FloatArray,
    others: FloatArray,
    window_tallies: FloatArray,
) -> int:
    """Add rows, and compute the factors and the tallies of the windows that end in them.

    Parameters
    ----------
    state
        The window's state; changed in place.
    rows
        (m, p + 1) the rows ``[X y]``, at most `BATCH_SIZE`; overwritten.
    tallies
        (m, 3) their tallies.
    factors
        (p, p + 1, BATCH_SIZE) receives the factors ``[R Q'y]`` of the windows.
    others
        (p, p + 1, BATCH_SIZE) work space.
    window_tallies
        (m, 3) the tallies of the windows, which are updated.

    Returns
    -------
    count
        The number of windows.
    """
    length, p, _ = state.suffixes.shape
    count: int = np.int64(0)  # type: ignore[assignment] # a literal compiles `merge_factors` again
    for t in range(len(rows)):
        index = state.row_count[0] % length
        if index == 0 and state.row_count[0] > 0:
            _complete_block(state)
        for j in range(p + 1):
            state.rows[index, j] = rows[t, j]
        _add_tally(state.row_tallies, index, tallies, t)
        rotate_row(state.prefix, rows, t)
        _add_tally(state.prefix_tally, 0, tallies, t)
        state.row_count[0] += 1
        if state.row_count[0] < length:
            continue
        suffix = (index + 1) % length  # zero: the window is the current block alone
        weight = 1.0 if suffix else 0.0
        for i in range(p):
            for j in range(i, p + 1):
                factors[i, j, count] = state.prefix[i, j]
                others[i, j, count] = weight * state.suffixes[suffix, i, j]
        _add_tally(window_tallies, count, state.prefix_tally, 0)
        if suffix:
            _add_tally(window_tallies, count, state.suffix_tallies, suffix)
        count += 1
    merge_factors(factors, others, count)
    return count


@inlined
def _complete_block(state: WindowState) -> None:
    """Compute the suffixes of the block that is complete, and start an empty one."""
    length, p, _ = state.suffixes.shape
    factor, tally = state.prefix, state.prefix_tally
    _clear(factor, tally)
    for t in range(length - 1, -1, -1):
        rotate_row(factor, state.rows, t)
        _add_tally(tally, 0, state.row_tallies, t)
        for i in range(p):
            for j in range(i, p + 1):
                state.suffixes[t, i, j] = factor[i, j]
        for j in range(3):
            state.suffix_tallies[t, j] = tally[0, j]
            state.row_tallies[t, j] = EMPTY_TALLY[j]
    _clear(factor, tally)


@inlined
def _clear(factor: FloatArray, tally: FloatArray) -> None:
    """Set a factor and its tally to those of no rows."""
    p = len(factor)
    for i in range(p):
        for j in range(p + 1):
            factor[i, j] = 0.0
    for j in range(3):
        tally[0, j] = EMPTY_TALLY[j]


@inlined
def _add_tally(tallies: FloatArray, i: int, others: FloatArray, j: int) -> None:
    """Add tally j of `others` to tally i of `tallies`."""
    tallies[i, 0] += others[j, 0]
    tallies[i, 1] = min(tallies[i, 1], others[j, 1])
    tallies[i, 2] = max(tallies[i, 2], others[j, 2])
