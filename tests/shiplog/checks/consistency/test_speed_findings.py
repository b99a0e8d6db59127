"""Tests of the comparison of speed, heading, rpm and fixes on constructed signals."""

import numpy as np

from shiplog.checks.consistency.coarse_record import CoarseSignals
from shiplog.checks.consistency.findings import Finding
from shiplog.checks.consistency.speed_findings import range_findings
from shiplog.types import FloatArray

DT = 0.1
TIMES = np.arange(0.0, 600.0, DT)
UNKNOWN = np.full_like(TIMES, np.nan)
TOPICS = {name: f"/{name}/a" for name in ("heading", "position", "speed", "rpm")}


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
