from dataclasses import replace

import numpy as np
import pytest
from filter_runs import designed_gain, signals_of
from gaussian import held
from scipy.linalg import block_diag, expm, solve_discrete_are, solve_discrete_lyapunov

from analysis.filters import gains
from analysis.filters.gains import LinearAxis, linear_axes, relinearised_gain
from analysis.filters.noise_model import NoiseModel, Wave
from analysis.filters.ship_step import ShipState, jacobian, ship_slopes
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import UsageError, Vessel
from shiplog.compiled import compiled
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

WAVE = Wave(frequency=0.6, damping=0.1, std=5e-4, evidence=1.0)
WAVES = pytest.mark.parametrize("wave", [None, WAVE], ids=["calm", "waves"])
STEADY = FilterSettings(kind="steady-state")
TURNING, AHEAD = 4e-3, 7.0


def usual_at(c: Coefficients, dt: float, intervals: tuple[int, int] = (1, 1)) -> SignalStats:
    """A ship that turns at an ordinary rate and speed, and the intervals of its sensors."""
    still = signals_of(np.ones((40, 2)), np.zeros(40), np.full(40, 80.0), dt)
    result = signal_stats(still, c)
    return replace(
        result, intervals=np.array(intervals, float), yaw_rate_rms=TURNING, median_speed=AHEAD
    )


def both(
    c: Coefficients, dt: float, width: float, wave: Wave | None = None
) -> tuple[LinearAxis, LinearAxis]:
    """The channels for a yaw of that bandwidth, in rad/s; surge is slower."""
    ratios = np.array([width**4, (0.4 * width) ** 2])
    return linear_axes(c, NoiseModel(np.array([1e-4, 0.1]), ratios, wave=wave), usual_at(c, dt))


def from_sample_to_sample(of: LinearAxis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """F, Q and the variance of a sample."""
    F, Q = held(of.A, of.G @ of.Q @ of.G.T, of.interval_secs)
    return F, Q, np.array([[of.R / of.interval_secs]])


def closed(of: LinearAxis, gain: np.ndarray) -> np.ndarray:
    """The poles of (I - K C) F."""
    F, _, _ = from_sample_to_sample(of)
    return np.linalg.eigvals((np.eye(len(F)) - np.outer(gain, of.C[0])) @ F)


def best_gain(of: LinearAxis) -> np.ndarray:
    F, Q, r = from_sample_to_sample(of)
    P = solve_discrete_are(F.T, of.C.T, Q, r)
    return (P @ of.C.T / (of.C @ P @ of.C.T + r))[:, 0]


def stds(of: LinearAxis, gain: np.ndarray) -> np.ndarray:
    """Stationary error variance of a filter of that gain, in units of the process noise."""
    F, Q, r = from_sample_to_sample(of)
    unit = np.sqrt(np.diag(Q))
    kept = np.eye(len(F)) - np.outer(gain, of.C[0])
    noise = kept @ Q @ kept.T + r * np.outer(gain, gain)
    P = solve_discrete_lyapunov(kept @ F * unit / unit[:, None], noise / np.outer(unit, unit))
    return np.sqrt(np.diag(P))


def same_poles(result: np.ndarray, wanted: np.ndarray) -> bool:
    return bool(np.abs(np.poly(result) - np.poly(wanted)).max() < 1e-8)


def test_a_channel_is_the_ship_about_her_usual_motion(vessel: Vessel) -> None:
    c = vessel.coefficients
    noise = NoiseModel(np.array([1e-4, 0.2]), np.array([3e-6, 2e-4]))
    yaw, surge = linear_axes(c, noise, usual_at(c, 0.5, (2, 6)))
    stiffness = c.b1 + 2 * c.b2 * TURNING + 3 * c.b3 * TURNING**2
    close = np.testing.assert_allclose
    close(yaw.A, [[0, 1], [stiffness, c.a]])
    assert np.array_equal(yaw.C, [[1, 0]])
    close((yaw.R, surge.R), (1e-8, 0.04 * 3))  # variance times interval
    close(yaw.G @ yaw.Q @ yaw.G.T, np.diag([0, 3e-14]))
    close(surge.A, [[2 * c.g * AHEAD]])
    close(surge.G @ surge.Q @ surge.G.T, [[2.4e-5]])
    assert (yaw.interval_secs, surge.interval_secs) == (1.0, 3.0)


def test_a_wave_is_seen_in_the_measurement_alone(vessel: Vessel) -> None:
    calm, _ = both(vessel.coefficients, 0.5, 0.1)
    rough, _ = both(vessel.coefficients, 0.5, 0.1, WAVE)
    assert np.array_equal(rough.A, block_diag(calm.A, rough.A[2:, 2:]))
    assert np.array_equal(rough.C[:, :2], calm.C)
    frequency, damping = WAVE.frequency, WAVE.damping
    expected = frequency * (-damping + 1j * np.sqrt(1 - damping**2) * np.array([1, -1]))
    assert same_poles(np.linalg.eigvals(rough.A[2:, 2:]), expected)
    F, Q, _ = from_sample_to_sample(rough)
    stationary = solve_discrete_lyapunov(F[2:, 2:], Q[2:, 2:])
    seen = rough.C[0, 2:]
    assert seen @ stationary @ seen == pytest.approx(WAVE.std**2, rel=1e-9, abs=0)


@WAVES
@pytest.mark.parametrize("kind", ["steady-state", "quality", "per-tick"])
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_the_poles_of_i_minus_k_c_f_are_those_returned(
    vessel: Vessel, kind: str, dt: float, wave: Wave | None
) -> None:
    settings = FilterSettings(kind=kind, damping=0.1, yaw_decay=0.08, surge_decay=0.03)
    for channel in both(vessel.coefficients, dt, 0.1, wave):
        gain, poles = designed_gain(settings, channel)
        assert same_poles(closed(channel, gain), poles)


@pytest.mark.parametrize("dt", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("width", [0.02, 0.1])
def test_a_fast_sensors_steady_state_gain_is_the_best_there_is(
    vessel: Vessel, dt: float, width: float
) -> None:
    """The design is continuous: what is lost by it grows with the square of pole times interval."""
    for channel in both(vessel.coefficients, dt, width):
        gain, poles = designed_gain(STEADY, channel)
        fast = np.abs(np.log(poles)).max()
        assert fast < 0.06
        np.testing.assert_allclose(gain, best_gain(channel), rtol=0.06 * fast**2 + 1e-7)


@pytest.mark.parametrize("dt", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("width", [0.05, 0.2])
def test_among_waves_a_steady_state_filter_is_within_a_hundredth_of_the_best(
    vessel: Vessel, dt: float, width: float
) -> None:
    channel, _ = both(vessel.coefficients, dt, width, WAVE)
    gain, _ = designed_gain(STEADY, channel)
    assert np.all(stds(channel, gain)[:2] < 1.01 * stds(channel, best_gain(channel))[:2])


@WAVES
@pytest.mark.parametrize("shift", [0.05, 0.1, 0.4])
@pytest.mark.parametrize("damping", [0.0, 1e-9])
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_every_pole_of_a_quality_filter_is_left_of_half_its_shift(
    vessel: Vessel, shift: float, damping: float, dt: float, wave: Wave | None
) -> None:
    settings = FilterSettings(kind="quality", shift=shift, damping=damping)
    for channel in both(vessel.coefficients, dt, 0.02, wave):
        gain, _ = designed_gain(settings, channel)
        assert (np.log(closed(channel, gain)) / dt).real.max() < -shift / 2


@WAVES
def test_without_shift_and_damping_a_quality_filter_is_the_steady_state_one(
    vessel: Vessel, wave: Wave | None
) -> None:
    settings = FilterSettings(kind="quality", shift=0.0, damping=0.0)
    for channel in both(vessel.coefficients, 0.5, 0.1, wave):
        gain, _ = designed_gain(settings, channel)
        np.testing.assert_allclose(gain, designed_gain(STEADY, channel)[0], rtol=1e-7)


def test_damping_takes_the_yaw_acceleration_for_noisier_in_a_quality_filter(vessel: Vessel) -> None:
    """Source of the oracle: Antonov's (6), as white noise A ξ in the state and none in y."""
    yaw, _ = both(vessel.coefficients, 0.5, 0.1)
    settings = FilterSettings(kind="quality", shift=0.0, damping=0.4)
    G = np.diag([0.0, 0.4 * yaw.R])
    extra = np.linalg.cholesky(yaw.A @ G @ yaw.A.T + yaw.G @ yaw.Q @ yaw.G.T + 1e-30 * np.eye(2))
    noisier = replace(yaw, G=extra, Q=np.eye(2))
    gain, _ = designed_gain(settings, yaw)
    np.testing.assert_allclose(gain, designed_gain(STEADY, noisier)[0], rtol=1e-6)


def test_the_decays_stated_for_a_per_tick_observer_are_its_poles(vessel: Vessel) -> None:
    yaw, surge = both(vessel.coefficients, 0.5, 0.1)
    settings = FilterSettings(kind="per-tick", yaw_decay=0.07, surge_decay=0.02)
    for channel, decay, count in ((yaw, 0.07, 2), (surge, 0.02, 1)):
        gain, _ = designed_gain(settings, channel)
        assert same_poles(closed(channel, gain), np.full(count, np.exp(-decay * 0.5)))


@WAVES
def test_without_decays_a_per_tick_observer_has_the_steady_state_filters_poles(
    vessel: Vessel, wave: Wave | None
) -> None:
    for channel in both(vessel.coefficients, 0.5, 0.1, wave):
        gain, poles = designed_gain(FilterSettings(kind="per-tick"), channel)
        expected, steady = designed_gain(STEADY, channel)
        assert np.array_equal(gain, expected)
        assert np.array_equal(poles, steady)


def test_a_wave_that_is_the_ships_own_motion_is_refused(vessel: Vessel) -> None:
    """What swings alike cannot be distinguished."""
    alike = vessel.coefficients._replace(a=-0.12, b1=-0.36, b2=0.0, b3=0.0)
    yaw, _ = both(alike, 0.5, 0.1, WAVE)
    with pytest.raises(UsageError, match="cannot be seen"):
        designed_gain(STEADY, yaw)


@compiled
def place(  # numba cannot hand an array back to Python from what a cached caller brought with it
    K: np.ndarray,
    J: np.ndarray,
    wave: np.ndarray,
    c: np.ndarray,
    poles: np.ndarray,
    interval: float,
    output: int,
) -> None:
    K[:] = relinearised_gain(J, wave, c, poles, interval, output)


def placed(
    J: np.ndarray, wave: np.ndarray, c: np.ndarray, poles: np.ndarray, interval: float, output: int
) -> np.ndarray:
    K = np.full(len(c), np.nan)
    place(K, J, wave, c, poles, interval, output)
    return K


def of_all(channel: LinearAxis, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The measurement and the poles of a yaw channel among all states, and its wave's F."""
    c, among = np.zeros(len(poles) + 1), np.ones(len(poles) + 1, np.complex128)
    at = [0, 1, *range(3, len(c))]
    c[at], among[at] = channel.C[0], poles
    between = expm(channel.A[2:, 2:] * channel.interval_secs)
    return c, among, np.ascontiguousarray(between)


@WAVES
@pytest.mark.parametrize("dt", [0.1, 1.0])
@pytest.mark.parametrize("seed", range(8))
def test_a_per_tick_gain_places_the_same_poles_whatever_the_motion(
    vessel: Vessel, seed: int, dt: float, wave: Wave | None
) -> None:
    rng = np.random.default_rng(seed)
    yaw, _ = both(vessel.coefficients, dt, 10 ** rng.uniform(-2, -0.5), wave)
    _, poles = designed_gain(STEADY, yaw)
    c, among, between = of_all(yaw, poles)
    J = np.zeros((3, 3))
    J[0, 1] = 1.0
    J[1] = rng.uniform([-2e-2, -0.3, -1e-3], [5e-3, 0.05, 1e-3])
    J[2] = rng.uniform([-3.0, 0.0, -0.1], [3.0, 0.0, 0.02])
    K = placed(J, between, c, among, dt, 0)
    F = block_diag(expm(J[:2, :2] * dt), between)
    at = [0, 1, *range(3, len(c))]
    kept = np.eye(len(F)) - np.outer(K[at], c[at])
    result, wanted = (np.sort_complex(p) for p in (np.linalg.eigvals(kept @ F), poles))
    assert K[2] == 0.0
    assert np.abs(result - wanted).max() < 1e-8
    among[2] = np.exp(-0.05 * dt)
    K = placed(J, between, np.eye(len(c))[2], among, dt, 1)
    assert (1 - K[2]) * np.exp(J[2, 2] * dt) == pytest.approx(among[2].real, rel=1e-12)
    assert not np.any(np.delete(K, 2))


def test_hard_over_the_poles_of_yaw_and_surge_together_deviate_from_those_placed_apart(
    vessel: Vessel,
) -> None:
    """As the page on the per-tick observer states, there in continuous time."""
    dt, C = 0.1, np.eye(3)[[0, 2]]
    hard_over = ShipState(8.88e-3, 0.0, 4.43)  # a steady turn at 35° and 80 rpm
    slopes = ship_slopes.py_func(vessel.coefficients, hard_over, np.radians(35), 0.0, 80.0)
    J = jacobian.py_func(slopes)
    among = np.exp(np.array([-0.1, -0.1, -0.05]) * dt).astype(complex)
    by_rate, by_speed = (placed(J, np.zeros((0, 0)), c, among, dt, k) for k, c in enumerate(C))
    kept = (np.eye(3) - np.outer(by_speed, C[1])) @ (np.eye(3) - np.outer(by_rate, C[0]))
    poles = np.log(np.linalg.eigvals(kept @ expm(J * dt)).astype(complex)).real / dt
    assert np.sort(poles) == pytest.approx([-0.1095, -0.0882, -0.0523], abs=3e-4)


@WAVES
@pytest.mark.parametrize(
    "settings",
    [
        FilterSettings(kind="per-tick"),
        FilterSettings(kind="per-tick", yaw_decay=0.1, surge_decay=0.04),
    ],
    ids=["free", "stated"],
)
def test_at_the_usual_motion_a_per_tick_gain_is_the_one_designed(
    vessel: Vessel, settings: FilterSettings, wave: Wave | None
) -> None:
    yaw, surge = both(vessel.coefficients, 0.5, 0.1, wave)
    J = block_diag(yaw.A[:2, :2], surge.A)
    gain, poles = designed_gain(settings, yaw)
    c, among, between = of_all(yaw, poles)
    at = [0, 1, *range(3, len(c))]
    np.testing.assert_allclose(placed(J, between, c, among, 0.5, 0)[at], gain, rtol=1e-8)
    gain, poles = designed_gain(settings, surge)
    among[2] = poles[0]
    K = placed(J, between, np.eye(len(c))[2], among, 0.5, 1)
    assert K[2] == pytest.approx(gain[0], rel=1e-12, abs=0)


@pytest.mark.parametrize("stiffness", [-4.0, -1e-2, -1e-10, 0.0, 1e-10, 1e-3, 2.0])
@pytest.mark.parametrize("a", [-1.5, -1e-3, 0.0])
@pytest.mark.parametrize("interval", [0.02, 0.5, 2.0])
def test_the_exponential_of_the_yaw_is_that_of_scipy(
    stiffness: float, a: float, interval: float
) -> None:
    F, J = np.zeros((2, 2)), np.array([[0.0, 1.0], [stiffness, a]])
    gains._set_exponential.py_func(F, J, interval)
    expected = expm(J * interval)
    np.testing.assert_allclose(F, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("size", [1, 2, 4])
def test_elimination_with_pivots_solves_what_numpy_solves(size: int) -> None:
    rng = np.random.default_rng(size)
    M, b = rng.normal(size=(size, size)), rng.normal(size=size)
    if size > 1:
        M[0, 0] = 0.0  # a row must be exchanged
    expected = np.linalg.solve(M, b)
    gains._solve.py_func(M, b)
    np.testing.assert_allclose(b, expected, rtol=1e-12)


def test_a_motion_at_which_the_yaw_is_not_observable_has_no_gain() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="not observable"):
        gains._solve.py_func(np.array([[1.0, 2.0], [0.5, 1.0]]), np.ones(2))
