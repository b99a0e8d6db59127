"""Checks of matrix arguments: shape, finiteness, symmetry and definiteness."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from shiplog.errors import UsageError
from shiplog.types import FloatArray

Definite = Literal["semi", "positive"]

ROUNDING = 1e-10  # relative tolerance of symmetry and definiteness, after scaling


def as_finite_array(name: str, values: ArrayLike) -> FloatArray:
    """Convert `values` to an array of finite real numbers, of any shape.

    Parameters
    ----------
    name
        Name of the argument, for error messages.
    values
        Numbers of any shape.

    Returns
    -------
    FloatArray
        A copy of the values, of their shape.

    Raises
    ------
    UsageError
        The values are not an array of real numbers, or contain NaN or infinities.
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
    """Convert `values` to a matrix of finite numbers and check its shape.

    Parameters
    ----------
    name
        Name of the argument, for error messages.
    values
        Numbers, (rows, columns).
    rows, columns
        Required size; `None` accepts any size above zero.

    Raises
    ------
    UsageError
        The shape differs, or `as_finite_array` rejects the values.
    """
    array = as_finite_array(name, values)
    expected = f"({'any' if rows is None else rows}, {'any' if columns is None else columns})"
    fits = array.ndim == 2 and array.size > 0
    fits = fits and all(
        required in (None, size)
        for required, size in zip((rows, columns), array.shape, strict=False)
    )
    if not fits:
        raise UsageError(f"{name} is of shape {array.shape}; expected {expected}")
    return array


def as_square_matrix(name: str, values: ArrayLike, n: int | None = None) -> FloatArray:
    """Convert `values` to a square matrix (n, n) of finite numbers; `None` accepts any n.

    Raises
    ------
    UsageError
        The matrix is not square or not (n, n), or `as_finite_array` rejects the values.
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
    """Convert `values` to a symmetric positive semidefinite or positive definite matrix (n, n).

    Symmetry and eigenvalues are judged to a relative 1e-10 after each row and column is scaled to a
    unit diagonal, so that states in very different units are treated alike.

    Parameters
    ----------
    name
        Name of the argument, for error messages.
    values
        Numbers, (n, n); a scalar is taken as a matrix (1, 1).
    n
        Required size; `None` accepts any.
    definite
        "semi" accepts zero eigenvalues, "positive" rejects them.

    Returns
    -------
    FloatArray
        (n, n), exactly symmetric.

    Raises
    ------
    UsageError
        The matrix is not symmetric or not definite as required, or `as_square_matrix` rejects it.

    Examples
    --------
    >>> as_symmetric_matrix("R", 2.0).tolist()
    [[2.0]]
    """
    array = as_finite_array(name, values)
    array = as_square_matrix(name, array.reshape(1, 1) if array.ndim == 0 else array, n)
    largest = float(np.abs(array).max()) or 1.0
    units = np.sqrt(np.maximum(np.diag(array), ROUNDING**2 * largest))
    scaled = array / np.outer(units, units)
    if np.abs(scaled - scaled.T).max() > ROUNDING * max(1.0, np.abs(scaled).max()):
        difference = np.abs(array - array.T).max()
        raise UsageError(
            f"{name}, {array.shape}, differs from its transpose by {difference:.3g}; expected a"
            " symmetric matrix"
        )
    least = np.linalg.eigvalsh(scaled + scaled.T)[0] / 2
    if least < -ROUNDING or (definite == "positive" and least < ROUNDING**1.5):
        required = "definite" if definite == "positive" else "semidefinite"
        raise UsageError(
            f"{name}, {array.shape}, has the eigenvalue {np.linalg.eigvalsh(array)[0]:.3g};"
            f" expected a positive {required} matrix"
        )
    return (array + array.T) / 2


def as_number(name: str, value: float, *, least: float = 0.0) -> float:
    """Convert `value` to a finite number not below `least`; raise `UsageError` otherwise."""
    array = as_finite_array(name, value)
    if array.ndim != 0 or array < least:
        raise UsageError(f"{name} is {value}; expected one number not below {least:g}")
    return float(array)


def as_count(name: str, value: int) -> int:
    """Convert `value` to a whole number not below one; raise `UsageError` otherwise."""
    if as_number(name, value, least=1) % 1:
        raise UsageError(f"{name} is {value}; expected a whole number")
    return int(value)
