"""The sliding-window identifier: the model's coefficients, and how they settled.

Burylin's eq. (7) by least squares over a window that slides along the trial, each equation in
its integral form (`weak_form`). Columns are scaled to unit length before anything is solved or
any condition number is told.
"""

from dataclasses import dataclass, replace

import numpy as np

from shiplog.ship import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .weak_form import Rows, with_constant

WINDOW_SECS = 200.0
WORST_CONDITION = 1e4  # beyond it a window cannot tell its coefficients apart
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
class _Fit:
    values: FloatArray  # (p,), NaN for a column that is zero throughout
    stds: FloatArray  # (p,)
    condition: float


def identify(
    rows: Rows, *, constant: bool = False, window_secs: float = WINDOW_SECS
) -> Identification:
    """The coefficients of one equation over the whole trial and over each window.

    With `constant`, a constant disturbance is estimated beside those of the whole trial (a gyro's
    bias, the rudder's zero); within one window it cannot be told from the rest. A trial shorter
    than the window is one window.
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


def fit(rows: Rows) -> _Fit:
    """Column-scaled least squares with errors that allow for overlapping, coloured residuals."""
    known = np.isfinite(rows.target) & np.isfinite(rows.regressors).all(axis=1)
    return _solve(rows.regressors[known], rows.target[known], rows.overlap)


def _history(rows: Rows, window_secs: float) -> History:
    count = len(rows.centres_secs)
    length = max(1, min(count, round((window_secs - rows.bump_secs) / rows.stride_secs) + 1))
    fits, ends = [], []
    for start in range(count - length + 1):
        cut = slice(start, start + length)
        fits.append(fit(replace(rows, target=rows.target[cut], regressors=rows.regressors[cut])))
        ends.append(rows.centres_secs[start + length - 1] + rows.bump_secs / 2)
    return History(
        rows.names,
        np.array(ends),
        np.array([f.values for f in fits]).reshape(-1, len(rows.names)),
        np.array([f.stds for f in fits]).reshape(-1, len(rows.names)),
        np.array([f.condition for f in fits]),
    )


def _solve(X: FloatArray, y: FloatArray, overlap: int) -> _Fit:
    p = X.shape[1]
    values, stds = np.full(p, np.nan), np.full(p, np.nan)
    scale = np.linalg.norm(X, axis=0)
    kept = scale > 1e-12 * np.max(scale, initial=0.0)
    # rows overlap: what counts is how many of them could differ
    independent = len(y) / (overlap * CORRELATED)
    freedom = independent - int(kept.sum())
    if not kept.any() or freedom <= 0 or len(y) < p:
        return _Fit(values, stds, np.inf)
    X = X[:, kept] / scale[kept]
    U, s, Vt = np.linalg.svd(X, full_matrices=False)
    condition = float(s[0] / s[-1]) if s[-1] > 0 else np.inf
    if condition > WORST_CONDITION:
        return _Fit(values, stds, condition)
    scaled = Vt.T @ ((U.T @ y) / s)
    inverse = (Vt.T / s**2) @ Vt
    scores = _neighbours_sum(X * (y - X @ scaled)[:, None], overlap)
    covariance = inverse @ (scores.T @ scores / overlap) @ inverse
    values[kept] = scaled / scale[kept]
    stds[kept] = np.sqrt(np.diag(covariance) * independent / freedom) / scale[kept]
    return _Fit(values, stds, condition)


def _neighbours_sum(scores: FloatArray, overlap: int) -> FloatArray:
    """Sums over every run of `overlap` rows, those reaching over the ends too.

    Their products, summed, are Newey and West's estimate: autocovariances under Bartlett weights.
    """
    n = len(scores)
    total = np.vstack((np.zeros(scores.shape[1]), np.cumsum(scores, axis=0)))
    last = np.clip(np.arange(1, n + overlap), 0, n)
    first = np.clip(np.arange(1 - overlap, n), 0, n)
    sums: FloatArray = total[last] - total[first]
    return sums
