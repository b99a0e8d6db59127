"""Corrections of a sampled observer x̂ = x⁻ + M (y - C x⁻), x⁻ = F x̂: optimal, or matched to L."""

import numpy as np
from scipy.linalg import LinAlgError, expm, solve_discrete_are

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .luenberger import discrete_correction
from .observability import ComplexArray
from .riccati import sorted_eigenvalues


def optimal_correction(F: FloatArray, C: FloatArray, Q: FloatArray, r: FloatArray) -> FloatArray:
    """Compute the correction M (n, m) of the steady-state discrete Kalman filter.

    Measurements are scaled to unit noise and the covariance to the size at which the terms of the
    Riccati equation are alike, as in `riccati`: in a ship's units scipy finds no solution.

    Parameters
    ----------
    F
        (n, n): transition from sample to sample.
    C
        (m, n).
    Q
        (n, n): covariance of the noise added from sample to sample.
    r
        (m,): variances of the measurement noise.

    Raises
    ------
    UsageError
        There is no stabilising solution.

    Examples
    --------
    A random walk that is measured with noise as large as its steps (the golden ratio):

    >>> one = np.eye(1)
    >>> optimal_correction(one, one, one, np.ones(1)).round(6).tolist()
    [[0.618034]]
    """
    scaled = C / np.sqrt(r)[:, None]
    size = float(np.sqrt(np.linalg.norm(Q)) / np.linalg.norm(scaled)) or 1.0
    H = scaled * np.sqrt(size)
    try:
        P = solve_discrete_are(F.T, H.T, Q / size, np.eye(len(H)))
    except (LinAlgError, ValueError) as error:
        raise UsageError(
            f"F {F.shape} and C {C.shape}: no steady-state gain found ({error}); use the"
            " time-varying one"
        ) from None
    M: FloatArray = (
        np.linalg.solve(H @ P @ H.T + np.eye(len(H)), H @ P).T * np.sqrt(size) / np.sqrt(r)
    )
    if sampled_poles(F, C, M, 1.0).real.max() >= 0:
        raise UsageError(
            f"F {F.shape} and C {C.shape}: the computed gain is not stable: a mode is almost"
            " unobservable, or the units differ too much"
        )
    return M


def matched_correction(A: FloatArray, C: FloatArray, L: FloatArray, dt: float) -> FloatArray:
    """Compute the correction M (n, m) of a sampled observer that acts as the continuous gain L.

    With one output each pole s of A - L C becomes exp(s dt). With several, M is the integral of
    exp((A - L C) t) L over a step, which matches all poles to the first order of their shift times
    dt; `sampled_poles` gives those that result.

    Parameters
    ----------
    A
        (n, n), 1/s.
    C
        (m, n).
    L
        (n, m).
    dt
        Sampling interval, s.

    Raises
    ------
    UsageError
        The samples are too rare for these poles: the sampled observer would not be stable.
    """
    n, m = L.shape
    if m == 1:
        return discrete_correction(A, C, sorted_eigenvalues(A - L @ C), dt)[:, None]
    extended = np.zeros((n + m, n + m))
    extended[:n] = np.hstack((A - L @ C, L)) * dt
    M: FloatArray = expm(extended)[:n, n:]
    if sampled_poles(expm(A * dt), C, M, dt)[-1].real >= 0:
        fastest = np.abs(np.linalg.eigvals(A - L @ C)).max()
        raise UsageError(
            f"samples every {dt:g} s are too rare for poles of up to {fastest:.3g} 1/s; choose"
            " slower poles or a shorter step"
        )
    return M


def sampled_poles(F: FloatArray, C: FloatArray, M: FloatArray, dt: float) -> ComplexArray:
    """Return the poles (n,) of (I - M C) F as continuous ones, 1/s, the slowest last.

    A pole at z = 0, of an error that vanishes at each sample, is -inf: an observer of reduced order
    has as many as outputs.
    """
    transition = (np.eye(len(F)) - M @ C) @ F
    values = np.linalg.eigvals(transition).astype(complex)
    vanishing = np.abs(values) <= np.finfo(float).eps * np.linalg.norm(F)
    poles: ComplexArray = np.full(len(values), -np.inf, dtype=complex)
    poles[~vanishing] = np.log(values[~vanishing]) / dt
    order = np.lexsort((poles.imag, poles.real))
    return np.asarray(poles[order])
