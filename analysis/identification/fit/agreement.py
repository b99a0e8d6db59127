"""Whether the runs of a fit agree with each other: each fitted alone against all at once.

For every run, the likelihood ratio compares the parameters of all runs with the run's own. Twice
its logarithm is a chi-squared variable with p degrees of freedom where the model is true and the
ship the same. A run with little information about the parameters contributes little, whatever
its own estimates are.

References
----------
S. S. Wilks, "The large-sample distribution of the likelihood ratio for testing composite
hypotheses", Annals of Mathematical Statistics 9, 1938. R. T. Birge, "The calculation of errors by
the method of least squares", Physical Review 40, 1932 (enlargement of errors).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan, sqrt

import numpy as np
from scipy.special import gammaincinv

from shiplog.types import FloatArray

from .least_squares import Minimum, ResidualStd, marginal_information, minimise, total_cost
from .output_error import OutputError, reweighted_fit
from .problem import Problem, residuals
from .segment import MIN_SEGMENT_SECS

SIGNIFICANCE = 0.01  # probability of a larger disagreement by chance
EFFECTIVE_PARAMETERS = 2  # degrees of freedom: the estimates are correlated
HALVES = ("first half", "second half")


@dataclass(frozen=True)
class Agreement:
    """How far the runs of a fit are from their common parameters.

    The ratios are in standard deviations per parameter: about 1 where the model is true and the
    ship the same.

    Attributes
    ----------
    names
        The runs, or the halves of a single run.
    by_own_noise
        Of each run, with the noise estimated from the run alone; NaN where it is too short.
    by_common_noise
        Of each run, with the noise of the fit to all, which includes their disagreement.
    outlier
        The run without which the others agree best; None with fewer than three runs.
    """

    names: tuple[str, ...]
    by_own_noise: tuple[float, ...]
    by_common_noise: tuple[float, ...]
    outlier: str | None = None

    @property
    def contradiction(self) -> float:
        """Combined ratio by the runs' own noise; 1 where it is not significant."""
        return _combined(self.by_own_noise)

    @property
    def enlargement(self) -> float:
        """Factor by which to enlarge standard errors from the common noise; 1 for none."""
        return _combined(self.by_common_noise)


def _combined(ratios: Sequence[float]) -> float:
    """Return the Birge ratio of all runs; 1 where it is not significant or there is one run."""
    finite = np.array(ratios)[np.isfinite(ratios)]
    if len(finite) < 2:
        return 1.0
    # of r runs, r - 1 are independent: their common parameters are fitted to them
    ratio = float(np.sum(finite**2)) / (len(finite) - 1)
    # the quantile of chi-squared over its degrees of freedom
    limit = (
        2 * float(gammaincinv(EFFECTIVE_PARAMETERS / 2, 1 - SIGNIFICANCE)) / EFFECTIVE_PARAMETERS
    )
    return float(np.sqrt(ratio)) if ratio > limit else 1.0


def assess_agreement(fit: OutputError) -> Agreement:
    """Assess how the runs of a fit agree, or the halves of a single run.

    Parameters
    ----------
    fit
        The fit to all runs.

    Returns
    -------
    Agreement
        Without any names where a single run is too short to be halved.
    """
    parts = _runs(fit) if len(fit.problem.runs) > 1 else _halves(fit)
    own_fits = [_fit_alone(part) for part in parts]
    names = tuple(part.name for part in parts)
    return Agreement(
        names,
        tuple(each.by_own_noise for each in own_fits),
        tuple(each.by_common_noise for each in own_fits),
        _find_outlier(names, own_fits),
    )


@dataclass(frozen=True, eq=False)
class _RunProblem:
    """A run, or half of one, as a problem of its own, with the unknowns of the fit to all."""

    name: str
    problem: Problem
    unknowns: FloatArray
    residual_stds: tuple[ResidualStd, ...]


def _runs(fit: OutputError) -> list[_RunProblem]:
    problem, z = fit.problem, fit.minimum.unknowns
    return [
        _RunProblem(
            problem.segments[run[0]].name, *problem.select_segments(run, z),
            tuple(fit.residual_stds[i] for i in run),
        )
        for run in problem.runs
    ]  # fmt: skip


def _halves(fit: OutputError) -> list[_RunProblem]:
    """Return the halves of a single run; none where they are too short."""
    segments, z = fit.problem.segments, fit.minimum.unknowns
    if min(len(segment) // 2 * segment.dt_secs for segment in segments) < MIN_SEGMENT_SECS:
        return []
    halves = []
    for number, name in enumerate(HALVES):
        cuts = [
            (len(segment) // 2, len(segment)) if number else (0, len(segment) // 2)
            for segment in segments
        ]
        parts = [segment.part(*cut) for segment, cut in zip(segments, cuts, strict=True)]
        problem = replace(fit.problem, segments=tuple(parts))
        residual_stds = (s.part(*cut) for s, cut in zip(fit.residual_stds, cuts, strict=True))
        unknowns = _with_new_states(problem, z) if number else z
        halves.append(_RunProblem(name, problem, unknowns, tuple(residual_stds)))
    return halves


def _with_new_states(problem: Problem, z: FloatArray) -> FloatArray:
    """Return the unknowns with initial states guessed anew: the segments start at other times."""
    changed, start = z.copy(), problem.start()
    for i in range(len(problem.segments)):
        at = problem.own_slice(i).start
        states = slice(at, at + len(problem.model.state))
        changed[states] = start[states]
    return changed


@dataclass(frozen=True, eq=False)
class _OwnFit:
    """A run fitted alone: the ratios of `Agreement`, its estimates and their information.

    `values` are (p,), `information` is (p, p).
    """

    by_own_noise: float
    by_common_noise: float
    values: FloatArray
    information: FloatArray


def _fit_alone(part: _RunProblem) -> _OwnFit:
    """Fit a run with the common parameters and with its own, by the common and by its own noise."""
    problem, common = part.problem, part.unknowns[: len(part.problem.free)]
    pinned = replace(problem, values=problem.parameters(part.unknowns), free=())
    with_common = minimise(pinned, part.unknowns[len(common) :], part.residual_stds)
    with_own = minimise(problem, np.concatenate((common, with_common.unknowns)), part.residual_stds)
    own = reweighted_fit(problem, with_own)
    pinned_by_own = minimise(pinned, with_common.unknowns, own.residual_stds)
    by_own = _squared_ratio(problem, common, pinned_by_own, own.minimum, own.residual_stds)
    by_common = _squared_ratio(problem, common, with_common, with_own, part.residual_stds)
    freedom = _freedom(own)
    precision = own.minimum.information + np.diag(problem.prior[1])
    return _OwnFit(
        by_own_noise=sqrt(by_own * freedom) if freedom > 0 else nan,
        by_common_noise=sqrt(by_common),
        values=own.parameters[list(problem.free)],
        information=marginal_information(precision, len(common)),
    )


def _squared_ratio(
    problem: Problem,
    common: FloatArray,
    pinned: Minimum,
    free: Minimum,
    residual_stds: Sequence[ResidualStd],
) -> float:
    """Return twice the log likelihood ratio of the common and the own parameters, over p."""
    z = np.concatenate((common, pinned.unknowns))
    excess = total_cost(problem, z, residuals(problem, z), residual_stds) - free.cost
    return max(2 * excess, 0.0) / len(common) if np.isfinite(excess) else np.nan


def _freedom(fit: OutputError) -> float:
    """Return the residual degrees of freedom over the number of independent samples.

    Slow noise leaves few independent samples, and the more unknowns are fitted to them, the
    smaller the residuals look. Zero or below where there are more unknowns than samples.
    """
    problem = fit.problem
    independent = sum(
        float(np.sum((std.typical / std.effective)[problem.measured_mask(i)] ** 2))
        for i, std in enumerate(fit.residual_stds)
    )
    information = fit.minimum.information
    precision = np.diag(problem.prior[1])
    # the effective number of unknowns, trace (I + P)^-1 I: those determined by the prior count less
    fitted = float(np.trace(np.linalg.lstsq(information + precision, information, rcond=None)[0]))
    return 1 - fitted / independent


def _find_outlier(names: Sequence[str], own_fits: Sequence[_OwnFit]) -> str | None:
    """Return the run without which the others agree best."""
    if len(names) < 3:
        return None
    scatter = [
        _scatter([each for j, each in enumerate(own_fits) if j != i]) for i in range(len(own_fits))
    ]
    return names[int(np.argmin(scatter))]


def _scatter(runs: Sequence[_OwnFit]) -> float:
    """Return the sum of squared deviations from the mean, both weighted by the information."""
    total = sum(each.information for each in runs)
    weighted = sum(each.information @ each.values for each in runs)
    mean = np.linalg.lstsq(np.asarray(total), np.asarray(weighted), rcond=None)[0]
    deviations = [each.values - mean for each in runs]
    return float(sum(x @ each.information @ x for x, each in zip(deviations, runs, strict=True)))
