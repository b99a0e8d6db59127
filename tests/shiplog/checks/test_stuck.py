"""A stuck sensor is recognised by what it missed; a steady ship gives constant values, too."""

import numpy as np
import pytest

from shiplog.checks.stuck import StuckCheck, StuckStats
from shiplog.types import FloatArray

APPROACH_SECS = 60.0
TIMES = np.arange(600.0)
TURNING_SECS = np.maximum(TIMES - APPROACH_SECS, 0.0)
# a smooth start from a straight approach, then a zigzag between 0 and 20 deg
HEADING = np.radians(10 * (1 - np.cos(TURNING_SECS / 20)))


def stuck_of(
    values: FloatArray, chunks: int = 1, interval: float = 1.0, *, circular: bool = True
) -> StuckStats | None:
    check = StuckCheck(circular=circular)
    parts = np.array_split(np.arange(len(values)), chunks)
    for part in parts:
        check.add(interval * part, values[part, None])
    return check.result(interval)


@pytest.mark.parametrize("course", [0.0, 200.0, 355.0])
@pytest.mark.parametrize("digit", [0.0, 0.1])
@pytest.mark.parametrize("hand", [-1, 1])
def test_a_heading_constant_in_a_straight_approach_is_not_stuck(
    course: float, digit: float, hand: int
) -> None:
    degrees = course + hand * np.degrees(HEADING)
    degrees = np.round(degrees / digit) * digit if digit else degrees
    values = np.radians(degrees % 360)
    assert np.all(values[:60] == values[0])
    assert stuck_of(values) is None
    assert stuck_of(values[::-1]) is None


@pytest.mark.parametrize("digit", [0.0, np.radians(0.1)])
@pytest.mark.parametrize("end", [150, 600])
def test_a_heading_that_freezes_in_a_turn_is_stuck(digit: float, end: int) -> None:
    values = np.round(HEADING / digit) * digit if digit else HEADING.copy()
    values[90:end] = values[90]
    found = stuck_of(values)
    assert found is not None
    assert (found.count, found.start_secs, found.duration_secs) == (1, 90.0, end - 91)


def test_a_heading_that_froze_before_the_turn_and_resumes_in_it_is_stuck() -> None:
    values = HEADING.copy()
    values[:100] = values[0]
    found = stuck_of(values)
    assert found is not None
    assert (found.start_secs, found.duration_secs) == (0.0, 99.0)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("where", [slice(0, 50), slice(200, 250), slice(550, 600)])
@pytest.mark.parametrize("digit", [1e-9, 1e-4])
def test_a_noisy_gyro_that_freezes_while_the_ship_goes_straight_is_stuck(
    seed: int, where: slice, digit: float
) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 2e-4, 600)
    values = np.round(noise / digit) * digit
    values[where] = values[where.start]
    found = stuck_of(values, circular=False)
    assert found is not None
    assert found.duration_secs >= 49


def test_where_the_chunks_are_cut_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    values = HEADING + rng.normal(0.0, 1e-3, 600)
    values[200:300] = values[200]
    whole = stuck_of(values)
    assert whole is not None
    for chunks in (2, 7, 600):
        cut = stuck_of(values, chunks)
        assert cut is not None
        assert vars(cut) == vars(whole)
