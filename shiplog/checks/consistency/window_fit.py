"""Least squares over overlapping windows, with standard errors that account for the overlap."""

import numpy as np

from shiplog.types import FloatArray

MAX_CONDITION = 1e6  # of the scaled regressors, beyond which they cannot be separated


def fit_windows(
    X: FloatArray, y: FloatArray, lags: int, max_condition: float = MAX_CONDITION
) -> tuple[FloatArray, FloatArray] | None:
    """Solve X p = y by least squares.

    Parameters
    ----------
    X
        (n, k) one row per window.
    y
        (n,) one value per window.
    lags
        Number of following rows whose residuals are correlated with that of a row.
    max_condition
        Condition number of the scaled regressors up to which the solution counts as determined.

    Returns
    -------
    tuple of ndarray or None
        The k parameters and their standard errors by Newey and West; None where the regressors
        cannot be separated.

    References
    ----------
    W. K. Newey and K. D. West, A simple, positive semi-definite, heteroskedasticity and
    autocorrelation consistent covariance matrix, Econometrica 55 (1987).

    Examples
    --------
    >>> import numpy as np
    >>> solution, errors = fit_windows(np.ones((4, 1)), np.array([1.0, 2.0, 1.0, 2.0]), lags=0)
    >>> solution.round(2).tolist(), errors.round(2).tolist()
    ([1.5], [0.25])
    """
    scale = np.sqrt(np.mean(X**2, axis=0))
    if np.any(scale == 0):
        return None
    X = X / scale
    values = np.linalg.svd(X, compute_uv=False)
    if values[-1] * max_condition <= values[0]:
        return None
    solution, *_ = np.linalg.lstsq(X, y, rcond=None)
    errors = _newey_west_errors(X, y - X @ solution, lags)
    return solution / scale, errors / scale


def _newey_west_errors(X: FloatArray, residual: FloatArray, lags: int) -> FloatArray:
    """Return standard errors of least squares, (k,), with residuals correlated over `lags`."""
    moments = X * residual[:, None]
    middle = moments.T @ moments
    for lag in range(1, min(lags + 1, len(X) - 1)):
        cross = moments[lag:].T @ moments[:-lag]
        middle += (1 - lag / (lags + 1)) * (cross + cross.T)
    inverse = np.linalg.inv(X.T @ X)
    return np.asarray(np.sqrt(np.abs(np.diag(inverse @ middle @ inverse))))
