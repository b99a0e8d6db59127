"""The smoother: what the rest of the trial says of each instant.

Going back from the end, what the future measurements say of an instant is kept as an adjoint
(λ, Λ): with the filter's x and P there, x - P λ is the smoothed state and P - P Λ P its covariance.
It is the Rauch-Tung-Striebel smoother without an inverse of any covariance.
Source: Bierman, "Fixed interval smoothing with discrete measurements", 1973, (modified
Bryson-Frazier); Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems",
1965.

A trial longer than memory is gone through twice, forward each time. The first time tells of each
chunk how it takes an adjoint from its end to its start; from these follow the adjoints at the ends
of all chunks, and with the one at its end each chunk is smoothed by itself the second time.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray, Signals

from .base import Estimates, Filter, Trace
from .kernels import propagate

ROUNDING = 1e-9  # of a variance: no less is left of it in the difference


class Adjoint(NamedTuple):
    """What all measurements after an instant say of the state then."""

    slope: FloatArray  # λ, (s,)
    curvature: FloatArray  # Λ, (s, s)


@dataclass(frozen=True, eq=False)
class _Way:
    """How a chunk takes an adjoint from its end to before its start: Φ' λ + b, Φ' Λ Φ + B."""

    across: FloatArray  # Φ, (s, s)
    own: Adjoint  # b and B: what the chunk itself says

    def back(self, end: Adjoint) -> Adjoint:
        return Adjoint(
            self.across.T @ end.slope + self.own.slope,
            self.across.T @ end.curvature @ self.across + self.own.curvature,
        )


class SmoothingPass:
    """Takes the traces of a trial's chunks in their order, the first time."""

    def __init__(self, outputs: FloatArray) -> None:
        self._C = np.ascontiguousarray(outputs)
        self._ways: list[_Way] = []

    def add(self, trace: Trace) -> None:
        """Take the next chunk's."""
        size = self._C.shape[1]
        nothing = Adjoint(np.zeros(size), np.zeros((size, size)))
        *_, start, across = _back(self._C, *_parts(trace), *nothing)
        self._ways.append(_Way(across, Adjoint(*start)))

    def result(self) -> list[Adjoint]:
        """The adjoint at the end of each chunk, in their order."""
        size = self._C.shape[1]
        ends = [Adjoint(np.zeros(size), np.zeros((size, size)))]  # after the last there is nothing
        for way in reversed(self._ways[1:]):
            ends.append(way.back(ends[-1]))
        return ends[::-1]


def smooth(trace: Trace, outputs: FloatArray, end: Adjoint) -> tuple[FloatArray, FloatArray]:
    """The smoothed states (n, s) and their covariances (n, s, s) of a chunk."""
    C = np.ascontiguousarray(outputs)
    slopes, curvatures, *_ = _back(C, *_parts(trace), *end)
    return _smoothed(trace.states, trace.covariances, slopes, curvatures)


def smoothed(
    filtering: Filter,
    chunk: Signals,
    following: Mapping[str, float],
    estimates: Estimates,
    trace: Trace,
    end: Adjoint,
) -> Estimates:
    """A chunk's estimates with its states smoothed; the innovations are the filter's own."""
    found = smooth(trace, filtering.outputs, end)
    states, stds, wave = filtering.told(chunk, following, *found)
    return replace(estimates, states=states, stds=stds, wave=wave)


def _parts(trace: Trace) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    return trace.transitions, trace.gains, trace.innovations, trace.variances


@compiled
def _back(
    C: FloatArray,
    F: FloatArray,
    K: FloatArray,
    e: FloatArray,
    S: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray], FloatArray]:
    """The adjoints at every instant of a chunk, (n, s) and (n, s, s), from those after its end.

    And the one before its first measurement, and Φ, by which the end's came there.
    """
    count, size = len(F), C.shape[1]
    slopes, curvatures = np.empty((count, size)), np.empty((count, size, size))
    slope, curvature, across = slope.copy(), curvature.copy(), np.eye(size)
    room, row, nothing = np.empty((size, size)), np.empty(size), np.zeros((size, size))
    for k in range(count - 1, -1, -1):
        _transpose_through(F[k], slope, row)
        propagate(curvature, F[k].T, nothing, room)
        _multiply(across, F[k], room)
        slopes[k], curvatures[k] = slope, curvature
        for output in range(1, -1, -1):
            if np.any(K[k, output] != 0.0):
                _untake(C[output], K[k, output], e[k, output], S[k, output], slope, curvature, row)
                _untake_across(C[output], K[k, output], across)
    return slopes, curvatures, (slope, curvature), across


@compiled
def _transpose_through(F: FloatArray, slope: FloatArray, room: FloatArray) -> None:
    """F' λ, in place."""
    size = len(slope)
    for i in range(size):
        room[i] = 0.0
        for j in range(size):
            room[i] += F[j, i] * slope[j]
    slope[:] = room


@compiled
def _multiply(across: FloatArray, F: FloatArray, room: FloatArray) -> None:
    """Φ F, in place."""
    size = len(F)
    for i in range(size):
        for j in range(size):
            room[i, j] = 0.0
            for m in range(size):
                room[i, j] += across[i, m] * F[m, j]
    across[:] = room


@compiled
def _untake(
    c: FloatArray,
    K: FloatArray,
    e: float,
    S: float,
    slope: FloatArray,
    curvature: FloatArray,
    room: FloatArray,
) -> None:
    """To before a measurement: M' λ - c e / S and M' Λ M + c c' / S with M = I - K c', in place."""
    size = len(c)
    along, twice = e / S, 1 / S
    for i in range(size):
        along += K[i] * slope[i]
        room[i] = 0.0
        for j in range(size):
            room[i] += curvature[i, j] * K[j]
        twice += K[i] * room[i]
    for i in range(size):
        slope[i] -= c[i] * along
        for j in range(i + 1):
            curvature[i, j] += c[i] * twice * c[j] - c[i] * room[j] - room[i] * c[j]
            curvature[j, i] = curvature[i, j]


@compiled
def _untake_across(c: FloatArray, K: FloatArray, across: FloatArray) -> None:
    """Φ (I - K c'), in place."""
    for i in range(len(c)):
        taken = 0.0
        for j in range(len(c)):
            taken += across[i, j] * K[j]
        for j in range(len(c)):
            across[i, j] -= taken * c[j]


@compiled
def _smoothed(
    x: FloatArray, P: FloatArray, slopes: FloatArray, curvatures: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """x - P λ and P - P Λ P at every instant."""
    size = x.shape[1]
    states, covariances = np.empty_like(x), np.empty_like(P)
    room, nothing = np.empty((size, size)), np.zeros((size, size))
    for k in range(len(x)):
        covariances[k] = curvatures[k]
        propagate(covariances[k], P[k], nothing, room)
        for i in range(size):
            states[k, i] = x[k, i]
            for j in range(size):
                states[k, i] -= P[k, i, j] * slopes[k, j]
                covariances[k, i, j] = P[k, i, j] - covariances[k, i, j]
            covariances[k, i, i] = max(covariances[k, i, i], ROUNDING * P[k, i, i])
    return states, covariances
