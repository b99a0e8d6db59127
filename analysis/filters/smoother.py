"""Fixed-interval smoother: the state at each instant given the measurements of the whole trial.

Backward from the end, the measurements after an instant are summarised by an adjoint (λ, Λ): with
the filter's x and P at that instant, x - P λ is the smoothed state and P - P Λ P its covariance.
This is the Rauch-Tung-Striebel smoother without the inverse of a covariance.

A trial is filtered twice, forward each time and in pieces of few instants. The first pass computes
for each piece how an adjoint at its end becomes one at its start; the adjoints at the ends of all
pieces follow from that, and with them the second pass smooths each piece by itself.

References
----------
Bierman, "Fixed interval smoothing with discrete measurements", 1973 (the modified Bryson-Frazier
smoother). Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems", 1965.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.signals.concat import concatenate
from analysis.signals.hold import in_pieces
from shiplog.compiled import compiled, copy_vector
from shiplog.types import FloatArray, Signals

from .base import Estimates, SmoothableFilter, Trace
from .kernels import copy_matrix

PIECE = 4096  # instants that are traced at once: their matrices fit the processor's cache
MIN_VARIANCE_SHARE = 1e-9  # of a smoothed variance in the filtered: below it is rounding


class Adjoint(NamedTuple):
    """The information on a state in all measurements after its instant.

    Slope and curvature, by that state, of minus the log likelihood of these measurements.

    Attributes
    ----------
    slope
        λ, (s,).
    curvature
        Λ, (s, s).
    """

    slope: FloatArray
    curvature: FloatArray


@dataclass(frozen=True, eq=False)
class _ChunkMap:
    """The map of an adjoint from a chunk's end to before its start: Φ' λ + b, Φ' Λ Φ + B."""

    transition: FloatArray  # Φ, (s, s)
    own: Adjoint  # b and B: from the measurements of the chunk

    def at_start(self, end: Adjoint) -> Adjoint:
        return Adjoint(
            self.transition.T @ end.slope + self.own.slope,
            self.transition.T @ end.curvature @ self.transition + self.own.curvature,
        )


class SmoothingPass:
    """The first pass: takes the traces of all chunks in order, for the adjoints at their ends."""

    def __init__(self) -> None:
        self._maps: list[_ChunkMap] = []

    def add(self, trace: Trace) -> None:
        """Take the trace of the next chunk."""
        transition, *own = _map_chunk(_steps(trace, trace.transitions))
        self._maps.append(_ChunkMap(transition, Adjoint(*own)))
        self._last = _nothing(trace)

    def result(self) -> list[Adjoint]:
        """Return the adjoint at the end of each chunk, in order."""
        ends = [self._last]
        for chunk_map in reversed(self._maps[1:]):
            ends.append(chunk_map.at_start(ends[-1]))
        return ends[::-1]


def _nothing(trace: Trace) -> Adjoint:
    """Return the adjoint where no measurement follows."""
    size = trace.states.shape[1]
    return Adjoint(np.zeros(size), np.zeros((size, size)))


def smooth(trace: Trace, end: Adjoint) -> tuple[FloatArray, FloatArray]:
    """Smooth the states of a chunk.

    Parameters
    ----------
    trace
        The intermediate results of the filter.
    end
        The adjoint at the end of the chunk.

    Returns
    -------
    states
        (n, s).
    covariances
        (n, s, s).
    """
    steps = _steps(trace, np.swapaxes(trace.transitions, 1, 2))
    return _smooth_backwards(trace.states, trace.covariances, steps, *end)


def trace_chunk(
    filter_: SmoothableFilter, chunk: Signals, following: Mapping[str, float], first: SmoothingPass
) -> None:
    """Filter a chunk for the first pass.

    Parameters
    ----------
    filter_
        The filter, which is advanced.
    chunk, following
        The signals, and the inputs at the instant after them, as in `Filter.step`.
    first
        The pass, which gets the traces of the chunk's pieces.
    """
    for piece in in_pieces(chunk, following, PIECE):
        first.add(filter_.trace(*piece)[1])


def smooth_chunk(
    filter_: SmoothableFilter,
    chunk: Signals,
    following: Mapping[str, float],
    adjoints: Iterator[Adjoint],
) -> Estimates:
    """Filter a chunk and smooth its states; the innovations stay the filter's.

    Parameters
    ----------
    filter_
        The filter, which is advanced.
    chunk, following
        The signals, and the inputs at the instant after them, as in `Filter.step`.
    adjoints
        Those at the ends of the pieces, from the first pass over the same chunks.
    """
    pieces = []
    for piece, ahead in in_pieces(chunk, following, PIECE):
        estimates, trace = filter_.trace(piece, ahead)
        states, covariances = smooth(trace, next(adjoints))
        states, stds, wave, further = filter_.to_estimates(piece, ahead, states, covariances)
        pieces.append(replace(estimates, states=states, stds=stds, wave=wave, further=further))
    return concatenate(pieces)


class _Steps(NamedTuple):
    """The steps of a chunk of n instants, with the places where their matrices are not zero.

    Attributes
    ----------
    C, F, K, e, S
        Rows, transitions, gains, innovations and variances of `Trace`.
    at, counts
        (s, s) and (s,): the first `counts[i]` elements of the row `at[i]` are the places where the
        row i of some F is not zero, or the column i.
    """

    C: FloatArray
    F: FloatArray
    K: FloatArray
    e: FloatArray
    S: FloatArray
    at: NDArray[np.int64]
    counts: NDArray[np.int64]


def _steps(trace: Trace, by_place: FloatArray) -> _Steps:
    """Return the steps of a trace; `by_place` (n, s, s) are the transitions or their transposes."""
    is_used = np.any(by_place != 0.0, axis=0)
    at = np.argsort(~is_used, axis=1, kind="stable")
    return _Steps(
        trace.rows, trace.transitions, trace.gains, trace.innovations, trace.variances,
        at, np.sum(is_used, axis=1),
    )  # fmt: skip


@compiled
def _map_chunk(steps: _Steps) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the map of an adjoint over a chunk.

    Returns
    -------
    transition
        Φ, (s, s): the product of the transitions and corrections of the chunk.
    slope, curvature
        (s,) and (s, s): the adjoint before the chunk where nothing follows it. By Φ up to each
        correction, its row of the output matrix becomes one at the chunk's start.
    """
    (count, outputs, size) = steps.C.shape
    transition, slope, curvature = np.eye(size), np.zeros(size), np.zeros((size, size))
    work, row = np.empty((size, size)), np.empty(size)
    for k in range(count):
        for output in range(outputs):
            c, K, S = steps.C[k, output], steps.K[k, output], steps.S[k, output]
            if not _is_used(c):
                continue
            _multiply_row(c, transition, row)
            for i in range(size):
                slope[i] -= row[i] * steps.e[k, output] / S
                for j in range(i + 1):
                    curvature[i, j] += row[i] * row[j] / S
                for j in range(size):
                    transition[i, j] -= K[i] * row[j]
        _after_step(steps, k, transition, work)
    for i in range(size):
        for j in range(i):
            curvature[j, i] = curvature[i, j]
    return transition, slope, curvature


@compiled
def _after_step(steps: _Steps, k: int, transition: FloatArray, work: FloatArray) -> None:
    """Set Φ to F Φ, in place."""
    for i in range(len(transition)):
        for j in range(len(transition)):
            total = 0.0
            for q in range(steps.counts[i]):
                m = steps.at[i, q]
                total += steps.F[k, i, m] * transition[m, j]
            work[i, j] = total
    copy_matrix(transition, work)


@compiled
def _is_used(c: FloatArray) -> bool:
    """Whether there was a correction by this row (s,)."""
    used = False
    for i in range(len(c)):
        used = used or c[i] != 0.0
    return used


@compiled
def _multiply_row(c: FloatArray, M: FloatArray, row: FloatArray) -> None:
    """Set the row to c' M; most elements of c (s,) are zero."""
    for j in range(len(row)):
        row[j] = 0.0
    for i in range(len(c)):
        if c[i] != 0.0:
            for j in range(len(row)):
                row[j] += c[i] * M[i, j]


@compiled
def _smooth_backwards(
    x: FloatArray, P: FloatArray, steps: _Steps, slope: FloatArray, curvature: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Smooth the states of a chunk backwards from the adjoint after its end, as `smooth` does."""
    (count, outputs, size) = steps.C.shape
    states, covariances = np.empty_like(x), np.empty_like(P)
    slope, curvature = slope.copy(), curvature.copy()
    work, row = np.empty((size, size)), np.empty(size)
    for k in range(count - 1, -1, -1):
        _before_step(steps, k, slope, curvature, work, row)
        _smooth_instant(x[k], P[k], slope, curvature, work, states[k], covariances[k])
        for output in range(outputs - 1, -1, -1):
            c = steps.C[k, output]
            if _is_used(c):
                K, e, S = steps.K[k, output], steps.e[k, output], steps.S[k, output]
                _before_correction(c, K, e, S, slope, curvature, row)
    return states, covariances


@compiled
def _before_step(
    steps: _Steps, k: int, slope: FloatArray, curvature: FloatArray, work: FloatArray,
    row: FloatArray,
) -> None:  # fmt: skip
    """Set λ, Λ to those before a step: F' λ and F' Λ F."""
    size, F, at = len(slope), steps.F[k], steps.at
    copy_vector(row, slope)
    for i in range(size):
        total = 0.0
        for q in range(steps.counts[i]):
            m = at[i, q]
            total += F[m, i] * row[m]
        slope[i] = total
        for j in range(size):
            total = 0.0
            for q in range(steps.counts[i]):
                m = at[i, q]
                total += F[m, i] * curvature[m, j]
            work[i, j] = total
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for q in range(steps.counts[j]):
                m = at[j, q]
                total += work[i, m] * F[m, j]
            curvature[i, j] = curvature[j, i] = total


@compiled
def _before_correction(
    c: FloatArray,
    K: FloatArray,
    e: float,
    S: float,
    slope: FloatArray,
    curvature: FloatArray,
    work: FloatArray,
) -> None:
    """Set λ, Λ to those before a correction: M' λ - c e / S, M' Λ M + c c' / S; M = I - K c'."""
    size = len(c)
    c_slope, c_curvature = e / S, 1 / S
    for i in range(size):
        c_slope += K[i] * slope[i]
        total = 0.0
        for j in range(size):
            total += curvature[i, j] * K[j]
        work[i] = total
        c_curvature += K[i] * total
    for i in range(size):
        slope[i] -= c[i] * c_slope
        for j in range(i + 1):
            curvature[i, j] += c[i] * c_curvature * c[j] - c[i] * work[j] - work[i] * c[j]
            curvature[j, i] = curvature[i, j]


@compiled
def _smooth_instant(
    x: FloatArray, P: FloatArray, slope: FloatArray, curvature: FloatArray, work: FloatArray,
    state: FloatArray, covariance: FloatArray,
) -> None:  # fmt: skip
    """Set the smoothed state to x - P λ and its covariance to P - P Λ P."""
    size = len(x)
    for i in range(size):
        total = x[i]
        for j in range(size):
            total -= P[i, j] * slope[j]
        state[i] = total
        for j in range(size):
            total = 0.0
            for m in range(size):
                total += P[i, m] * curvature[j, m]  # both are symmetric
            work[i, j] = total
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for m in range(size):
                total += work[i, m] * P[j, m]
            covariance[i, j], covariance[j, i] = P[i, j] - total, P[j, i] - total
        covariance[i, i] = max(covariance[i, i], MIN_VARIANCE_SHARE * P[i, i])
