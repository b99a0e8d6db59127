from dataclasses import replace
from itertools import pairwise
from math import degrees, radians

import numpy as np
import pytest
from model_ships import AHEAD, RPM, SHIPS, SPEED, approach, rates_in_si, vessel_of
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_lyapunov

from recorders.simulated.manoeuvres import Manoeuvre, manoeuvre
from recorders.simulated.trajectory import (
    Gust,
    RandomForcing,
    Trajectory,
    WaveMoment,
    compute_trajectory,
)
from shiplog import UsageError, Vessel, load_vessel
from shiplog.ships import ship_model
from shiplog.ships.paper import rudder_effect, steady_speed

DEG = np.pi / 180

# manoeuvre, t in s: w in deg/s, w' in deg/s^2, v in m/s, heading in deg
REFERENCES = [
    ("turning-circle", 60, 0.646748175, 0.01699870857, 9.88333899, 11.22958),
    ("turning-circle", 100, 0.567861133, -0.01123471521, 8.14025977, 39.853424),
    ("turning-circle", 300, 0.539167909, -0.00098587306, 5.9056404, 146.235341),
    ("turning-circle", 500, 0.521274535, -8.784138e-5, 5.03621554, 251.200178),
    ("zigzag-10-10", 100, 0.346433769, -0.00694048347, 9.84935389, 18.070377),
    ("zigzag-10-10", 500, -0.35215684, 0.00453681996, 8.46858912, -11.48115),
    ("zigzag-20-20", 100, 0.498717637, -0.01475557499, 9.06084792, 29.893113),
    ("zigzag-20-20", 500, -0.241888963, -0.01717656162, 7.80760042, 32.220491),
    ("paper", 500, -0.451700125, -0.00084314563, 7.60544314, -27.369603),
]


def simulated(vessel: Vessel, name: str, duration: float = 520.0) -> Trajectory:
    return compute_trajectory(vessel, manoeuvre(name, duration, vessel.approach_rpm), duration)


@pytest.mark.parametrize(("name", "time", "w", "w_dot", "v", "heading"), REFERENCES)
def test_the_reference_trajectories_are_reproduced(
    vessel: Vessel, name: str, time: float, w: float, w_dot: float, v: float, heading: float
) -> None:
    truth = simulated(vessel, name).at(np.array([float(time)]))
    assert truth["yaw_rate"][0] / DEG == pytest.approx(w, abs=1e-7)
    assert truth["yaw_acceleration"][0] / DEG == pytest.approx(w_dot, abs=1e-7)
    assert truth["speed"][0] == pytest.approx(v, abs=1e-7)
    assert truth["heading"][0] / DEG == pytest.approx(heading, abs=2e-6)


@pytest.mark.parametrize(
    ("name", "extrema"),
    [
        ("zigzag-10-10", [(24.159, 133.0), (-18.093, 275.8), (19.596, 406.2)]),
        ("zigzag-20-20", [(36.355, 124.6), (-34.744, 305.4), (33.923, 485.8)]),
    ],
)
def test_the_heading_overshoots_are_reproduced(
    vessel: Vessel, name: str, extrema: list[tuple[float, float]]
) -> None:
    times = np.arange(0.0, 520.0, 0.1)
    heading = simulated(vessel, name).at(times)["heading"]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(heading)))) + 1
    turns = turns[np.abs(heading[turns]) > radians(5)]
    for (angle, time), at in zip(extrema, turns, strict=True):
        assert heading[at] / DEG == pytest.approx(angle, abs=6e-4)
        assert times[at] == pytest.approx(time, abs=0.11)


def test_an_independent_integrator_agrees_with_knots_between_steps(vessel: Vessel) -> None:
    vessel = replace(vessel, rudder_rate=2.3456 * DEG)
    c = vessel.coefficients

    def rates(t: float, x: np.ndarray) -> list[float]:
        w, w_dot, v = x
        moving = min(max(t - 10, 0) * vessel.rudder_rate, 35 * DEG)
        rate = vessel.rudder_rate if 10 < t < 10 + 35 * DEG / vessel.rudder_rate else 0.0
        ks = c.alpha1 * v + c.alpha2 * 80 * np.exp(-c.alpha3 * v)
        hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
        return [w_dot, hull + ks * (c.d * moving + c.e * rate), c.f * w**2 + c.g * v**2 + c.h * 80]

    x, knots = np.array([0, 0, steady_speed(c, 80)]), [0, 10, 10 + 35 * DEG / vessel.rudder_rate]
    for start, end in zip(knots, [*knots[1:], 200.0], strict=True):
        piece = solve_ivp(rates, (start + 1e-12, end), x, rtol=1e-11, atol=1e-14, method="DOP853")
        x = piece.y[:, -1]
    truth = simulated(vessel, "turning-circle", 200.0).at(np.array([200.0]))
    assert truth["yaw_rate"][0] == pytest.approx(x[0], rel=1e-9)
    assert truth["speed"][0] == pytest.approx(x[2], rel=1e-9)


def test_a_zigzag_reverses_the_rudder_exactly_at_the_heading(vessel: Vessel) -> None:
    trajectory = simulated(vessel, "zigzag-20-20")
    rate = trajectory.rows[:, 8]
    turns = np.flatnonzero((rate[1:] != 0) & (rate[:-1] == 0)) + 1
    headings = trajectory.rows[turns[1:], 4] / DEG
    assert headings == pytest.approx([20, -20, 20][: len(headings)], abs=1e-9)
    assert len(headings) == 3


def test_the_rudder_never_moves_faster_than_its_gear(vessel: Vessel) -> None:
    times = np.arange(0, 520, 0.01)
    rudder = simulated(vessel, "spiral").at(times)["rudder"]
    assert np.max(np.abs(np.diff(rudder))) <= vessel.rudder_rate * 0.01 * (1 + 1e-9)


def test_the_rudder_stops_at_its_limit(vessel: Vessel) -> None:
    short = replace(vessel, rudder_max=15 * DEG)
    rudder = simulated(short, "turning-circle").at(np.arange(0.0, 100.0, 1.0))["rudder"]
    assert rudder.max() == pytest.approx(15 * DEG)


def test_the_truth_between_rows_is_integrated_not_interpolated(vessel: Vessel) -> None:
    trajectory = simulated(vessel, "zigzag-20-20")
    fine = np.arange(80.0, 90.0, 0.003)
    w, w_dot = (trajectory.at(fine)[k] for k in ("yaw_rate", "yaw_acceleration"))
    slope = np.gradient(w, fine, edge_order=2)
    assert np.max(np.abs(slope - w_dot)[1:-1]) < 1e-8


def test_both_readings_of_the_table_can_be_simulated_and_differ() -> None:
    turns = {}
    for preset in ("table1", "table1-rad"):
        trajectory = simulated(load_vessel(preset)[0], "turning-circle")
        turns[preset] = trajectory.at(np.array([500.0]))["speed"][0]
    assert turns["table1"] == pytest.approx(5.03621554, abs=1e-7)
    assert turns["table1-rad"] > 10  # read in radians, hard over costs 1 % of the speed


def test_a_gust_acts_as_its_rudder_angle(vessel: Vessel) -> None:
    straight = manoeuvre("turning-circle-1", 400.0, 80.0)
    straight = replace(straight, orders=straight.orders[:1])
    pushed = compute_trajectory(vessel, straight, 400.0, gusts=(Gust(radians(2), 50.0, 100.0),))
    truth = pushed.at(np.array([49.9, 50.1, 149.9, 150.1]))
    c = vessel.coefficients
    size = c.d * rudder_effect(c, steady_speed(c, 80), 80) * radians(2)
    assert truth["yaw_disturbance"] == pytest.approx([0, size, size, 0])
    assert degrees(truth["yaw_rate"][2]) > 0.1


def test_a_wave_moment_has_its_period_and_amplitude(vessel: Vessel) -> None:
    ordered = manoeuvre("turning-circle", 100.0, 80.0)
    wavy = compute_trajectory(vessel, ordered, 100.0, wave=WaveMoment(radians(1), 8.0))
    truth = wavy.at(np.array([2.0, 4.0, 6.0]))["yaw_disturbance"]
    assert truth[0] == pytest.approx(-truth[2])
    assert truth[0] > 0
    assert truth[1] == pytest.approx(0, abs=1e-18)


# ---- random forcing


def straight(vessel: Vessel, duration: float) -> Manoeuvre:
    ahead = manoeuvre("turning-circle", duration, vessel.approach_rpm)
    return replace(ahead, orders=ahead.orders[:1])


def moment_of(vessel: Vessel, size: float) -> float:
    """The yaw moment of a rudder angle at the approach speed."""
    c, rpm = vessel.coefficients, vessel.approach_rpm
    return c.d * rudder_effect(c, steady_speed(c, rpm), rpm) * size


@pytest.fixture(scope="module")
def linear(vessel: Vessel) -> Vessel:
    """A linear ship with time constants so short that a run holds thousands of them."""
    c = vessel.coefficients
    quick = c._replace(a=-2.0, b1=-1.0, b2=0.0, b3=0.0, f=0.0, g=100 * c.g, h=100 * c.h)
    return replace(vessel, coefficients=quick)


def test_a_random_forcings_mean_over_a_second_has_its_standard_deviation(
    vessel: Vessel,
) -> None:
    forcing, rng = RandomForcing(rudder=radians(0.3), force=0.02), np.random.default_rng(1)
    truth = compute_trajectory(
        vessel, straight(vessel, 6e3), 6e3, random_forcing=forcing, rng=rng
    ).at(np.arange(60_000) / 10)
    sizes = {
        "yaw_disturbance": moment_of(vessel, forcing.rudder),
        "surge_disturbance": forcing.force,
    }
    for name, size in sizes.items():
        means = truth[name].reshape(-1, 10).mean(axis=1)
        assert np.std(means) == pytest.approx(size, rel=0.03)
        assert np.std(truth[name]) == pytest.approx(size / np.sqrt(0.1), rel=0.01)
        assert abs(np.corrcoef(means[1:], means[:-1])[0, 1]) < 0.05
    assert abs(np.corrcoef(truth["yaw_disturbance"], truth["surge_disturbance"])[0, 1]) < 0.02


def test_a_random_forcing_gives_a_linear_ship_the_variances_of_lyapunov(
    linear: Vessel,
) -> None:
    forcing, c = RandomForcing(rudder=radians(1), force=0.02), linear.coefficients
    trajectory = compute_trajectory(
        linear, straight(linear, 2e4), 2e4, random_forcing=forcing, rng=np.random.default_rng(2)
    )
    truth = trajectory.at(np.arange(20.0, 2e4, 0.1))
    F, G = np.array([[0.0, 1.0], [c.b1, c.a]]), np.array([[0.0], [1.0]])
    P = solve_continuous_lyapunov(F, -G @ G.T * moment_of(linear, forcing.rudder) ** 2)
    assert np.var(truth["yaw_rate"]) == pytest.approx(P[0, 0], rel=0.06)
    assert np.var(truth["yaw_acceleration"]) == pytest.approx(P[1, 1], rel=0.06)
    slope = np.array([[2 * c.g * steady_speed(c, linear.approach_rpm)]])
    surge = solve_continuous_lyapunov(slope, np.array([[-(forcing.force**2)]]))
    assert np.var(truth["speed"]) == pytest.approx(surge[0, 0], rel=0.06)


def test_an_independent_integrator_agrees_with_random_forcing_and_knots_between_steps(
    vessel: Vessel,
) -> None:
    vessel = replace(vessel, rudder_rate=2.3456 * DEG)
    c, duration = vessel.coefficients, 40.0
    trajectory = compute_trajectory(
        vessel,
        manoeuvre("turning-circle", duration, vessel.approach_rpm),
        duration,
        random_forcing=RandomForcing(rudder=radians(2), force=0.05),
        rng=np.random.default_rng(3),
    )
    pushes = trajectory.at(np.arange(400) / 10 + 0.05)
    arrival = 10 + 35 * DEG / vessel.rudder_rate

    def rates(t: float, x: np.ndarray, k: int) -> list[float]:
        w, w_dot, v = x
        delta = min(max(t - 10, 0) * vessel.rudder_rate, 35 * DEG)
        rate = vessel.rudder_rate if 10 < t < arrival else 0.0
        ks = c.alpha1 * v + c.alpha2 * 80 * np.exp(-c.alpha3 * v)
        hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
        moment, force = pushes["yaw_disturbance"][k], pushes["surge_disturbance"][k]
        yaw = hull + ks * (c.d * delta + c.e * rate) + moment
        return [w_dot, yaw, c.f * w**2 + c.g * v**2 + c.h * 80 + force]

    x = np.array([0, 0, steady_speed(c, 80)])
    knots = np.unique([*np.arange(401) / 10, arrival])
    for start, end in pairwise(knots):
        k = int((start + end) / 2 * 10)
        span = (start + 1e-12, end)
        piece = solve_ivp(rates, span, x, args=(k,), rtol=1e-11, atol=1e-14, method="DOP853")
        x = piece.y[:, -1]
    truth = trajectory.at(np.array([duration]))
    assert truth["yaw_rate"][0] == pytest.approx(x[0], rel=1e-8)
    assert truth["yaw_acceleration"][0] == pytest.approx(x[1], rel=1e-8)
    assert truth["speed"][0] == pytest.approx(x[2], rel=1e-9)


def test_at_every_tenth_of_a_second_the_random_forcing_is_that_of_the_next_step(
    vessel: Vessel,
) -> None:
    trajectory = compute_trajectory(
        vessel, straight(vessel, 100.0), 100.0, random_forcing=RandomForcing(force=0.01)
    )
    tenths = np.arange(1000) / 10
    at, after = trajectory.at(tenths), trajectory.at(tenths + 0.05)
    assert np.array_equal(at["surge_disturbance"], after["surge_disturbance"])
    assert len(np.unique(at["surge_disturbance"])) == 1000


def test_a_random_forcing_adds_to_the_gust_and_the_wave(vessel: Vessel) -> None:
    ordered, times = straight(vessel, 60.0), np.arange(0.05, 60.0, 0.1)
    acting = {"gusts": (Gust(radians(2), 20.0, 20.0),), "wave": WaveMoment(radians(1), 8.0)}
    both, random_forcing, rest = (
        compute_trajectory(vessel, ordered, 60.0, **kinds).at(times)["yaw_disturbance"]
        for kinds in (
            {**acting, "random_forcing": RandomForcing(rudder=radians(1))},
            {"random_forcing": RandomForcing(rudder=radians(1))},
            acting,
        )
    )
    assert both == pytest.approx(random_forcing + rest, abs=1e-15)


def test_a_zigzag_reverses_the_rudder_at_the_heading_with_random_forcing(vessel: Vessel) -> None:
    ordered = manoeuvre("zigzag-20-20", 520.0, vessel.approach_rpm)
    trajectory = compute_trajectory(
        vessel, ordered, 520.0, random_forcing=RandomForcing(rudder=radians(1), force=0.02)
    )
    rate = trajectory.rows[:, 8]
    turns = np.flatnonzero((rate[1:] != 0) & (rate[:-1] == 0)) + 1
    headings = trajectory.rows[turns[1:], 4] / DEG
    assert headings == pytest.approx([20, -20, 20][: len(headings)], abs=1e-9)
    assert len(headings) >= 2


# ---- every model


def rudder_at(t: float, vessel: Vessel) -> tuple[float, float]:
    """The rudder of a turning circle and its rate: it starts to move at 10 s."""
    moving = 10 < t < 10 + 35 * DEG / vessel.rudder_rate
    return min(max(t - 10, 0) * vessel.rudder_rate, 35 * DEG), moving * vessel.rudder_rate


@pytest.mark.parametrize("name", SHIPS)
def test_an_independent_integrator_agrees_with_every_model(name: str) -> None:
    vessel = replace(vessel_of(name), rudder_rate=2.3456 * DEG)
    gust, wave = Gust(radians(3), 33.33, 40.0), WaveMoment(radians(1), 9.0)
    circle = manoeuvre("turning-circle", 300.0, RPM)
    trajectory = compute_trajectory(vessel, circle, 300.0, gusts=(gust,), wave=wave)

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        pushed = gust.rudder if 33.33 <= t < 73.33 else 0.0
        moment = pushed + wave.rudder * np.sin(2 * np.pi * t / 9)
        return rates_in_si(name, x, rudder_at(t, vessel), RPM, moment=moment)

    x = trajectory.ship.straight_state(approach(name))
    knots = [0.0, 10.0, 10 + 35 * DEG / vessel.rudder_rate, 33.33, 73.33, 300.0]
    for start, end in pairwise(knots):
        span = (start + 1e-12, end - 1e-12)
        x = solve_ivp(rates, span, x, rtol=1e-11, atol=1e-13, method="DOP853").y[:, -1]
    truth = {key: value[0] for key, value in trajectory.at(np.array([300.0])).items()}
    final = rates_in_si(name, x, rudder_at(300.0, vessel), RPM)
    over_ground = (final[-2] + 1j * final[-1]) * np.exp(-1j * x[-3])
    assert truth["yaw_rate"] == pytest.approx(x[0] * SPEED / 180, rel=1e-6)
    assert truth["speed"] == pytest.approx(over_ground.real, rel=1e-6)
    assert truth["sway"] == pytest.approx(over_ground.imag, rel=1e-6, abs=1e-12)
    assert truth["heading"] == pytest.approx(x[-3], rel=1e-6)
    assert truth["position"] == pytest.approx(x[-2:], rel=1e-6)
    assert trajectory.at(np.zeros(1))["speed"][0] == pytest.approx(approach(name))


@pytest.mark.parametrize("name", SHIPS)
def test_a_gust_turns_a_ship_of_every_model_as_its_rudder_does(name: str) -> None:
    vessel = vessel_of(name)
    ahead = straight(vessel, 600.0)
    order = replace(ahead.orders[0], time_secs=50.0, rudder=0.1 * DEG)
    times = np.array([590.0])  # when the transient of the rudder has decayed
    undisturbed, pushed, steered = (
        trajectory.at(times)
        for trajectory in (
            compute_trajectory(vessel, ahead, 600.0),
            compute_trajectory(vessel, ahead, 600.0, gusts=(Gust(0.1 * DEG, 50.0),)),
            compute_trajectory(vessel, replace(ahead, orders=(*ahead.orders, order)), 600.0),
        )
    )
    for channel in ("yaw_rate", "sway"):
        by_gust, by_rudder = (s[channel] - undisturbed[channel] for s in (pushed, steered))
        assert by_gust == pytest.approx(by_rudder, rel=2e-2)
    assert pushed["yaw_disturbance"][0] > 0


@pytest.mark.parametrize("name", SHIPS)
def test_a_zigzag_of_every_model_reverses_the_rudder_at_the_heading(name: str) -> None:
    trajectory = simulated(vessel_of(name), "zigzag-20-20", 400.0)
    rate = trajectory.rows[:, -6]
    turns = np.flatnonzero((rate[1:] != 0) & (rate[:-1] == 0)) + 1
    headings = trajectory.rows[turns[1:], -10] / DEG
    assert headings == pytest.approx([20, -20, 20, -20, 20, -20][: len(headings)], abs=1e-9)
    assert len(headings) >= 3


@pytest.mark.parametrize("name", SHIPS)
def test_the_yaw_acceleration_is_the_slope_of_the_yaw_rate(name: str) -> None:
    trajectory = simulated(vessel_of(name), "zigzag-20-20", 200.0)
    fine = np.arange(80.0, 84.0, 0.003)
    truth = trajectory.at(fine)
    slope = np.gradient(truth["yaw_rate"], fine, edge_order=2)
    assert np.max(np.abs(slope - truth["yaw_acceleration"])[1:-1]) < 1e-7


@pytest.mark.parametrize("name", SHIPS)
def test_a_random_forcing_accelerates_every_model(name: str) -> None:
    vessel = vessel_of(name)
    forcing, rng = RandomForcing(force=0.02), np.random.default_rng(4)
    pushed = compute_trajectory(
        vessel, straight(vessel, 10.0), 10.0, random_forcing=forcing, rng=rng
    )
    edges = np.array([5.0, 5.1])
    speeds, force = pushed.at(edges)["speed"], pushed.at(np.array([5.05]))["surge_disturbance"]
    ahead = AHEAD[name]
    x = pushed.rows[np.searchsorted(pushed.rows[:, 0], 5.0 - 1e-9), 1:-7]
    free = SPEED * rates_in_si(name, x, (0.0, 0.0), RPM)[ahead]
    assert (speeds[1] - speeds[0]) / 0.1 == pytest.approx(force[0] + free, rel=2e-2)


def test_a_ship_without_a_steady_speed_is_refused() -> None:
    vessel = vessel_of("nomoto")
    assert vessel.model is not None
    a, k, f, _, h = vessel.model.parameters
    free = replace(vessel, model=replace(vessel.model, parameters=(a, k, f, 0.0, h)))
    with pytest.raises(UsageError, match="a nomoto has no steady speed at 90 rpm"):
        simulated(free, "zigzag-20-20")


def test_a_diverging_model_is_refused() -> None:
    vessel = vessel_of("slipstream")
    assert vessel.model is not None
    parameters = list(vessel.model.parameters)
    parameters[ship_model("slipstream").names.index("b2")] = 500.0
    wild = replace(vessel, model=replace(vessel.model, parameters=tuple(parameters)))
    with pytest.raises(UsageError, match="of a slipstream diverges in turning-circle"):
        simulated(wild, "turning-circle")
