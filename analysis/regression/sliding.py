"""The sliding-window identifier: the model's coefficients, and how they settled.

Burylin's eq. (7) by least squares over a window that slides along the trial, each equation in
its integral form (`weak_form`). Columns are scaled to unit length before anything is solved or
any condition number is determined.

Rows may come in chunks, and how they are parted changes no result: `Windows` takes them once, the
whole trial's fit twice, once for the values (`Regression`) and once for the errors (`Errors`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .batched_qr import BatchSolutions, solve_single
from .newey_west import (
    add_rows,
    empty_sums,
    newey_west_variances,
    small_sample_factor,
    window_variances,
)
from .weak_form import Equation, Rows
from .window_qr import empty_window, push_rows, rotate_rows

WINDOW_SECS = 200.0
MAX_WINDOW_CONDITION = (
    400.0  # condition of a window beyond which it is blank: in a steady turn it is so
)
MAX_CONDITION = 1e4  # the same of a whole trial, of which each coefficient is judged by itself:
MAX_INFLATION = 150.0  # how much less sure than alone, for what the others can do in its place
CORRELATION_SHARE = 1 / 3  # of a bump's width: over this its curvature keeps its sign


@dataclass(frozen=True, eq=False)
class CoefficientHistory:
    """Coefficients window by window; NaN where a window cannot tell."""

    names: tuple[str, ...]
    time_secs: FloatArray  # (k,) the end of each window, since the signals' start
    values: FloatArray  # (k, p)
    stds: FloatArray  # (k, p)
    conditions: FloatArray  # (k,) of the column-scaled regressors


@dataclass(frozen=True, eq=False)
class RegressionFit:
    """Least squares over some rows."""

    values: FloatArray  # (p,), NaN for a column that is zero throughout, or if nothing can be told
    stds: FloatArray  # (p,)
    condition: float  # of the column-scaled regressors


def fit_regression(rows: Rows) -> RegressionFit:
    """Column-scaled least squares with errors that allow for overlapping, coloured residuals.

    The covariance is Newey and West's (1987) over the rows that share data, enlarged for the
    freedom that the coefficients take of the rows that could differ, and for the few rows beside
    their overlap, so that two standard deviations are a 95 % interval (Kiefer and Vogelsang,
    "A new asymptotic theory for heteroskedasticity-autocorrelation robust tests", 2005). What the
    rows cannot tell is NaN: where nothing moved, or where other coefficients can do what
    one does.
    """
    regression = RegressionAccumulator(rows.equation)
    regression.add(rows)
    errors = StandardErrorAccumulator(regression.solve())
    errors.add(rows)
    return errors.result()


class WindowedRegression:
    """The history of a trial whose rows come in chunks."""

    def __init__(self, equation: Equation, count: int, window_secs: float = WINDOW_SECS) -> None:
        """Of `count` rows in all."""
        reach = round((window_secs - equation.bump_secs) / equation.stride_secs) + 1
        self._length = max(1, min(count, reach))
        self._stacks = empty_window(self._length, len(equation.names))
        self._known: FloatArray = np.empty((0, len(equation.names) + 1))  # rows of the next windows

    def step(self, rows: Rows) -> CoefficientHistory:
        """The windows that end in the next rows: none, before there are enough."""
        found, tallies = push_rows(self._stacks, rows.regressors, rows.target, rows.excitation)
        conditions, determined, std_factor = _judge(
            found, tallies, rows.equation, rows.min_excitation, MAX_WINDOW_CONDITION
        )
        new, known = _known(rows)
        ends = len(self._known) + np.cumsum(known)[len(known) - len(tallies) :]
        held = np.concatenate((self._known, new))
        self._known = held[len(held) - min(len(held), self._length) :].copy()
        spans = np.column_stack((ends - tallies[:, 0].astype(np.int64), ends))
        wanted = np.asarray(determined.any(axis=0))
        stds = std_factor * np.sqrt(
            window_variances(
                held.T.copy(), spans, wanted, found.values, found.inverses, rows.equation.overlap
            )
        )
        return CoefficientHistory(
            rows.equation.names,
            rows.centres_secs[len(known) - len(tallies) :] + rows.equation.bump_secs / 2,
            np.where(determined, found.values, np.nan).T.copy(),
            np.where(determined, stds, np.nan).T.copy(),
            conditions,
        )


@dataclass(frozen=True, eq=False)
class RegressionSolution:
    """What the first pass over a whole trial finds, and what the second needs of it."""

    values: FloatArray  # (p,) zero for a column that is zero throughout
    condition: float
    determined: NDArray[np.bool_]  # (p,) whether the rows can tell the value
    inverse: FloatArray  # (p, p) of X'X
    std_factor: float  # the errors, for the freedom taken and the few rows
    overlap: int


class RegressionAccumulator:
    """The first pass over a whole trial whose rows come in chunks: the values."""

    def __init__(self, equation: Equation) -> None:
        p = len(equation.names)
        self._equation, self._least_excitation = equation, 0.0
        self._factor = np.zeros((p, p + 1))
        self._tally = np.array([0.0, np.inf, -np.inf])  # rows, least and greatest excitation

    def add(self, rows: Rows) -> None:
        """The next rows."""
        new, known = _known(rows)
        moved, self._least_excitation = rows.excitation[known], rows.min_excitation
        rotate_rows(self._factor, new)
        count, least, greatest = self._tally
        self._tally = np.array(
            [count + len(new), np.min(moved, initial=least), np.max(moved, initial=greatest)]
        )

    def solve(self, names: tuple[str, ...] | None = None) -> RegressionSolution:
        """The values over the rows so far, as if there were no regressors but those of `names`."""
        factor = self._factor
        if names is not None:
            columns = [self._equation.names.index(name) for name in names]
            factor = np.zeros((len(names), len(names) + 1))
            rotate_rows(factor, self._factor[:, [*columns, -1]].copy())
        found = solve_single(factor)
        conditions, determined, std_factor = _judge(
            found, self._tally[None, :], self._equation, self._least_excitation, MAX_CONDITION
        )
        return RegressionSolution(
            found.values[:, 0].copy(),
            float(conditions[0]),
            determined[:, 0],
            found.inverses[:, :, 0].copy(),
            float(std_factor[0]),
            self._equation.overlap,
        )


class StandardErrorAccumulator:
    """The second pass, over the same rows in chunks: the errors."""

    def __init__(self, solution: RegressionSolution) -> None:
        self._solution = solution
        self._runs = empty_sums(solution.overlap, len(solution.values))
        self._count = 0

    def add(self, rows: Rows) -> None:
        """The next rows."""
        new, _ = _known(rows)
        add_rows(self._runs, new, self._count, self._solution.values, self._solution.inverse)
        self._count += len(new)

    def result(self) -> RegressionFit:
        """The values and their errors, when all rows have come twice."""
        of = self._solution
        stds = of.std_factor * np.sqrt(newey_west_variances(self._runs, self._count))
        return RegressionFit(
            np.where(of.determined, of.values, np.nan),
            np.where(of.determined, stds, np.nan),
            of.condition,
        )


def min_window_secs(equation: Equation) -> float:
    """The length up to which no window has more rows that could differ than coefficients."""
    rows = int(len(equation.names) * equation.overlap * CORRELATION_SHARE)
    return equation.bump_secs + (rows - 1) * equation.stride_secs


def _judge(
    found: BatchSolutions,
    tallies: FloatArray,
    equation: Equation,
    min_excitation: float,
    worst_condition: float,
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Return conditions (k,), whether determined (p, k), and factors of the errors (k,)."""
    known, moved = tallies[:, 0], tallies[:, 2] - tallies[:, 1]
    kept = np.count_nonzero(found.inflations > 0, axis=0)
    # rows overlap: what counts is how many of them could differ
    independent = known / (equation.overlap * CORRELATION_SHARE)
    freedom = independent - kept
    is_determined = (kept > 0) & (freedom > 0) & (known >= kept) & (moved >= min_excitation)
    conditions = np.where(is_determined, found.conditions, np.inf)
    sure = (found.inflations > 0) & (found.inflations <= MAX_INFLATION)
    std_factor = np.full(len(known), np.nan)
    few = small_sample_factor(equation.overlap / known[is_determined])
    std_factor[is_determined] = few * np.sqrt(independent[is_determined] / freedom[is_determined])
    return conditions, sure & (conditions <= worst_condition), std_factor


def _known(rows: Rows) -> tuple[FloatArray, NDArray[np.bool_]]:
    """[X y] of the rows that are known, and which they are."""
    every = np.column_stack((rows.regressors, rows.target))
    known = np.isfinite(every).all(axis=1)
    return every[known], known
