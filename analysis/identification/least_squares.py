"""Levenberg and Marquardt's least squares over several segments, with limits, priors and outliers.

Each residual is weighed by its own standard deviation; beyond three of what is usual it counts by
its size and no longer by its square (the pseudo-Huber loss). Marquardt, "An algorithm for
least-squares estimation of nonlinear parameters", 1963.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from shiplog.types import FloatArray

from .problem import Problem, residuals

OUTLIER_STDS = 3.0  # standard deviations
MOST_ROUNDS = 60
SMALL = 1e-4  # a step of so many squared standard deviations of its own is the last
STALE = 1.0  # after a step of so many, the derivatives are taken anew
STEEPEST = 1e12  # of damping: no step is short enough


@dataclass(frozen=True, eq=False)
class ResidualStd:
    """How far a segment's residuals may be off, (n, c)."""

    effective: FloatArray  # the std that each counts with, for neighbours that are off together
    typical: FloatArray  # the std it has by itself, by which an outlier is told

    def part(self, start: int, stop: int) -> "ResidualStd":
        """Of the samples from `start` to before `stop`."""
        return ResidualStd(self.effective[start:stop], self.typical[start:stop])


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the sum of squares is least."""

    unknowns: FloatArray  # (m,)
    information: FloatArray  # (m, m) the data's, without the priors
    jacobians: tuple[FloatArray, ...]  # of each segment, (n, c, k), there or very near
    cost: float
    iterations: int
    converged: bool


def minimise(
    problem: Problem,
    start: FloatArray,
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray] | None = None,
) -> Minimum:
    """The unknowns that fit best, from `start` on, where the `jacobians` are known if they are."""
    lowest, highest = problem.bounds
    _, precision = problem.prior
    z, damping, converged = np.clip(start, lowest, highest), 1e-3, False
    left = residuals(problem, z)
    cost, rounds = total_cost(problem, z, left, residual_stds), 0
    if not np.isfinite(cost):
        return Minimum(z, np.zeros((len(z), len(z))), (), cost, 0, converged=False)
    jacobians = _jacobians(problem, z) if jacobians is None else jacobians
    gradient, information = gradient_and_information(problem, z, left, residual_stds, jacobians)
    while rounds < MOST_ROUNDS and damping < STEEPEST:
        rounds += 1
        hessian = information + np.diag(precision)
        inside = ~(((z <= lowest) & (gradient > 0)) | ((z >= highest) & (gradient < 0)))
        step, decrease = _step(hessian, gradient, inside, damping)
        if decrease < SMALL:
            converged = damping <= 1.0
            if converged:
                break
        moved = np.clip(z + step, lowest, highest)
        new_left = residuals(problem, moved)
        new_cost = total_cost(problem, moved, new_left, residual_stds)
        if new_cost < cost:
            z, left, cost, damping = moved, new_left, new_cost, max(damping / 10, 1e-9)
            if decrease > STALE:
                jacobians = _jacobians(problem, z)
            gradient, information = gradient_and_information(
                problem, z, left, residual_stds, jacobians
            )
        else:
            damping *= 10 if damping > 1e-6 else 1e3
    return Minimum(z, information, tuple(jacobians), cost, rounds, converged)


def _jacobians(problem: Problem, z: FloatArray) -> list[FloatArray]:
    """Of each segment, zero where nothing was measured: there a ship may even stand."""
    found = [problem.jacobian(z, i) for i in range(len(problem.segments))]
    return [
        np.where(problem.measured_mask(i)[:, :, None], each, 0.0) for i, each in enumerate(found)
    ]


def _step(
    hessian: FloatArray, gradient: FloatArray, inside: NDArray[np.bool_], damping: float
) -> tuple[FloatArray, float]:
    """The damped step over the unknowns not at a limit, and by how much it should help."""
    at = np.flatnonzero(inside)
    scale = np.sqrt(np.maximum(np.diag(hessian)[at], 1e-300))
    scaled = hessian[np.ix_(at, at)] / np.outer(scale, scale)
    scaled[np.diag_indices(len(at))] += damping + 1e-14
    downhill = -gradient[at] / scale
    try:
        along = cho_solve(cho_factor(scaled), downhill)
    except np.linalg.LinAlgError:
        along = downhill / (1 + damping)
    step = np.zeros(len(gradient))
    step[at] = along / scale
    return step, float(downhill @ along)


def total_cost(
    problem: Problem,
    z: FloatArray,
    left: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
) -> float:
    """Half the sum of squares, outliers for less, and of the priors; inf where a ship runs away.

    `left` are the residuals at `z`.
    """
    centre, precision = problem.prior
    total = float(np.sum(precision * (z - centre) ** 2)) / 2
    for i, (off, spread) in enumerate(zip(left, residual_stds, strict=True)):
        known = problem.measured_mask(i)
        edge = OUTLIER_STDS * spread.typical[known]
        with np.errstate(over="ignore"):  # a ship about to run away: the cost is inf
            loss = edge**2 * (np.sqrt(1 + (off[known] / edge) ** 2) - 1)
            total += float(np.sum(loss / spread.effective[known] ** 2))
    return total if np.isfinite(total) else inf


def gradient_and_information(
    problem: Problem,
    z: FloatArray,
    left: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """The gradient of the cost, (m,), and the data's information matrix, (m, m)."""
    centre, precision = problem.prior
    gradient = precision * (z - centre)
    for i, (spread, jacobian) in enumerate(zip(residual_stds, jacobians, strict=True)):
        at, (off, weight) = problem.unknown_indices(i), weighted_residuals(left[i], spread)
        gradient[at] -= jacobian.reshape(-1, len(at)).T @ (weight * off).reshape(-1)
    return gradient, information_matrix(problem, left, residual_stds, jacobians)


def information_matrix(
    problem: Problem,
    left: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray],
    power: int = 1,
) -> FloatArray:
    """What the data tell of the unknowns, (m, m), outliers counting by a power of their share.

    With 1 the matrix by which the search goes; with 3 the curvature of the loss itself, by which
    its minimum moves with the data; with 0 Fisher's information of noise without outliers.
    """
    found = np.zeros((problem.size, problem.size))
    for i, (spread, jacobian) in enumerate(zip(residual_stds, jacobians, strict=True)):
        at, (_, weight) = problem.unknown_indices(i), weighted_residuals(left[i], spread, power)
        flat = jacobian.reshape(-1, len(at))
        found[np.ix_(at, at)] += (flat * weight.reshape(-1, 1)).T @ flat
    return found


def weighted_residuals(
    left: FloatArray, spread: ResidualStd, power: int = 1
) -> tuple[FloatArray, FloatArray]:
    """A segment's residuals, zero where nothing was measured, and their weights: (n, c) each."""
    known = np.isfinite(left)
    off = np.where(known, left, 0.0)
    share = 1 / np.sqrt(1 + (off / (OUTLIER_STDS * spread.typical)) ** 2)
    return off, np.where(known, share**power / spread.effective**2, 0.0)


def marginal_information(information: FloatArray, p: int) -> FloatArray:
    """What a matrix of information tells of the first p unknowns, the others unknown, (p, p)."""
    own = information[p:, p:]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    across = information[:p, p:] / scale
    solved = np.linalg.lstsq(own / np.outer(scale, scale), across.T, rcond=None)[0]
    return np.asarray(information[:p, :p] - across @ solved)
