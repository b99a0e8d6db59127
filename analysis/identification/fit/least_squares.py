"""Levenberg-Marquardt least squares with bounds, priors and a robust loss.

The cost of the unknowns z is

    J(z) = sum of rho(r / s) s^2 / sigma^2 + (z - z0)' P (z - z0) / 2

over all measured residuals r, with the pseudo-Huber loss ``rho(u) = k^2 (sqrt(1 + (u/k)^2) - 1)``
and k = `OUTLIER_STDS`: quadratic for small residuals, linear beyond k typical standard deviations
s. sigma is the effective standard deviation (`ResidualStd`), z0 and P are the mean and the diagonal
precision of the prior (`Problem.prior`).

References
----------
K. Levenberg, "A method for the solution of certain non-linear problems in least squares",
Quarterly of Applied Mathematics 2, 1944. D. W. Marquardt, "An algorithm for least-squares
estimation of nonlinear parameters", SIAM Journal 11, 1963. P. Charbonnier et al., "Deterministic
edge-preserving regularization in computed imaging", IEEE Transactions on Image Processing 6, 1997
(pseudo-Huber loss).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from shiplog.types import FloatArray

from .problem import Problem, residuals

OUTLIER_STDS = 3.0  # typical standard deviations: where the loss turns from quadratic to linear
MAX_ITERATIONS = 60
CONVERGED_DECREASE = 1e-4  # predicted decrease of 2 J below which the iteration ends
JACOBIAN_DECREASE = 1.0  # predicted decrease of 2 J above which the Jacobian is computed anew
MAX_DAMPING = 1e12  # beyond it no step decreases the cost


@dataclass(frozen=True, eq=False)
class ResidualStd:
    """Standard deviations of one segment's residuals.

    Attributes
    ----------
    effective
        (n, c) the standard deviation by which each residual is weighted. It exceeds `typical`
        where neighbouring residuals are correlated, so that they do not count as independent.
    typical
        (n, c) the standard deviation of a single residual, by which outliers are recognised.
    """

    effective: FloatArray
    typical: FloatArray

    def part(self, start: int, stop: int) -> "ResidualStd":
        """Return those of the samples from `start` to before `stop`."""
        return ResidualStd(self.effective[start:stop], self.typical[start:stop])


@dataclass(frozen=True, eq=False)
class Minimum:
    """The result of a minimisation.

    Attributes
    ----------
    unknowns
        (m,) at the smallest cost.
    information
        (m, m) information matrix of the data alone, without the prior.
    jacobians
        For each segment (n, c, k) derivatives of the outputs at the minimum or very near it.
    cost
        J.
    iterations
        How many steps were tried.
    converged
        Whether the iteration ended by `CONVERGED_DECREASE`.
    """

    unknowns: FloatArray
    information: FloatArray
    jacobians: tuple[FloatArray, ...]
    cost: float
    iterations: int
    converged: bool


def minimise(
    problem: Problem,
    start: FloatArray,
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray] | None = None,
) -> Minimum:
    """Minimise the cost of a problem from a start.

    Parameters
    ----------
    problem
        The problem, with its bounds and prior.
    start
        (m,) the unknowns to start from, clipped to the bounds.
    residual_stds
        For each segment.
    jacobians
        The derivatives at the start, if they are known already.

    Returns
    -------
    Minimum
        Its cost is infinite where the simulation diverges at the start.
    """
    lowest, highest = problem.bounds
    _, precision = problem.prior
    z, damping, converged = np.clip(start, lowest, highest), 1e-3, False
    residual = residuals(problem, z)
    cost, iterations = total_cost(problem, z, residual, residual_stds), 0
    if not np.isfinite(cost):
        return Minimum(z, np.zeros((len(z), len(z))), (), cost, 0, converged=False)
    jacobians = _jacobians(problem, z) if jacobians is None else jacobians
    gradient, information = _linearise(problem, z, residual, residual_stds, jacobians)
    while iterations < MAX_ITERATIONS and damping < MAX_DAMPING:
        iterations += 1
        hessian = information + np.diag(precision)
        inside = ~(((z <= lowest) & (gradient > 0)) | ((z >= highest) & (gradient < 0)))
        step, decrease = _damped_step(hessian, gradient, inside, damping)
        if decrease < CONVERGED_DECREASE:
            converged = damping <= 1.0
            if converged:
                break
        trial = np.clip(z + step, lowest, highest)
        trial_residual = residuals(problem, trial)
        trial_cost = total_cost(problem, trial, trial_residual, residual_stds)
        if trial_cost < cost:
            z, residual, cost, damping = trial, trial_residual, trial_cost, max(damping / 10, 1e-9)
            if decrease > JACOBIAN_DECREASE:
                jacobians = _jacobians(problem, z)
            gradient, information = _linearise(problem, z, residual, residual_stds, jacobians)
        else:
            damping *= 10 if damping > 1e-6 else 1e3
    return Minimum(z, information, tuple(jacobians), cost, iterations, converged)


def _jacobians(problem: Problem, z: FloatArray) -> list[FloatArray]:
    """Compute each segment's Jacobian, zero where nothing was measured.

    There the speed may be zero, where a derivative need not exist.
    """
    jacobians = [problem.jacobian(z, i) for i in range(len(problem.segments))]
    return [
        np.where(problem.measured_mask(i)[:, :, None], each, 0.0)
        for i, each in enumerate(jacobians)
    ]


def _damped_step(
    hessian: FloatArray, gradient: FloatArray, inside: NDArray[np.bool_], damping: float
) -> tuple[FloatArray, float]:
    """Return the damped step of the unknowns inside their bounds, and the predicted decrease.

    The step solves ``(D^-1 H D^-1 + damping I) D step = -D^-1 g`` with D the root of H's diagonal,
    which makes it independent of the unknowns' units (Marquardt, 1963).
    """
    at = np.flatnonzero(inside)
    scale = np.sqrt(np.maximum(np.diag(hessian)[at], 1e-300))
    scaled = hessian[np.ix_(at, at)] / np.outer(scale, scale)
    scaled[np.diag_indices(len(at))] += damping + 1e-14
    descent = -gradient[at] / scale
    try:
        scaled_step = cho_solve(cho_factor(scaled), descent)
    except np.linalg.LinAlgError:
        scaled_step = descent / (1 + damping)
    step = np.zeros(len(gradient))
    step[at] = scaled_step / scale
    return step, float(descent @ scaled_step)


def total_cost(
    problem: Problem,
    z: FloatArray,
    residual: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
) -> float:
    """Compute the cost J of the module docstring.

    Parameters
    ----------
    problem
        The problem.
    z
        (m,) unknowns.
    residual
        For each segment (n, c), as of `residuals` at `z`.
    residual_stds
        For each segment.

    Returns
    -------
    float
        Infinite where the simulation diverges.
    """
    mean, precision = problem.prior
    total = float(np.sum(precision * (z - mean) ** 2)) / 2
    for i, (r, std) in enumerate(zip(residual, residual_stds, strict=True)):
        measured = problem.measured_mask(i)
        edge = OUTLIER_STDS * std.typical[measured]
        with np.errstate(over="ignore"):  # of a diverging simulation: the cost is infinite
            loss = edge**2 * (np.sqrt(1 + (r[measured] / edge) ** 2) - 1)
            total += float(np.sum(loss / std.effective[measured] ** 2))
    return total if np.isfinite(total) else inf


def _linearise(
    problem: Problem,
    z: FloatArray,
    residual: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Return the gradient of the cost, (m,), and the data's information matrix, (m, m)."""
    mean, precision = problem.prior
    gradient = precision * (z - mean)
    for i, (std, jacobian) in enumerate(zip(residual_stds, jacobians, strict=True)):
        at, (r, weight) = problem.unknown_indices(i), weighted_residuals(residual[i], std)
        gradient[at] -= jacobian.reshape(-1, len(at)).T @ (weight * r).reshape(-1)
    return gradient, information_matrix(problem, residual, residual_stds, jacobians)


def information_matrix(
    problem: Problem,
    residual: Sequence[FloatArray],
    residual_stds: Sequence[ResidualStd],
    jacobians: Sequence[FloatArray],
    power: int = 1,
) -> FloatArray:
    """Compute the information of the data about the unknowns, ``sum of J' W J``.

    Parameters
    ----------
    problem
        The problem.
    residual, residual_stds
        For each segment.
    jacobians
        For each segment, (n, c, k).
    power
        The robust weight ``w = (1 + (r / k s)^2)^(-1/2)`` enters as ``w^power``: 1 gives the
        Gauss-Newton matrix of the iteration; 3 the second derivative of the loss, which states how
        the minimum moves with the data; 0 Fisher's information of Gaussian noise.

    Returns
    -------
    information
        (m, m).
    """
    information = np.zeros((problem.size, problem.size))
    for i, (std, jacobian) in enumerate(zip(residual_stds, jacobians, strict=True)):
        at, (_, weight) = problem.unknown_indices(i), weighted_residuals(residual[i], std, power)
        flat = jacobian.reshape(-1, len(at))
        information[np.ix_(at, at)] += (flat * weight.reshape(-1, 1)).T @ flat
    return information


def weighted_residuals(
    residual: FloatArray, std: ResidualStd, power: int = 1
) -> tuple[FloatArray, FloatArray]:
    """Return a segment's residuals, zero where nothing was measured, and their weights.

    Parameters
    ----------
    residual
        (n, c), NaN where not measured.
    std
        Of the same samples.
    power
        Of the robust weight, as in `information_matrix`.

    Returns
    -------
    residual, weight
        (n, c) each.
    """
    measured = np.isfinite(residual)
    r = np.where(measured, residual, 0.0)
    robust = 1 / np.sqrt(1 + (r / (OUTLIER_STDS * std.typical)) ** 2)
    return r, np.where(measured, robust**power / std.effective**2, 0.0)


def marginal_information(information: FloatArray, p: int) -> FloatArray:
    """Compute the information about the first p unknowns when the others are unknown.

    The Schur complement ``A - B D^+ B'`` of the blocks ``[[A, B], [B', D]]``; D is scaled to a
    unit diagonal before it is inverted.

    Parameters
    ----------
    information
        (m, m).
    p
        How many unknowns to keep.

    Returns
    -------
    information
        (p, p).

    Examples
    --------
    >>> import numpy as np
    >>> marginal_information(np.array([[2.0, 1.0], [1.0, 2.0]]), 1).round(6).tolist()
    [[1.5]]
    """
    own = information[p:, p:]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    across = information[:p, p:] / scale
    solved = np.linalg.lstsq(own / np.outer(scale, scale), across.T, rcond=None)[0]
    return np.asarray(information[:p, :p] - across @ solved)
