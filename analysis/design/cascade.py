"""Cascades of filters, each taking the estimate of the one before as its measurement."""

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
    """Stages that each take the state estimated before for a measurement of the whole state."""

    gain: FloatArray  # of every stage after the first, (n, n)
    relative: FloatArray  # (stages, m) σ of each measured quantity's error, the optimal filter's 1

    @property
    def best(self) -> int:
        """The stage with the least error, counted from one."""
        return int(np.argmin(np.linalg.norm(self.relative, axis=1))) + 1

    @property
    def verdict(self) -> str:
        """Whether it was worth it, in one line."""
        first, least, last = (self.relative[k].max() for k in (0, self.best - 1, -1))
        text = f"stage {self.best} of {len(self.relative)} is the best, {least:.3g} times the"
        text += f" optimal error; the first alone has {first:.3g}"
        return text if last == least else f"{text}, and more stages hurt: the last has {last:.3g}"


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
    """What stages of x̂₊' = A x̂₊ + K₊ (x̂ - x̂₊) make of a first filter of gain `first` (n, m).

    A and R1 (n, n), S (m, n), R2 (m, m) as in `quality_filter`, and true. The first filter's error
    is taken for white measurement noise of the intensity covariance times `correlation_secs`, the
    time it stays the same. It is not white, and it is correlated with the noise in x': so no stage
    adds accuracy to an optimal filter, each costs some, and one repairs a filter that is much too
    fast. A slow one is beyond repair: what it threw away no stage brings back.

    Raises `UsageError` for matrices that do not fit, a first filter that is not stable, fewer
    stages than one. Source: Antonov, (12), whose claim of accuracy without bound does not hold.
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

    # the errors of all stages are one system, driven by the state's noise and by the sensors'
    F = np.kron(np.eye(stages), A - K) + np.kron(np.eye(stages, k=-1), K)
    F[:n, :n] = A - first @ S
    noise = np.kron(np.ones((stages, stages)), R1)
    noise[:n, :n] += first @ R2 @ first.T
    P = solve_continuous_lyapunov(F, -noise)
    variances = [np.diag(S @ P[k : k + n, k : k + n] @ S.T) for k in range(0, n * stages, n)]
    return Cascade(K, np.sqrt(np.array(variances) / np.diag(S @ optimum @ S.T)))
