"""The reference ships of the examples: their equations agree with what others published of them."""

from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq
from ships import container_ship, esso_tanker
from ships.sea_trial import GOOD, SHIPS, Steering, TrialShip, as_log, sail
from ships.true_indices import circle_indices, turn_from_execute, zigzag_indices

CONTAINER, TANKER = SHIPS[3:]
STEP = 1e-6  # relative, of the differences


def straight(ship: TrialShip, speed: float, rpm: float) -> NDArray[np.float64]:
    motion = np.array([speed, 0.0, 0.0, *ship.further])
    if ship.shaft is not None:
        motion[ship.shaft] = rpm
    return motion


def steady_speed(ship: TrialShip, rpm: float) -> float:
    return float(brentq(lambda u: ship.rates(tuple(straight(ship, u, rpm)), 0.0, rpm)[0], 1, 15))


def slopes(
    ship: TrialShip, motion: NDArray[np.float64], rpm: float, at: int
) -> NDArray[np.float64]:
    """Differentiate the rates by a state, or by the rudder where `at` is -1."""
    step = np.zeros(len(motion))
    if at >= 0:
        step[at] = STEP
    rudder = STEP if at == -1 else 0.0
    after = np.array(ship.rates(tuple(motion + step), rudder, rpm))
    before = np.array(ship.rates(tuple(motion - step), -rudder, rpm))
    return (after - before) / (2 * STEP)


def test_the_container_ship_keeps_the_speed_published_for_its_revolutions() -> None:
    # Fossen's examples of rudder roll damping: 7.3 m/s at 70 revolutions per minute
    assert steady_speed(CONTAINER, 70.0) == pytest.approx(7.3, rel=0.01)
    assert pytest.approx(steady_speed(CONTAINER, 70.0), rel=1e-3) == CONTAINER.speed


def test_the_container_ship_linearised_is_the_published_linear_model() -> None:
    """Fossen 2011, appendix E: sway, yaw and roll at 7 m/s, nondimensional."""
    length, speed = container_ship.LENGTH, 7.0
    rpm = float(
        brentq(
            lambda n: CONTAINER.rates(tuple(straight(CONTAINER, speed, n)), 0.0, n)[0], 40.0, 100.0
        )
    )
    motion = straight(CONTAINER, speed, rpm)
    scale = np.array([length / speed**2, (length / speed) ** 2, (length / speed) ** 2])

    def forces(at: int, unit: float) -> NDArray[np.float64]:
        accelerations = slopes(CONTAINER, motion, rpm, at)[1:4]
        return container_ship.MASS_MATRIX @ (scale * accelerations) * unit

    mass = [[0.01497, 0.0003525, -0.0002205], [0.0003525, 0.000875, 0], [-0.0002205, 0, 0.000021]]
    damping = [
        [0.012035, 0.00522, 0], [0.0038436, 0.00243, -0.000213], [-0.000314, 0.0000692, 0.0000075],
    ]  # fmt: skip
    np.testing.assert_allclose(container_ship.MASS_MATRIX, mass, rtol=1e-3)
    units = (speed, speed / length, speed / length)
    ours = np.column_stack([-forces(at, unit) for at, unit in zip((1, 2, 3), units, strict=True)])
    # the flow at the rudder depends on revolutions that are not published
    np.testing.assert_allclose(ours, damping, rtol=0.05, atol=1e-8)
    assert -forces(4, 1.0)[2] == pytest.approx(0.0004966, rel=1e-3)  # stiffness in roll
    rudder = np.array([-0.002578, 0.00126, 0.0000855])
    ratios = forces(-1, 1.0) / rudder
    assert ratios == pytest.approx(ratios[0], rel=0.02)  # one flow for force and moments
    assert ratios == pytest.approx(1.0, abs=0.2)


def test_the_container_ship_heels_outwards_and_turns_alike_to_both_sides() -> None:
    motion, mirrored = (
        tuple(straight(CONTAINER, 7.33, 70.0)),
        tuple(straight(CONTAINER, 7.33, 70.0)),
    )
    for _ in range(1200):
        for angle in (0.3, -0.3):
            start = motion if angle > 0 else mirrored
            rates = CONTAINER.rates(start, angle, 70.0)
            moved = tuple(m + 0.1 * rate for m, rate in zip(start, rates, strict=True))
            motion, mirrored = (moved, mirrored) if angle > 0 else (motion, moved)
    assert motion[2] > 0  # to starboard
    assert -20.0 < degrees(motion[4]) < -2.0  # to port
    for i, sign in enumerate((1, -1, -1, -1, -1, 1)):
        assert mirrored[i] == pytest.approx(sign * motion[i])


def test_the_shaft_follows_an_order_with_a_lag() -> None:
    slowed = sail(CONTAINER, lambda *_: 0.0, 30.0, revolutions=lambda _: 60.0)
    assert slowed.rpm[0] == pytest.approx(70.0)
    assert np.all(np.diff(slowed.rpm) < 0)
    lag = 5.65 / (65.0 / 60.0)  # s, in the middle of the change
    middle = float(np.interp(-65.0, -slowed.rpm, slowed.time))
    assert middle == pytest.approx(lag * np.log(2), rel=0.05)


def test_the_tanker_keeps_its_design_speed_at_its_design_revolutions() -> None:
    assert steady_speed(TANKER, 80.0) == pytest.approx(8.23, rel=2e-3)  # 16 knots


def test_the_tanker_is_unstable_on_a_straight_course_as_full_tankers_are() -> None:
    motion = straight(TANKER, esso_tanker.SPEED, 80.0)
    matrix = np.column_stack([slopes(TANKER, motion, 80.0, at)[1:3] for at in (1, 2)])
    rudder = slopes(TANKER, motion, 80.0, -1)[1:3]
    gain = -np.linalg.solve(matrix, rudder)[1]
    times = sorted(-1.0 / np.linalg.eigvals(matrix).real)
    zero = rudder[1] / (matrix[1, 0] * rudder[0] - matrix[0, 0] * rudder[1])
    assert gain < 0
    assert times[0] < 0 < times[1]
    # Fossen 1994: a tanker of 350 m has T2 = 16.4 s and T3 = 46 s at 8.1 m/s
    unit = esso_tanker.LENGTH / esso_tanker.SPEED
    assert times[1] / unit == pytest.approx(16.4 * 8.1 / 350, rel=0.15)
    assert zero / unit == pytest.approx(46.0 * 8.1 / 350, rel=0.15)


@pytest.mark.parametrize("ship", [CONTAINER, TANKER], ids=["container", "tanker"])
def test_a_ship_goes_straight_with_neutral_rudder_and_turns_to_the_side_of_its_rudder(
    ship: TrialShip,
) -> None:
    kept = sail(ship, Steering(ship, 400.0, radians(35)), 400.0)
    assert abs(degrees(kept.yaw_rate[-1])) < 0.002
    assert degrees(abs(kept.heading).max()) < 0.5
    for side in (1, -1):
        turned = sail(ship, Steering(ship, 0.0, side * radians(35)), 200.0)
        assert side * turned.heading[-1] > 1.0
        assert side * turned.track[-1, 1] > 0


def test_a_trial_of_a_ship_without_shaft_dynamics_has_the_revolutions_ordered() -> None:
    ordered = sail(TANKER, lambda *_: 0.0, 5.0, revolutions=lambda time: 80.0 - time)
    np.testing.assert_allclose(ordered.rpm, 80.0 - ordered.time)


def test_a_log_has_sway_where_its_sensors_measure_it() -> None:
    trial = sail(CONTAINER, Steering(CONTAINER, 5.0, radians(35)), 60.0)
    exact = replace(GOOD, sway=0.0)
    log = as_log(trial, exact, np.random.default_rng(0))
    (sway,) = [channel for channel in log if channel.name == "sway"]
    assert sway.values.min() < -0.3  # to port in a turn to starboard
    assert "sway" not in {each.name for each in as_log(trial, GOOD, np.random.default_rng(0))}


def test_the_indices_of_a_uniform_circle_are_those_of_geometry() -> None:
    step, rate, speed = 0.1, 0.02, 5.0
    time = np.arange(0.0, 400.0, step)
    for side in (1.0, -1.0):
        turned = np.maximum(time - 20.0, 0.0) * rate
        heading = 0.3 + side * turned
        radius = speed / rate
        ahead = np.where(time < 20.0, (time - 20.0) * speed, radius * np.sin(turned))
        across = side * radius * (1.0 - np.cos(turned))
        north = ahead * np.cos(0.3) - across * np.sin(0.3)
        east = ahead * np.sin(0.3) + across * np.cos(0.3)
        motion = np.column_stack(
            (np.full_like(time, 4.0), np.full_like(time, 3.0), side * np.full_like(time, rate))
        )
        track = np.column_stack((north, east))
        turn = turn_from_execute(step, 200, side, 0.3, heading, motion, track)
        values = circle_indices(turn)
        assert values["advance"] == pytest.approx(radius, rel=1e-4)
        assert values["transfer"] == pytest.approx(radius, rel=1e-4)
        assert values["tactical diameter"] == pytest.approx(2 * radius, rel=1e-4)
        assert values["time to 180°"] == pytest.approx(np.pi / rate, rel=1e-4)
        assert values["initial turning distance"] == pytest.approx(radius * radians(10), rel=1e-3)
        assert values["steady yaw rate"] == pytest.approx(rate)
        assert values["steady speed"] == pytest.approx(5.0)


def test_what_a_circle_does_not_reach_is_nan() -> None:
    time = np.arange(0.0, 100.0)
    motion = np.tile([5.0, 0.0, 0.02], (100, 1))
    turn = turn_from_execute(1.0, 0, 1.0, 0.0, 0.02 * time, motion, motion[:, :2])
    values = circle_indices(turn)
    assert np.isfinite(values["time to 90°"])
    assert np.isnan([values["time to 180°"], values["tactical diameter"]]).all()


def test_the_overshoots_of_a_heading_in_waves_are_its_amplitude_beyond_the_switch() -> None:
    time = np.arange(0.0, 300.0, 0.1)
    heading = 0.5 * np.sin(time / 20.0)
    motion = np.tile([5.0, 0.0, 0.0], (len(time), 1))
    turn = turn_from_execute(0.1, 0, -1.0, 0.0, -heading, motion, motion[:, :2])
    reversed_at = [round(10 * t) for t in (20 * np.arcsin(0.6), 20 * (np.pi + np.arcsin(0.6)))]
    values = zigzag_indices(turn, 0.3, reversed_at)
    assert values["overshoot 1"] == pytest.approx(0.2, abs=1e-5)
    assert values["overshoot 2"] == pytest.approx(0.2, abs=1e-5)
    assert values["reach"] == pytest.approx(20 * np.pi, abs=0.05)
