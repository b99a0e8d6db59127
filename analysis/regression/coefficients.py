"""One equation's coefficients: over the whole trial, and window by window as they settled."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.signals.concat import concatenate
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .sliding import WINDOW_SECS, Errors, History, Regression, Solution, Windows
from .weak_form import Equation, Rows, with_constant

ROWS = 1 << 13  # a chunk


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


class Identifier:
    """Identifies one equation from rows in chunks, which come twice: to `add`, then to `step`.

    With `constant`, a constant is estimated beside the coefficients of the whole trial: a steady
    moment, or the rudder's zero. A gyro's bias it takes up in part only, for that stands in w|w|
    and w^3 too. Within one window no constant can be told from the rest.
    """

    def __init__(
        self,
        equation: Equation,
        count: int,
        *,
        constant: bool = False,
        window_secs: float = WINDOW_SECS,
    ) -> None:
        """Of `count` rows in all."""
        self._names, self._constant = equation.names, constant
        self._regression = Regression(equation.with_constant() if constant else equation)
        self._windows = Windows(equation, count, window_secs)
        self._ends: list[FloatArray] = []
        self._conditions: list[FloatArray] = []
        self._blank = 0

    def add(self, rows: Rows) -> None:
        """The next rows, the first time."""
        self._regression.add(with_constant(rows) if self._constant else rows)

    def solution(self, names: tuple[str, ...] | None = None) -> Solution:
        """The values over the whole trial, of these names alone if some are given."""
        if names is None:
            return self._regression.solve()
        return self._regression.solve((*names, "constant") if self._constant else names)

    @cached_property
    def _errors(self) -> Errors:
        return Errors(self.solution())

    def step(self, rows: Rows) -> History:
        """The next rows, the second time; the windows that end in them."""
        self._errors.add(with_constant(rows) if self._constant else rows)
        history = self._windows.step(rows)
        self._ends.append(history.time_secs)
        self._conditions.append(history.conditions)
        self._blank += int(np.isnan(history.values).all(axis=1).sum())
        return history

    def result(self) -> CoefficientFit:
        """What all rows come to, when they have come twice."""
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


def identify(
    rows: Rows, *, constant: bool = False, window_secs: float = WINDOW_SECS
) -> tuple[CoefficientFit, History]:
    """The coefficients over the whole trial and over each window, of rows that are all there.

    As `Identifier`. A trial shorter than the window is one window.
    """
    count = len(rows.target)
    identifier = Identifier(rows.equation, count, constant=constant, window_secs=window_secs)
    identifier.add(rows)
    chunks = [rows.part(start, start + ROWS) for start in range(0, max(count, 1), ROWS)]
    history = concatenate([identifier.step(chunk) for chunk in chunks])
    return identifier.result(), history
