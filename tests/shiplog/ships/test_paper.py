import subprocess
import sys
from math import pi, radians

import pytest

from shiplog import load_vessel
from shiplog.ships.paper import (
    COEFFICIENT_UNITS,
    Coefficients,
    rudder_effect,
    rudder_effect_rate,
    steady_speed,
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
def test_the_rate_of_the_rudder_effectiveness_is_its_derivative(v_dot: float, n_dot: float) -> None:
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


def test_every_coefficient_has_a_unit() -> None:
    assert tuple(COEFFICIENT_UNITS) == Coefficients._fields


def test_importing_shiplog_loads_nothing_heavy() -> None:
    code = (
        "import shiplog, sys;"
        "print(*({'rerun', 'control', 'pandas', 'numba', 'scipy', 'rich'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
