"""How far the parameters of a fit may be off, by what the data themselves show.

Four answers, for four reasons to be off. The Cramér-Rao bound is of white noise of the size
found. What stays off for a while makes it too small; White's sandwich with Newey and West's (1987)
sums allows for that. What differs from run to run, as the ship's trim and her rudder's zero do,
shows when each run is left out in turn (the jackknife; Tukey, 1958). And where there are too few
runs for that, it shows how much more they differ than they should if the model were true: all
errors are enlarged by so much (Birge, 1932; `agreement`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from analysis.regression.newey_west import few_rows
from shiplog.types import FloatArray

from .agreement import Agreement, assess_agreement
from .least_squares import information_matrix, marginal_information, minimise, weighted_residuals
from .output_error import OutputError
from .problem import Problem, residuals

LEAST_RUNS = 4  # for a jackknife
LEAST_WINDOW_SECS = 5.0  # over which neighbours are taken together, at the least
UNIDENTIFIABLE = 0.25  # relative std of a parameter that these data cannot tell,
NEGLIGIBLE = 0.05  # unless the std is so small a part of what it is of ships in general,
ECHO = 0.5  # and how much of it may be what was believed before
NOTHING = 1e-200  # of information: its inverse is still a number
SINGULAR = 1e-13  # of the scaled information: less of it is none


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the p parameters sought. `std` is the one to be believed; the others say why."""

    names: tuple[str, ...]
    values: FloatArray  # (p,)
    std: FloatArray  # (p,) half the 95 % interval over 1.96
    bound: FloatArray  # (p,) Cramér and Rao's
    coloured: FloatArray  # (p,) for noise that stays
    between_runs: FloatArray  # (p,) by the jackknife; NaN with too few runs
    agreement: Agreement  # of the runs with each other
    enlargement: float  # by how much, for runs that do not agree
    prior_share: FloatArray  # (p,) of each value: how much of it was believed before any data
    covariance: FloatArray  # (p, p) that `std` is of
    condition: float  # of the scaled information on the parameters
    sizes: FloatArray  # (p,) what the values are of ships in general

    @property
    def interval(self) -> FloatArray:
        """(p, 2) in which 95 of 100 times the truth is."""
        return np.column_stack((self.values - 1.96 * self.std, self.values + 1.96 * self.std))

    @property
    def correlation(self) -> FloatArray:
        """(p, p) between them."""
        scale = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(scale, scale))

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """The parameters that are not identifiable from these data.

        One that is small beside what it is of other ships is told by that measure.
        """
        sure = self.std <= np.maximum(UNIDENTIFIABLE * np.abs(self.values), NEGLIGIBLE * self.sizes)
        told = sure & (self.prior_share <= ECHO)
        return tuple(name for name, is_told in zip(self.names, told, strict=True) if not is_told)


def uncertainty(fit: OutputError, *, between_runs: bool = True) -> Uncertainty:
    """How far off a fit's parameters may be.

    With `between_runs` each run, or of a single one each half, is fitted by itself, and where there
    are enough the fit is repeated without each in turn.
    """
    problem, z = fit.problem, fit.minimum.unknowns
    p = len(problem.free)
    left = residuals(problem, z)
    curvature = information_matrix(problem, left, fit.residual_stds, fit.minimum.jacobians, power=3)
    inverse = _inverse(problem, curvature)
    share = np.diag(inverse)[:p] * problem.prior[1][:p]
    bound = _stds(_inverse(problem, _white_information(fit, left)))[:p]
    covariance = _sandwich(fit, left, inverse)[:p, :p]
    coloured = _stds(covariance)
    jackknife, agreement = np.full(p, np.nan), Agreement((), (), ())
    if between_runs:
        agreement = assess_agreement(fit)
        if len(problem.runs) >= LEAST_RUNS:
            jackknife = _jackknife(_left_out(fit))
    enlarged = 1.0 if np.isfinite(jackknife).any() else agreement.enlargement
    std = np.fmax(np.maximum(coloured, bound) * enlarged, jackknife)
    grown = std / np.where(coloured > 0, coloured, 1.0)
    whole = fit.minimum.information + np.diag(problem.prior[1])
    return Uncertainty(
        problem.free_names, z[:p].copy(), std, bound, coloured, jackknife, agreement, enlarged,
        share, covariance * np.outer(grown, grown), _condition(whole, p),
        np.array([problem.model.parameters[i].size for i in problem.free]),
    )  # fmt: skip


def _inverse(problem: Problem, information: FloatArray) -> FloatArray:
    """The covariance of all unknowns; what nothing tells has a variance beyond all bounds."""
    whole = information + np.diag(problem.prior[1])
    scale = np.sqrt(np.maximum(np.diag(whole), NOTHING))
    values, vectors = np.linalg.eigh(whole / np.outer(scale, scale))
    scaled = (vectors / np.maximum(values, SINGULAR)) @ vectors.T
    return np.asarray(scaled / np.outer(scale, scale))


def _condition(whole: FloatArray, p: int) -> float:
    """Of the root of the parameters' scaled information, the nuisances eliminated."""
    left = marginal_information(whole, p)
    size = np.sqrt(np.maximum(np.diag(left), 1e-300))
    values = np.linalg.eigvalsh(left / np.outer(size, size))
    return float(np.sqrt(values[-1] / max(values[0], 1e-16)))


def _stds(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _white_information(fit: OutputError, left: Sequence[FloatArray]) -> FloatArray:
    """Fisher's information if each sample were off by itself."""
    white = [replace(spread, effective=spread.typical) for spread in fit.residual_stds]
    return information_matrix(fit.problem, left, white, fit.minimum.jacobians, power=0)


def _sandwich(fit: OutputError, left: Sequence[FloatArray], inverse: FloatArray) -> FloatArray:
    """White's covariance, neighbouring scores summed over windows as Newey and West have it."""
    problem, middle = fit.problem, np.diag(fit.problem.prior[1])
    longest = max(noise.slow_secs for noise in fit.noises)
    for i, spread in enumerate(fit.residual_stds):
        off, weight = weighted_residuals(left[i], spread)
        scores = np.einsum("ncq,nc->nq", fit.minimum.jacobians[i], weight * off)
        together = max(longest, LEAST_WINDOW_SECS) / problem.segments[i].dt_secs
        window = int(min(max(together, 1), len(scores) / 2))
        sums = np.cumsum(scores, axis=0)
        ends = np.vstack((sums, np.tile(sums[-1], (window, 1))))
        starts = np.vstack((np.zeros((window, sums.shape[1])), sums))
        runs = ends - starts
        at = problem.unknown_indices(i)
        middle[np.ix_(at, at)] += (
            float(few_rows(window / len(scores))) ** 2 * (runs.T @ runs) / window
        )
    return np.asarray(inverse @ middle @ inverse)


def _left_out(fit: OutputError) -> FloatArray:
    """The parameters without each run in turn, (r, p), of the fits that came to an end."""
    problem, found = fit.problem, []
    for run in problem.runs:
        kept = [i for i in range(len(problem.segments)) if i not in run]
        rest, start = problem.select_segments(kept, fit.minimum.unknowns)
        minimum = minimise(rest, start, [fit.residual_stds[i] for i in kept])
        if minimum.converged:
            found.append(minimum.unknowns[: len(problem.free)])
    return np.array(found).reshape(-1, len(problem.free))


def _jackknife(others: FloatArray) -> FloatArray:
    """The std of what was found without each run in turn, its few runs allowed for."""
    count = len(others)
    if count < LEAST_RUNS:
        return np.full(others.shape[1], np.nan)
    spread = np.sum((others - others.mean(axis=0)) ** 2, axis=0) * (count - 1) / count
    return np.asarray(np.sqrt(spread) * stdtrit(count - 1, 0.975) / 1.96)
