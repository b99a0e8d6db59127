"""A continuous system and its white noise, from one sample to the next."""

import numpy as np
from scipy.linalg import expm

from shiplog.types import FloatArray


def discretise(A: FloatArray, Q: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """exp(A dt) and the covariance that white noise of intensity Q adds in dt, by Van Loan."""
    n = len(A)
    M = np.zeros((2 * n, 2 * n))
    M[:n, :n], M[:n, n:], M[n:, n:] = -A, Q, A.T
    E = expm(M * dt)
    F = E[n:, n:].T
    Qd = F @ E[:n, n:]
    return F, (Qd + Qd.T) / 2
