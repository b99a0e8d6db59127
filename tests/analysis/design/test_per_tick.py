import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import block_diag

from analysis.design.per_tick import StateFunction, TickObserver, block_gains, tick_observer
from analysis.design.placement import polynomial_error
from shiplog import UsageError
from shiplog.ships.paper import Coefficients, surge_acceleration, yaw_acceleration_rate

I1, I2, I3 = 2000.0, 3000.0, 2500.0
NO_INPUT = np.zeros(0)


def spacecraft(x: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Euler angles 3-2-1 (roll, pitch, yaw) and body rates of a free rigid body."""
    phi, theta, _, p, q, r = x
    turn = q * np.sin(phi) + r * np.cos(phi)
    return np.array(
        [
            p + np.tan(theta) * turn,
            q * np.cos(phi) - r * np.sin(phi),
            turn / np.cos(theta),
            (I2 - I3) / I1 * q * r,
            (I3 - I1) / I2 * r * p,
            (I1 - I2) / I3 * p * q,
        ]
    )


def spacecraft_jacobian(x: np.ndarray, _: np.ndarray) -> np.ndarray:
    phi, theta, _, p, q, r = x
    s, c, tan, sec = np.sin(phi), np.cos(phi), np.tan(theta), 1 / np.cos(theta)
    turn, across = q * s + r * c, q * c - r * s
    return np.array(
        [
            [tan * across, sec**2 * turn, 0, 1, tan * s, tan * c],
            [-turn, 0, 0, 0, c, -s],
            [across * sec, turn * sec * tan, 0, 0, s * sec, c * sec],
            [0, 0, 0, 0, (I2 - I3) / I1 * r, (I2 - I3) / I1 * q],
            [0, 0, 0, (I3 - I1) / I2 * r, 0, (I3 - I1) / I2 * p],
            [0, 0, 0, (I1 - I2) / I3 * q, (I1 - I2) / I3 * p, 0],
        ]
    )


ANGLES = np.eye(3, 6)
POINT = np.array([0.1, -0.2, 0.3, 0.05, -0.04, 0.06])
# methods, section 3: poles -0.5, at POINT
ROW_1 = [1.0058525977, 0.0779500126, -0.0087351559]
ROW_4 = [0.24999, 0.0161099183, 0.0415227586]
N = [
    [0.5, 0.0159233966, 0.0910506131],
    [0.01, 0.4966701375, 0.0590348102],
    [0.016, -0.0698167916, 0.488807005],
]


def truth(rate: StateFunction, x: np.ndarray, u: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Integrate the model itself; return the states at `times`, (len(times), n)."""
    return solve_ivp(
        lambda _, x: rate(x, u), times[[0, -1]], x, "DOP853", times, rtol=1e-13, atol=1e-15
    ).y.T


def observer_of_the_spacecraft(order: str) -> TickObserver:
    poles = [-0.5] * (6 if order == "full" else 3)
    return tick_observer(spacecraft, spacecraft_jacobian, ANGLES, poles, order=order)


def errors_along_the_flight(observer: TickObserver, guess: np.ndarray, count: int) -> np.ndarray:
    """Return the largest rate error after each tick of 1 s, (count + 1,); 40 samples a tick."""
    times = np.arange(40 * count + 1) / 40
    flight = truth(spacecraft, POINT, NO_INPUT, times)
    x = observer.init(guess, flight[0, :3])
    errors = [np.abs(x - flight[0])[3:].max()]
    for k in range(count):
        y = flight[40 * k : 40 * k + 41, :3]
        x = observer.step(x, y, tick_secs=1.0)
        errors.append(np.abs(x - flight[40 * k + 40])[3:].max())
    return np.array(errors)


def test_jacobian_of_the_test_model() -> None:
    h = 1e-6
    steps = np.eye(6) * h
    J = [
        (spacecraft(POINT + s, NO_INPUT) - spacecraft(POINT - s, NO_INPUT)) / (2 * h) for s in steps
    ]
    assert spacecraft_jacobian(POINT, NO_INPUT) == pytest.approx(np.array(J).T, abs=1e-9)


def test_gains_of_the_spacecraft() -> None:
    L = observer_of_the_spacecraft("full").gain(POINT)
    assert L[0] == pytest.approx(ROW_1, abs=1e-9)
    assert L[3] == pytest.approx(ROW_4, abs=1e-9)
    assert observer_of_the_spacecraft("reduced").gain(POINT) == pytest.approx(np.array(N), abs=1e-9)


def test_closed_form_equals_multilevel_placement() -> None:
    gains = block_gains(spacecraft_jacobian(POINT, NO_INPUT), -0.5 * np.eye(3), -0.5 * np.eye(3))
    assert pytest.approx(np.array(N), abs=1e-9) == gains.N
    assert gains.L1[0] == pytest.approx(ROW_1, abs=1e-9)
    assert gains.L2[0] == pytest.approx(ROW_4, abs=1e-9)
    L = observer_of_the_spacecraft("full").gain(POINT)
    assert np.vstack((gains.L1, gains.L2)) == pytest.approx(L, abs=1e-12)


def test_error_of_the_reduced_observer_decays_with_its_poles() -> None:
    errors = errors_along_the_flight(observer_of_the_spacecraft("reduced"), np.zeros(6), 40)
    # methods, section 3, to the digits given there; the largest rate at POINT is 0.06
    assert errors[0] == 0.06
    assert errors[5] == pytest.approx(5e-3, abs=5e-4)
    assert errors[10] == pytest.approx(4e-4, abs=5e-5)
    assert errors[20] == pytest.approx(2.7e-6, abs=5e-8)
    assert errors[40] == pytest.approx(1.4e-10, abs=5e-12)


def test_full_observer_converges_from_zero_rates() -> None:
    guess = np.r_[POINT[:3], np.zeros(3)]
    errors = errors_along_the_flight(observer_of_the_spacecraft("full"), guess, 40)
    assert errors[10] < 0.05 * errors[0]
    assert errors[40] < 1e-6


@pytest.mark.parametrize("order", ["full", "reduced"])
@pytest.mark.parametrize("theta", [np.pi / 2, -np.pi / 2])
def test_singular_euler_angles_raise_an_error(order: str, theta: float) -> None:
    there, at_rest = np.array([[0.1, theta, 0.3, 0.05, -0.04, 0.06], [0.1, theta, 0, 0, 0, 0]])
    for x in (there, at_rest):
        with pytest.raises(UsageError, match=r"singular there.*cos θ = 0.*other coordinates"):
            observer_of_the_spacecraft(order).gain(x)

    def divides_by_zero(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return spacecraft_jacobian(x, u) / 0 if x[1] == 0 else np.full((6, 6), 1 / int(x[0] * 0))

    broken = tick_observer(spacecraft, divides_by_zero, ANGLES, [-0.5] * 6)
    for x in (there, POINT * 0):
        with pytest.raises(UsageError, match=r"not finite.*cos θ = 0"):
            broken.gain(x)


def test_closed_form_raises_an_error_for_a_singular_block() -> None:
    A = block_diag(np.zeros((2, 2)), np.eye(2))
    with pytest.raises(UsageError, match=r"A12, \(2, 2\), of A \(4, 4\) is singular.*cos θ = 0"):
        block_gains(A, -np.eye(2), -np.eye(2))


@settings(derandomize=True, max_examples=40, deadline=None)
@given(st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_closed_form_places_the_poles_of_both_orders(m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, Phi0, Phi1 = rng.standard_normal((2 * m, 2 * m)), *rng.standard_normal((2, m, m))
    A[:m, m:] = np.linalg.qr(A[:m, m:])[0]  # well observable
    gains = block_gains(A, Phi0, Phi1)
    L = np.vstack((gains.L1, gains.L2))
    both = np.linalg.eigvals(block_diag(Phi0, Phi1))
    assert polynomial_error(A - np.hstack((L, np.zeros_like(L))), both) < 1e-9
    assert polynomial_error(A[m:, m:] - gains.N @ A[:m, m:], np.linalg.eigvals(Phi1)) < 1e-9


# the ship of the identification paper, its angles as printed
T1, T2, T3 = 150.0, 50.0, 0.5
D = 1 / (T1 * T2)
TABLE1 = Coefficients(
    a=-(T1 + T2) * D, b1=-D, b2=-10 * D, b3=-20 * D, d=D, e=T3 * D,
    f=-0.1, g=-0.0003, h=0.0004, alpha1=0.0171, alpha2=0.0015, alpha3=0.0654,
)  # fmt: skip


def ship(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    (w, w_dot, v), (delta, delta_dot, n) = x, u
    w_ddot = yaw_acceleration_rate(TABLE1, w, w_dot, v, n, delta, delta_dot)
    return np.array([w_dot, w_ddot, surge_acceleration(TABLE1, w, v, n)])


def ship_jacobian(x: np.ndarray, u: np.ndarray) -> np.ndarray:
    c, (w, _, v), (delta, delta_dot, n) = TABLE1, x, u
    works = c.alpha1 - c.alpha2 * c.alpha3 * n * np.exp(-c.alpha3 * v)
    stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w
    return np.array(
        [
            [0, 1, 0],
            [stiffness, c.a, works * (c.d * delta + c.e * delta_dot)],
            [2 * c.f * w, 0, 2 * c.g * v],
        ]
    )


SHIP_POINT, SHIP_INPUT = np.array([0.01, 1e-4, 7.0]), np.array([0.35, 0.0, 36.0])
RATE_AND_SPEED = np.eye(3)[[0, 2]]


def test_gain_of_the_ship_of_the_identification_paper() -> None:
    assert ship_jacobian(SHIP_POINT, SHIP_INPUT) == pytest.approx(
        np.array([[0, 1, 0], [-1.608e-4, -0.0266666667, 6.9373026368e-7], [-0.002, 0, -0.0042]]),
        abs=1e-9,
    )
    observer = tick_observer(ship, ship_jacobian, RATE_AND_SPEED, [-0.1] * 3)
    L = observer.gain(SHIP_POINT, SHIP_INPUT)
    assert pytest.approx(
        np.array([[0.1733333333, 0], [0.0052169777778, 6.9373026368e-7], [-0.002, 0.0958]]),
        abs=1e-9,
    ) == L  # fmt: skip


@pytest.mark.parametrize("order", ["full", "reduced"])
def test_unmeasured_rate_of_the_ship_is_estimated(order: str) -> None:
    observer = tick_observer(
        ship, ship_jacobian, RATE_AND_SPEED, [-0.1] * (3 if order == "full" else 1), order=order
    )
    times = np.arange(0, 201, 0.5)
    run = truth(ship, SHIP_POINT, SHIP_INPUT, times)
    x = observer.init(SHIP_POINT * [1, 0, 1], run[0, [0, 2]])
    for k in range(100):
        y = run[4 * k : 4 * k + 5, [0, 2]]
        x = observer.step(x, y, SHIP_INPUT, tick_secs=2.0)
    assert x == pytest.approx(run[400], abs=1e-9)


def test_inputs_that_change_within_a_tick() -> None:
    observer = tick_observer(ship, ship_jacobian, RATE_AND_SPEED, [-0.1] * 3)
    y = np.tile([0.01, 7.0], (3, 1))
    held = observer.step(SHIP_POINT, y, SHIP_INPUT, tick_secs=1.0)
    rows = observer.step(SHIP_POINT, y, np.tile(SHIP_INPUT, (3, 1)), tick_secs=1.0)
    assert held.tolist() == rows.tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"C": np.ones(6)}, r"C is of shape \(6,\)"),
        ({"C": [[np.nan] * 6]}, r"C, \(1, 6\), has NaN"),
        ({"poles": [-0.5] * 5}, r"poles are of shape \(5,\); expected \(6,\)"),
        ({"poles": [-0.5 + 1j] * 6}, "without its conjugate"),
        ({"poles": [-0.5] * 5 + [0.1]}, r"poles, \(6,\), go up to 0.1; expected negative"),
        ({"order": "half"}, "order is 'half'; expected full or reduced"),
        ({"order": "reduced"}, r"poles are of shape \(6,\); expected \(3,\)"),
        ({"order": "reduced", "C": 2 * ANGLES, "poles": [-1] * 3}, r"C, \(3, 6\), mixes states"),
        ({"order": "reduced", "C": ANGLES[[0, 0, 1]], "poles": [-1] * 3}, "mixes states"),
    ],
)
def test_invalid_observer_raises_an_error(change: dict, message: str) -> None:
    request = {"C": ANGLES, "poles": [-0.5] * 6} | change
    with pytest.raises(UsageError, match=message) as raised:
        tick_observer(spacecraft, spacecraft_jacobian, **request)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"y": np.zeros((2, 3))}, r"y is of shape \(2, 3\); expected an odd number of rows"),
        ({"y": np.zeros((3, 2))}, r"y is of shape \(3, 2\); expected \(any, 3\)"),
        ({"y": np.full((3, 3), np.nan)}, r"y, \(3, 3\), has NaN"),
        ({"x": np.zeros(5)}, r"x is of shape \(5,\); expected \(6,\)"),
        ({"u": np.zeros((4, 1))}, r"u is of shape \(4, 1\); expected \(3, any\)"),
        ({"tick_secs": -1.0}, "tick_secs is -1.0"),
    ],
)
@pytest.mark.parametrize("order", ["full", "reduced"])
def test_invalid_tick_raises_an_error(order: str, change: dict, message: str) -> None:
    request = {"x": POINT, "y": np.tile(POINT[:3], (3, 1)), "tick_secs": 1.0} | change
    with pytest.raises(UsageError, match=message):
        observer_of_the_spacecraft(order).step(**request)


@pytest.mark.parametrize(("order", "count"), [("full", 6), ("reduced", 3)])
def test_diverging_estimate_raises_an_error(order: str, count: int) -> None:
    def away(x: np.ndarray, _: np.ndarray) -> np.ndarray:
        return np.exp(1e3 * np.abs(x))

    observer = tick_observer(away, spacecraft_jacobian, ANGLES, [-0.5] * count, order=order)
    with pytest.raises(UsageError, match=r"the estimate diverges in the tick from x̂ = \[0.1, -0.2"):
        observer.step(POINT, np.tile(POINT[:3], (3, 1)), tick_secs=1.0)


def test_invalid_or_unobservable_jacobian_raises_an_error() -> None:
    wide = tick_observer(spacecraft, lambda _x, _u: np.eye(3, 6), ANGLES, [-0.5] * 6)
    with pytest.raises(UsageError, match=r"jacobian is of shape \(3, 6\); expected \(6, 6\)"):
        wide.gain(POINT)
    for order, count in (("full", 6), ("reduced", 3)):
        blind = tick_observer(
            spacecraft, lambda _x, _u: np.diag(np.full(6, -0.1)), ANGLES, [-0.5] * count,
            order=order,
        )  # fmt: skip
        with pytest.raises(UsageError, match=r"no gain at x̂ = \[0.1, -0.2.*mode at -0.1 cannot"):
            blind.gain(POINT)


def test_frozen_gain_of_the_ship_is_as_good_as_one_per_tick() -> None:
    """The rudder swings by 20°, and the estimate starts with a large error."""
    tick, turn = 2.0, 2 * np.pi / 120
    times = np.arange(401) * tick / 4
    u = np.column_stack(
        (0.35 * np.sin(turn * times), 0.35 * turn * np.cos(turn * times), np.full(401, 36.0))
    )

    def moving(t: float, x: np.ndarray) -> np.ndarray:
        return ship(x, np.array([0.35 * np.sin(turn * t), 0.35 * turn * np.cos(turn * t), 36.0]))

    run = solve_ivp(moving, times[[0, -1]], SHIP_POINT, "DOP853", times, rtol=1e-12, atol=1e-14).y.T
    each_tick = tick_observer(ship, ship_jacobian, RATE_AND_SPEED, [-0.1] * 3)
    at_first = ship_jacobian(SHIP_POINT, u[0])
    frozen = tick_observer(ship, lambda *_: at_first, RATE_AND_SPEED, [-0.1] * 3)
    errors = []
    for observer in (each_tick, frozen):
        x, deviations = SHIP_POINT + np.array([0.005, -5e-4, -1.0]), []
        for k in range(0, 400, 4):
            x = observer.step(x, run[k : k + 5, [0, 2]], u[k : k + 5], tick_secs=tick)
            deviations.append(x - run[k + 4])
        errors.append(np.array(deviations))
    sizes = np.abs(errors[0]).max(axis=0)
    assert np.all(np.abs(errors[0] - errors[1]).max(axis=0) < 0.01 * sizes)
