"""Whole-trial and sliding-window regression of one equation of motion, with standard errors.

Least squares of the rows of `weak_form`, over the whole trial and over a window that slides along
it. The columns are scaled to unit length before a system is solved and before its condition number
is computed.

Rows may come in chunks; results do not depend on where the chunks are cut. `WindowedRegression`
takes the rows once. The regression of the whole trial takes them twice: first
`RegressionAccumulator` for the coefficients, then `StandardErrorAccumulator` for their errors.

Coefficients are *determined* by rows if enough rows are independent, the excitation has a
sufficient range, and the condition number and the inflation of the coefficient are below their
limits.
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
MAX_WINDOW_CONDITION = 400.0  # of a window; exceeded in a steady turn
MAX_CONDITION = 1e4  # of a whole trial, where the inflation of each coefficient is limited, too
MAX_INFLATION = 150.0  # of a standard deviation by the other regressors
CORRELATION_SHARE = (
    1 / 3
)  # of a bump's length, over which phi'' keeps its sign: residuals correlate


@dataclass(frozen=True, eq=False)
class CoefficientHistory:
    """Coefficients over k sliding windows.

    Attributes
    ----------
    names
        The p coefficients.
    time_secs
        (k,) the end of each window, s since the signals' start.
    values
        (k, p) the coefficients; NaN where a window does not determine them.
    stds
        (k, p) their standard deviations.
    conditions
        (k,) condition numbers of the column-scaled regressors; infinite where a window has too few
        rows or too little excitation.
    """

    names: tuple[str, ...]
    time_secs: FloatArray
    values: FloatArray
    stds: FloatArray
    conditions: FloatArray


@dataclass(frozen=True, eq=False)
class RegressionFit:
    """Coefficients of one regression with standard errors.

    Attributes
    ----------
    values
        (p,) the coefficients; NaN where the rows do not determine them.
    stds
        (p,) their standard deviations; NaN likewise.
    condition
        The condition number of the column-scaled regressors.
    """

    values: FloatArray
    stds: FloatArray
    condition: float


def fit_regression(rows: Rows) -> RegressionFit:
    """Fit the coefficients of an equation, with errors that allow for correlated residuals.

    The covariance is that of Newey and West (1987) over the rows that share data. It is enlarged
    for the degrees of freedom taken by the coefficients, of the rows that are independent, and for
    a small number of rows relative to their overlap (Kiefer and Vogelsang, 2005), so that two
    standard deviations are a 95 % interval. See `newey_west`.

    Parameters
    ----------
    rows
        All rows of the equation; rows that are NaN are ignored.

    Returns
    -------
    fit
        The coefficients. Those that the rows do not determine are NaN: where the excitation is too
        small, or where other regressors are nearly equivalent.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(600.0)
    >>> X = np.column_stack((np.sin(t / 25), np.cos(t / 40)))
    >>> rows = Rows(Equation(("a", "d"), 1.0, 20.0), t, X @ [2.0, -1.0], X, X[:, 0], 0.1)
    >>> fit_regression(rows).values.round(6).tolist()
    [2.0, -1.0]
    """
    regression = RegressionAccumulator(rows.equation)
    regression.add(rows)
    errors = StandardErrorAccumulator(regression.solve())
    errors.add(rows)
    return errors.result()


class WindowedRegression:
    """Stage that computes the sliding-window coefficients from rows that come in chunks.

    Parameters
    ----------
    equation
        The equation.
    count
        The number of rows of the whole trial. A trial shorter than a window is one window.
    window_secs
        The length of a window, s.
    """

    def __init__(self, equation: Equation, count: int, window_secs: float = WINDOW_SECS) -> None:
        reach = round((window_secs - equation.bump_secs) / equation.stride_secs) + 1
        self._length = max(1, min(count, reach))
        self._state = empty_window(self._length, len(equation.names))
        self._kept: FloatArray = np.empty((0, len(equation.names) + 1))  # known, of later windows

    def step(self, rows: Rows) -> CoefficientHistory:
        """Take the next rows; return the windows that end in them."""
        solutions, tallies = push_rows(self._state, rows.regressors, rows.target, rows.excitation)
        conditions, determined, std_factor = _assess(
            solutions, tallies, rows.equation, rows.min_excitation, MAX_WINDOW_CONDITION
        )
        new, is_known = _known_rows(rows)
        ends = len(self._kept) + np.cumsum(is_known)[len(is_known) - len(tallies) :]
        available = np.concatenate((self._kept, new))
        self._kept = available[len(available) - min(len(available), self._length) :].copy()
        spans = np.column_stack((ends - tallies[:, 0].astype(np.int64), ends))
        wanted = np.asarray(determined.any(axis=0))
        stds = std_factor * np.sqrt(
            window_variances(
                available.T.copy(),
                spans,
                wanted,
                solutions.values,
                solutions.inverses,
                rows.equation.overlap,
            )
        )
        return CoefficientHistory(
            rows.equation.names,
            rows.centres_secs[len(is_known) - len(tallies) :] + rows.equation.bump_secs / 2,
            np.where(determined, solutions.values, np.nan).T.copy(),
            np.where(determined, stds, np.nan).T.copy(),
            conditions,
        )


@dataclass(frozen=True, eq=False)
class RegressionSolution:
    """Result of the first pass over a whole trial.

    Attributes
    ----------
    values
        (p,) the coefficients; zero for a regressor that is zero in all rows.
    condition
        The condition number of the column-scaled regressors.
    determined
        (p,) whether the rows determine the coefficient.
    inverse
        (p, p) ``(X'X)^-1``.
    std_factor
        The factor by which Newey-West errors are enlarged for the degrees of freedom and the
        small number of independent rows.
    overlap
        The number of successive rows that share data.
    """

    values: FloatArray
    condition: float
    determined: NDArray[np.bool_]
    inverse: FloatArray
    std_factor: float
    overlap: int


class RegressionAccumulator:
    """First pass over the rows of a trial, in chunks: the coefficients."""

    def __init__(self, equation: Equation) -> None:
        p = len(equation.names)
        self._equation, self._min_excitation = equation, 0.0
        self._factor = np.zeros((p, p + 1))
        self._tally = np.array(
            [0.0, np.inf, -np.inf]
        )  # known rows, smallest and largest excitation

    def add(self, rows: Rows) -> None:
        """Add the next rows."""
        new, is_known = _known_rows(rows)
        moved, self._min_excitation = rows.excitation[is_known], rows.min_excitation
        rotate_rows(self._factor, new)
        count, least, greatest = self._tally
        self._tally = np.array(
            [count + len(new), np.min(moved, initial=least), np.max(moved, initial=greatest)]
        )

    def solve(self, names: tuple[str, ...] | None = None) -> RegressionSolution:
        """Solve for the coefficients over the rows so far.

        Parameters
        ----------
        names
            The regressors to use; all by default.
        """
        factor = self._factor
        if names is not None:
            columns = [self._equation.names.index(name) for name in names]
            factor = np.zeros((len(names), len(names) + 1))
            rotate_rows(factor, self._factor[:, [*columns, -1]].copy())
        solutions = solve_single(factor)
        conditions, determined, std_factor = _assess(
            solutions, self._tally[None, :], self._equation, self._min_excitation, MAX_CONDITION
        )
        return RegressionSolution(
            solutions.values[:, 0].copy(),
            float(conditions[0]),
            determined[:, 0],
            solutions.inverses[:, :, 0].copy(),
            float(std_factor[0]),
            self._equation.overlap,
        )


class StandardErrorAccumulator:
    """Second pass over the same rows, in chunks: the standard errors of a solution."""

    def __init__(self, solution: RegressionSolution) -> None:
        self._solution = solution
        self._sums = empty_sums(solution.overlap, len(solution.values))
        self._count = 0

    def add(self, rows: Rows) -> None:
        """Add the rows of the first pass once more, in any chunks."""
        new, _ = _known_rows(rows)
        add_rows(self._sums, new, self._count, self._solution.values, self._solution.inverse)
        self._count += len(new)

    def result(self) -> RegressionFit:
        """Return the coefficients with their errors, after all rows have been added."""
        solution = self._solution
        stds = solution.std_factor * np.sqrt(newey_west_variances(self._sums, self._count))
        return RegressionFit(
            np.where(solution.determined, solution.values, np.nan),
            np.where(solution.determined, stds, np.nan),
            solution.condition,
        )


def min_window_secs(equation: Equation) -> float:
    """Return the window length, s, up to which windows have no degree of freedom left.

    Such a window has no more independent rows than coefficients.
    """
    rows = int(len(equation.names) * equation.overlap * CORRELATION_SHARE)
    return equation.bump_secs + (rows - 1) * equation.stride_secs


def _assess(
    solutions: BatchSolutions,
    tallies: FloatArray,
    equation: Equation,
    min_excitation: float,
    max_condition: float,
) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Assess k systems with p regressors: which coefficients their rows determine.

    Parameters
    ----------
    solutions
        The solutions of the systems.
    tallies
        (k, 3) the number of known rows, the smallest and the largest excitation.
    equation
        The equation.
    min_excitation
        The smallest range of the excitation that determines coefficients.
    max_condition
        The largest condition number with which a system determines coefficients.

    Returns
    -------
    conditions
        (k,) condition numbers; infinite where rows or excitation do not suffice.
    determined
        (p, k) whether a coefficient is determined.
    std_factor
        (k,) the factor of the Newey-West errors; NaN where rows or excitation do not suffice.
    """
    row_count, excitation_range = tallies[:, 0], tallies[:, 2] - tallies[:, 1]
    used_count = np.count_nonzero(solutions.inflations > 0, axis=0)
    # rows overlap: only some of them are independent
    independent = row_count / (equation.overlap * CORRELATION_SHARE)
    freedom = independent - used_count
    suffices = (used_count > 0) & (freedom > 0)
    suffices &= (row_count >= used_count) & (excitation_range >= min_excitation)
    conditions = np.where(suffices, solutions.conditions, np.inf)
    is_distinct = (solutions.inflations > 0) & (solutions.inflations <= MAX_INFLATION)
    std_factor = np.full(len(row_count), np.nan)
    small_sample = small_sample_factor(equation.overlap / row_count[suffices])
    std_factor[suffices] = small_sample * np.sqrt(independent[suffices] / freedom[suffices])
    return conditions, is_distinct & (conditions <= max_condition), std_factor


def _known_rows(rows: Rows) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the known rows ``[X y]`` and whether each row is known, (m,)."""
    every = np.column_stack((rows.regressors, rows.target))
    is_known = np.isfinite(every).all(axis=1)
    return every[is_known], is_known
