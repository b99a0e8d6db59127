"""The sliding-window identifier: the model's coefficients, and how they settled.

Burylin's eq. (7) by least squares over a window that slides along the trial, each equation in
its integral form (`weak_form`). Columns are scaled to unit length before anything is solved or
any condition number is told.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.ship import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .weak_form import Rows, with_constant

WINDOW_SECS = 200.0
RICHEST = 400.0  # condition of a window beyond which it is blank: in a steady turn it is so
WORST_CONDITION = 1e4  # the same of a whole trial, of which each coefficient is judged by itself:
WORST_INFLATION = 150.0  # how much less sure than alone, for what the others can do in its place
CORRELATED = 1 / 3  # of a bump's width: over this its curvature keeps its sign


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
class History:
    """Coefficients window by window; NaN where a window cannot tell."""

    names: tuple[str, ...]
    time_secs: FloatArray  # (k,) the end of each window, since the signals' start
    values: FloatArray  # (k, p)
    stds: FloatArray  # (k, p)
    conditions: FloatArray  # (k,) of the column-scaled regressors


@dataclass(frozen=True, eq=False)
class Identification:
    """One equation's coefficients from the whole trial, and their history."""

    coefficients: dict[str, Coefficient]
    condition: float  # of the column-scaled regressors over the whole trial
    history: History


@dataclass(frozen=True, eq=False)
class Fit:
    """Least squares over some rows."""

    values: FloatArray  # (p,), NaN for a column that is zero throughout, or if nothing can be told
    stds: FloatArray  # (p,)
    condition: float  # of the column-scaled regressors


def identify(
    rows: Rows, *, constant: bool = False, window_secs: float = WINDOW_SECS
) -> Identification:
    """The coefficients of one equation over the whole trial and over each window.

    With `constant`, a constant is estimated beside those of the whole trial: a steady moment, or
    the rudder's zero. A gyro's bias it takes up in part only, for that stands in w|w| and w^3 too.
    Within one window no constant can be told from the rest. A trial shorter than the window is
    one window.
    """
    whole = fit(with_constant(rows) if constant else rows)
    return Identification(
        {
            name: Coefficient(float(value), float(std), COEFFICIENT_UNITS[name])
            for name, value, std in zip(rows.names, whole.values, whole.stds, strict=False)
        },
        whole.condition,
        _history(rows, window_secs),
    )


def fit(rows: Rows) -> Fit:
    """Column-scaled least squares with errors that allow for overlapping, coloured residuals.

    The covariance is Newey and West's (1987) over the rows that share data, enlarged for the
    freedom that the coefficients take of the rows that could differ, and for the few rows beside
    their overlap, so that two standard deviations are a 95 % interval (Kiefer and Vogelsang,
    "A new asymptotic theory for heteroskedasticity-autocorrelation robust tests", 2005). What the
    rows cannot tell is NaN: where nothing moved, or where other coefficients can do what
    one does.
    """
    values, stds, conditions = _fits(rows, len(rows.target), WORST_CONDITION)
    return Fit(values[0], stds[0], float(conditions[0]))


def _history(rows: Rows, window_secs: float) -> History:
    count = len(rows.centres_secs)
    length = max(1, min(count, round((window_secs - rows.bump_secs) / rows.stride_secs) + 1))
    values, stds, conditions = _fits(rows, length, RICHEST)
    ends = rows.centres_secs[length - 1 :] + rows.bump_secs / 2
    return History(rows.names, ends[: len(values)], values, stds, conditions)


def _fits(
    rows: Rows, length: int, worst_condition: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (k, p), standard deviations (k, p) and condition (k,) of each run of rows."""
    X, y = np.ascontiguousarray(rows.regressors), np.ascontiguousarray(rows.target)
    count, p = max(len(y) - length + 1, 1), X.shape[1]
    values, stds = np.full((count, p), np.nan), np.full((count, p), np.nan)
    conditions = np.full(count, np.inf)
    known = np.isfinite(y) & np.isfinite(X).all(axis=1)
    excitation = np.ascontiguousarray(rows.excitation)
    _slide(
        X, y, excitation, rows.least_excitation, known, length, rows.overlap, worst_condition,
        values, stds, conditions,
    )  # fmt: skip
    return values, stds, conditions


@compiled
def _slide(
    X: FloatArray,
    y: FloatArray,
    excitation: FloatArray,
    least: float,
    known: NDArray[np.bool_],
    length: int,
    overlap: int,
    worst_condition: float,
    values: FloatArray,
    stds: FloatArray,
    conditions: FloatArray,
) -> None:
    for k in range(len(values)):
        rows = k + np.flatnonzero(known[k : k + length])
        scale = np.sqrt((X[rows] ** 2).sum(axis=0))
        kept = np.flatnonzero(scale > 0)
        # rows overlap: what counts is how many of them could differ
        independent = len(rows) / (overlap * CORRELATED)
        freedom = independent - len(kept)
        if len(kept) == 0 or freedom <= 0 or len(rows) < len(kept):
            continue
        if np.max(excitation[rows]) - np.min(excitation[rows]) < least:
            continue
        A = X[rows][:, kept] / scale[kept]
        R, projected = _triangular(A, y[rows])
        singular = np.linalg.svd(R)[1]
        conditions[k] = singular[0] / singular[-1] if singular[-1] > 0 else np.inf
        if conditions[k] > worst_condition:
            continue
        inverse = np.linalg.inv(R)
        scaled = inverse @ projected
        S = _neighbours_products(A, y[rows] - A @ scaled, overlap)
        inverse = inverse @ inverse.T  # of A'A
        covariance = inverse @ S @ inverse * (independent / freedom)
        few = _few_rows(overlap / len(rows))
        for i in range(len(kept)):
            if inverse[i, i] <= WORST_INFLATION**2:
                values[k, kept[i]] = scaled[i] / scale[kept[i]]
                stds[k, kept[i]] = few * np.sqrt(covariance[i, i]) / scale[kept[i]]


@compiled
def _few_rows(b: float) -> float:
    """The 95 % point of Kiefer and Vogelsang over the Gaussian's, b the overlap over the rows."""
    b = min(b, 1.0)
    return (1.96 + 2.9694 * b + 0.4160 * b**2 - 0.5324 * b**3) / 1.96


@compiled
def _triangular(A: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R of A = Q R, and Q'y, by Householder's reflections."""
    m, p = A.shape
    W = np.column_stack((A, y))
    for j in range(p):
        norm = np.sqrt((W[j:, j] ** 2).sum())
        if norm == 0:
            continue
        pivot = -norm if W[j, j] > 0 else norm
        W[j, j] -= pivot
        for k in range(j + 1, p + 1):
            along = 0.0
            for i in range(j, m):
                along += W[i, j] * W[i, k]
            along /= pivot * W[j, j]
            for i in range(j, m):
                W[i, k] += along * W[i, j]
        W[j, j] = pivot
    return np.triu(W[:p, :p]), W[:p, p].copy()


@compiled
def _neighbours_products(A: FloatArray, residual: FloatArray, overlap: int) -> FloatArray:
    """Newey and West's sum of autocovariances of the scores under Bartlett's weights, (p, p).

    It is the sum of the products of the scores' sums over every run of `overlap` rows, those
    reaching over the ends too, over `overlap`.
    """
    n, p = A.shape
    run, products = np.zeros(p), np.zeros((p, p))
    for end in range(n + overlap - 1):
        for i in range(p):
            if end < n:
                run[i] += A[end, i] * residual[end]
            if end >= overlap:
                run[i] -= A[end - overlap, i] * residual[end - overlap]
        for i in range(p):
            for j in range(p):
                products[i, j] += run[i] * run[j]
    return products / overlap
