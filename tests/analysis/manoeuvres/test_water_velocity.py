"""Current and systematic errors, from turns and straight runs that can be computed by hand."""

from math import radians

import numpy as np
import pytest

from analysis.manoeuvres.found_manoeuvre import FoundManoeuvre
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.trial_signals import TrialSignals
from analysis.manoeuvres.water_velocity import AssumedErrors, corrected_signals, velocity_errors

CURRENT = np.array([0.5, -0.3])


def signals(heading: np.ndarray, speed: float, *, with_log: bool = True) -> TrialSignals:
    """Make signals of a ship that moves along its heading, in a current, every second."""
    steps = speed * np.column_stack((np.cos(heading), np.sin(heading))) + CURRENT
    positions = np.concatenate((np.zeros((1, 2)), np.cumsum((steps[1:] + steps[:-1]) / 2, axis=0)))
    none = np.full(len(heading), np.nan)
    log = np.full(len(heading), speed) if with_log else none
    rate = np.gradient(heading)
    return TrialSignals(1.0, none, heading, rate, log, none, positions, none, none, none)


def test_the_current_is_found_from_a_turn_of_two_circles_without_a_log() -> None:
    heading = 0.02 * np.arange(800.0)
    turn = FoundManoeuvre(ManoeuvreKind.TURNING_CIRCLE, 0, 800, level=0.6)
    found = velocity_errors(signals(heading, 5.0, with_log=False), [turn], AssumedErrors())
    assert found.current == pytest.approx(CURRENT, abs=0.01)
    assert "turn" in found.method


def test_runs_on_reciprocal_courses_give_current_and_errors_of_log_and_compass() -> None:
    true = np.concatenate([np.full(300, angle) for angle in (0.0, np.pi, 1.5, 1.5 + np.pi)])
    measured = signals(true, 6.0)
    biased = corrected_signals(measured, np.array([0.0, 0.0, -0.03, radians(-0.8)]), (0.0, 0.0))
    runs = [FoundManoeuvre(ManoeuvreKind.STRAIGHT, 300 * k + 5, 300 * k + 295) for k in range(4)]
    found = velocity_errors(biased, runs, AssumedErrors())
    north, east, scale, bias = found.mean
    assert (north, east) == pytest.approx(tuple(CURRENT), abs=0.02)
    assert scale == pytest.approx(1 / 0.97 - 1, abs=0.005)
    assert bias == pytest.approx(radians(0.8), abs=radians(0.1))


def test_without_positions_the_current_is_that_assumed() -> None:
    still = signals(np.zeros(300), 5.0)
    lost = TrialSignals(
        1.0, still.rudder, still.heading, still.yaw_rate, still.speed, still.sway,
        np.full((300, 2), np.nan), still.rudder_order, still.rpm, still.power,
    )  # fmt: skip
    found = velocity_errors(lost, [], AssumedErrors(current_std=0.25))
    assert found.method == ""
    assert found.current == pytest.approx((0.0, 0.0))
    assert np.sqrt(np.diag(found.covariance)[:2]) == pytest.approx(0.25)


def test_the_track_is_that_of_the_midship_point() -> None:
    heading = np.full(10, np.pi / 2)
    moved = corrected_signals(signals(heading, 0.0), np.zeros(4), (30.0, 4.0))
    assert moved.positions[0] == pytest.approx((4.0, -30.0))  # heading east: ahead is east
