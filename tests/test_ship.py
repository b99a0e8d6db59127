import subprocess
import sys
from itertools import pairwise
from math import pi, radians

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shiplog import load_vessel
from shiplog.ship import (
    COEFFICIENT_UNITS,
    Coefficients,
    Forcing,
    State,
    motion,
    rudder_effect,
    rudder_effect_rate,
    steady_speed,
    step,
    surge_acceleration,
    yaw_acceleration_rate,
)

TABLE1 = load_vessel("table1")[0].coefficients
TABLE1_RAD = load_vessel("table1-rad")[0].coefficients


def test_the_yaw_equation_gives_the_published_point_in_degrees() -> None:
    w_ddot = yaw_acceleration_rate(
        TABLE1, radians(0.3), radians(0.01), 9.0, 80.0, radians(20), radians(2.5)
    )
    assert w_ddot * 180 / pi == pytest.approx(1.261186547187e-4, rel=1e-11)


def test_the_surge_equation_gives_the_published_point_in_degrees() -> None:
    assert surge_acceleration(TABLE1, radians(0.3), 9.0, 80.0) == pytest.approx(-1.3e-3, rel=1e-12)


def test_the_equations_give_the_same_point_where_the_table_is_read_in_radians() -> None:
    w_ddot = yaw_acceleration_rate(TABLE1_RAD, 0.3, 0.01, 9.0, 80.0, 20.0, 2.5)
    assert w_ddot == pytest.approx(1.261186547187e-4, rel=1e-11)
    assert surge_acceleration(TABLE1_RAD, 0.3, 9.0, 80.0) == pytest.approx(-1.3e-3, rel=1e-12)


def test_port_mirrors_starboard() -> None:
    for w, w_dot, delta, delta_dot in ((0.01, 1e-4, 0.3, 0.04), (-0.02, 3e-4, 0.1, -0.02)):
        starboard = yaw_acceleration_rate(TABLE1, w, w_dot, 7.0, 60.0, delta, delta_dot)
        port = yaw_acceleration_rate(TABLE1, -w, -w_dot, 7.0, 60.0, -delta, -delta_dot)
        assert port == -starboard
    assert surge_acceleration(TABLE1, 0.01, 7.0, 60.0) == surge_acceleration(
        TABLE1, -0.01, 7.0, 60.0
    )


@pytest.mark.parametrize("n_dot", [0.0, 0.5])
@pytest.mark.parametrize("v_dot", [0.0, -0.02])
def test_the_rate_of_the_rudder_effect_is_its_derivative(v_dot: float, n_dot: float) -> None:
    v, n, h = 9.0, 80.0, 1e-3
    ahead = rudder_effect(TABLE1, v + v_dot * h, n + n_dot * h)
    behind = rudder_effect(TABLE1, v - v_dot * h, n - n_dot * h)
    rate = rudder_effect_rate(TABLE1, v, v_dot, n, n_dot)
    assert rate == pytest.approx((ahead - behind) / (2 * h), rel=1e-8, abs=1e-12)


@pytest.mark.parametrize(
    ("rpm", "speed"),
    [
        (20, 5.164),
        (40, 7.303),
        (60, 8.944),
        (80, 10.328),
        (100, 11.547),
        (120, 12.649),
        (150, 14.142),
    ],
)
def test_a_straight_run_settles_at_the_published_speed(rpm: float, speed: float) -> None:
    assert steady_speed(TABLE1, rpm) == pytest.approx(speed, abs=5e-4)
    assert surge_acceleration(TABLE1, 0.0, steady_speed(TABLE1, rpm), rpm) == pytest.approx(
        0, abs=1e-17
    )


def test_a_ship_stopped_or_astern_has_no_steady_speed_ahead() -> None:
    assert steady_speed(TABLE1, 0.0) == 0
    assert steady_speed(TABLE1, -40.0) == 0
    assert steady_speed(TABLE1._replace(g=0.0), 40.0) == 0


def test_a_moment_and_a_force_add_to_yaw_and_surge_alone() -> None:
    state, calm = State(0.01, 1e-4, 8.0, 0.3, 5.0, 6.0), Forcing(0.2, 0.01, 80.0, 0, 0, 0, 0)
    free = motion(TABLE1, state, calm, 3.0, 0.1)
    pushed = motion(TABLE1, state, calm._replace(moment=2e-5, force=0.03), 3.0, 0.1)
    added = [one - other for one, other in zip(pushed, free, strict=True)]
    assert added == pytest.approx([0, 2e-5, 0.03, 0, 0, 0], abs=1e-15)


def test_a_ship_that_nothing_holds_back_gains_what_the_forces_give() -> None:
    free = Coefficients(*[0.0] * 12)
    pushed = Forcing(0.0, 0.0, 0.0, 2e-5, 0.0, 0.0, 0.03)
    after = step(free, State(0.0, 0.0, 1.0, 0.0, 0.0, 0.0), pushed, 0.0, 2.0)
    assert after.w_dot == pytest.approx(4e-5)
    assert after.w == pytest.approx(4e-5)
    assert after.v == pytest.approx(1.06)


def test_every_coefficient_has_a_unit() -> None:
    assert tuple(COEFFICIENT_UNITS) == Coefficients._fields


def test_importing_shiplog_loads_nothing_heavy() -> None:
    code = (
        "import shiplog, sys;"
        "print(*({'rerun', 'control', 'pandas', 'numba', 'scipy', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def hard_over(t: float, start: float, rate: float) -> float:
    """The rudder on its way to 35°."""
    return min(max(t - start, 0.0) * rate, radians(35))


def stepped(start: float, rate: float) -> np.ndarray:
    """w, w' and v every 0.1 s of 200 s, (2000, 3): a step a sample, whatever the rudder does."""
    state, found = State(0.0, 0.0, steady_speed(TABLE1, 80.0), 0.0, 0.0, 0.0), []
    for k in range(2000):
        delta, after = (hard_over(k * 0.1 + h, start, rate) for h in (0.0, 0.1))
        forcing = Forcing(delta, (after - delta) / 0.1, 80.0, 0.0, 0.0, 0.0, 0.0)
        state = step(TABLE1, state, forcing, 0.0, 0.1)
        found.append(state[:3])
    return np.array(found)


def exact(start: float, rate: float) -> np.ndarray:
    """The same by another integrator, from knot to knot of the rudder."""
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
    # identification, section 3: 4e-11 with knots on the grid, 3e-6 off it, of each state's size
    ("start", "rate_deg", "least", "most"),
    [(10.0, 2.5, 0.0, 5e-11), (10.0, 2.3456, 2.5e-6, 3.5e-6), (10.03, 2.3456, 2.5e-6, 4e-6)],
)
def test_runge_kutta_at_a_tenth_of_a_second_wants_the_rudders_knots_on_its_grid(
    start: float, rate_deg: float, least: float, most: float
) -> None:
    true = exact(start, radians(rate_deg))
    off = np.abs(stepped(start, radians(rate_deg)) - true) / np.abs(true).max(axis=0)
    assert least <= off.max() < most
