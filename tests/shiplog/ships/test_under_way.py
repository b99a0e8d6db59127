"""A ship of any model in SI: its equations, disturbances and position."""

from itertools import pairwise
from math import radians

import numpy as np
import pytest
from model_ships import RPM, SHIPS, SPEED, approach, rates_in_si, vessel_of
from scipy.integrate import solve_ivp

from shiplog import Vessel, load_vessel
from shiplog.ships import ship_model
from shiplog.ships.model import SI
from shiplog.ships.paper import (
    Coefficients,
    rudder_effect,
    steady_speed,
    surge_acceleration,
    yaw_acceleration_rate,
)
from shiplog.ships.under_way import Excitation, Ship, rates_si, runge_kutta_step, straight_run
from shiplog.vessel.ship import ship_from_vessel

TABLE1 = load_vessel("table1")[0].paper_coefficients


def papers(c: Coefficients = TABLE1) -> Ship:
    return Ship(ship_model("burylin"), c, SI)


# ---- the paper's ship


def test_the_papers_ship_has_the_equations_of_the_filters_to_the_last_bit() -> None:
    rng, ship = np.random.default_rng(0), papers()
    constants = ship.constants(9.0, 80.0)
    for w, w_dot, v, delta, rate in rng.normal(size=(100, 5)) * (0.01, 1e-4, 3.0, 0.3, 0.04):
        x = np.array([w, w_dot, 9 + v, 0.3, 5.0, 6.0])
        result = rates_si(
            TABLE1, constants, x, straight_run(80, delta)._replace(delta_dot=rate), 0.0, 0.0
        )
        w_ddot = yaw_acceleration_rate(TABLE1, w, w_dot, 9 + v, 80.0, delta, rate)
        surge = surge_acceleration(TABLE1, w, 9 + v, 80.0)
        assert result[:4].tolist() == [w_dot, w_ddot, surge, w]
        assert result[4:] == pytest.approx((9 + v) * np.array([np.cos(0.3), np.sin(0.3)]))


def test_a_moment_acts_on_the_yaw_of_the_papers_ship_alone() -> None:
    constants = papers().constants(9.0, 80.0)
    size = TABLE1.d * rudder_effect(TABLE1, 9.0, 80.0)
    assert constants.per_rudder.tolist() == [0.0, size, 0.0, 0.0]
    assert papers().moment_per_rudder(constants) == (size, "rad/s³")


def test_a_moment_and_a_force_add_to_yaw_and_surge_alone() -> None:
    constants, x = papers().constants(9.0, 80.0), np.array([0.01, 1e-4, 8.0, 0.3, 5.0, 6.0])
    calm = Excitation(0.2, 0.01, 80.0, 0.0, 0.0, 0.0, 0.0)
    free = rates_si(TABLE1, constants, x, calm, 3.0, 0.1)
    pushed = rates_si(TABLE1, constants, x, calm._replace(moment=0.02, force=0.03), 3.0, 0.1)
    size = 0.02 * TABLE1.d * rudder_effect(TABLE1, 9.0, 80.0)
    assert pushed - free == pytest.approx([0, size, 0.03, 0, 0, 0], abs=1e-15)


def test_a_ship_without_hull_forces_accelerates_by_the_disturbances() -> None:
    free = papers(Coefficients(*[0.0] * 12))
    constants = free.constants(1.0, 0.0)._replace(per_rudder=np.array([0.0, 1.0, 0.0, 0.0]))
    pushed = straight_run(0)._replace(moment=2e-5, force=0.03)
    after = runge_kutta_step(
        free.coefficients, constants, free.straight_state(1.0), pushed, 0.0, 2.0, np.empty((3, 6))
    )
    assert after[:3] == pytest.approx([4e-5, 4e-5, 1.06])


def test_the_papers_ship_starts_at_the_steady_speed_in_closed_form(vessel: Vessel) -> None:
    assert ship_from_vessel(vessel).steady_speed(80.0) == steady_speed(TABLE1, 80.0)


# ---- any model


@pytest.mark.parametrize("name", SHIPS)
def test_at_the_steady_speed_the_speed_does_not_change(name: str) -> None:
    ship = ship_from_vessel(vessel_of(name))
    speed = ship.steady_speed(RPM)
    assert speed == pytest.approx(approach(name), rel=1e-12)
    rates = rates_si(
        ship.coefficients,
        ship.constants(speed, RPM),
        ship.straight_state(speed),
        straight_run(RPM),
        0.0,
        0.0,
    )
    surge = [value.channel for value in ship.model.state].index("speed")
    assert rates[surge] == pytest.approx(0, abs=1e-14)
    assert ship.steady_speed(1.1 * RPM) > speed


@pytest.mark.parametrize("changes", [{"h": -0.01}, {"g": 0.0}])
def test_without_thrust_or_resistance_the_steady_speed_is_zero(changes: dict[str, float]) -> None:
    ship = ship_from_vessel(vessel_of("nomoto"))
    other = Ship(ship.model, ship.coefficients._replace(**changes), ship.scale)
    assert other.steady_speed(RPM) == 0.0


@pytest.mark.parametrize("name", SHIPS)
def test_the_rates_in_si_are_those_of_the_documented_equations(name: str) -> None:
    ship, rng = ship_from_vessel(vessel_of(name)), np.random.default_rng(1)
    speed = approach(name)
    constants, straight_state = ship.constants(speed, RPM), ship.straight_state(speed)
    for _ in range(50):
        x = straight_state + rng.normal(size=len(straight_state)) * np.where(
            straight_state > 0, 0.1, 0.05
        )
        acting = Excitation(*rng.normal(size=2) * (0.3, 0.03), 80.0, 0.02, 0.01, 0.7, 0.03)
        result = rates_si(ship.coefficients, constants, x, acting, 3.0, 0.5)
        moment = 0.02 + 0.01 * np.sin(0.7 * 3.5)
        rudder = acting.delta + 0.5 * acting.delta_dot, acting.delta_dot
        expected = rates_in_si(name, x, rudder, 80.0, moment=moment, force=0.03)
        assert result == pytest.approx(expected, rel=1e-11, abs=1e-13)


@pytest.mark.parametrize("name", SHIPS)
def test_a_moment_turns_to_its_side_and_leaves_the_speed(name: str) -> None:
    ship = ship_from_vessel(vessel_of(name))
    constants = ship.constants(SPEED, RPM)
    size, unit = ship.moment_per_rudder(constants)
    assert size > 0
    assert unit == ("rad/s³" if name in ("slipstream", "drift-lag") else "rad/s²")
    assert constants.per_rudder[constants.ahead] == 0


# ---- the error of Runge-Kutta


def hard_over(t: float, start: float, rate: float) -> float:
    """The rudder while it moves to 35°."""
    return min(max(t - start, 0.0) * rate, radians(35))


def stepped(start: float, rate: float) -> np.ndarray:
    """w, w' and v every 0.1 s for 200 s, (2000, 3), one step a sample without regard to knots."""
    ship, result, work = papers(), [], np.empty((3, 6))
    state = ship.straight_state(steady_speed(TABLE1, 80.0))
    constants = ship.constants(state[2], 80.0)
    for k in range(2000):
        delta, after = (hard_over(k * 0.1 + h, start, rate) for h in (0.0, 0.1))
        moving = straight_run(80, delta)._replace(delta_dot=(after - delta) / 0.1)
        state = runge_kutta_step(TABLE1, constants, state, moving, 0.0, 0.1, work).copy()
        result.append(state[:3])
    return np.array(result)


def exact(start: float, rate: float) -> np.ndarray:
    """The same by an independent integrator, from knot to knot of the rudder."""
    c, x, parts = TABLE1, np.array([0.0, 0.0, steady_speed(TABLE1, 80.0)]), []

    def moving(t: float, x: np.ndarray, delta_dot: float) -> list[float]:
        w, w_dot, v = x
        w_ddot = yaw_acceleration_rate(c, *x, 80.0, hard_over(t, start, rate), delta_dot)
        return [w_dot, w_ddot, surge_acceleration(c, w, v, 80.0)]

    times, knots = np.arange(1, 2001) * 0.1, [0.0, start, start + radians(35) / rate, 200.0]
    for (begins, ends), delta_dot in zip(pairwise(knots), (0.0, rate, 0.0), strict=True):
        asked = times[(times > begins + 1e-9) & (times <= ends + 1e-9)].clip(max=ends)
        run = solve_ivp(
            moving, (begins, ends), x, "DOP853", np.unique([*asked, ends]), args=(delta_dot,),
            rtol=1e-13, atol=1e-16,
        )  # fmt: skip
        parts.append(run.y[:, : len(asked)].T)
        x = run.y[:, -1]
    return np.concatenate(parts)


@pytest.mark.parametrize(
    # of the size of each state: 4e-11 with knots on the steps, 3e-6 with knots between them
    ("start", "rate_deg", "least", "most"),
    [(10.0, 2.5, 0.0, 5e-11), (10.0, 2.3456, 2.5e-6, 3.5e-6), (10.03, 2.3456, 2.5e-6, 4e-6)],
)
def test_runge_kutta_at_a_tenth_of_a_second_needs_the_rudders_knots_on_its_steps(
    start: float, rate_deg: float, least: float, most: float
) -> None:
    true = exact(start, radians(rate_deg))
    error = np.abs(stepped(start, radians(rate_deg)) - true) / np.abs(true).max(axis=0)
    assert least <= error.max() < most
