"""What of a system its measurements show."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance

from shiplog.types import FloatArray

ComplexArray = NDArray[np.complexfloating[Any, Any]]

RANK = 1e-12  # below it a direction counts as not seen, every measurement's unit being one
AXIS = 1e-8  # of the norm of A: as near to the imaginary axis as a double eigenvalue is known


def unseen_modes(A: FloatArray, C: FloatArray) -> ComplexArray:
    """The eigenvalues of A (n, n) that C (m, n) does not show, (k,); none if observable.

    What C shows is taken away, what A feeds into that next, and so on, by orthogonal rotations
    (the staircase form); the eigenvalues of what is left over are the modes. Unlike Hautus's test
    it needs no eigenvalue of A, which where it is multiple is known to half the digits only.
    The modes that an input B does not reach are `unseen_modes(A.T, B.T)`.
    """
    A, (units, _) = matrix_balance(A, permute=False, separate=True)
    C = C * units
    lengths = np.linalg.norm(C, axis=1, keepdims=True)
    C = C / np.where(lengths > 0, lengths, 1.0)
    size = float(np.linalg.norm(A))
    threshold = RANK
    while len(A):
        _, shown, rotation = np.linalg.svd(C)
        rank = int(np.sum(shown > threshold))
        if rank == 0:
            break
        # what is still hidden: how it moves itself, and how it moves what was just seen
        seen, hidden = rotation[:rank], rotation[rank:]
        A, C = hidden @ A @ hidden.T, seen @ A @ hidden.T
        threshold = RANK * size
    return np.linalg.eigvals(A).astype(complex)


def spelled(mode: complex) -> str:
    """An eigenvalue for a message: 0.2164316, or -0.05+0.6j."""
    return f"{mode:.7g}" if mode.imag else f"{mode.real:.7g}"
