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
    """Return the unobservable eigenvalues (k,) of A (n, n) with the output matrix C (m, n).

    The staircase form: orthogonal rotations split off the states that C shows, then those that
    drive these, and so on; the eigenvalues of the remaining states are unobservable. Unlike
    Hautus's test this needs no eigenvalue of A, which is known to half the digits only where it is
    multiple. The uncontrollable eigenvalues of an input matrix B are `unseen_modes(A.T, B.T)`.
    """
    A, (units, _) = matrix_balance(A, permute=False, separate=True)
    C = C * units
    lengths = np.linalg.norm(C, axis=1, keepdims=True)
    C = C / np.where(lengths > 0, lengths, 1.0)
    size = float(np.linalg.norm(A))
    threshold = RANK_TOLERANCE
    while len(A):
        _, shown, rotation = np.linalg.svd(C)
        rank = int(np.sum(shown > threshold))
        if rank == 0:
            break
        # what is still hidden: how it moves itself, and how it moves what was just seen
        seen, hidden = rotation[:rank], rotation[rank:]
        A, C = hidden @ A @ hidden.T, seen @ A @ hidden.T
        threshold = RANK_TOLERANCE * size
    return np.linalg.eigvals(A).astype(complex)


def format_eigenvalue(mode: complex) -> str:
    """Format an eigenvalue for a message: 0.2164316, or -0.05+0.6j."""
    return f"{mode:.7g}" if mode.imag else f"{mode.real:.7g}"
