"""Cascades of filters, each taking the estimate of the previous one as its measurement.

Source: Antonov, (12). Its claim that the accuracy grows without bound does not hold.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_lyapunov

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_count, as_matrix, as_number, as_square_matrix, as_symmetric_matrix
from .riccati import error_covariance, kalman_gain


@dataclass(frozen=True, eq=False)
class Cascade:
    """The gain and the accuracy of a cascade of filters.

    Attributes
    ----------
    gain
        K, (n, n): the gain of every stage after the first.
    relative
        (stages, m): standard deviation of the error of each measured quantity at each stage,
        relative to that of the optimal filter.
    """

    gain: FloatArray
    relative: FloatArray

    @property
    def best(self) -> int:
        """The stage with the smallest error, counted from one."""
        return int(np.argmin(np.linalg.norm(self.relative, axis=1))) + 1

    @property
    def summary(self) -> str:
        """The best stage and its error relative to the first and the last stage, in one line."""
        first, least, last = (self.relative[k].max() for k in (0, self.best - 1, -1))
        text = f"stage {self.best} of {len(self.relative)} is the best, {least:.3g} times the"
        text += f" optimal error; the first alone has {first:.3g}"
        if last == least:
            return text
        return f"{text}; further stages increase it: the last has {last:.3g}"


def cascade(
    A: ArrayLike,
    S: ArrayLike,
    R1: ArrayLike,
    R2: ArrayLike,
    first: ArrayLike,
    *,
    stages: int,
    correlation_secs: float,
) -> Cascade:
    """Design the stages x̂₊' = A x̂₊ + K (x̂ - x̂₊) behind a first filter and compute their errors.

    Each stage treats the error of the first filter as white measurement noise of the intensity
    covariance times `correlation_secs`. It is neither white nor uncorrelated with the noise in x':
    no stage adds accuracy to an optimal filter, each costs some. One stage improves a filter that
    is much too fast; a filter that is too slow cannot be improved, since the information is lost.

    Parameters
    ----------
    A
        (n, n), 1/s: x' = A x + white noise of intensity R1.
    S
        (m, n): y = S x + white noise of intensity R2.
    R1
        (n, n): true intensity of the state noise.
    R2
        (m, m): true intensity of the measurement noise.
    first
        (n, m): the gain of the first filter.
    stages
        Number of stages, the first included.
    correlation_secs
        Correlation time of the first filter's error, s.

    Raises
    ------
    UsageError
        The matrices do not fit, the first filter is not stable, `stages` is below one, or
        `correlation_secs` is not positive.

    References
    ----------
    Antonov, (12).
    """
    A = as_square_matrix("A", A)
    n = len(A)
    S = as_matrix("S", S, columns=n)
    m = len(S)
    R1, R2 = as_symmetric_matrix("R1", R1, n), as_symmetric_matrix("R2", R2, m, definite="positive")
    first = as_matrix("first", first, n, m)
    stages = as_count("stages", stages)
    if as_number("correlation_secs", correlation_secs) == 0:
        raise UsageError("correlation_secs is 0; expected a positive number")
    errors = error_covariance(A, first, S, R1, R2)
    errors = as_symmetric_matrix("the covariance of first's error", errors, n, definite="positive")
    K = kalman_gain(A, np.eye(n), np.eye(n), R1, errors * correlation_secs).gain
    optimum = kalman_gain(A, np.eye(n), S, R1, R2).covariance

    # the errors of all stages form one linear system driven by state noise and sensor noise
    F = np.kron(np.eye(stages), A - K) + np.kron(np.eye(stages, k=-1), K)
    F[:n, :n] = A - first @ S
    noise = np.kron(np.ones((stages, stages)), R1)
    noise[:n, :n] += first @ R2 @ first.T
    P = solve_continuous_lyapunov(F, -noise)
    variances = [np.diag(S @ P[k : k + n, k : k + n] @ S.T) for k in range(0, n * stages, n)]
    return Cascade(K, np.sqrt(np.array(variances) / np.diag(S @ optimum @ S.T)))
