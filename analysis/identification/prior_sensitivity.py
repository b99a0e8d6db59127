"""Dependence of a fit on its priors, by a second fit from other priors."""

from dataclasses import dataclass, replace

import numpy as np

from analysis.identification.comparison.history import two_priors
from analysis.identification.fit.least_squares import minimise
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.problem import Problem
from analysis.identification.fit.uncertainty import Uncertainty
from shiplog.types import FloatArray

MAX_COST_DIFFERENCE = 2.0  # half a sum of squared standard deviations; beyond it another minimum


@dataclass(frozen=True, eq=False)
class PriorSensitivity:
    """Result of a second fit from shifted priors.

    Attributes
    ----------
    shares
        (p,) the change of each free parameter over the change of its prior: 0 where the data alone
        determine it, 1 where it copies the prior. NaN where the second fit ended in another
        minimum.
    worse_by
        The cost of the second fit minus the cost, under the shifted priors, of the minimum nearest
        to the first fit. Negative where the second fit is better, infinite where it diverged.
    """

    shares: FloatArray
    worse_by: float

    @property
    def other_minimum(self) -> bool:
        """Whether the second fit ended in another minimum."""
        return not abs(self.worse_by) < MAX_COST_DIFFERENCE


def prior_sensitivity(fit: OutputError, fitted: Uncertainty) -> PriorSensitivity:
    """Repeat a fit with each prior shifted by its standard deviation and each start moved away.

    A parameter without a prior is only started elsewhere, and its share is the part of that
    distance at which it remains.

    Parameters
    ----------
    fit
        The fit to repeat; the noise is not estimated again.
    fitted
        Its values and standard deviations, from which the other start is chosen (`two_priors`).

    Returns
    -------
    sensitivity
        Share of the prior in each free parameter.
    """
    problem, p = fit.problem, len(fitted.names)
    shifted = _with_shifted_priors(problem)
    start = fit.minimum.unknowns.copy()
    start[:p] = two_priors(fitted, shifted.bounds)[0]
    second = minimise(shifted, start, fit.residual_stds)
    nearest = minimise(shifted, fit.minimum.unknowns, fit.residual_stds, fit.minimum.jacobians)
    worse_by = second.cost - nearest.cost if np.isfinite(second.cost) else np.inf
    shift = np.abs(shifted.prior[0] - problem.prior[0])[:p]
    shift = np.where(shift > 0, shift, np.abs(start - fit.minimum.unknowns)[:p])
    change = np.abs(second.unknowns - fit.minimum.unknowns)[:p]
    result = PriorSensitivity(change / np.where(shift > 0, shift, np.inf), float(worse_by))
    return replace(result, shares=np.full(p, np.nan)) if result.other_minimum else result


def _with_shifted_priors(problem: Problem) -> Problem:
    """Shift the priors of the free parameters by a standard deviation, alternately up and down."""
    model, parameters = problem.model, list(problem.model.parameters)
    for k, i in enumerate(problem.free):
        parameter = parameters[i]
        if np.isfinite(parameter.prior_std):
            centre = parameter.start + parameter.prior_std * (-1 if k % 2 else 1)
            parameters[i] = replace(parameter, start=centre)
    return replace(problem, model=replace(model, parameters=tuple(parameters)))
