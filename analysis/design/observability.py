"""Observability: the modes of a linear system that its outputs do not show."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from shiplog.types import FloatArray

ComplexArray = NDArray[np.complexfloating[Any, Any]]

RANK_TOLERANCE = 1e-12  # a direction below it is unobservable; each output has unit length
AXIS_TOLERANCE = 1e-8  # of the norm of A: the accuracy of a double eigenvalue


def unobservable_eigenvalues(A: FloatArray, C: FloatArray) -> ComplexArray:
    """Compute the eigenvalues of A that are unobservable from y = C x.

    The staircase form: orthogonal rotations separate the states that C measures, then those that
    drive these, and so on; the eigenvalues of the remaining states are unobservable. Unlike
    Hautus's test it needs no eigenvalue of A, and a double eigenvalue is computed to half the
    digits only. The uncontrollable eigenvalues of an input matrix B are
    `unobservable_eigenvalues(A.T, B.T)`.

    Parameters
    ----------
    A
        (n, n), 1/s.
    C
        (m, n): the output matrix.

    Returns
    -------
    ComplexArray
        (k,), 1/s; empty where the pair is observable.

    Examples
    --------
    The rate of a double integrator is measured, its position is not:

    >>> A, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0, 1.0]])
    >>> unobservable_eigenvalues(A, C).tolist()
    [0j]
    """
    A, (units, _) = matrix_balance(A, permute=False, separate=True)
    C = C * units
    lengths = np.linalg.norm(C, axis=1, keepdims=True)
    C = C / np.where(lengths > 0, lengths, 1.0)
    size = float(np.linalg.norm(A))
    threshold = RANK_TOLERANCE
    while len(A):
        _, values, rotation = np.linalg.svd(C)
        rank = int(np.sum(values > threshold))
        if rank == 0:
            break
        # the dynamics of the remaining states, and how they drive the states just separated
        observed, remaining = rotation[:rank], rotation[rank:]
        A, C = remaining @ A @ remaining.T, observed @ A @ remaining.T
        threshold = RANK_TOLERANCE * size
    return np.linalg.eigvals(A).astype(complex)


def format_eigenvalue(mode: complex) -> str:
    """Format an eigenvalue for a message: 0.2164316, or -0.05+0.6j."""
    return f"{mode:.7g}" if mode.imag else f"{mode.real:.7g}"
