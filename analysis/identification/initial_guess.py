"""Where a fit begins: at what was asked for, or at what the data say at a glance.

Of the paper's model the weak form gives every coefficient without a guess, by least squares; of the
others the starts in their files lie within reach of most ships.
"""

from collections.abc import Sequence

import numpy as np

from analysis.regression.sliding import Regression
from analysis.regression.weak_form import CHANNELS, Equation, Rows, weak_form
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .least_squares import ResidualStd, total_cost
from .problem import Problem, residuals

YAW_FORMS = (("a", "b1", "b2", "b3", "d", "e"), ("a", "b1", "b2", "d", "e"), ("a", "b1", "d", "e"))
SURGE_FORMS = (("f", "g", "h"), ("f", "h"))


def initial_guesses(problem: Problem, residual_stds: Sequence[ResidualStd]) -> list[FloatArray]:
    """Unknowns to begin with, those that fit best first."""
    given = problem.start()
    found = [given]
    if problem.model.kind is Coefficients:
        found.append(_moved(problem, given, _by_weak_form(problem)))
    costs = [total_cost(problem, z, residuals(problem, z), residual_stds) for z in found]
    return [found[i] for i in np.argsort(costs, kind="stable")]


def _moved(problem: Problem, start: FloatArray, values: dict[str, float]) -> FloatArray:
    """The start with these values of its parameters."""
    moved = start.copy()
    for at, name in enumerate(problem.free_names):
        moved[at] = values.get(name, moved[at])
    lowest, highest = problem.bounds
    return np.clip(moved, lowest, highest)


def _by_weak_form(problem: Problem) -> dict[str, float]:
    """The paper's coefficients by the rows of all segments; 0 for an undetermined b2 or b3."""
    model = problem.model.coefficients(problem.values)
    pairs = [
        weak_form(segment.signals, model)
        for segment in problem.segments
        if all(segment.has(name) for name in CHANNELS if name in MODEL_OUTPUTS)
    ]
    found: dict[str, float] = {}
    for rows, forms in (([p[0] for p in pairs], YAW_FORMS), ([p[1] for p in pairs], SURGE_FORMS)):
        found |= _solved(rows, forms)
    if "d" in found:
        found |= {"b2": found.get("b2", 0.0), "b3": found.get("b3", 0.0)}
        found["T3"] = found["e"] / found["d"] if found["d"] else 0.0
    return found


def _solved(rows: Sequence[Rows], forms: tuple[tuple[str, ...], ...]) -> dict[str, float]:
    """The coefficients of the first form the rows can tell."""
    if not rows:
        return {}
    equation: Equation = rows[0].equation
    regression = Regression(equation)
    for part in rows:
        regression.add(part)
    for names in forms:
        solution = regression.solve(names)
        if solution.told.all():
            return dict(zip(names, solution.values.tolist(), strict=True))
    return {}
