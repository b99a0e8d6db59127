"""Quality regulator and filter: LQ designs with prescribed decay and damping (Antonov).

A shift c makes every mode decay faster than exp(-c t / 2); a weight G on the rates adds damping.
A single c gives the ordinary design for A + (c / 2) I. Two shifts, for fast and slow modes,
guarantee no bound and can destabilise: the poles are checked and the result is rejected where it
violates the bound.
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
    """The gain of the state feedback u = L x.

    Attributes
    ----------
    gain
        L, (inputs, n); the closed loop is A + B L.
    cost
        Q, (n, n): x' Q x is the cost from the state x on.
    poles
        (n,), 1/s: eigenvalues of A + B L, the slowest last.
    residual
        The residual of the Riccati equation over the sum of its terms.
    """

    gain: FloatArray
    cost: FloatArray
    poles: ComplexArray
    residual: float


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
    """Design the regulator u = L x of x' = A x + B u with prescribed decay.

    It minimises ∫ x'P x + (x')'G x' + u'R u + c V dt, V being the cost from the current state on.
    With Ec = c1 E1 + c2 E2 and R~ = R + B'GB the Riccati equation is that of A + Ec / 2, the state
    weight P + A'GA, the input weight R~ and the cross term A'GB, which the shift does not enter:
    L = -R~⁻¹ (B'GA + B'Q).

    Parameters
    ----------
    A
        (n, n), 1/s.
    B
        (n, inputs).
    P
        (n, n): weight of the state, semidefinite.
    R
        (inputs, inputs): weight of the input, positive definite.
    G
        (n, n): weight of the rates x', semidefinite; zero by default.
    shift
        c in 1/s: the real part of every pole is below -c / 2. A pair (c1, c2) needs `projectors`,
        and the bound is -min(c1, c2) / 2.
    projectors
        E1 and E2 on the fast and the slow modes, each (n, n): see `decay_projectors`.

    Raises
    ------
    UsageError
        The matrices do not fit, P or G is not semidefinite, R is not definite, there is no
        stabilising solution, or a pole violates the bound.

    References
    ----------
    Antonov, (2) to (5).

    Examples
    --------
    A double integrator whose modes decay faster than exp(-t / 2):

    >>> A, B = [[0, 1], [0, 0]], [[0], [1]]
    >>> design = quality_regulator(A, B, np.eye(2), np.eye(1), shift=1.0)
    >>> bool(design.poles.real.max() < -0.5)
    True
    """
    A = as_square_matrix("A", A)
    n = len(A)
    B = as_matrix("B", B, rows=n)
    P = as_symmetric_matrix("P", P, n)
    R = as_symmetric_matrix("R", R, B.shape[1], definite="positive")
    G = np.zeros((n, n)) if G is None else as_symmetric_matrix("G", G, n)
    shifted, bound = _shifted(A, shift, projectors)
    words = MatrixNames(
        _name(bound, "A"), "B", "P", "cannot be moved by B; add an input", "P gives it no weight"
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
    """Design the filter of x' = A x + w, y = S x + v with prescribed decay of the error.

    G is additional white noise ξ that enters as A ξ in x' and as S ξ in y: the intensities become
    R1 + A G A' and R2 + S G S', with the cross term A G S', and K = (P S' + A G S') (R2 + S G
    S')⁻¹. With c = 0 and G = 0 the result is the Kalman filter; otherwise its covariance is that of
    the changed problem, and `error_covariance` computes the actual one.

    Parameters
    ----------
    A
        (n, n), 1/s.
    S
        (m, n).
    R1
        (n, n): intensity of the state noise w, semidefinite.
    R2
        (m, m): intensity of the measurement noise v, positive definite.
    G
        (n, n): intensity of the additional noise ξ, semidefinite; zero by default.
    shift, projectors
        As in `quality_regulator`.

    Raises
    ------
    UsageError
        As in `quality_regulator`.

    References
    ----------
    Antonov, (6) to (9); (6) is completed by its quadratic term.
    """
    A = as_square_matrix("A", A)
    n = len(A)
    S = as_matrix("S", S, columns=n)
    R1 = as_symmetric_matrix("R1", R1, n)
    R2 = as_symmetric_matrix("R2", R2, len(S), definite="positive")
    G = np.zeros((n, n)) if G is None else as_symmetric_matrix("G", G, n)
    shifted, bound = _shifted(A, shift, projectors)
    solution = optimal_gain(
        shifted,
        S,
        R1 + A @ G @ A.T,
        R2 + S @ G @ S.T,
        A @ G @ S.T,
        words=MatrixNames(A=_name(bound, "A"), C="S", noise="R1"),
    )
    poles = _bounded(A - solution.gain @ S, bound)
    return Gain(solution.gain, solution.covariance, poles, solution.residual)


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
    """Repeat the regulator design, each time for the loop that the previous designs closed.

    With G = 0 and c = 0, j cycles equal one design with j P: the increments of the gain fall as
    1/√j, and their sum grows without bound. With B'GB > 0 they fall geometrically in the end, with
    the largest eigenvalue ρ of (R + B'GB)⁻¹ R as their ratio; with one input, j cycles equal one
    design with ρʲ B'GB / (1 - ρʲ) in place of R.

    Parameters
    ----------
    A, B, P, R, G, shift, projectors
        As in `quality_regulator`.
    cycles
        Number of designs, at least one.

    Returns
    -------
    tuple of Regulator
        After each cycle: the sum of the gains so far, the poles of that loop, and the cost and
        residual of this cycle.

    Raises
    ------
    UsageError
        `cycles` is below one, or as in `quality_regulator`.

    References
    ----------
    Antonov, (10) and (11).
    """
    cycles = as_count("cycles", cycles)
    A = as_square_matrix("A", A)
    B = as_matrix("B", B, rows=len(A))
    total = np.zeros(B.T.shape)
    designs = []
    for _ in range(cycles):
        step = quality_regulator(A + B @ total, B, P, R, G=G, shift=shift, projectors=projectors)
        total = total + step.gain
        designs.append(Regulator(total, step.cost, step.poles, step.residual))
    return tuple(designs)


def decay_projectors(A: ArrayLike, border: float) -> tuple[FloatArray, FloatArray]:
    """Compute the spectral projectors on the fast and the slow modes of A.

    Parameters
    ----------
    A
        (n, n), 1/s.
    border
        Decay rate in 1/s: modes with Re λ < -border are fast.

    Returns
    -------
    E1, E2
        (n, n) each, on the fast and on the slow modes; E1 + E2 = I, and both commute with A.

    Raises
    ------
    UsageError
        A is not square.

    Examples
    --------
    >>> fast, slow = decay_projectors(np.diag([-3.0, -0.1]), border=1.0)
    >>> fast.tolist(), slow.tolist()
    ([[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]])
    """
    A = as_square_matrix("A", A)
    n = len(A)
    T, Z, count = schur(A, output="real", sort=lambda real, _: real < -border)
    fast, coupling, slow = T[:count, :count], T[:count, count:], T[count:, count:]
    split = 0 < count < n
    X = solve_sylvester(fast, -slow, coupling) if split else np.zeros((count, n - count))
    E1 = Z[:, :count] @ np.hstack((np.eye(count), X)) @ Z.T
    return E1, np.eye(n) - E1


def _shifted(
    A: FloatArray, shift: Shift, projectors: Projectors | None
) -> tuple[FloatArray, float]:
    """Return A + Ec / 2 and the bound below which the real part of every pole must lie."""
    n = len(A)
    shifts = as_finite_array("shift", shift)
    if shifts.shape not in {(), (2,)} or shifts.min() < 0:
        raise UsageError(f"shift is {shift}; expected one number, or two, not below 0")
    c1, c2 = np.broadcast_to(shifts, 2)
    if projectors is None and c1 != c2:
        raise UsageError(f"shift is {shift}; expected projectors with two different ones")
    first, second = projectors or (np.eye(n), np.zeros((n, n)))
    E1 = as_square_matrix("projectors[0]", first, n)
    E2 = as_square_matrix("projectors[1]", second, n)
    if not (np.allclose(E1 + E2, np.eye(n)) and np.allclose(E1 @ E1, E1)):
        raise UsageError(f"projectors, {E1.shape}: expected E1 + E2 = I and E1 E1 = E1")
    return A + (c1 * E1 + c2 * E2) / 2, -float(min(c1, c2)) / 2


def _name(bound: float, matrix_name: str) -> str:
    """Return the name of the shifted matrix for error messages."""
    return f"{matrix_name} + Ec/2" if bound else matrix_name


def _bounded(closed: FloatArray, bound: float) -> ComplexArray:
    """Return the poles of a closed loop (n, n), slowest last; raise if one violates the bound."""
    poles = sorted_eigenvalues(closed)
    if poles[-1].real >= bound:
        raise UsageError(
            f"shift requires poles left of {bound:g}, and one is at"
            f" {format_eigenvalue(poles[-1])}; use one shift for fast and slow modes"
        )
    return poles
