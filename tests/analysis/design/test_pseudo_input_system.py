import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import cont2discrete

from analysis.design.discrete import discretise
from analysis.design.luenberger import butterworth_poles, discrete_observer
from analysis.design.placement import unobservable_modes
from analysis.design.pseudo_input_system import pseudo_input_matrices, pseudo_inputs
from analysis.design.riccati import kalman_gain
from shiplog import UsageError, Vessel
from shiplog.ships.paper import Coefficients, surge_acceleration, yaw_acceleration_rate

# The paper's coefficients as printed, angles in degrees
T1, T2, T3, C2, C3 = 150.0, 50.0, 0.5, 10.0, 20.0
D = 1 / (T1 * T2)
TABLE1 = Coefficients(
    a=-(T1 + T2) * D, b1=-D, b2=-C2 * D, b3=-C3 * D, d=D, e=T3 * D,
    f=-0.1, g=-0.0003, h=0.0004, alpha1=0.0171, alpha2=0.0015, alpha3=0.0654,
)  # fmt: skip


def derivative(x: np.ndarray, delta: float, rate: float, n: float, n_dot: float) -> np.ndarray:
    A, B = pseudo_input_matrices(TABLE1, float(np.sign(x[0])))
    return A @ x + B @ pseudo_inputs(x, delta, rate, n, n_dot, TABLE1.alpha3)


def test_corrected_pseudo_inputs_at_one_point() -> None:
    w, w_dot, v, delta, rate, n, n_dot = 0.3, 0.01, 9.0, 20.0, 2.5, 80.0, 0.5
    w_ddot = yaw_acceleration_rate(TABLE1, w, w_dot, v, n, delta, rate)
    v_dot = surge_acceleration(TABLE1, w, v, n)
    x_dot = derivative(np.array([w, w_dot, w_ddot, v, v_dot]), delta, rate, n, n_dot)
    assert x_dot == pytest.approx(
        [0.01, 1.261186547187e-4, 5.474031503e-5, -1.3e-3, -3.9298e-4], rel=1e-9
    )


@pytest.mark.parametrize("seed", range(20))
def test_a_x_plus_b_u_is_the_derivative_of_the_ship_model(seed: int) -> None:
    rng = np.random.default_rng(seed)
    w, w_dot, v = rng.uniform([-0.6, -0.02, 3], [0.6, 0.02, 12])
    delta, rate, n, n_dot = rng.uniform([-35, -2.5, 40, -1], [35, 2.5, 120, 1])

    def accelerations(h: float) -> np.ndarray:
        """Return w'' and v' a short time later along the trajectory (delta'' = n'' = 0)."""
        w2 = yaw_acceleration_rate(TABLE1, w, w_dot, v, n, delta, rate)
        v1 = surge_acceleration(TABLE1, w, v, n)
        w_h, w_dot_h = w + h * w_dot + h * h / 2 * w2, w_dot + h * w2
        delta_h, n_h, v_h = delta + h * rate, n + h * n_dot, v + h * v1
        return np.array(
            [
                yaw_acceleration_rate(TABLE1, w_h, w_dot_h, v_h, n_h, delta_h, rate),
                surge_acceleration(TABLE1, w_h, v_h, n_h),
            ]
        )

    w_ddot, v_dot = accelerations(0.0)
    jerks = (accelerations(1e-4) - accelerations(-1e-4)) / 2e-4
    x_dot = derivative(np.array([w, w_dot, w_ddot, v, v_dot]), delta, rate, n, n_dot)
    assert x_dot[[1, 3]] == pytest.approx([w_ddot, v_dot], rel=1e-12)
    assert x_dot[[2, 4]] == pytest.approx(jerks, rel=1e-5, abs=1e-9)


def test_printed_covariance_is_the_riccati_solution_at_378_s() -> None:
    A, _ = pseudo_input_matrices(TABLE1, 1.0)
    C = np.eye(5)[[0, 3]]

    def rate(_: float, flat: np.ndarray) -> np.ndarray:
        P = flat.reshape(5, 5)
        return (A @ P + P @ A.T + 0.01 * np.eye(5) - P @ C.T @ C @ P / 400).ravel()

    P = solve_ivp(rate, (0, 378), 10 * np.eye(5).ravel(), rtol=1e-10, atol=1e-12).y[:, -1]
    P = P.reshape(5, 5)
    printed = [30.27534702, 1.14074580, -0.00286807, 0.12079779, -0.00014146, 0.18750034]
    assert [P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2]] == pytest.approx(
        printed, abs=1e-6
    )
    assert [P[3, 3], P[4, 4]] == pytest.approx([2.06180082, 13.78], abs=1e-6)


def test_discretised_noise_equals_its_integral(vessel: Vessel) -> None:
    A, _ = pseudo_input_matrices(vessel.coefficients, 1.0)
    Q, dt = np.diag([1.0, 0.3, 0.1, 2.0, 0.5]), 5.0
    F, Qd = discretise(A, Q, dt)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    times = (nodes + 1) * dt / 2
    summed = sum(
        w * dt / 2 * expm(A * t) @ Q @ expm(A * t).T for t, w in zip(times, weights, strict=True)
    )
    assert expm(A * dt) == pytest.approx(F)
    assert Qd == pytest.approx(summed, rel=1e-10)


def test_butterworth_poles_are_roots_of_the_butterworth_polynomial() -> None:
    assert np.poly(butterworth_poles(3, 0.05)) == pytest.approx([1, 0.1, 0.005, 0.000125])
    assert np.poly(butterworth_poles(2, 2.0)) == pytest.approx([1, 2 * np.sqrt(2), 4])


def test_poles_and_noise_gain_of_a_discrete_observer() -> None:
    A = np.array([[0, 1, 0], [-1e-4, -0.03, 1], [0, 0, 0]])
    C, poles, dt = np.array([[1.0, 0, 0]]), butterworth_poles(3, 0.05), 0.5
    observer = discrete_observer(A, C, poles, dt)
    F = expm(A * dt)
    closed = (np.eye(3) - np.outer(observer.correction, C)) @ F
    assert np.sort(np.linalg.eigvals(closed)) == pytest.approx(np.sort(np.exp(poles * dt)))
    rng, error, errors = np.random.default_rng(0), np.zeros(3), []
    for noise in rng.standard_normal(40_000):
        error = closed @ error + observer.correction * noise
        errors.append(error)
    assert np.std(errors[200:], axis=0) == pytest.approx(observer.noise_gain, rel=0.06)


# identification, section 2: the page's rows, column: value; s = 1, b4 = α1 d, b5 = α2 d, ...
B4, B5 = TABLE1.alpha1 * TABLE1.d, TABLE1.alpha2 * TABLE1.d
B6, B7 = TABLE1.alpha1 * TABLE1.e, TABLE1.alpha2 * TABLE1.e
INPUT_ROWS = [
    {},
    {4: TABLE1.b2, 5: TABLE1.b3, 7: B4, 8: B6, 9: B5, 10: B7},
    {
        8: B4, 10: B5, 11: B4, 12: B5, 14: 2 * TABLE1.b2, 16: 3 * TABLE1.b3, 17: B6, 18: B7,
        19: -TABLE1.alpha3 * B7, 20: -TABLE1.alpha3 * B5,
    },
    {3: TABLE1.h, 4: TABLE1.f, 6: TABLE1.g},
    {13: TABLE1.h, 14: 2 * TABLE1.f, 15: 2 * TABLE1.g},
]  # fmt: skip
MOTION_ROWS = [
    [0, 1, 0, 0, 0],
    [TABLE1.b1, TABLE1.a, 0, 0, 0],
    [0, TABLE1.b1, TABLE1.a, 0, 0],
    [0] * 5,
    [0] * 5,
]


def test_matrices_row_by_row() -> None:
    A, B = pseudo_input_matrices(TABLE1, 1.0)
    assert pytest.approx(np.array(MOTION_ROWS), rel=1e-15) == A
    for result, row in zip(B, INPUT_ROWS, strict=True):
        entries = {int(column) + 1: result[column] for column in np.flatnonzero(result)}
        assert entries == pytest.approx(row, rel=1e-15)
    _, port = pseudo_input_matrices(TABLE1, -1.0)
    changed = {(2, 4), (3, 14)}  # the entries of w|w|
    assert {(int(i) + 1, int(j) + 1) for i, j in np.argwhere(port != B)} == changed


def test_unobservable_states_of_the_five_state_model() -> None:
    A, _ = pseudo_input_matrices(TABLE1, 1.0)
    C = np.eye(5)[[0, 3]]
    seen = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(5)])
    assert np.linalg.matrix_rank(seen, tol=1e-12) == 3
    hidden = {mode.states: mode.value for mode in unobservable_modes(A, C)}
    assert hidden == pytest.approx({(2,): TABLE1.a, (4,): 0.0}, abs=1e-12)
    with pytest.raises(UsageError, match=r"A \(5, 5\) and C: the mode at 0 does not decay and can"):
        kalman_gain(A, np.eye(5), C, 0.01 * np.eye(5), 400 * np.eye(2))


def test_printed_covariance_is_stationary_in_yaw_but_not_in_surge() -> None:
    A, _ = pseudo_input_matrices(TABLE1, 1.0)
    yaw = kalman_gain(A[:2, :2], np.eye(2), [[1, 0]], 0.01 * np.eye(2), 400).covariance
    surge = kalman_gain([[0]], [[1]], [[1]], 0.01, 400).covariance
    assert [*yaw[0], yaw[1, 1]] == pytest.approx([30.27534702, 1.14074580, 0.12079779], abs=1e-8)
    assert surge.item() == pytest.approx(2, rel=1e-12)  # √(QR); printed 2.06180082
    assert pytest.approx(13.78, abs=1e-12) == 10 + 0.01 * 378  # v' grows without bound


def test_discretisation_matches_scipy_and_control(vessel: Vessel) -> None:
    A, B = pseudo_input_matrices(vessel.coefficients, 1.0)
    C, D, dt = np.eye(5)[[0, 3]], np.zeros((2, 20)), 0.5
    F, _ = discretise(A, np.eye(5), dt)
    assert pytest.approx(cont2discrete((A, B, C, D), dt)[0], abs=1e-14) == F
    assert pytest.approx(control.sample_system(control.ss(A, B, C, D), dt).A, abs=1e-14) == F
