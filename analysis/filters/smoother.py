"""Fixed-interval smoother: the state at each instant given the measurements of the whole trial.

Backward from the end, the measurements after an instant are summarised by an adjoint (λ, Λ): with
the filter's x and P at that instant, x - P λ is the smoothed state and P - P Λ P its covariance.
This is the Rauch-Tung-Striebel smoother without the inverse of a covariance.

A trial longer than memory is filtered twice, forward each time. The first pass computes for each
chunk how an adjoint at its end becomes one at its start; the adjoints at the ends of all chunks
follow from that, and with them the second pass smooths each chunk by itself.

References
----------
Bierman, "Fixed interval smoothing with discrete measurements", 1973 (the modified Bryson-Frazier
smoother). Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems", 1965.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray, Signals

from .base import Estimates, SmoothableFilter, Trace
from .kernels import copy_matrix, copy_vector, propagate

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
        *_, start, transition = _backward(*_backward_arrays(trace), *_nothing(trace))
        self._maps.append(_ChunkMap(transition, Adjoint(*start)))
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
    slopes, curvatures, *_ = _backward(*_backward_arrays(trace), *end)
    return _smoothed(trace.states, trace.covariances, slopes, curvatures)


def smoothed(
    filter_: SmoothableFilter,
    chunk: Signals,
    following: Mapping[str, float],
    estimates: Estimates,
    trace: Trace,
    end: Adjoint,
) -> Estimates:
    """Return a chunk's estimates with smoothed states; the innovations stay the filter's.

    Parameters
    ----------
    filter_
        The filter that made the estimates and the trace.
    chunk, following
        The signals, and the inputs at the instant after them, as in `Filter.step`.
    estimates, trace
        The result of `SmoothableFilter.trace`.
    end
        The adjoint at the end of the chunk.
    """
    states, covariances = smooth(trace, end)
    states, stds, wave, further = filter_.to_estimates(chunk, following, states, covariances)
    return replace(estimates, states=states, stds=stds, wave=wave, further=further)


def _backward_arrays(
    trace: Trace,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    return trace.rows, trace.transitions, trace.gains, trace.innovations, trace.variances


@compiled
def _backward(
    C: FloatArray,
    F: FloatArray,
    K: FloatArray,
    e: FloatArray,
    S: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray], FloatArray]:
    """Compute the adjoints of a chunk backwards from the one after its end.

    Returns
    -------
    slopes, curvatures
        (n, s) and (n, s, s): after the corrections of each instant.
    start
        The adjoint before the first correction of the chunk.
    transition
        Φ, (s, s): the product of the transitions and corrections of the chunk.
    """
    (count, outputs, size) = C.shape
    slopes, curvatures = np.empty((count, size)), np.empty((count, size, size))
    slope, curvature, transition = slope.copy(), curvature.copy(), np.eye(size)
    work, row, zero = np.empty((size, size)), np.empty(size), np.zeros((size, size))
    for k in range(count - 1, -1, -1):
        _multiply_transposed(F[k], slope, row)
        propagate(curvature, F[k].T, zero, work, size)
        _multiply(transition, F[k], work)
        copy_vector(slopes[k], slope)
        copy_matrix(curvatures[k], curvature)
        for output in range(outputs - 1, -1, -1):
            c = C[k, output]
            if np.any(c != 0.0):
                _before_correction(
                    c, K[k, output], e[k, output], S[k, output], slope, curvature, row
                )
                _correction_before(c, K[k, output], transition)
    return slopes, curvatures, (slope, curvature), transition


@compiled
def _multiply_transposed(F: FloatArray, slope: FloatArray, work: FloatArray) -> None:
    """Set λ to F' λ, in place."""
    size = len(slope)
    for i in range(size):
        work[i] = 0.0
        for j in range(size):
            work[i] += F[j, i] * slope[j]
    copy_vector(slope, work)


@compiled
def _multiply(transition: FloatArray, F: FloatArray, work: FloatArray) -> None:
    """Set Φ to Φ F, in place."""
    size = len(F)
    for i in range(size):
        for j in range(size):
            work[i, j] = 0.0
            for m in range(size):
                work[i, j] += transition[i, m] * F[m, j]
    copy_matrix(transition, work)


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
        work[i] = 0.0
        for j in range(size):
            work[i] += curvature[i, j] * K[j]
        c_curvature += K[i] * work[i]
    for i in range(size):
        slope[i] -= c[i] * c_slope
        for j in range(i + 1):
            curvature[i, j] += c[i] * c_curvature * c[j] - c[i] * work[j] - work[i] * c[j]
            curvature[j, i] = curvature[i, j]


@compiled
def _correction_before(c: FloatArray, K: FloatArray, transition: FloatArray) -> None:
    """Set Φ to Φ (I - K c'), in place."""
    for i in range(len(c)):
        gain = 0.0
        for j in range(len(c)):
            gain += transition[i, j] * K[j]
        for j in range(len(c)):
            transition[i, j] -= gain * c[j]


@compiled
def _smoothed(
    x: FloatArray, P: FloatArray, slopes: FloatArray, curvatures: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute x - P λ and P - P Λ P at every instant."""
    size = x.shape[1]
    states, covariances = np.empty_like(x), np.empty_like(P)
    work, zero = np.empty((size, size)), np.zeros((size, size))
    for k in range(len(x)):
        copy_matrix(covariances[k], curvatures[k])
        propagate(covariances[k], P[k], zero, work, size)
        for i in range(size):
            states[k, i] = x[k, i]
            for j in range(size):
                states[k, i] -= P[k, i, j] * slopes[k, j]
                covariances[k, i, j] = P[k, i, j] - covariances[k, i, j]
            covariances[k, i, i] = max(covariances[k, i, i], MIN_VARIANCE_SHARE * P[k, i, i])
    return states, covariances
