"""Standard errors of a fit's parameters, and which of them the data do not determine.

Four estimates, for four sources of error:

- the Cramér-Rao bound: white noise of the size found, covariance ``(I + P)^-1`` with the
  information I of the data and the precision P of the prior;
- the sandwich covariance ``H^-1 M H^-1`` for residuals correlated in time: H is the Hessian of the
  cost, M the covariance of the summed scores with the weights of Newey and West;
- the jackknife, for what differs from run to run, as trim and rudder zero do: the fit without each
  run in turn;
- with too few runs for that, the enlargement of all errors by the Birge ratio of the runs'
  disagreement (`agreement`).

References
----------
H. Cramér, "Mathematical Methods of Statistics", 1946, section 32.3. H. White, "Maximum likelihood
estimation of misspecified models", Econometrica 50, 1982. W. K. Newey and K. D. West, "A simple,
positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix",
Econometrica 55, 1987. J. W. Tukey, "Bias and confidence in not quite large samples", Annals of
Mathematical Statistics 29, 1958. R. T. Birge, "The calculation of errors by the method of least
squares", Physical Review 40, 1932.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from analysis.regression.newey_west import small_sample_factor
from shiplog.types import FloatArray

from .agreement import Agreement, assess_agreement
from .drift import unobserved_parameters
from .least_squares import information_matrix, marginal_information, minimise, weighted_residuals
from .output_error import OutputError
from .problem import Problem, residuals

MIN_JACKKNIFE_RUNS = 4
MIN_WINDOW_SECS = 5.0  # of the sums of neighbouring scores
MAX_RELATIVE_STD = 0.25  # of an identifiable parameter, relative to its value
MAX_STD_SHARE = 0.05  # or else relative to its magnitude for ships in general
MAX_PRIOR_SHARE = 0.5  # of an identifiable parameter's value
MIN_INFORMATION = 1e-200  # whose inverse is still a number
MIN_EIGENVALUE = 1e-13  # of the scaled information: smaller ones are rounding errors


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Uncertainty of the p free parameters of a fit.

    Attributes
    ----------
    names, values
        (p,) the parameters and their estimates.
    std
        (p,) standard errors to use: the largest of the others. The 95 % interval is 1.96 of them
        to either side.
    bound
        (p,) Cramér-Rao bound.
    coloured
        (p,) by the sandwich covariance, for residuals correlated in time.
    between_runs
        (p,) by the jackknife; NaN with fewer than `MIN_JACKKNIFE_RUNS` runs.
    agreement
        Of the runs with each other.
    enlargement
        Factor in `std` for runs that disagree; 1 for none.
    prior_share
        (p,) how much of each value is due to its prior, 0 to 1.
    covariance
        (p, p) with the standard errors `std`.
    condition
        Condition number of the root of the scaled information about the parameters.
    sizes
        (p,) the parameters' magnitudes for ships in general.
    unobserved
        Those of the sway equation where nothing that was measured shows the drift, as of
        `unobserved_parameters`.
    """

    names: tuple[str, ...]
    values: FloatArray
    std: FloatArray
    bound: FloatArray
    coloured: FloatArray
    between_runs: FloatArray
    agreement: Agreement
    enlargement: float
    prior_share: FloatArray
    covariance: FloatArray
    condition: float
    sizes: FloatArray
    unobserved: tuple[str, ...] = ()

    @property
    def interval(self) -> FloatArray:
        """(p, 2) 95 % intervals."""
        return np.column_stack((self.values - 1.96 * self.std, self.values + 1.96 * self.std))

    @property
    def correlation(self) -> FloatArray:
        """(p, p) correlation of the estimates."""
        scale = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(scale, scale))

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """The parameters that these data do not determine.

        Their standard error exceeds both `MAX_RELATIVE_STD` of the value and `MAX_STD_SHARE` of
        the magnitude for ships in general, or more than `MAX_PRIOR_SHARE` of the value is prior, or
        they are `unobserved`.
        """
        limit = np.maximum(MAX_RELATIVE_STD * np.abs(self.values), MAX_STD_SHARE * self.sizes)
        identifiable = (self.std <= limit) & (self.prior_share <= MAX_PRIOR_SHARE)
        return tuple(
            name
            for name, ok in zip(self.names, identifiable, strict=True)
            if not ok or name in self.unobserved
        )


def uncertainty(fit: OutputError, *, between_runs: bool = True) -> Uncertainty:
    """Estimate the uncertainty of a fit's parameters.

    Parameters
    ----------
    fit
        The fit.
    between_runs
        Whether to fit each run alone (of a single run, each half) and, with at least
        `MIN_JACKKNIFE_RUNS` runs, all runs but each one in turn. Without it `std` covers the noise
        only.

    Returns
    -------
    Uncertainty
        Standard errors, intervals, and what is unidentifiable.
    """
    problem, z = fit.problem, fit.minimum.unknowns
    p = len(problem.free)
    residual = residuals(problem, z)
    curvature = information_matrix(
        problem, residual, fit.residual_stds, fit.minimum.jacobians, power=3
    )
    inverse = _covariance(problem, curvature)
    prior_share = np.diag(inverse)[:p] * problem.prior[1][:p]
    bound = _stds(_covariance(problem, _white_information(fit, residual)))[:p]
    covariance = _sandwich(fit, residual, inverse)[:p, :p]
    coloured = _stds(covariance)
    jackknife, agreement = np.full(p, np.nan), Agreement((), (), ())
    if between_runs:
        agreement = assess_agreement(fit)
        if len(problem.runs) >= MIN_JACKKNIFE_RUNS:
            jackknife = _jackknife_std(_leave_one_out(fit))
    enlargement = 1.0 if np.isfinite(jackknife).any() else agreement.enlargement
    std = np.fmax(np.maximum(coloured, bound) * enlargement, jackknife)
    factor = std / np.where(coloured > 0, coloured, 1.0)
    precision = fit.minimum.information + np.diag(problem.prior[1])
    return Uncertainty(
        names=problem.free_names,
        values=z[:p].copy(),
        std=std,
        bound=bound,
        coloured=coloured,
        between_runs=jackknife,
        agreement=agreement,
        enlargement=enlargement,
        prior_share=prior_share,
        covariance=covariance * np.outer(factor, factor),
        condition=_condition(precision, p),
        sizes=np.array([problem.model.parameters[i].size for i in problem.free]),
        unobserved=unobserved_parameters(problem),
    )


def parameter_covariance(fit: OutputError) -> FloatArray:
    """Return the covariance of the unknowns that all runs share, (k, k), from noise and priors.

    The free parameters come first, then the rudder zero.
    """
    common = fit.problem.common
    return _covariance(fit.problem, fit.minimum.information)[:common, :common]


def _covariance(problem: Problem, information: FloatArray) -> FloatArray:
    """Invert information plus prior, (m, m); what nothing determines gets a huge variance."""
    precision = information + np.diag(problem.prior[1])
    scale = np.sqrt(np.maximum(np.diag(precision), MIN_INFORMATION))
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    scaled = (vectors / np.maximum(values, MIN_EIGENVALUE)) @ vectors.T
    return np.asarray(scaled / np.outer(scale, scale))


def _condition(precision: FloatArray, p: int) -> float:
    """Return the condition number of the root of the parameters' scaled information.

    The other unknowns are eliminated.
    """
    marginal = marginal_information(precision, p)
    size = np.sqrt(np.maximum(np.diag(marginal), 1e-300))
    values = np.linalg.eigvalsh(marginal / np.outer(size, size))
    return float(np.sqrt(values[-1] / max(values[0], 1e-16)))


def _stds(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _white_information(fit: OutputError, residual: Sequence[FloatArray]) -> FloatArray:
    """Return Fisher's information if all residuals were independent, (m, m)."""
    white = [replace(std, effective=std.typical) for std in fit.residual_stds]
    return information_matrix(fit.problem, residual, white, fit.minimum.jacobians, power=0)


def _sandwich(fit: OutputError, residual: Sequence[FloatArray], inverse: FloatArray) -> FloatArray:
    """Return the sandwich covariance, (m, m).

    The covariance of the scores is summed over all windows of the residuals' correlation time,
    which gives the triangular weights of Newey and West; few windows are corrected for.
    """
    problem, middle = fit.problem, np.diag(fit.problem.prior[1])
    correlation_secs = max(*(noise.slow_secs for noise in fit.noises), MIN_WINDOW_SECS)
    for i, std in enumerate(fit.residual_stds):
        r, weight = weighted_residuals(residual[i], std)
        scores = np.einsum("ncq,nc->nq", fit.minimum.jacobians[i], weight * r)
        samples = correlation_secs / problem.segments[i].dt_secs
        window = int(min(max(samples, 1), len(scores) / 2))
        sums = np.cumsum(scores, axis=0)
        ends = np.vstack((sums, np.tile(sums[-1], (window, 1))))
        starts = np.vstack((np.zeros((window, sums.shape[1])), sums))
        windows = ends - starts
        at = problem.unknown_indices(i)
        middle[np.ix_(at, at)] += (
            float(small_sample_factor(window / len(scores))) ** 2 * (windows.T @ windows) / window
        )
    return np.asarray(inverse @ middle @ inverse)


def _leave_one_out(fit: OutputError) -> FloatArray:
    """Return the parameters fitted without each run in turn, (r, p), where the fits converge."""
    problem, estimates = fit.problem, []
    for run in problem.runs:
        kept = [i for i in range(len(problem.segments)) if i not in run]
        rest, start = problem.select_segments(kept, fit.minimum.unknowns)
        minimum = minimise(rest, start, [fit.residual_stds[i] for i in kept])
        if minimum.converged:
            estimates.append(minimum.unknowns[: len(problem.free)])
    return np.array(estimates).reshape(-1, len(problem.free))


def _jackknife_std(estimates: FloatArray) -> FloatArray:
    """Return the jackknife's standard error, (p,), of leave-one-out estimates, (r, p).

    Student's t with r - 1 degrees of freedom widens it, so that 1.96 of it is a 95 % interval.
    """
    count = len(estimates)
    if count < MIN_JACKKNIFE_RUNS:
        return np.full(estimates.shape[1], np.nan)
    variance = np.sum((estimates - estimates.mean(axis=0)) ** 2, axis=0) * (count - 1) / count
    return np.asarray(np.sqrt(variance) * stdtrit(count - 1, 0.975) / 1.96)
