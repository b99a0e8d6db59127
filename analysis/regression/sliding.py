"""The sliding-window identifier: the model's coefficients, and how they settled.

Burylin's eq. (7) by least squares over a window that slides along the trial, each equation in
its integral form (`weak_form`). Columns are scaled to unit length before anything is solved or
any condition number is told.

Rows may come in chunks, and how they are parted changes no result: `Windows` takes them once, the
whole trial's fit twice, once for the values (`Regression`) and once for the errors (`Errors`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .batched_qr import Solutions, solve_one
from .newey_west import add_runs, few_rows, no_runs, variances, window_variances
from .weak_form import Equation, Rows
from .window_qr import no_rows, push, rotate_all

WINDOW_SECS = 200.0
RICHEST = 400.0  # condition of a window beyond which it is blank: in a steady turn it is so
WORST_CONDITION = 1e4  # the same of a whole trial, of which each coefficient is judged by itself:
WORST_INFLATION = 150.0  # how much less sure than alone, for what the others can do in its place
CORRELATED = 1 / 3  # of a bump's width: over this its curvature keeps its sign


@dataclass(frozen=True, eq=False)
class History:
    """Coefficients window by window; NaN where a window cannot tell."""

    names: tuple[str, ...]
    time_secs: FloatArray  # (k,) the end of each window, since the signals' start
    values: FloatArray  # (k, p)
    stds: FloatArray  # (k, p)
    conditions: FloatArray  # (k,) of the column-scaled regressors


@dataclass(frozen=True, eq=False)
class Fit:
    """Least squares over some rows."""

    values: FloatArray  # (p,), NaN for a column that is zero throughout, or if nothing can be told
    stds: FloatArray  # (p,)
    condition: float  # of the column-scaled regressors


def fit(rows: Rows) -> Fit:
    """Column-scaled least squares with errors that allow for overlapping, coloured residuals.

    The covariance is Newey and West's (1987) over the rows that share data, enlarged for the
    freedom that the coefficients take of the rows that could differ, and for the few rows beside
    their overlap, so that two standard deviations are a 95 % interval (Kiefer and Vogelsang,
    "A new asymptotic theory for heteroskedasticity-autocorrelation robust tests", 2005). What the
    rows cannot tell is NaN: where nothing moved, or where other coefficients can do what
    one does.
    """
    regression = Regression(rows.equation)
    regression.add(rows)
    errors = Errors(regression.solve())
    errors.add(rows)
    return errors.result()


class Windows:
    """The history of a trial whose rows come in chunks."""

    def __init__(self, equation: Equation, count: int, window_secs: float = WINDOW_SECS) -> None:
        """Of `count` rows in all."""
        reach = round((window_secs - equation.bump_secs) / equation.stride_secs) + 1
        self._length = max(1, min(count, reach))
        self._stacks = no_rows(self._length, len(equation.names))
        self._known: FloatArray = np.empty((0, len(equation.names) + 1))  # rows of the next windows

    def step(self, rows: Rows) -> History:
        """The windows that end in the next rows: none, before there are enough."""
        found, tallies = push(self._stacks, rows.regressors, rows.target, rows.excitation)
        conditions, told, enlarged = _judge(
            found, tallies, rows.equation, rows.least_excitation, RICHEST
        )
        new, known = _known(rows)
        ends = len(self._known) + np.cumsum(known)[len(known) - len(tallies) :]
        held = np.concatenate((self._known, new))
        self._known = held[len(held) - min(len(held), self._length) :].copy()
        spans = np.column_stack((ends - tallies[:, 0].astype(np.int64), ends))
        wanted = np.asarray(told.any(axis=0))
        stds = enlarged * np.sqrt(
            window_variances(
                held.T.copy(), spans, wanted, found.values, found.inverses, rows.equation.overlap
            )
        )
        return History(
            rows.equation.names,
            rows.centres_secs[len(known) - len(tallies) :] + rows.equation.bump_secs / 2,
            np.where(told, found.values, np.nan).T.copy(),
            np.where(told, stds, np.nan).T.copy(),
            conditions,
        )


@dataclass(frozen=True, eq=False)
class Solution:
    """What the first pass over a whole trial finds, and what the second needs of it."""

    values: FloatArray  # (p,) zero for a column that is zero throughout
    condition: float
    told: NDArray[np.bool_]  # (p,) whether the rows can tell the value
    inverse: FloatArray  # (p, p) of X'X
    enlarged: float  # the errors, for the freedom taken and the few rows
    overlap: int


class Regression:
    """The first pass over a whole trial whose rows come in chunks: the values."""

    def __init__(self, equation: Equation) -> None:
        p = len(equation.names)
        self._equation, self._least_excitation = equation, 0.0
        self._factor = np.zeros((p, p + 1))
        self._tally = np.array([0.0, np.inf, -np.inf])  # rows, least and greatest excitation

    def add(self, rows: Rows) -> None:
        """The next rows."""
        new, known = _known(rows)
        moved, self._least_excitation = rows.excitation[known], rows.least_excitation
        rotate_all(self._factor, new)
        count, least, greatest = self._tally
        self._tally = np.array(
            [count + len(new), np.min(moved, initial=least), np.max(moved, initial=greatest)]
        )

    def solve(self, names: tuple[str, ...] | None = None) -> Solution:
        """The values over the rows so far, as if there were no regressors but those of `names`."""
        factor = self._factor
        if names is not None:
            columns = [self._equation.names.index(name) for name in names]
            factor = np.zeros((len(names), len(names) + 1))
            rotate_all(factor, self._factor[:, [*columns, -1]].copy())
        found = solve_one(factor)
        conditions, told, enlarged = _judge(
            found, self._tally[None, :], self._equation, self._least_excitation, WORST_CONDITION
        )
        return Solution(
            found.values[:, 0].copy(),
            float(conditions[0]),
            told[:, 0],
            found.inverses[:, :, 0].copy(),
            float(enlarged[0]),
            self._equation.overlap,
        )


class Errors:
    """The second pass, over the same rows in chunks: the errors."""

    def __init__(self, solution: Solution) -> None:
        self._solution = solution
        self._runs = no_runs(solution.overlap, len(solution.values))
        self._count = 0

    def add(self, rows: Rows) -> None:
        """The next rows."""
        new, _ = _known(rows)
        add_runs(self._runs, new, self._count, self._solution.values, self._solution.inverse)
        self._count += len(new)

    def result(self) -> Fit:
        """The values and their errors, when all rows have come twice."""
        of = self._solution
        stds = of.enlarged * np.sqrt(variances(self._runs, self._count))
        return Fit(
            np.where(of.told, of.values, np.nan), np.where(of.told, stds, np.nan), of.condition
        )


def least_window_secs(equation: Equation) -> float:
    """The length up to which no window has more rows that could differ than coefficients."""
    rows = int(len(equation.names) * equation.overlap * CORRELATED)
    return equation.bump_secs + (rows - 1) * equation.stride_secs


def _judge(
    found: Solutions,
    tallies: FloatArray,
    equation: Equation,
    least_excitation: float,
    worst_condition: float,
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Conditions (k,), inf where none counts; what is told (p, k); what enlarges errors (k,)."""
    known, moved = tallies[:, 0], tallies[:, 2] - tallies[:, 1]
    kept = np.count_nonzero(found.inflations > 0, axis=0)
    # rows overlap: what counts is how many of them could differ
    independent = known / (equation.overlap * CORRELATED)
    freedom = independent - kept
    tells = (kept > 0) & (freedom > 0) & (known >= kept) & (moved >= least_excitation)
    conditions = np.where(tells, found.conditions, np.inf)
    sure = (found.inflations > 0) & (found.inflations <= WORST_INFLATION)
    enlarged = np.full(len(known), np.nan)
    few = few_rows(equation.overlap / known[tells])
    enlarged[tells] = few * np.sqrt(independent[tells] / freedom[tells])
    return conditions, sure & (conditions <= worst_condition), enlarged


def _known(rows: Rows) -> tuple[FloatArray, NDArray[np.bool_]]:
    """[X y] of the rows that are known, and which they are."""
    every = np.column_stack((rows.regressors, rows.target))
    known = np.isfinite(every).all(axis=1)
    return every[known], known
