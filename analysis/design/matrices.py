"""Checks of matrix arguments: shape, finiteness, symmetry and definiteness."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from shiplog.errors import UsageError
from shiplog.types import FloatArray

Definite = Literal["semi", "positive"]

ROUNDING = 1e-10  # what symmetry and definiteness are judged to, every unit being one


def as_finite_array(name: str, values: ArrayLike) -> FloatArray:
    """`values` as an array of real, finite numbers, of any shape.

    Raises `UsageError` for what is no array of real numbers, and for NaN and infinities.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise UsageError(f"{name} has rows of different lengths; expected a matrix") from None
    if array.dtype.kind not in "biuf":
        raise UsageError(f"{name}, {array.shape}, is {array.dtype}; expected real numbers")
    if not np.isfinite(array).all():
        raise UsageError(f"{name}, {array.shape}, has NaN or infinities; expected finite numbers")
    return array.astype(np.float64)


def as_matrix(
    name: str, values: ArrayLike, rows: int | None = None, columns: int | None = None
) -> FloatArray:
    """`values` as a matrix (rows, columns) of finite numbers; `None` is any number but none.

    Raises `UsageError` where it is of another shape, and what `as_finite_array` raises.
    """
    array = as_finite_array(name, values)
    expected = f"({'any' if rows is None else rows}, {'any' if columns is None else columns})"
    fits = array.ndim == 2 and array.size > 0
    fits = fits and all(
        wanted in (None, found) for wanted, found in zip((rows, columns), array.shape, strict=False)
    )
    if not fits:
        raise UsageError(f"{name} is of shape {array.shape}; expected {expected}")
    return array


def as_square_matrix(name: str, values: ArrayLike, n: int | None = None) -> FloatArray:
    """`values` as a matrix (n, n) of finite numbers; `None` is any n.

    Raises `UsageError` where it is not square or not of that n, and what `as_finite_array` raises.
    """
    array = as_finite_array(name, values)
    size = n if n is not None else max(array.shape, default=0)
    if array.shape != (size, size) or not size:
        expected = f"({n}, {n})" if n else "a square matrix"
        raise UsageError(f"{name} is of shape {array.shape}; expected {expected}")
    return array


def as_symmetric_matrix(
    name: str, values: ArrayLike, n: int | None = None, *, definite: Definite = "semi"
) -> FloatArray:
    """`values` as a symmetric matrix (n, n), positive semidefinite or positive definite.

    A scalar stands for a matrix (1, 1). Each entry is judged in the units of its own row and
    column, to a relative 1e-10; what is given back is symmetric to the bit. Raises `UsageError`
    for any other, and what `as_square_matrix` raises.
    """
    array = as_finite_array(name, values)
    array = as_square_matrix(name, array.reshape(1, 1) if array.ndim == 0 else array, n)
    largest = float(np.abs(array).max()) or 1.0
    units = np.sqrt(np.maximum(np.diag(array), ROUNDING**2 * largest))
    scaled = array / np.outer(units, units)
    if np.abs(scaled - scaled.T).max() > ROUNDING * max(1.0, np.abs(scaled).max()):
        off = np.abs(array - array.T).max()
        raise UsageError(
            f"{name}, {array.shape}, differs from its transpose by {off:.3g}; expected a symmetric"
            " matrix"
        )
    least = np.linalg.eigvalsh(scaled + scaled.T)[0] / 2
    if least < -ROUNDING or (definite == "positive" and least < ROUNDING**1.5):
        wanted = "definite" if definite == "positive" else "semidefinite"
        raise UsageError(
            f"{name}, {array.shape}, has the eigenvalue {np.linalg.eigvalsh(array)[0]:.3g};"
            f" expected a positive {wanted} matrix"
        )
    return (array + array.T) / 2


def as_number(name: str, value: float, *, least: float = 0.0) -> float:
    """`value` as a finite number not below `least`; raises `UsageError` for any other."""
    array = as_finite_array(name, value)
    if array.ndim != 0 or array < least:
        raise UsageError(f"{name} is {value}; expected one number not below {least:g}")
    return float(array)


def as_count(name: str, value: int) -> int:
    """`value` as a whole number not below one; raises `UsageError` for any other."""
    if as_number(name, value, least=1) % 1:
        raise UsageError(f"{name} is {value}; expected a whole number")
    return int(value)
