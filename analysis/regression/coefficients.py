"""Coefficients of one equation over the whole trial and over sliding windows.

Combines the two passes of `sliding` over the rows of a trial: `WholeTrialRegression` for the first,
`CoefficientStage` for the second. `fit_coefficients` does both where all rows are available.
"""

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

CHUNK_ROWS = 1 << 13  # rows processed at once by `fit_coefficients`


@dataclass(frozen=True)
class Coefficient:
    """One coefficient with its standard deviation.

    Attributes
    ----------
    value
        The estimate; NaN if the rows do not determine it.
    std
        Its standard deviation; NaN likewise.
    unit
        The unit of both, such as ``1/s²``.

    Examples
    --------
    >>> Coefficient(-3.0, 1.0, "1/s").determined
    True
    """

    value: float
    std: float
    unit: str

    @property
    def determined(self) -> bool:
        """Whether the sign is determined: the value is over two standard deviations from zero."""
        return bool(np.isfinite(self.std) and abs(self.value) > 2 * self.std)


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """One equation's coefficients over the whole trial, and the quality of its windows.

    Attributes
    ----------
    coefficients
        The coefficients by name.
    condition
        Condition number of the column-scaled regressors over the whole trial.
    window_ends_secs
        (k,) the end of each window, s since the signals' start.
    window_conditions
        (k,) condition number of the column-scaled regressors of each window.
    blank_windows
        The number of windows that determine no coefficient.
    """

    coefficients: dict[str, Coefficient]
    condition: float
    window_ends_secs: FloatArray
    window_conditions: FloatArray
    blank_windows: int


class WholeTrialRegression:
    """First pass: least squares over the rows of a whole trial, which come in chunks.

    Parameters
    ----------
    equation
        The equation, without a constant.
    constant
        Whether to estimate a constant in addition: a steady moment, or the zero offset of the
        rudder. It compensates a gyro's bias only in part, since that also enters w|w| and w^3.
    """

    def __init__(self, equation: Equation, *, constant: bool = False) -> None:
        self._constant = constant
        self._regression = RegressionAccumulator(equation.with_constant() if constant else equation)

    def add(self, rows: Rows) -> None:
        """Add the next rows to the sums."""
        self._regression.add(with_constant(rows) if self._constant else rows)

    def solution(self, names: tuple[str, ...] | None = None) -> RegressionSolution:
        """Solve for all coefficients, or only for `names`, over the rows added so far."""
        if names is None:
            return self._regression.solve()
        return self._regression.solve((*names, "constant") if self._constant else names)


class CoefficientStage:
    """Second pass over the rows, in chunks: standard errors and the history over windows.

    Parameters
    ----------
    equation
        The equation, without the constant.
    count
        The number of rows of the whole trial.
    solution
        The result of the first pass, from `WholeTrialRegression`; it is not changed.
    constant
        Whether the solution contains a constant. The windows never do, since a single window
        cannot distinguish it from the other regressors.
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
        """Return the whole trial's coefficients and errors, after all rows have been added."""
        whole = self._errors.result()
        coefficients = {  # without the constant that may follow them
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
    """Fit the coefficients of an equation over the whole trial and over each window.

    Parameters
    ----------
    rows
        All rows of the equation.
    constant
        Whether to estimate a constant in addition over the whole trial.
    window_secs
        The length of a window, s. A shorter trial is one window.

    Returns
    -------
    fit
        The coefficients over the whole trial.
    history
        The coefficients over the windows.

    Examples
    --------
    >>> import numpy as np
    >>> from .weak_form import Equation
    >>> t = np.arange(600.0)
    >>> X = np.column_stack((np.sin(t / 25), np.cos(t / 40)))
    >>> rows = Rows(Equation(("a", "d"), 1.0, 20.0), t, X @ [2.0, -1.0], X, X[:, 0], 0.1)
    >>> fit, history = fit_coefficients(rows)
    >>> round(fit.coefficients["a"].value, 6), history.values.shape
    (2.0, (420, 2))
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
