from typing import Any

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_are

from analysis.design.cascade import cascade
from analysis.design.quality import (
    cycle_regulator,
    decay_projectors,
    quality_filter,
    quality_regulator,
)
from analysis.design.riccati import error_covariance, kalman_gain
from shiplog import UsageError
from shiplog.types import FloatArray

FEW = settings(derandomize=True, max_examples=30, deadline=None)
SEEDS = st.integers(0, 2**32 - 1)

# Second-order Nomoto, the rate ω measured; states ω and ω'
T1, T2 = 150.0, 50.0
SHIP = np.array([[0, 1], [-1 / (T1 * T2), -(T1 + T2) / (T1 * T2)]])
RATE, R1, R2 = np.array([[1.0, 0]]), np.diag([0, 1e-12]), np.array([[2.5e-9]])
DOUBLE, PUSH = np.array([[0.0, 1], [0, 0]]), np.array([[0.0], [1]])  # the double integrator
TWO_DECAYS, BOTH = np.diag([-2, -0.2]), np.array([[1.0], [1]])


@pytest.mark.parametrize(
    ("shift", "G", "gain"),
    [
        (0.0, (0, 0), [0.174443585, 0.0152152822]),
        (0.2, (0, 0), [0.4137657921, 0.0442244862]),
        (0.0, (0, 1e-9), [0.6369938891, 0.0028806074]),
        (0.0, (1e-8, 0), [0.109519673, 0.0058906127]),
        (0.2, (1e-8, 0), [0.3695245931, 0.0312150865]),
    ],
)
def test_gains_of_the_ship_filters(shift: float, G: tuple[float, float], gain: list[float]) -> None:
    result = quality_filter(SHIP, RATE, R1, R2, G=np.diag(G), shift=shift)
    assert result.gain[:, 0] == pytest.approx(gain, abs=1e-8)
    assert result.residual < 1e-12


def test_three_design_cycles_of_the_double_integrator() -> None:
    last = cycle_regulator(DOUBLE, PUSH, np.eye(2), 1, 3)[-1]
    expected = [-np.sqrt(3), -np.sqrt(3 + 2 * np.sqrt(3))]
    assert last.gain[0] == pytest.approx(expected, abs=1e-8)


def test_double_integrator_with_shift_and_weight_on_the_rates() -> None:
    result = quality_regulator(DOUBLE, PUSH, np.eye(2), 1, G=np.diag([0.5, 2]), shift=1)
    assert result.gain[0] == pytest.approx([-1.7532528806, -2.5631300883], abs=1e-8)
    expected = [-1.2815650442 - 0.3329323028j, -1.2815650442 + 0.3329323028j]
    assert result.poles == pytest.approx(np.array(expected), abs=1e-8)


def test_cycles_of_a_scalar_system_converge_to_minus_two() -> None:
    done = cycle_regulator([[0.5]], [[1]], 1, 1, 60, G=0.25)
    poles = [step.poles[0].real for step in done]
    assert poles[:3] == pytest.approx([-1, -1.2649110641, -1.4422205102], abs=1e-8)
    assert poles[-1] == pytest.approx(-2, abs=1e-5)


@pytest.mark.parametrize(
    ("shift", "settling", "noise"),
    [(0, 30.5, 1), (0.1, 22.7, 1.07), (0.2, 17.0, 1.23), (0.4, 10.1, 1.64), (0.8, 5.1, 2.34)],
)
def test_shift_trades_settling_time_against_noise(
    shift: float, settling: float, noise: float
) -> None:
    optimal = kalman_gain(SHIP, np.eye(2), RATE, R1, R2).covariance[0, 0]
    K = quality_filter(SHIP, RATE, R1, R2, shift=shift).gain
    of_it = error_covariance(SHIP, K, RATE, R1, R2)[0, 0]
    assert np.sqrt(of_it / optimal) == pytest.approx(noise, abs=5e-3)
    poles, modes = np.linalg.eig(SHIP - K @ RATE)
    times = np.arange(0, 60, 0.01)
    parts = modes[0] * np.linalg.solve(modes, [1, 0])
    error = np.real(np.exp(np.outer(times, poles)) @ parts)  # of ω, starting from one in ω
    settled = times[np.abs(error) > 0.05][-1]
    assert settled + 0.01 == pytest.approx(settling + 0.05, abs=0.05)  # truncated on the page


@pytest.mark.parametrize(
    ("G", "noise", "slowest"), [(1e-10, 1.034, -0.1313), (1e-9, 1.387, -0.0316)]
)
def test_rate_weight_trades_damping_against_noise(G: float, noise: float, slowest: float) -> None:
    optimal = kalman_gain(SHIP, np.eye(2), RATE, R1, R2).covariance[0, 0]
    result = quality_filter(SHIP, RATE, R1, R2, G=np.diag([0, G]))
    of_it = error_covariance(SHIP, result.gain, RATE, R1, R2)[0, 0]
    assert np.abs(result.poles.imag).max() == 0  # damping ratio of at least one
    assert np.sqrt(of_it / optimal) == pytest.approx(noise, abs=5e-4)
    assert result.poles[-1].real == pytest.approx(slowest, abs=5e-5)


def test_destabilising_shifts_raise_an_error_with_the_pole() -> None:
    projectors = decay_projectors(TWO_DECAYS, 1.0)
    assert_allclose(projectors, [np.diag([1, 0]), np.diag([0, 1])])
    with pytest.raises(UsageError, match=r"poles left of -0\.5, and one is at 0\.2164316;"):
        quality_regulator(
            TWO_DECAYS, BOTH, np.zeros((2, 2)), 1, shift=(6, 1), projectors=projectors
        )
    with pytest.raises(UsageError, match=r"poles left of -0\.5, and one is at 0\.2164316;"):
        quality_filter(TWO_DECAYS, BOTH.T, np.zeros((2, 2)), 1, shift=(6, 1), projectors=projectors)


def test_gain_of_the_destabilising_shifts() -> None:
    shifted = TWO_DECAYS + np.diag([6, 1]) / 2
    L = quality_regulator(shifted, BOTH, np.zeros((2, 2)), 1).gain
    assert L[0] == pytest.approx([-3.7142857, 1.1142857], abs=5e-8)
    poles = np.linalg.eigvals(TWO_DECAYS + BOTH @ L)
    assert poles.max() == pytest.approx(0.2164316, abs=5e-8)


@pytest.mark.parametrize(
    ("factor", "errors", "best"),
    [
        (1.0, [1, 1.43, 2.08, 2.76, 3.44], 1),
        (1e-4, [2.91, 1.27, 2.09, 2.97, 3.84], 2),  # designed for 1e-4 R2
    ],
)
def test_cascade_improves_only_a_first_stage_that_is_too_fast(
    factor: float, errors: list[float], best: int
) -> None:
    first = quality_filter(SHIP, RATE, R1, factor * R2).gain
    result = cascade(SHIP, RATE, R1, R2, first, stages=5, correlation_secs=10)
    assert result.relative[:, 0] == pytest.approx(errors, abs=5e-3)
    assert result.best == best
    assert "further stages increase it" in result.summary
    assert f"stage {best} of 5 is the best" in result.summary


def test_summary_of_a_cascade() -> None:
    first = quality_filter(SHIP, RATE, R1, 1e-4 * R2).gain
    result = cascade(SHIP, RATE, R1, R2, first, stages=2, correlation_secs=10)
    assert result.summary == (
        "stage 2 of 2 is the best, 1.27 times the optimal error; the first alone has 2.91"
    )


def random_regulator(
    seed: int,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return random A, B, P, R and G of one to six states."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(1, [7, 4])
    half, rotated, rates = (rng.standard_normal((k, k)) for k in (n, m, n))
    return (
        rng.standard_normal((n, n)),
        rng.standard_normal((n, m)),
        half @ half.T,
        rotated @ rotated.T + 0.1 * np.eye(m),
        0.3 * rates @ rates.T,
    )


@FEW
@given(SEEDS, st.floats(0, 3))
def test_poles_meet_the_bound_and_the_riccati_equation_holds(seed: int, c: float) -> None:
    A, B, P, R, G = random_regulator(seed)
    result = quality_regulator(A, B, P, R, G=G, shift=c)
    Q, heavier = result.cost, R + B.T @ G @ B
    part = np.linalg.solve(heavier, B.T @ G @ A)
    J21 = P + A.T @ G @ A - A.T @ G @ B @ part
    J11 = c / 2 * np.eye(len(A)) + A - B @ part
    J12 = B @ np.linalg.solve(heavier, B.T)
    left = J21 + Q @ J11 + J11.T @ Q - Q @ J12 @ Q
    sizes = [np.linalg.norm(M) for M in (J21, A, Q, J12)]
    scale = sizes[0] + 2 * sizes[1] * sizes[2] + sizes[3] * sizes[2] ** 2
    assert np.linalg.norm(left) < 1e-12 * scale
    assert result.residual < 1e-12
    assert result.gain == pytest.approx(
        -np.linalg.solve(heavier, B.T @ G @ A + B.T @ Q), rel=1e-8, abs=1e-8
    )
    assert np.linalg.eigvals(A + B @ result.gain).real.max() < -c / 2


@FEW
@given(SEEDS, st.floats(0, 3))
def test_filter_is_the_dual_of_the_regulator(seed: int, c: float) -> None:
    A, B, P, R, G = random_regulator(seed)
    L = quality_regulator(A.T, B, P, R, G=G, shift=c).gain
    assert_allclose(quality_filter(A, B.T, P, R, G=G, shift=c).gain, -L.T, rtol=1e-8, atol=1e-10)


@FEW
@given(SEEDS)
def test_without_shift_and_weight_the_gains_match_control(seed: int) -> None:
    A, B, P, R, _ = random_regulator(seed)
    P, R = (P + P.T) / 2, (R + R.T) / 2
    K, _, _ = control.lqr(A, B, P, R)
    assume(np.linalg.norm(K) < 1e3)  # a weakly controllable mode loses digits
    assert_allclose(quality_regulator(A, B, P, R).gain, -K, rtol=1e-7, atol=1e-8)
    L, _, _ = control.lqe(A, np.eye(len(A)), B.T, P, R)
    assert_allclose(quality_filter(A, B.T, P, R).gain, L, rtol=1e-7, atol=1e-8)


@FEW
@given(SEEDS, st.floats(0.01, 3))
def test_one_shift_equals_the_lq_design_of_a_shifted_system(seed: int, c: float) -> None:
    A, B, P, R, _ = random_regulator(seed)
    shifted = A + c / 2 * np.eye(len(A))
    L = quality_regulator(A, B, P, R, shift=c).gain
    assert_allclose(L, quality_regulator(shifted, B, P, R).gain, rtol=1e-8, atol=1e-10)


@FEW
@given(SEEDS, st.floats(0, 2))
def test_without_weights_slow_eigenvalues_are_mirrored_and_fast_ones_kept(
    seed: int, c: float
) -> None:
    A, B, P, R, _ = random_regulator(seed)
    before = np.linalg.eigvals(A)
    assume(np.abs(before.real + c / 2).min() > 0.02)
    after = np.where(before.real < -c / 2, before, -c - before.conj())
    result = quality_regulator(A, B, np.zeros_like(P), R, shift=c)
    assert np.poly(result.poles) == pytest.approx(np.poly(after), rel=1e-6, abs=1e-6)


@FEW
@given(SEEDS, st.integers(1, 6))
def test_cycles_without_rate_weight_equal_one_design_with_j_times_p(seed: int, cycles: int) -> None:
    A, B, P, R, _ = random_regulator(seed)
    done = cycle_regulator(A, B, P, R, cycles)
    assert len(done) == cycles
    assert_allclose(
        done[-1].gain, quality_regulator(A, B, cycles * P, R).gain, rtol=1e-6, atol=1e-8
    )


@FEW
@given(SEEDS, st.integers(1, 6))
def test_cycles_of_one_input_with_rate_weight_equal_one_design_with_a_smaller_r(
    seed: int, cycles: int
) -> None:
    A, B, P, R, G = random_regulator(seed)
    B, R = B[:, :1], R[:1, :1]
    weight = (B.T @ G @ B).item()
    assume(weight > 0.01)
    ratio = R.item() / (R.item() + weight)
    effective = ratio**cycles * weight / (1 - ratio**cycles)
    once = quality_regulator(A, B, P, effective, G=G)
    assert_allclose(
        cycle_regulator(A, B, P, R, cycles, G=G)[-1].gain, once.gain, rtol=1e-6, atol=1e-7
    )


@FEW
@given(SEEDS, st.floats(-1, 2))
def test_projectors_separate_fast_and_slow_modes(seed: int, border: float) -> None:
    A = random_regulator(seed)[0]
    values = np.linalg.eigvals(A)
    assume(np.abs(values.real + border).min() > 0.02)
    E1, E2 = decay_projectors(A, border)
    for E in (E1, E2):
        assert_allclose(E @ E, E, atol=1e-7 * (1 + np.linalg.norm(E)) ** 2)
        assert_allclose(E @ A, A @ E, atol=1e-7 * (1 + np.linalg.norm(E)) * np.linalg.norm(A))
    assert np.trace(E1) == pytest.approx(np.sum(values.real < -border), abs=1e-7)


UNFIT: list[tuple[dict[str, Any], str]] = [
    ({"A": [[1, 2]]}, r"A is of shape \(1, 2\); expected a square matrix"),
    ({"B": [[1]]}, r"B is of shape \(1, 1\); expected \(2, any\)"),
    ({"P": np.eye(3)}, r"P is of shape \(3, 3\); expected \(2, 2\)"),
    ({"P": [[0, 1], [0, 0]]}, r"P, \(2, 2\), differs from its transpose by 1"),
    ({"P": -np.eye(2)}, r"P, \(2, 2\), has the eigenvalue -1; expected a positive semidefinite"),
    ({"R": -1}, r"R, \(1, 1\), has the eigenvalue -1; expected a positive definite"),
    ({"G": np.diag([1, -1])}, r"G, \(2, 2\), has the eigenvalue -1"),
    ({"A": [[np.nan, 0], [0, 0]]}, r"A, \(2, 2\), has NaN or infinities"),
    ({"shift": -1}, "shift is -1; expected one number, or two, not below 0"),
    ({"shift": (1, 2, 3)}, "shift is .* expected one number, or two"),
    ({"shift": (6, 1)}, r"shift is \(6, 1\); expected projectors"),
    ({"projectors": (np.eye(2), np.eye(2))}, r"projectors, \(2, 2\): expected E1 \+ E2 = I"),
    ({"projectors": (np.eye(3), np.eye(2))}, r"projectors\[0\] is of shape \(3, 3\)"),
    ({"B": [[1], [0]]}, r"A \(2, 2\) and B: the mode at 0 does not decay and cannot be moved by B"),
    ({"P": np.zeros((2, 2))}, "A .* and P: the mode at 0 neither grows nor decays and P gives"),
]


@pytest.mark.parametrize(("changed", "message"), UNFIT)
def test_invalid_regulator_arguments_raise_a_one_line_error(
    changed: dict[str, ArrayLike], message: str
) -> None:
    arguments: dict[str, Any] = {"A": DOUBLE, "B": PUSH, "P": np.eye(2), "R": 1}
    with pytest.raises(UsageError, match=message) as caught:
        quality_regulator(**(arguments | changed))
    assert "\n" not in str(caught.value)


def test_invalid_filter_arguments_raise_an_error() -> None:
    with pytest.raises(UsageError, match=r"S is of shape \(1, 3\); expected \(any, 2\)"):
        quality_filter(SHIP, [[1, 0, 0]], R1, R2)
    with pytest.raises(UsageError, match=r"R2, .* expected a positive definite"):
        quality_filter(SHIP, RATE, R1, 0)
    with pytest.raises(UsageError, match=r"A \+ Ec/2 \(2, 2\) and S: the mode at 0\.5 .* seen"):
        quality_filter(np.diag([-1, -1.0]), RATE, np.eye(2), 1, shift=3)


def test_invalid_cycles_and_stages_raise_an_error() -> None:
    for cycles, message in ((0, "not below 1"), (1.5, "expected a whole number")):
        with pytest.raises(UsageError, match=f"cycles is {cycles}; expected .*{message[-6:]}"):
            cycle_regulator(DOUBLE, PUSH, np.eye(2), 1, cycles)
    with pytest.raises(UsageError, match="stages is 0; expected"):
        cascade(SHIP, RATE, R1, R2, [[0.2], [0.01]], stages=0, correlation_secs=10)
    with pytest.raises(UsageError, match="correlation_secs is 0; expected a positive number"):
        cascade(SHIP, RATE, R1, R2, [[0.2], [0.01]], stages=2, correlation_secs=0)
    with pytest.raises(UsageError, match=r"a pole at .* expected a stable L"):
        cascade(SHIP, RATE, R1, R2, [[-1], [0]], stages=2, correlation_secs=10)


# ---- methods, section 2: statements without a table


def equation_of(
    A: FloatArray, B: FloatArray, P: FloatArray, R: FloatArray, G: FloatArray, c: float
) -> tuple[FloatArray, FloatArray]:
    """Solve the Riccati equation of the page with scipy; the shift is not in the cross term."""
    heavier, across = R + B.T @ G @ B, A.T @ G @ B
    weight, heavier = P + A.T @ G @ A, (heavier + heavier.T) / 2
    shifted = A + c / 2 * np.eye(len(A))
    Q = solve_continuous_are(shifted, B, (weight + weight.T) / 2, heavier, s=across)
    return Q, -np.linalg.solve(heavier, across.T + B.T @ Q)


@FEW
@given(SEEDS, st.floats(0, 3))
def test_gain_matches_the_standard_riccati_equation(seed: int, c: float) -> None:
    A, B, P, R, G = random_regulator(seed)
    Q, L = equation_of(A, B, P, R, G, c)
    assume(np.linalg.norm(L) < 1e3)
    result = quality_regulator(A, B, P, R, G=G, shift=c)
    assert_allclose(result.cost, Q, rtol=1e-7, atol=1e-8 * np.abs(Q).max())
    assert_allclose(result.gain, L, rtol=1e-7, atol=1e-7)


@FEW
@given(SEEDS)
def test_rate_weight_equals_the_cross_term_of_control(seed: int) -> None:
    A, B, P, R, G = random_regulator(seed)
    weight, heavier = P + A.T @ G @ A, R + B.T @ G @ B
    K, _, _ = control.lqr(A, B, (weight + weight.T) / 2, (heavier + heavier.T) / 2, A.T @ G @ B)
    assume(np.linalg.norm(K) < 1e3)
    assert_allclose(quality_regulator(A, B, P, R, G=G).gain, -K, rtol=1e-7, atol=1e-7)


@FEW
@given(SEEDS, st.floats(0, 3))
def test_filter_equation_has_its_quadratic_term(seed: int, c: float) -> None:
    """J21 + P J11 + J11* P - P J12 P = 0, K = (P S' + A G S') (R2 + S G S')⁻¹."""
    A, B, R1, R2, G = random_regulator(seed)
    S = B.T
    result = quality_filter(A, S, R1, R2, G=G, shift=c)
    P, heavier, across = result.covariance, R2 + S @ G @ S.T, A @ G @ S.T
    J12 = S.T @ np.linalg.solve(heavier, S)
    J11 = c / 2 * np.eye(len(A)) + A.T - S.T @ np.linalg.solve(heavier, across.T)
    J21 = R1 + A @ G @ A.T - across @ np.linalg.solve(heavier, across.T)
    left = J21 + P @ J11 + J11.T @ P - P @ J12 @ P
    sizes = [np.linalg.norm(M) for M in (J21, A, P, J12)]
    assert np.linalg.norm(left) < 1e-12 * (
        sizes[0] + 2 * sizes[1] * sizes[2] + sizes[3] * sizes[2] ** 2
    )
    gain = np.linalg.solve(heavier, (P @ S.T + across).T).T
    assert_allclose(result.gain, gain, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("weighted", [False, True])
def test_bound_holds_for_300_random_systems(weighted: bool) -> None:
    for seed in range(300):
        A, B, P, R, G = random_regulator(seed)
        c = 0.01 * seed
        result = quality_regulator(A, B, P, R, G=G if weighted else None, shift=c)
        assert np.linalg.eigvals(A + B @ result.gain).real.max() < -c / 2
        assert result.residual < 1e-12


def test_gain_grows_without_bound_over_cycles_without_rate_weight() -> None:
    """The increments of the gain fall as 1/√j."""
    done = cycle_regulator(DOUBLE, PUSH, np.eye(2), 1, 100)
    j = np.arange(1, 101)
    gains = np.array([step.gain[0] for step in done])
    assert_allclose(gains, -np.column_stack((np.sqrt(j), np.sqrt(j + 2 * np.sqrt(j)))), rtol=1e-8)
    increments = np.abs(np.diff(gains, axis=0)) * np.sqrt(j[1:, None])
    assert increments[-1] == pytest.approx([0.5, 0.5], abs=0.05)


@pytest.mark.parametrize(
    "rates", [np.diag([0.5, 2, 1.0]), np.diag([0, 0.3, 0.3]), np.diag([0, 0.5, 3])]
)
def test_gain_increments_of_several_inputs_fall_geometrically_with_rate_weight(
    rates: FloatArray,
) -> None:
    """The oracle solves each cycle with scipy; ρ is the largest eigenvalue of (R + B'GB)⁻¹ R."""
    A, B = np.array([[0, 1, 0], [0.2, -0.1, 0.5], [0, 0.3, -0.4]]), np.eye(3)[:, 1:]
    R = np.array([[1, 0.2], [0.2, 0.7]])
    ratio = np.linalg.eigvals(np.linalg.solve(R + B.T @ rates @ B, R)).real.max()
    total, gains = np.zeros((2, 3)), []
    for _ in range(40):
        total = total + equation_of(A + B @ total, B, np.eye(3), R, rates, 0.0)[1]
        gains.append(total)
    done = cycle_regulator(A, B, np.eye(3), R, 40, G=rates)
    assert_allclose([step.gain for step in done], gains, rtol=1e-7, atol=1e-9)
    increments = np.linalg.norm(np.diff(gains, axis=0), axis=(1, 2))
    last = int(np.searchsorted(-increments, -1e-6 * increments[0])) - 1  # above rounding
    assert increments[last] < 1e-4 * increments[0]
    assert increments[last] / increments[last - 1] == pytest.approx(ratio, rel=1e-3)


def test_an_input_without_rate_weight_does_not_converge_beside_one_that_has() -> None:
    """Two equal integrators with an input each; only the first has a weight on its rate."""
    done = cycle_regulator(np.zeros((2, 2)), np.eye(2), np.eye(2), np.eye(2), 40, G=np.diag([1, 0]))
    gains = -np.array([np.diag(step.gain) for step in done])
    increments = np.diff(gains, axis=0)
    assert increments[20, 0] / increments[19, 0] == pytest.approx(0.5, abs=1e-4)
    assert gains[:, 1] == pytest.approx(np.sqrt(np.arange(1, 41)), rel=1e-9)


def test_cascade_does_not_improve_a_first_stage_that_is_too_slow() -> None:
    """The first filter is designed for 1e4 times the noise, as in the text of the page."""
    first = quality_filter(SHIP, RATE, R1, 1e4 * R2).gain
    result = cascade(SHIP, RATE, R1, R2, first, stages=5, correlation_secs=10)
    assert result.best == 1
    assert result.relative[:, 0] == pytest.approx([12.52, 14.87, 16.47, 17.47, 18.03], abs=5e-3)
