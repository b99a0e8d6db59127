"""One equation's coefficients: over the whole trial, and window by window as they settled."""

from dataclasses import dataclass

import numpy as np

from analysis.signals.concat import concatenate
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .sliding import (
    WINDOW_SECS,
    CoefficientHistory,
    RegressionAccumulator,
    RegressionSolution,
    StandardErrorAccumulator,
    WindowedRegression,
)
from .weak_form import Equation, Rows, with_constant

CHUNK_ROWS = 1 << 13  # a chunk


@dataclass(frozen=True)
class Coefficient:
    """One coefficient, with its standard deviation and its unit."""

    value: float
    std: float
    unit: str

    @property
    def determined(self) -> bool:
        """Whether the data tell at least its sign, at two standard deviations."""
        return bool(np.isfinite(self.std) and abs(self.value) > 2 * self.std)


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """One equation's coefficients from the whole trial, and how well its windows could tell."""

    coefficients: dict[str, Coefficient]
    condition: float  # of the column-scaled regressors over the whole trial
    window_ends_secs: FloatArray  # (k,) since the signals' start
    window_conditions: FloatArray  # (k,) of the column-scaled regressors
    blank_windows: int  # that tell no coefficient


class WholeTrialRegression:
    """Least squares over a whole trial's rows of one equation, which come in chunks.

    With `constant`, a constant is estimated beside the coefficients: a steady moment, or the
    rudder's zero. A gyro's bias it takes up in part only, for that stands in w|w| and w^3 too.
    """

    def __init__(self, equation: Equation, *, constant: bool = False) -> None:
        self._constant = constant
        self._regression = RegressionAccumulator(equation.with_constant() if constant else equation)

    def add(self, rows: Rows) -> None:
        """Add the next rows to the sums."""
        self._regression.add(with_constant(rows) if self._constant else rows)

    def solution(self, names: tuple[str, ...] | None = None) -> RegressionSolution:
        """Solve for all coefficients, or for `names` alone, over the rows added so far."""
        if names is None:
            return self._regression.solve()
        return self._regression.solve((*names, "constant") if self._constant else names)


class CoefficientStage:
    """One equation's coefficients: errors over the whole trial, and the history over windows.

    The rows come in chunks a second time; `solution` is what `WholeTrialRegression` found of them
    the first time.

    Parameters
    ----------
    equation
        The equation, without the constant.
    count
        The number of rows in all.
    solution
        The whole trial's solution; it is not changed.
    constant
        Whether the solution has a constant beside the coefficients. Within one window no constant
        can be told from the rest, so the windows never have one.
    window_secs
        The length of a window, s.
    """

    def __init__(
        self,
        equation: Equation,
        count: int,
        solution: RegressionSolution,
        *,
        constant: bool = False,
        window_secs: float = WINDOW_SECS,
    ) -> None:
        self._names, self._constant = equation.names, constant
        self._errors = StandardErrorAccumulator(solution)
        self._windows = WindowedRegression(equation, count, window_secs)
        self._ends: list[FloatArray] = []
        self._conditions: list[FloatArray] = []
        self._blank = 0

    def step(self, rows: Rows) -> CoefficientHistory:
        """Take the next rows; return the windows that end in them."""
        self._errors.add(with_constant(rows) if self._constant else rows)
        history = self._windows.step(rows)
        self._ends.append(history.time_secs)
        self._conditions.append(history.conditions)
        self._blank += int(np.isnan(history.values).all(axis=1).sum())
        return history

    def result(self) -> CoefficientFit:
        """Return the whole trial's coefficients with their errors, once all rows have come."""
        whole = self._errors.result()
        coefficients = {  # a constant after them is left out
            name: Coefficient(float(value), float(std), COEFFICIENT_UNITS[name])
            for name, value, std in zip(self._names, whole.values, whole.stds, strict=False)
        }
        return CoefficientFit(
            coefficients,
            whole.condition,
            np.concatenate(self._ends),
            np.concatenate(self._conditions),
            self._blank,
        )


def fit_coefficients(
    rows: Rows, *, constant: bool = False, window_secs: float = WINDOW_SECS
) -> tuple[CoefficientFit, CoefficientHistory]:
    """The coefficients over the whole trial and over each window, of rows that are all there.

    A trial shorter than the window is one window.
    """
    count = len(rows.target)
    regression = WholeTrialRegression(rows.equation, constant=constant)
    regression.add(rows)
    stage = CoefficientStage(
        rows.equation, count, regression.solution(), constant=constant, window_secs=window_secs
    )
    chunks = [rows.part(start, start + CHUNK_ROWS) for start in range(0, max(count, 1), CHUNK_ROWS)]
    history = concatenate([stage.step(chunk) for chunk in chunks])
    return stage.result(), history
