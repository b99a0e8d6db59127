import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.linalg import expm, solve_continuous_are

from analysis.design.observability import unobservable_eigenvalues
from analysis.design.riccati import Gain, error_covariance, kalman_gain
from shiplog import UsageError
from shiplog.types import FloatArray

FEW = settings(derandomize=True, max_examples=30, deadline=None)
SEEDS = st.integers(0, 2**32 - 1)


def system(seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return A, G, C, Q and R of a random system of one to seven states."""
    rng = np.random.default_rng(seed)
    n, m, q = rng.integers(1, [8, 4, 4])
    rotated = rng.standard_normal((m, m))
    return (
        rng.standard_normal((n, n)),
        rng.standard_normal((n, q)),
        rng.standard_normal((m, n)),
        np.diag(rng.uniform(0.1, 10, q)),
        rotated @ rotated.T + 0.1 * np.eye(m),
    )


@FEW
@given(SEEDS)
def test_gain_matches_control(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    result = kalman_gain(A, G, C, Q, R)
    W = G @ Q @ G.T  # control requires exact symmetry
    L, P, _ = control.lqe(A, np.eye(len(A)), C, (W + W.T) / 2, (R + R.T) / 2)
    # both solve the equation to rounding; how far they may then differ is a matter of its condition
    allowed = 10 * _rounding_error_of_covariance(A, C, W, R, result)
    of_gain = allowed * np.linalg.norm(np.linalg.solve(R, C))
    assert result.gain == pytest.approx(L, rel=1e-7, abs=max(1e-7, of_gain))
    assert result.covariance == pytest.approx(P, rel=1e-7, abs=max(1e-7, allowed))


def _rounding_error_of_covariance(
    A: FloatArray, C: FloatArray, W: FloatArray, R: FloatArray, result: Gain
) -> float:
    """First-order error of the covariance where the terms of its equation are rounded."""
    closed, identity = A - result.gain @ C, np.eye(len(A))
    lyapunov = np.kron(identity, closed) + np.kron(closed, identity)
    a, q, p = (np.linalg.norm(M) for M in (A, W, result.covariance))
    terms = q + 2 * a * p + np.linalg.norm(C.T @ np.linalg.solve(R, C)) * p**2
    smallest = np.linalg.svd(lyapunov, compute_uv=False)[-1]
    return float(np.finfo(float).eps * terms / smallest)


@FEW
@given(SEEDS)
def test_riccati_equation_holds_and_the_slowest_pole_is_last(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    result = kalman_gain(A, G, C, Q, R)
    P, sharp = result.covariance, C.T @ np.linalg.solve(R, C)
    left = A @ P + P @ A.T + G @ Q @ G.T - P @ sharp @ P
    a, q, s, p = (np.linalg.norm(M) for M in (A, G @ Q @ G.T, sharp, P))
    assert np.linalg.norm(left) < 1e-12 * (q + 2 * a * p + s * p**2)
    assert result.residual < 1e-12
    assert result.poles[-1].real == result.poles.real.max() < 0
    assert np.poly(result.poles) == pytest.approx(np.poly(A - result.gain @ C), rel=1e-9, abs=1e-9)
    assert np.linalg.eigvalsh(P)[0] > -1e-12 * p


@FEW
@given(SEEDS)
def test_any_other_gain_has_a_larger_error(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    result, W = kalman_gain(A, G, C, Q, R), G @ Q @ G.T
    best = error_covariance(A, result.gain, C, W, R)
    assert best == pytest.approx(result.covariance, rel=1e-6, abs=1e-8 * np.trace(best))
    rng = np.random.default_rng(seed)
    margin = -result.poles[-1].real / np.linalg.norm(C, 2)
    other = result.gain + 0.01 * margin * rng.uniform(-1, 1, result.gain.shape)
    if np.linalg.eigvals(A - other @ C).real.max() < 0:
        assert np.trace(error_covariance(A, other, C, W, R)) >= np.trace(best) * (1 - 1e-9)


@FEW
@given(SEEDS)
def test_correlated_noise_equals_an_uncorrelated_system(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    rng = np.random.default_rng(seed)
    spread = rng.uniform(-1, 1, (len(Q), len(R)))
    spread /= 1.01 * max(1.0, np.linalg.norm(spread, 2))
    N = np.linalg.cholesky(Q) @ spread @ np.linalg.cholesky(R).T
    # w = N R⁻¹ v + a part uncorrelated with v, and v = y - C x: the first part is an input
    known = G @ N @ np.linalg.inv(R)
    plain = kalman_gain(A - known @ C, G, C, Q - N @ np.linalg.solve(R, N.T), R)
    result = kalman_gain(A, G, C, Q, R, N)
    assert result.residual < 1e-12
    assert result.gain == pytest.approx(plain.gain + known, rel=1e-7, abs=1e-7)


@FEW
@given(SEEDS)
def test_residual_is_small_in_the_units_of_a_ship(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    assert kalman_gain(A, 1e-6 * G, C, Q, 1e-9 * R).residual < 1e-12


def test_samples_every_dt_have_noise_intensity_r_dt() -> None:
    A, C = np.array([[0, 1], [-1 / 7500, -200 / 7500]]), np.array([[1.0, 0]])
    q, r, dt = 1e-12, 2.5e-7, 0.01
    Qd = q * dt * np.array([[dt**2 / 3, dt / 2], [dt / 2, 1]])
    predictor, P, _ = control.dlqe(expm(A * dt), np.eye(2), C, Qd, [[r]])
    result = kalman_gain(A, [[0], [1]], C, q, r * dt)
    assert predictor / dt == pytest.approx(result.gain, rel=2e-3)
    assert result.covariance == pytest.approx(P, rel=2e-3)


def test_control_returns_the_gain_of_the_discrete_predictor() -> None:
    A, C = np.array([[0.9, 0.1], [0, 0.8]]), np.array([[1.0, 0]])
    L, P, _ = control.dlqe(A, np.eye(2), C, np.eye(2), [[2.0]])
    assert pytest.approx(A @ P @ C.T / (C @ P @ C.T + 2.0)) == L


def test_cases_that_control_does_not_solve() -> None:
    with pytest.raises(control.ControlNotImplemented):
        control.lqe(np.eye(1), np.eye(1), np.eye(1), np.eye(1), np.eye(1), 0.5 * np.eye(1))


A2, G2, C2 = np.array([[0.0, 1], [0, -1]]), np.array([[0.0], [1]]), np.array([[1.0, 0]])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"A": [[1, 2, 3], [4, 5, 6]]}, r"A is of shape \(2, 3\); expected a square matrix"),
        ({"A": [1, 2]}, r"A is of shape \(2,\); expected a square matrix"),
        ({"A": [[1, 2], [3]]}, "A has rows of different lengths"),
        ({"A": [["a"]]}, r"A, \(1, 1\), is <U1; expected real numbers"),
        ({"A": [[0, 1j], [0, 0]]}, r"A, \(2, 2\), is complex128; expected real numbers"),
        ({"A": np.empty((0, 0))}, r"A is of shape \(0, 0\); expected a square matrix"),
        ({"A": [[np.nan, 1], [0, 1]]}, r"A, \(2, 2\), has NaN or infinities"),
        ({"G": [[1]]}, r"G is of shape \(1, 1\); expected \(2, any\)"),
        ({"G": [0, 1]}, r"G is of shape \(2,\); expected \(2, any\)"),
        ({"C": [[1, 0, 0]]}, r"C is of shape \(1, 3\); expected \(any, 2\)"),
        ({"C": [[np.inf, 0]]}, r"C, \(1, 2\), has NaN or infinities"),
        ({"Q": np.eye(2)}, r"Q is of shape \(2, 2\); expected \(1, 1\)"),
        ({"Q": -1}, r"Q, \(1, 1\), has the eigenvalue -1; expected a positive semidefinite"),
        ({"G": np.eye(2), "Q": [[1, 1], [0, 1]]}, r"Q, \(2, 2\), differs from its transpose by 1"),
        ({"G": np.eye(2), "Q": np.diag([1e6, -1e-6])}, "Q, .* eigenvalue -1e-06"),
        ({"R": 0}, r"R, \(1, 1\), has the eigenvalue 0; expected a positive definite"),
        ({"R": [[1, 0]]}, r"R is of shape \(1, 2\); expected \(1, 1\)"),
        ({"N": [[1, 2]]}, r"N is of shape \(1, 2\); expected \(1, 1\)"),
        ({"N": [[3]]}, r"\[Q N; N' R\], \(2, 2\), has the eigenvalue -2; expected a positive semi"),
        ({"C": [[0, 1]]}, r"A \(2, 2\) and C: the mode at 0 does not decay and cannot be seen"),
        ({"G": [[0], [0]]}, r"A \(2, 2\) and the noise: the mode at 0 neither grows nor decays"),
    ],
)
def test_invalid_arguments_raise_a_one_line_error(
    changed: dict[str, ArrayLike], message: str
) -> None:
    arguments = {"A": A2, "G": G2, "C": C2, "Q": 1, "R": 1} | changed
    with pytest.raises(UsageError, match=message) as caught:
        kalman_gain(**arguments)
    assert "\n" not in str(caught.value)


def test_error_covariance_of_an_unstable_gain_raises_an_error() -> None:
    with pytest.raises(UsageError, match="a pole at 0; expected a stable L"):
        error_covariance(A2, [[0], [0]], C2, np.eye(2), 1)
    with pytest.raises(UsageError, match=r"L is of shape \(2,\); expected \(2, 1\)"):
        error_covariance(A2, [0, 0], C2, np.eye(2), 1)


def test_units_of_different_magnitude_leave_modes_observable() -> None:
    for inertia in (1e-12, 1.0, 1e12):
        A = np.array([[0, 1 / inertia, 0], [0, 0, 1], [0, 0, 0]])
        assert len(unobservable_eigenvalues(A, np.array([[1.0, 0, 0]]))) == 0
        assert unobservable_eigenvalues(A, np.array([[0, 1.0, 0]])) == pytest.approx([0])


@FEW
@given(SEEDS)
def test_unobservable_modes_are_detected_in_any_coordinates(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hidden, shown, n = np.array([0.3, -0.2]), 3, 5
    A = np.zeros((n, n))
    A[:shown, :shown] = rng.standard_normal((shown, shown))
    A[shown:, :shown] = rng.standard_normal((n - shown, shown))
    A[shown:, shown:] = np.diag(hidden)
    C = np.hstack((rng.standard_normal((2, shown)), np.zeros((2, n - shown))))
    T = np.linalg.qr(rng.standard_normal((n, n)))[0]
    modes = unobservable_eigenvalues(T @ A @ T.T, C @ T.T)
    assert np.sort(modes.real) == pytest.approx(np.sort(hidden), abs=1e-8)
    with pytest.raises(UsageError, match=r"the mode at 0\.3"):
        kalman_gain(T @ A @ T.T, np.eye(n), C @ T.T, np.eye(n), np.eye(2))


@FEW
@given(SEEDS)
def test_cross_covariance_matches_the_cross_term_of_scipy(seed: int) -> None:
    A, G, C, Q, R = system(seed)
    rng = np.random.default_rng(seed)
    N = 0.1 * np.linalg.cholesky(Q) @ rng.uniform(-1, 1, (len(Q), len(R))) @ np.linalg.cholesky(R).T
    N /= max(1.0, 10 * np.linalg.norm(N, 2))
    W, R = G @ Q @ G.T, (R + R.T) / 2
    P = solve_continuous_are(A.T, C.T, (W + W.T) / 2, R, s=G @ N)
    result = kalman_gain(A, G, C, Q, R, N)
    assert result.covariance == pytest.approx(P, rel=1e-7, abs=1e-7 * np.abs(P).max())
    gain = np.linalg.solve(R, (P @ C.T + G @ N).T).T
    assert result.gain == pytest.approx(gain, rel=1e-6, abs=1e-7 * max(1.0, np.abs(gain).max()))
