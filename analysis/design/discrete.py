"""Discretisation of a linear system and its white noise."""

import numpy as np
from scipy.linalg import expm

from shiplog.types import FloatArray


def discretise(A: FloatArray, Q: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """Discretise x' = A x + w, w being white noise of intensity Q.

    Parameters
    ----------
    A
        (n, n), 1/s.
    Q
        (n, n): intensity of the noise, in units squared per second.
    dt
        Sampling interval, s.

    Returns
    -------
    F
        (n, n): exp(A dt).
    Qd
        (n, n): covariance of the noise added in dt.

    References
    ----------
    Van Loan, "Computing integrals involving the matrix exponential", 1978.

    Examples
    --------
    White noise of intensity 3 on the rate of a double integrator:

    >>> F, Qd = discretise(np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, 3.0]), 1.0)
    >>> Qd.round(3).tolist()
    [[1.0, 1.5], [1.5, 3.0]]
    """
    n = len(A)
    M = np.zeros((2 * n, 2 * n))
    M[:n, :n], M[:n, n:], M[n:, n:] = -A, Q, A.T
    E = expm(M * dt)
    F = E[n:, n:].T
    Qd = F @ E[:n, n:]
    return F, (Qd + Qd.T) / 2
