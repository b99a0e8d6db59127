"""The steady-state Kalman filter, from the algebraic Riccati equation."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, solve_continuous_are, solve_continuous_lyapunov

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_matrix, as_square_matrix, as_symmetric_matrix
from .observability import AXIS_TOLERANCE, ComplexArray, format_eigenvalue, unobservable_eigenvalues

MAX_RICCATI_RESIDUAL = 1e-9  # a scaled residual beyond it is no solution


@dataclass(frozen=True, eq=False)
class Gain:
    """The gain of the observer x̂' = A x̂ + B u + L (y - C x̂).

    Attributes
    ----------
    gain
        L, (n, m).
    covariance
        P, (n, n): the solution of the Riccati equation. It is the covariance of the error, except
        in a quality design, which solves a changed equation.
    poles
        (n,): the eigenvalues of A - L C, 1/s, the slowest last.
    residual
        The residual of the Riccati equation over the sum of its terms.
    """

    gain: FloatArray
    covariance: FloatArray
    poles: ComplexArray
    residual: float


def kalman_gain(
    A: ArrayLike, G: ArrayLike, C: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None
) -> Gain:
    """Design the steady-state Kalman filter of x' = A x + G w, y = C x + v.

    The covariance is singular where a stable state is not driven by w: for example, the row of the
    gain of an actuator's state is zero.

    Parameters
    ----------
    A
        (n, n), 1/s.
    G
        (n, q): where the process noise enters.
    C
        (m, n).
    Q
        (q, q): intensity of the white noise w, in its unit squared times second.
    R
        (m, m): intensity of the white noise v. Samples `dt` seconds apart with noise of variance r
        have the intensity R = r dt.
    N
        (q, m): cross intensity E[w v']; zero by default.

    Raises
    ------
    UsageError
        The matrices do not fit; Q or [Q N; N' R] is not semidefinite; R is not definite; a mode
        that does not decay is not observable in y; or a mode on the imaginary axis is not driven
        by w. The message names the mode.

    References
    ----------
    Sakharov, Shergina, Chertkov, (11) and (13).

    Examples
    --------
    A double integrator with noise of unit intensity on its rate and on its measurement:

    >>> A, G, C = [[0, 1], [0, 0]], [[0], [1]], [[1, 0]]
    >>> kalman_gain(A, G, C, Q=1.0, R=1.0).gain.round(3).tolist()
    [[1.414], [1.0]]
    """
    A = as_square_matrix("A", A)
    n = len(A)
    G = as_matrix("G", G, rows=n)
    C = as_matrix("C", C, columns=n)
    q, m = G.shape[1], len(C)
    Q = as_symmetric_matrix("Q", Q, q)
    R = as_symmetric_matrix("R", R, m, definite="positive")
    N = np.zeros((q, m)) if N is None else as_matrix("N", N, q, m)
    as_symmetric_matrix("[Q N; N' R]", np.block([[Q, N], [N.T, R]]), q + m)
    return optimal_gain(A, C, G @ Q @ G.T, R, G @ N)


class MatrixNames(NamedTuple):
    """The names of the matrices of `optimal_gain` in the caller's terms, for error messages."""

    A: str = "A"
    C: str = "C"
    noise: str = "the noise"
    unseen: str = "cannot be seen in the measurements; measure another state"
    undriven: str = "no noise drives it; give it some"


FILTER_NAMES = MatrixNames()


def optimal_gain(
    A: FloatArray,
    C: FloatArray,
    W: FloatArray,
    R: FloatArray,
    S: FloatArray,
    words: MatrixNames = FILTER_NAMES,
) -> Gain:
    """Compute the Kalman gain for the state noise W, measurement noise R and cross term S.

    It solves A P + P A' + W - (P C' + S) R⁻¹ (C P + S') = 0; L = (P C' + S) R⁻¹. The arguments are
    not checked; a quality design passes a shifted A, a regulator the transposed system.

    Parameters
    ----------
    A
        (n, n), 1/s.
    C
        (m, n).
    W
        (n, n): intensity of the state noise.
    R
        (m, m): intensity of the measurement noise.
    S
        (n, m): cross intensity.
    words
        Names of the matrices, for error messages.

    Raises
    ------
    UsageError
        There is no stabilising solution; the message names the mode.
    """
    weight = np.linalg.solve(R, S.T).T  # S R⁻¹
    drift, drive, sharp = A - weight @ C, W - weight @ S.T, C.T @ np.linalg.solve(R, C)
    _require_solvable(A, C, drift, drive, words)
    matrices = f"{words.A} {A.shape} and {words.C}"
    try:
        P = _solved(A, C, W, R, S)
    except (LinAlgError, ValueError) as error:
        raise UsageError(f"{matrices}: no stabilising gain found ({error})") from None
    _require_stable(drift - P @ sharp, matrices)
    P = newton_step(drift, drive, sharp, P)
    L = np.linalg.solve(R, (P @ C.T + S).T).T
    poles = _require_stable(A - L @ C, matrices)
    residual = scaled_residual(drift, drive, sharp, P)
    if residual > MAX_RICCATI_RESIDUAL:
        raise UsageError(
            f"{matrices}: the residual of the Riccati equation is {residual:.1g};"
            " choose units that make the entries more alike"
        )
    return Gain(L, P, poles, residual)


def _solved(
    A: FloatArray, C: FloatArray, W: FloatArray, R: FloatArray, S: FloatArray
) -> FloatArray:
    """Solve the Riccati equation with scipy, in scaled units; return P (n, n).

    With the noise of a ship (state 1e-12, measurement 1e-9) scipy finds no solution or a wrong one.
    The measurements are therefore scaled to unit noise, and P by the p that makes the constant and
    the quadratic coefficient of the equation alike.
    """
    if not W.any() and sorted_eigenvalues(A)[-1].real < 0:
        return np.zeros_like(A)  # exact: no noise drives a stable system
    F = np.linalg.cholesky(R)
    C, S = np.linalg.solve(F, C), np.linalg.solve(F, S.T).T
    p = np.sqrt(np.linalg.norm(W)) / np.linalg.norm(C) if W.any() and C.any() else 1.0
    C, S = np.sqrt(p) * C, S / np.sqrt(p)
    return p * solve_continuous_are(A.T, C.T, W / p, np.eye(len(R)), s=S)


def _require_solvable(
    A: FloatArray, C: FloatArray, drift: FloatArray, drive: FloatArray, words: MatrixNames
) -> None:
    """Raise `UsageError` for a mode that no gain or not the optimal gain stabilises."""
    for mode in unobservable_eigenvalues(A, C):
        if mode.real >= -AXIS_TOLERANCE * np.linalg.norm(A):
            raise UsageError(
                f"{words.A} {A.shape} and {words.C}: the mode at {format_eigenvalue(mode)} does"
                f" not decay and {words.unseen}"
            )
    for mode in unobservable_eigenvalues(drift.T, drive):
        if abs(mode.real) <= AXIS_TOLERANCE * np.linalg.norm(drift):
            on_axis = complex(0.0, mode.imag)
            raise UsageError(
                f"{words.A} {A.shape} and {words.noise}: the mode at {format_eigenvalue(on_axis)}"
                f" neither grows nor decays and {words.undriven}"
            )


def _require_stable(closed: FloatArray, matrices: str) -> ComplexArray:
    """Return the poles of a closed loop (n, n), slowest last; raise `UsageError` if unstable."""
    poles = sorted_eigenvalues(closed)
    if poles[-1].real >= 0:
        raise UsageError(
            f"{matrices}: the computed gain leaves a pole at {format_eigenvalue(poles[-1])}: a mode"
            " is almost unobservable, or the units differ too much"
        )
    return poles


def newton_step(
    drift: FloatArray, drive: FloatArray, sharp: FloatArray, P: FloatArray
) -> FloatArray:
    """Improve P as the root of drift P + P drift' + drive - P sharp P = 0, all (n, n).

    scipy's P is accurate in the units of its matrices, and those of a ship differ by orders of
    magnitude; from there one Newton step squares the error (Kleinman, 1968).
    """
    residual = drift @ P + P @ drift.T + drive - P @ sharp @ P
    improved = P + solve_continuous_lyapunov(drift - P @ sharp, -residual)
    return (improved + improved.T) / 2


def scaled_residual(
    drift: FloatArray, drive: FloatArray, sharp: FloatArray, P: FloatArray
) -> float:
    """Compute drift P + P drift' + drive - P sharp P, all (n, n), relative to its terms."""
    residual = drift @ P + P @ drift.T + drive - P @ sharp @ P
    drifts, drives, sharps, size = (float(np.linalg.norm(M)) for M in (drift, drive, sharp, P))
    terms = drives + 2 * drifts * size + sharps * size**2
    return float(np.linalg.norm(residual)) / terms if terms else 0.0


def sorted_eigenvalues(closed: FloatArray) -> ComplexArray:
    """Return the eigenvalues (n,) of a closed loop (n, n), the slowest last."""
    poles = np.linalg.eigvals(closed).astype(complex)
    return poles[np.lexsort((poles.imag, poles.real))]


def error_covariance(
    A: ArrayLike, L: ArrayLike, C: ArrayLike, W: ArrayLike, R: ArrayLike
) -> FloatArray:
    """Compute the steady-state error covariance (n, n) of any gain L, optimal or not.

    It solves (A - L C) P + P (A - L C)' + W + L R L' = 0.

    Parameters
    ----------
    A
        (n, n), 1/s.
    L
        (n, m).
    C
        (m, n).
    W
        (n, n): intensity of the state noise.
    R
        (m, m): intensity of the measurement noise.

    Raises
    ------
    UsageError
        The matrices do not fit, or A - L C is not stable.

    Examples
    --------
    A random walk whose value is measured, with the optimal gain of one and with twice that gain:

    >>> [error_covariance([[0]], [[gain]], [[1]], 1.0, 1.0).item() for gain in (1.0, 2.0)]
    [1.0, 1.25]
    """
    A = as_square_matrix("A", A)
    n = len(A)
    C = as_matrix("C", C, columns=n)
    L = as_matrix("L", L, n, len(C))
    W, R = as_symmetric_matrix("W", W, n), as_symmetric_matrix("R", R, len(C))
    F = A - L @ C
    worst = sorted_eigenvalues(F)[-1]
    if worst.real >= 0:
        raise UsageError(
            f"L {L.shape}: A - L C has a pole at {format_eigenvalue(worst)}; expected a stable L"
        )
    return solve_continuous_lyapunov(F, -(W + L @ R @ L.T))
