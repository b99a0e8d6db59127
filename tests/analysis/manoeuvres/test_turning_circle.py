"""Indices of turning circles that can be computed by hand."""

from dataclasses import astuple

import numpy as np
import pytest

from analysis.identification.prediction import dead_reckoning, manoeuvre_motion
from analysis.manoeuvres.turning_circle import TurningCircle, turning_circle


def circle(
    outputs: np.ndarray,
    positions: np.ndarray,
    rudder: np.ndarray,
    dt: float,
    approach: float | None = None,
) -> TurningCircle:
    return turning_circle(manoeuvre_motion(outputs, positions), rudder, dt, approach=approach)


def test_indices_of_an_exact_circle() -> None:
    dt, rate, radius, before = 0.1, 0.01, 500.0, 400.0
    time = np.arange(0, 800, dt)
    heading = 0.3 - rate * np.maximum(time - before / 5.0, 0)
    speed = rate * radius
    outputs = np.column_stack(
        (np.where(heading < 0.3, -rate, 0), np.full(len(time), speed), 0 * time, heading)
    )
    rudder = np.where(time > 50, -0.6, 0.0)
    indices = circle(outputs, dead_reckoning(outputs, dt), rudder, dt)
    assert indices.advance == pytest.approx(before + radius, rel=1e-3)
    assert indices.transfer == pytest.approx(radius, rel=1e-3)
    assert indices.tactical_diameter == pytest.approx(2 * radius, rel=1e-3)
    assert indices.time_90_secs == pytest.approx(80 + np.pi / 2 / rate, abs=0.2)
    assert indices.time_180_secs == pytest.approx(80 + np.pi / rate, abs=0.2)
    assert indices.steady_yaw_rate == pytest.approx(rate)
    assert indices.steady_speed == pytest.approx(speed)


def test_given_approach_heading_replaces_a_noisy_first_sample() -> None:
    time = np.arange(0, 500, 1.0)
    heading = 0.01 * time
    outputs = np.column_stack((0 * time + 0.01, 5 + 0 * time, 0 * time, heading))
    positions, rudder = dead_reckoning(outputs, 1.0), np.full(500, 0.6)
    noisy = outputs.copy()
    noisy[0, 3] += 0.05
    exact = circle(outputs, positions, rudder, 1.0)
    assert astuple(circle(noisy, positions, rudder, 1.0, approach=0.0)) == pytest.approx(
        astuple(exact), nan_ok=True, rel=0.01
    )
    assert circle(noisy, positions, rudder, 1.0).advance > exact.advance + 20


def test_indices_that_are_not_reached_are_nan() -> None:
    time = np.arange(0, 100, 1.0)
    outputs = np.column_stack((0.02 + 0 * time, 5 + 0 * time, 0 * time, 0.02 * time))
    indices = circle(outputs, dead_reckoning(outputs, 1.0), np.full(100, 0.6), 1.0)
    assert np.isfinite(indices.advance)
    assert np.isnan(indices.tactical_diameter)
