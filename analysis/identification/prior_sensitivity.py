"""The echo test: the fit once more, from other beliefs and another start.

What a value changes by, over what was changed before any data, is how much of it is prior. Where
parameters have no prior the search only begins elsewhere, and must come back.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.identification.comparison.history import two_priors
from shiplog.types import FloatArray

from .least_squares import minimise
from .output_error import OutputError
from .problem import Problem
from .uncertainty import Uncertainty

ELSEWHERE = 2.0  # of cost, in squared standard deviations over two: another minimum


@dataclass(frozen=True, eq=False)
class PriorSensitivity:
    """A second run of a fit."""

    shares: FloatArray  # (p,) of each value, how much is prior; NaN where the run ended elsewhere
    worse_by: float  # its cost over what it would have been where the fit is; below zero: better

    @property
    def elsewhere(self) -> bool:
        """Whether it ended in another minimum."""
        return not abs(self.worse_by) < ELSEWHERE


def prior_sensitivity(fit: OutputError, told: Uncertainty) -> PriorSensitivity:
    """Fit once more, each prior moved by its standard deviation, each start by much."""
    problem, p = fit.problem, len(told.names)
    moved = _with_other_priors(problem)
    start = fit.minimum.unknowns.copy()
    start[:p] = two_priors(told, moved.bounds)[0]
    again = minimise(moved, start, fit.residual_stds)
    there = minimise(moved, fit.minimum.unknowns, fit.residual_stds, fit.minimum.jacobians)
    worse_by = again.cost - there.cost if np.isfinite(again.cost) else np.inf
    before = np.abs(moved.prior[0] - problem.prior[0])[:p]
    before = np.where(before > 0, before, np.abs(start - fit.minimum.unknowns)[:p])
    changed = np.abs(again.unknowns - fit.minimum.unknowns)[:p]
    echo = PriorSensitivity(changed / np.where(before > 0, before, np.inf), float(worse_by))
    return replace(echo, shares=np.full(p, np.nan)) if echo.elsewhere else echo


def _with_other_priors(problem: Problem) -> Problem:
    """The same problem, its parameters believed elsewhere, by turns higher and lower."""
    model, parameters = problem.model, list(problem.model.parameters)
    for k, i in enumerate(problem.free):
        parameter = parameters[i]
        if np.isfinite(parameter.prior_std):
            to = parameter.start + parameter.prior_std * (-1 if k % 2 else 1)
            parameters[i] = replace(parameter, start=to)
    return replace(problem, model=replace(model, parameters=tuple(parameters)))
