"""Quality regulator and quality filter: LQ designs of prescribed decay and damping (Antonov).

A shift c makes every mode decay faster than exp(-c t / 2); a weight G on the rates damps it. With
one c both are the ordinary design for A + (c / 2) I. Two shifts, of fast and of slow motions, bound
nothing and can destabilise: what they give is looked at, and refused where it breaks its bound.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import schur, solve_sylvester

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_count, as_finite_array, as_matrix, as_square_matrix, as_symmetric_matrix
from .observability import ComplexArray, format_eigenvalue
from .riccati import Gain, MatrixNames, optimal_gain, sorted_eigenvalues

Shift = float | tuple[float, float]
Projectors = tuple[ArrayLike, ArrayLike]


@dataclass(frozen=True, eq=False)
class Regulator:
    """The gain of u = L x and what the Riccati equation says of it."""

    gain: FloatArray  # L, (inputs, n); A + B L is the closed loop
    cost: FloatArray  # Q, (n, n): x' Q x is what is still to be paid from x on
    poles: ComplexArray  # of A + B L, (n,), the slowest last
    residual: float  # of the Riccati equation, as a part of its terms


def quality_regulator(
    A: ArrayLike,
    B: ArrayLike,
    P: ArrayLike,
    R: ArrayLike,
    *,
    G: ArrayLike | None = None,
    shift: Shift = 0.0,
    projectors: Projectors | None = None,
) -> Regulator:
    """The regulator u = L x of x' = A x + B u that minimises ∫ x'Px + (x')'G x' + u'Ru + c V dt.

    A, P and G (n, n), B (n, inputs), R (inputs, inputs). `shift` is c in 1/s: every pole is left
    of -c / 2. For (c1, c2) `projectors` are those on the fast and the slow motions
    (`decay_projectors`), each (n, n), and every pole must be left of -min(c1, c2) / 2.
    With Ec = c1 E1 + c2 E2 and R~ = R + B'GB the equation is that of A + Ec / 2, P + A'GA, R~ and
    the cross term A'GB, which the shift does not enter; L = -R~⁻¹ (B'GA + B'Q).

    Raises `UsageError` for matrices that do not fit, P or G not semidefinite, R not definite, no
    stabilising solution, and a pole that breaks the bound. Source: Antonov, (2) to (5).
    """
    A = as_square_matrix("A", A)
    n = len(A)
    B = as_matrix("B", B, rows=n)
    P = as_symmetric_matrix("P", P, n)
    R = as_symmetric_matrix("R", R, B.shape[1], definite="positive")
    G = np.zeros((n, n)) if G is None else as_symmetric_matrix("G", G, n)
    shifted, bound = _shifted(A, shift, projectors)
    words = MatrixNames(
        _name(bound, "A"), "B", "P", "cannot be moved by B; add an input", "P does not weigh it"
    )
    dual = optimal_gain(shifted.T, B.T, P + A.T @ G @ A, R + B.T @ G @ B, A.T @ G @ B, words=words)
    L = -dual.gain.T
    return Regulator(L, dual.covariance, _bounded(A + B @ L, bound), dual.residual)


def quality_filter(
    A: ArrayLike,
    S: ArrayLike,
    R1: ArrayLike,
    R2: ArrayLike,
    *,
    G: ArrayLike | None = None,
    shift: Shift = 0.0,
    projectors: Projectors | None = None,
) -> Gain:
    """The filter of x' = A x + white noise of intensity R1, y = S x + white noise of R2.

    A, R1 and G (n, n), S (m, n), R2 (m, m). `shift` and `projectors` are `quality_regulator`'s. G
    is more white noise, A ξ in x' and S ξ in y: the intensities become R1 + A G A' and R2 + S G S',
    with A G S' across. K = (P S' + A G S') (R2 + S G S')⁻¹. With c = 0, G = 0 it is the Kalman
    filter; otherwise its covariance is that of the question so changed, and `error_covariance`
    tells the real one.

    Raises `UsageError` as `quality_regulator` does. Source: Antonov, (6) to (9), (6) with its
    quadratic term.
    """
    A = as_square_matrix("A", A)
    n = len(A)
    S = as_matrix("S", S, columns=n)
    R1 = as_symmetric_matrix("R1", R1, n)
    R2 = as_symmetric_matrix("R2", R2, len(S), definite="positive")
    G = np.zeros((n, n)) if G is None else as_symmetric_matrix("G", G, n)
    shifted, bound = _shifted(A, shift, projectors)
    found = optimal_gain(
        shifted,
        S,
        R1 + A @ G @ A.T,
        R2 + S @ G @ S.T,
        A @ G @ S.T,
        words=MatrixNames(A=_name(bound, "A"), C="S", noise="R1"),
    )
    poles = _bounded(A - found.gain @ S, bound)
    return Gain(found.gain, found.covariance, poles, found.residual)


def cycle_regulator(
    A: ArrayLike,
    B: ArrayLike,
    P: ArrayLike,
    R: ArrayLike,
    cycles: int,
    *,
    G: ArrayLike | None = None,
    shift: Shift = 0.0,
    projectors: Projectors | None = None,
) -> tuple[Regulator, ...]:
    """The regulator after each of `cycles` designs, each for the loop that those before closed.

    The arguments are `quality_regulator`'s; each gain is the sum of all so far, each cost and
    residual its own cycle's. With G = 0 and c = 0, j cycles are one design with j P: the increments
    fall as 1/√j and their sum grows without end. With G > 0 and one input they fall as
    R / (R + B'GB), and j cycles are one design with a smaller R.

    Raises `UsageError` for fewer cycles than one, and as `quality_regulator` does. Source:
    Antonov, (10) and (11).
    """
    cycles = as_count("cycles", cycles)
    A = as_square_matrix("A", A)
    B = as_matrix("B", B, rows=len(A))
    total = np.zeros(B.T.shape)
    done = []
    for _ in range(cycles):
        step = quality_regulator(A + B @ total, B, P, R, G=G, shift=shift, projectors=projectors)
        total = total + step.gain
        done.append(Regulator(total, step.cost, step.poles, step.residual))
    return tuple(done)


def decay_projectors(A: ArrayLike, border: float) -> tuple[FloatArray, FloatArray]:
    """The projectors E1 and E2 (n, n) on the motions of A (n, n) that decay faster, and the rest.

    `border` is a decay in 1/s: E1 is that of the eigenvalues with Re λ < -border. E1 + E2 = I, and
    both commute with A. Raises `UsageError` for A not square.
    """
    A = as_square_matrix("A", A)
    n = len(A)
    T, Z, fast = schur(A, output="real", sort=lambda real, _: real < -border)
    above, beside, below = T[:fast, :fast], T[:fast, fast:], T[fast:, fast:]
    X = solve_sylvester(above, -below, beside) if 0 < fast < n else np.zeros((fast, n - fast))
    E1 = Z[:, :fast] @ np.hstack((np.eye(fast), X)) @ Z.T
    return E1, np.eye(n) - E1


def _shifted(
    A: FloatArray, shift: Shift, projectors: Projectors | None
) -> tuple[FloatArray, float]:
    """A + Ec / 2 and the real part that every pole must be left of."""
    n = len(A)
    speeds = as_finite_array("shift", shift)
    if speeds.shape not in {(), (2,)} or speeds.min() < 0:
        raise UsageError(f"shift is {shift}; expected one number, or two, not below 0")
    c1, c2 = np.broadcast_to(speeds, 2)
    if projectors is None and c1 != c2:
        raise UsageError(f"shift is {shift}; expected projectors with two different ones")
    one, other = projectors or (np.eye(n), np.zeros((n, n)))
    E1, E2 = as_square_matrix("projectors[0]", one, n), as_square_matrix("projectors[1]", other, n)
    if not (np.allclose(E1 + E2, np.eye(n)) and np.allclose(E1 @ E1, E1)):
        raise UsageError(f"projectors, {E1.shape}: expected E1 + E2 = I and E1 E1 = E1")
    return A + (c1 * E1 + c2 * E2) / 2, -float(min(c1, c2)) / 2


def _name(bound: float, matrix_name: str) -> str:
    return f"{matrix_name} + Ec/2" if bound else matrix_name


def _bounded(closed: FloatArray, bound: float) -> ComplexArray:
    """The poles of the closed loop (n, n), the slowest last; refused unless left of the bound."""
    poles = sorted_eigenvalues(closed)
    if poles[-1].real >= bound:
        raise UsageError(
            f"shift asks for poles left of {bound:g}, and one is at"
            f" {format_eigenvalue(poles[-1])}; take one shift for fast and slow motions"
        )
    return poles
