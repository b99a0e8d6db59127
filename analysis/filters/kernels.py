"""The steps that all filters share: gate, correction and covariance propagation.

All are compiled loops over the elements of small matrices, without temporary arrays. `P` is
symmetric, and the results are symmetric to the last bit.
"""

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray

MISSING, REJECTED, ACCEPTED = range(3)  # status of a measurement
MAX_REJECTED_IN_A_ROW = 5  # after more than this many the filter is wrong, not the sensor


@compiled
def output_covariance(P: FloatArray, c: FloatArray, Pc: FloatArray) -> float:
    """Compute P c into `Pc` (s,), and return c' P c, the variance of the predicted output c' x."""
    variance = 0.0
    for i in range(len(c)):
        total = 0.0
        for j in range(len(c)):
            total += P[i, j] * c[j]
        Pc[i] = total
        variance += c[i] * total
    return variance


@compiled
def quadratic_form(g: FloatArray, P: FloatArray) -> float:
    """Return g' P g, the variance of g' x; most elements of g (s,) may be zero."""
    total = 0.0
    for i in range(len(g)):
        if g[i] != 0.0:
            for j in range(len(g)):
                total += g[i] * P[i, j] * g[j]
    return total


@compiled
def innovate(
    x: FloatArray,
    P: FloatArray,
    c: FloatArray,
    r: float,
    measured: float,
    gate: float,
    output: int,
    rejected_in_a_row: NDArray[np.int64],
    Pc: FloatArray,
) -> tuple[float, float, int]:
    """Compute the innovation of an output c' x, and decide whether to accept the measurement.

    Parameters
    ----------
    x, P
        The predicted state (s,) and its covariance (s, s).
    c
        The row (s,) of the output matrix.
    r
        The variance of the measurement noise.
    measured
        The measurement; NaN where there is none.
    gate
        The largest accepted innovation, in standard deviations.
    output
        The index of the output in `rejected_in_a_row`, which is updated; see `is_accepted`.
    Pc
        Set to P c (s,), from which the gain follows.

    Returns
    -------
    innovation
        measured - c' x.
    variance
        S = c' P c + r.
    status
        `ACCEPTED`, `REJECTED` or `MISSING`.
    """
    variance = output_covariance(P, c, Pc) + r
    innovation = measured
    for i in range(len(c)):
        innovation -= c[i] * x[i]
    if not np.isfinite(innovation):
        return innovation, variance, MISSING
    if is_accepted(innovation, variance, gate, output, rejected_in_a_row):
        return innovation, variance, ACCEPTED
    return innovation, variance, REJECTED


@compiled
def is_accepted(
    innovation: float,
    variance: float,
    gate: float,
    output: int,
    rejected_in_a_row: NDArray[np.int64],
) -> bool:
    """Whether a measurement is within the gate, or so many in a row were not that the filter errs.

    `rejected_in_a_row` (2,) counts the measurements of each output outside the gate. After more
    than `MAX_REJECTED_IN_A_ROW` all are accepted until one is within a standard deviation of the
    prediction: until the filter has caught up with them.
    """
    distance = innovation * innovation / variance
    if rejected_in_a_row[output] > MAX_REJECTED_IN_A_ROW:
        if distance <= 1:
            rejected_in_a_row[output] = 0
        return True
    rejected_in_a_row[output] = 0 if distance <= gate * gate else rejected_in_a_row[output] + 1
    return bool(rejected_in_a_row[output] == 0 or rejected_in_a_row[output] > MAX_REJECTED_IN_A_ROW)


@compiled
def kalman_gain_of_scalar(Pc: FloatArray, S: float, K: FloatArray) -> None:
    """Set the gain K (s,) of the Kalman filter, P c / S."""
    for i in range(len(K)):
        K[i] = Pc[i] / S


@compiled
def correct(
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    Pc: FloatArray,
    innovation: float,
    variance: float,
) -> None:
    """Correct the state by a measurement, in place: x + K e and (I - K c') P (I - K c')' + K r K'.

    Joseph's form of the covariance, written out with P c and S = c' P c + r. It holds for any gain
    K (s,), optimal or not.
    """
    for i in range(len(x)):
        x[i] += K[i] * innovation
        for j in range(i + 1):
            P[i, j] += K[i] * variance * K[j] - K[i] * Pc[j] - Pc[i] * K[j]
            P[j, i] = P[i, j]


@compiled
def propagate(P: FloatArray, F: FloatArray, Q: FloatArray, FP: FloatArray, dynamic: int) -> None:
    """Set P (s, s) to F P F' + Q, in place; `FP` (s, s) is work space.

    The rows of F from `dynamic` on are those of the unit matrix: states that change by noise alone.
    """
    n = len(P)
    for i in range(dynamic):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += F[i, k] * P[j, k]  # P is symmetric
            FP[i, j] = total
    for i in range(dynamic):
        for j in range(i + 1):
            total = Q[i, j]
            for k in range(n):
                total += FP[i, k] * F[j, k]
            P[i, j] = P[j, i] = total
    for i in range(dynamic, n):
        for j in range(i + 1):
            P[i, j] = Q[i, j] + (FP[j, i] if j < dynamic else P[i, j])
            P[j, i] = P[i, j]


@compiled
def copy_matrix(target: FloatArray, source: FloatArray) -> None:
    """Copy a matrix element by element, as `compiled.copy_vector` does a vector."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
