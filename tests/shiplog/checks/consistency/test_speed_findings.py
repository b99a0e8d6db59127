"""Tests of the comparison of speed, heading, rpm and fixes on constructed signals."""

from dataclasses import replace

import numpy as np
import pytest

from shiplog.checks.consistency.coarse_record import CoarseSignals
from shiplog.checks.consistency.findings import Finding
from shiplog.checks.consistency.speed_findings import (
    heading_zero_findings,
    range_findings,
    speed_findings,
)
from shiplog.types import FloatArray

DT = 0.1
TIMES = np.arange(0.0, 600.0, DT)
UNKNOWN = np.full_like(TIMES, np.nan)
TOPICS = {name: f"/{name}/a" for name in ("heading", "position", "speed", "rpm")}


def moving(
    speed: float, heading: FloatArray, east_current: float = 0.0, *, speed_factor: float = 1.0
) -> CoarseSignals:
    """Return a log of a ship at constant speed in a current, m/s, with fixes."""
    velocity = speed * np.exp(1j * heading) + 1j * east_current
    track = np.cumsum(velocity) * DT
    return CoarseSignals(
        dt_secs=DT, yaw=UNKNOWN, heading=heading, north=track.real, east=track.imag,
        course=np.unwrap(np.angle(velocity)), speed=np.full_like(TIMES, speed * speed_factor),
        rudder=UNKNOWN, rpm=UNKNOWN, topics=TOPICS, datum=None,
    )  # fmt: skip


def driven(speed: FloatArray, rpm: FloatArray) -> CoarseSignals:
    """Return a log of speed and rpm only."""
    return CoarseSignals(
        dt_secs=DT, yaw=UNKNOWN, heading=UNKNOWN, north=UNKNOWN, east=UNKNOWN, course=UNKNOWN,
        speed=speed, rudder=UNKNOWN, rpm=rpm, topics=TOPICS, datum=None,
    )  # fmt: skip


def advance_findings(speed: FloatArray, rpm: FloatArray) -> list[Finding]:
    return list(range_findings(driven(speed, rpm)))


def test_a_crash_stop_gives_no_finding() -> None:
    rpm = np.where(TIMES < 10.0, 80.0, -60.0)
    for stopping_secs in (150.0, 1200.0):
        speed = 8.0 * np.exp(-np.maximum(TIMES - 10.0, 0.0) / stopping_secs)
        assert advance_findings(speed, rpm) == []
        assert advance_findings(speed[TIMES > 5.0], rpm[TIMES > 5.0]) == []


def test_a_steady_speed_against_the_rpm_is_reported() -> None:
    (finding,) = advance_findings(8.0 + 0.1 * np.sin(TIMES), 0 * TIMES - 80.0)
    assert finding.kind == "sign"


def test_coasting_with_noise_of_the_shaft_gives_no_finding() -> None:
    noise = np.random.default_rng(1).uniform(-0.3, 0.3, len(TIMES))
    for speed in (2.0, 5.0):
        assert advance_findings(speed - 1e-4 * TIMES, noise) == []
        assert advance_findings(speed - 1e-4 * TIMES, noise + np.where(TIMES < 40, 80, 0)) == []


def test_a_wrong_unit_of_the_rpm_is_reported_although_the_ship_also_drifts() -> None:
    rpm = np.where(TIMES < 500.0, 90.0 / 60, 0.0)
    (finding,) = advance_findings(0 * TIMES + 8.0, rpm)
    assert "rev/s read as rpm" in finding.text


def test_a_small_craft_in_tight_circles_gives_no_finding() -> None:
    assert list(speed_findings(moving(8.0, 2 * np.pi * TIMES / 25), None)) == []


def test_a_wrong_unit_of_the_speed_is_reported_between_tight_circles() -> None:
    heading = 2 * np.pi * np.maximum(TIMES - 200.0, 0.0) / 25
    (finding,) = speed_findings(moving(8.0, heading, speed_factor=3.6), None)
    assert "km/h read as m/s" in finding.text


@pytest.mark.parametrize(("speed", "current"), [(0.3, 1.0), (1.5, 2.0), (1.5, -2.0), (3.0, 2.0)])
def test_a_slow_ship_in_a_current_gives_no_finding(speed: float, current: float) -> None:
    for heading in (0.0, np.pi / 2):
        signals = moving(speed, np.full_like(TIMES, heading), current)
        without_speed = replace(signals, speed=UNKNOWN)
        assert list(speed_findings(signals, None)) == []
        assert list(heading_zero_findings(signals, 1, None)) == []
        assert list(heading_zero_findings(without_speed, 1, None)) == []


def test_a_heading_from_east_is_reported_on_a_straight_course() -> None:
    signals = moving(8.0, 0 * TIMES, 2.0)
    for speed in (signals.speed, UNKNOWN):
        east = replace(signals, heading=signals.heading - np.pi / 2, speed=speed)
        (finding,) = heading_zero_findings(east, 1, None)
        assert finding.kind == "sign"
        assert "from east" in finding.text
