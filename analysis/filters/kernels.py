"""What all filters do at an instant: believe a measurement or not, correct, go on.

`P` is symmetric and stays so to the last bit.
"""

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray

MISSING, GATED, BELIEVED = range(3)  # measurements
PATIENCE = 5  # so many in a row that are off are no spikes: it is the filter that is


@compiled
def project(P: FloatArray, c: FloatArray, Pc: FloatArray) -> float:
    """P c, and c P c: the variance of an output as it is predicted."""
    variance = 0.0
    for i in range(len(c)):
        Pc[i] = 0.0
        for j in range(len(c)):
            Pc[i] += P[i, j] * c[j]
        variance += c[i] * Pc[i]
    return variance


@compiled
def weigh(
    x: FloatArray,
    P: FloatArray,
    c: FloatArray,
    r: float,
    measured: float,
    gate: float,
    output: int,
    off: NDArray[np.int64],
    Pc: FloatArray,
) -> tuple[float, float, int]:
    """The innovation of an output c x, its variance, and whether it is BELIEVED, GATED or MISSING.

    `Pc` is left as P c, which the gain is made of.
    """
    variance = project(P, c, Pc) + r
    innovation = measured
    for i in range(len(c)):
        innovation -= c[i] * x[i]
    if not np.isfinite(innovation):
        return innovation, variance, MISSING
    if believable(innovation, variance, gate, output, off):
        return innovation, variance, BELIEVED
    return innovation, variance, GATED


@compiled
def believable(
    innovation: float, variance: float, gate: float, output: int, off: NDArray[np.int64]
) -> bool:
    """Whether a measurement is within the gate, or has been off so often that it must be right.

    `off` (2,) counts, for each output, how many have been off in a row. Once they are believed,
    they are until the filter has come up to them.
    """
    distance = innovation * innovation / variance
    if off[output] > PATIENCE:
        if distance <= 1:
            off[output] = 0
        return True
    off[output] = 0 if distance <= gate * gate else off[output] + 1
    return bool(off[output] == 0 or off[output] > PATIENCE)


@compiled
def correct(
    x: FloatArray,
    P: FloatArray,
    K: FloatArray,
    Pc: FloatArray,
    innovation: float,
    variance: float,
) -> None:
    """Take a measurement in by a gain K (s,), the best one or not: Joseph's form, written out."""
    for i in range(len(x)):
        x[i] += K[i] * innovation
        for j in range(i + 1):
            P[i, j] += K[i] * variance * K[j] - K[i] * Pc[j] - Pc[i] * K[j]
            P[j, i] = P[i, j]


@compiled
def propagate(P: FloatArray, F: FloatArray, Q: FloatArray, FP: FloatArray) -> None:
    """F P F' + Q in place; `FP` is room to work in."""
    n = len(P)
    for i in range(n):
        for j in range(n):
            FP[i, j] = 0.0
            for k in range(n):
                FP[i, j] += F[i, k] * P[k, j]
    for i in range(n):
        for j in range(i + 1):
            P[i, j] = Q[i, j]
            for k in range(n):
                P[i, j] += FP[i, k] * F[j, k]
            P[j, i] = P[i, j]
