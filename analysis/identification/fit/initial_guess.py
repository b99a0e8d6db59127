"""Initial guesses of a fit: the values asked for, or a regression on the data.

For the paper's model the weak (integral) form gives every coefficient by linear least squares
without a guess. The other models start from the values in their modules, which lie within reach of
most ships.
"""

from collections.abc import Sequence

import numpy as np

from analysis.regression.sliding import RegressionAccumulator
from analysis.regression.weak_form import CHANNELS, Equation, Rows, weak_form
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .least_squares import ResidualStd, total_cost
from .problem import Problem, residuals

# the coefficients of each equation to solve for, the richest set first
YAW_FORMS = (("a", "b1", "b2", "b3", "d", "e"), ("a", "b1", "b2", "d", "e"), ("a", "b1", "d", "e"))
SURGE_FORMS = (("f", "g", "h"), ("f", "h"))


def initial_guesses(problem: Problem, residual_stds: Sequence[ResidualStd]) -> list[FloatArray]:
    """Return starts of the minimisation, the one of the lowest cost first.

    Parameters
    ----------
    problem
        The problem, whose `values` are one start.
    residual_stds
        For each segment, to compute the cost.

    Returns
    -------
    starts
        One or two vectors of unknowns, (m,) each.
    """
    given = problem.start()
    starts = [given]
    if problem.model.kind is Coefficients:
        starts.append(_with_parameters(problem, given, _weak_form_estimates(problem)))
    costs = [total_cost(problem, z, residuals(problem, z), residual_stds) for z in starts]
    return [starts[i] for i in np.argsort(costs, kind="stable")]


def _with_parameters(problem: Problem, start: FloatArray, values: dict[str, float]) -> FloatArray:
    """Return the start with these values of its free parameters, within their bounds."""
    changed = start.copy()
    for at, name in enumerate(problem.free_names):
        changed[at] = values.get(name, changed[at])
    lowest, highest = problem.bounds
    return np.clip(changed, lowest, highest)


def _weak_form_estimates(problem: Problem) -> dict[str, float]:
    """Estimate the paper's coefficients from all segments; 0 for an undetermined b2 or b3."""
    model = problem.model.coefficients(problem.values)
    pairs = [
        weak_form(segment.signals, model)
        for segment in problem.segments
        if all(segment.has(name) for name in CHANNELS if name in MODEL_OUTPUTS)
    ]
    estimates: dict[str, float] = {}
    for rows, forms in (([p[0] for p in pairs], YAW_FORMS), ([p[1] for p in pairs], SURGE_FORMS)):
        estimates |= _solve(rows, forms)
    if "d" in estimates:
        estimates |= {"b2": estimates.get("b2", 0.0), "b3": estimates.get("b3", 0.0)}
        estimates["T3"] = estimates["e"] / estimates["d"] if estimates["d"] else 0.0
    return estimates


def _solve(rows: Sequence[Rows], forms: tuple[tuple[str, ...], ...]) -> dict[str, float]:
    """Return the coefficients of the first form that the rows determine; empty if none."""
    if not rows:
        return {}
    equation: Equation = rows[0].equation
    regression = RegressionAccumulator(equation)
    for part in rows:
        regression.add(part)
    for names in forms:
        solution = regression.solve(names)
        if solution.determined.all():
            return dict(zip(names, solution.values.tolist(), strict=True))
    return {}
