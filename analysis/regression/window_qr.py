"""Least squares over a window that slides row by row, at a cost that knows nothing of its length.

Nothing is ever subtracted, so nothing is left of what has gone. The rows come in blocks of the
window's length. Of the block before, the triangular factor of every suffix is kept; of the block
that fills, one factor grows by Givens' rotations. A window is a suffix and what has grown, and
the two triangles are brought to one. (A queue of two stacks: Tangwongsan, Hirzel, Schneider and
Wu, "General incremental sliding-window aggregation", 2015.)
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray

from .batched_qr import TINY, BatchSolutions, allocate_solutions, merge_factors, solve

BATCH_SIZE = (
    56  # windows solved together; a power of two would have their rows in one line of cache
)
CHUNK_ROWS = 8192  # rows taken at a time where all are there
EMPTY_TALLY = (0.0, np.inf, -np.inf)  # the tally of no rows


class WindowSolutions(NamedTuple):
    """Least squares of each of k windows, the first of which ends with the `length`-th row."""

    values: FloatArray  # (k, p), NaN for a column that is zero throughout, or if X is singular
    conditions: FloatArray  # (k,) 2-norm, of the columns scaled to unit length; inf if singular


class WindowState(NamedTuple):
    """What is remembered of the rows so far; changed in place."""

    seen: NDArray[np.int64]  # (1,) rows so far
    block: FloatArray  # (n, p + 1) [X y] of the block that fills
    older: FloatArray  # (n, p, p + 1) [R Q'y] of every suffix of the block before
    newer: FloatArray  # (p, p + 1) the same of the block that fills
    block_tally: FloatArray  # (n, 3) 1 if it is known, its excitation, and that again; of a row
    older_tally: FloatArray  # (n, 3) rows known, least and greatest excitation; of a suffix
    newer_tally: FloatArray  # (1, 3)


class RawWindows(NamedTuple):
    """Windows as they stand before anyone has judged them."""

    solutions: BatchSolutions
    tallies: FloatArray  # (k, 3) rows known, least and greatest excitation


def sliding_least_squares(X: FloatArray, y: FloatArray, length: int) -> WindowSolutions:
    """Least squares over every `length` successive rows of X (m, p) and y (m,), p being small.

    Rows that are not finite take up room in a window and count for nothing; a column that is zero
    throughout a window has no value there; nor has any, where fewer rows are known than columns
    or X is singular to the arithmetic's precision. Raises `ValueError` unless `length` is one at
    the least.
    """
    p = X.shape[1]
    state, still = empty_window(length, p), np.zeros(len(y))
    values: list[FloatArray] = [np.empty((0, p))]
    conditions: list[FloatArray] = [np.empty(0)]
    for start in range(0, len(y), CHUNK_ROWS):
        chunk = slice(start, start + CHUNK_ROWS)
        found, tallies = push_rows(state, X[chunk], y[chunk], still[chunk])
        kept = found.inflations > 0
        enough = np.isfinite(found.conditions) & (tallies[:, 0] >= kept.sum(axis=0))
        values.append(np.where(kept & enough, found.values, np.nan).T)
        conditions.append(np.where(enough, found.conditions, np.inf))
    return WindowSolutions(np.concatenate(values), np.concatenate(conditions))


def empty_window(length: int, p: int) -> WindowState:
    """For windows of `length` rows of `p` regressors; `ValueError` unless there is a row."""
    if length < 1:
        raise ValueError(f"a window has one row at the least, not {length}")
    nothing = np.array([EMPTY_TALLY])
    return WindowState(
        np.zeros(1, np.int64),
        np.zeros((length, p + 1)),
        np.zeros((length, p, p + 1)),
        np.zeros((p, p + 1)),
        np.tile(nothing, (length, 1)),
        np.tile(nothing, (length, 1)),
        nothing.copy(),
    )


def push_rows(
    state: WindowState, X: FloatArray, y: FloatArray, excitation: FloatArray
) -> RawWindows:
    """The windows that end in the next rows X (m, p), y (m,) and excitation (m,).

    However the rows are parted into chunks, the windows are the same.
    """
    rows = np.column_stack((X, y)).astype(np.float64, copy=False)
    unknown = ~np.isfinite(rows).all(axis=1)
    tallies = np.column_stack((np.ones(len(y)), excitation, excitation))
    rows[unknown], tallies[unknown] = 0.0, EMPTY_TALLY
    length, before = len(state.block), int(state.seen[0])
    k = max(0, before + len(y) - length + 1) - max(0, before - length + 1)
    window = RawWindows(allocate_solutions(k, X.shape[1]), np.tile(EMPTY_TALLY, (k, 1)))
    _push_rows(state, rows, tallies, window)
    return window


@compiled
def rotate_row(factor: FloatArray, rows: FloatArray, t: int) -> None:
    """Row t of [X y] into a factor [R Q'y], by Givens' rotations; the row is used up."""
    p = len(factor)
    for j in range(p):
        square = factor[j, j] ** 2 + rows[t, j] ** 2
        if rows[t, j] == 0 or square < TINY:
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
    """Rows [X y] (m, p + 1) into a factor [R Q'y] (p, p + 1); they are used up."""
    for t in range(len(rows)):
        rotate_row(factor, rows, t)


@compiled
def _push_rows(
    state: WindowState, rows: FloatArray, tallies: FloatArray, window: RawWindows
) -> None:
    """Rows (m, p + 1), used up, and their tallies (m, 3) onto the stacks."""
    length, p, _ = state.older.shape
    factors, others = np.zeros((p, p + 1, BATCH_SIZE)), np.empty((p, p + 1, BATCH_SIZE))
    first = waiting = 0
    for t in range(len(rows)):
        at = state.seen[0] % length
        if at == 0 and state.seen[0] > 0:
            _turn_over(state)
        for j in range(p + 1):
            state.block[at, j] = rows[t, j]
        _count_in(state.block_tally, at, tallies, t)
        rotate_row(state.newer, rows, t)
        _count_in(state.newer_tally, 0, tallies, t)
        state.seen[0] += 1
        if state.seen[0] < length:
            continue
        suffix = (at + 1) % length  # none is left of a whole block:
        held = 1.0 if suffix else 0.0
        for i in range(p):
            for j in range(i, p + 1):
                factors[i, j, waiting] = state.newer[i, j]
                others[i, j, waiting] = held * state.older[suffix, i, j]
        _count_in(window.tallies, first + waiting, state.newer_tally, 0)
        if suffix:
            _count_in(window.tallies, first + waiting, state.older_tally, suffix)
        waiting += 1
        if waiting == BATCH_SIZE or t + 1 == len(rows):
            merge_factors(factors, others, waiting)
            solve(factors, waiting, first, window.solutions)
            first, waiting = first + waiting, 0


@compiled
def _turn_over(state: WindowState) -> None:
    """The block is full: its suffixes, and an empty one in its place."""
    length, p, _ = state.older.shape
    newer, tally = state.newer, state.newer_tally
    newer[:] = 0.0
    tally[0, 0], tally[0, 1], tally[0, 2] = EMPTY_TALLY
    for t in range(length - 1, -1, -1):
        rotate_row(newer, state.block, t)
        _count_in(tally, 0, state.block_tally, t)
        for i in range(p):
            for j in range(i, p + 1):
                state.older[t, i, j] = newer[i, j]
        for j in range(3):
            state.older_tally[t, j] = tally[0, j]
            state.block_tally[t, j] = EMPTY_TALLY[j]
    newer[:] = 0.0
    tally[0, 0], tally[0, 1], tally[0, 2] = EMPTY_TALLY


@compiled
def _count_in(tallies: FloatArray, i: int, others: FloatArray, j: int) -> None:
    tallies[i, 0] += others[j, 0]
    tallies[i, 1] = min(tallies[i, 1], others[j, 1])
    tallies[i, 2] = max(tallies[i, 2], others[j, 2])
