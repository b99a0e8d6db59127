"""Tests of the detection of times in a wrong unit."""

import numpy as np
import pytest

from shiplog.checks.consistency.time_findings import time_findings
from shiplog.types import FloatArray

DT = 0.1
TIMES = np.arange(0.0, 300.0, DT)
HEADING = 0.3 * np.sin(TIMES / 30)
TRACK = 9.0 * TIMES, 0.0 * TIMES
NO_TRACK = np.full_like(TIMES, np.nan), np.full_like(TIMES, np.nan)
SPEED = np.full_like(TIMES, 9.0)


def texts(factor: float, track: tuple[FloatArray, FloatArray], speed: FloatArray) -> list[str]:
    """Return the findings of a log whose times are wrong by a factor."""
    found = time_findings(DT * factor, factor * HEADING, HEADING, speed, track)
    return [finding.text for finding in found]


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1e3, "ms read as s"), (1e-3, "s read as ms"), (1 / 60, "min read as s"), (3600.0, "as h")],
)
def test_times_in_a_wrong_unit_are_reported(factor: float, unit: str) -> None:
    (text,) = texts(factor, TRACK, SPEED)
    assert unit in text
    assert "\n" not in text


def test_right_times_are_not_reported() -> None:
    assert texts(1.0, TRACK, SPEED) == texts(1.0, NO_TRACK, SPEED) == []


def test_a_yaw_rate_in_deg_min_is_not_taken_for_wrong_times() -> None:
    found = time_findings(DT, 60 * HEADING, HEADING, SPEED, TRACK)
    assert list(found) == []
    assert list(time_findings(DT, 60 * HEADING, HEADING, SPEED, NO_TRACK)) == []


def test_without_fixes_a_factor_that_no_unit_of_the_yaw_rate_explains_is_reported() -> None:
    (text,) = texts(1e3, NO_TRACK, SPEED)
    assert "ms read as s" in text


DAY = np.arange(0.0, 86400.0, 2.0)
BIASED = np.radians(0.05) * DAY


@pytest.mark.parametrize("great_circle_deg", [0.0, 4.0])
def test_a_biased_yaw_rate_on_a_straight_passage_is_not_taken_for_wrong_times(
    great_circle_deg: float,
) -> None:
    rng = np.random.default_rng(0)
    heading = np.radians(4.0) * rng.uniform(-0.5, 0.5, len(DAY))
    heading += np.radians(great_circle_deg) * DAY / DAY[-1]
    speed, unknown = np.full_like(DAY, 9.0), np.full_like(DAY, np.nan)
    for track in ((9.0 * DAY, 0 * DAY), (unknown, unknown)):
        assert list(time_findings(2.0, BIASED, heading, speed, track)) == []


def test_fixes_that_contradict_wrong_times_are_not_ignored() -> None:
    assert list(time_findings(DT, 1e3 * HEADING, HEADING, SPEED, TRACK)) == []


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-7, 1e-6, 1e-5])
@pytest.mark.parametrize("bias", [0.0, 1e-9, 1e-8])
def test_a_dead_or_stuck_yaw_rate_is_no_sign_of_wrong_times(
    seed: int, noise: float, bias: float
) -> None:
    rate = bias + noise * np.random.default_rng(seed).normal(size=len(TIMES))
    turned = np.cumsum(rate) * DT
    for track in (TRACK, NO_TRACK):
        assert list(time_findings(DT, turned, HEADING, SPEED, track)) == []


def test_a_yaw_rate_that_stuck_after_its_first_turn_is_no_sign_of_wrong_times() -> None:
    turned = 1e-6 * np.where(TIMES < 10.0, HEADING, HEADING[100])
    assert list(time_findings(DT, turned, HEADING, SPEED, NO_TRACK)) == []


def test_wrong_times_are_reported_for_a_reversed_yaw_rate_too() -> None:
    found = list(time_findings(DT * 1e-6, -1e-6 * HEADING, HEADING, SPEED, NO_TRACK))
    assert "s read as us" in found[0].text
