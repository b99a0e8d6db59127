"""Tests of steps of a sensor's clock, against the times of reception."""

import re

import numpy as np
import pytest

from shiplog.mcap.sensor_clocks import without_steps

SECOND = 1_000_000_000


def clocks(seed: int = 0, count: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Return the times of measurement and reception of a channel at 2 Hz with a lag of 50 ms."""
    rng = np.random.default_rng(seed)
    measured = np.arange(count) * SECOND // 2
    return measured, measured + 50_000_000 + rng.integers(0, 20_000_000, count)


@pytest.mark.parametrize("size", [-3600.0, -40.0, -5.0, 5.0, 40.0, 3600.0])
def test_a_sensor_clock_that_is_set_once_is_repaired(size: float) -> None:
    measured, received = clocks()
    stepped = measured + np.where(np.arange(600) >= 400, round(size * SECOND), 0)
    times, (warning,) = without_steps("/rudder/test", stepped, received)
    assert np.abs(times - measured).max() < 0.02 * SECOND
    stated = re.search(r"set (back|forward) by (\S+) s", warning)
    assert stated
    assert stated[1] == ("back" if size < 0 else "forward")
    assert float(stated[2]) == pytest.approx(abs(size), abs=0.01)
    assert "200.0 s after its start" in warning
    assert "later times were shifted" in warning


def test_a_sensor_clock_that_was_set_right_shifts_the_times_before() -> None:
    measured, received = clocks()
    stepped = measured - np.where(np.arange(600) < 400, 3600 * SECOND, 0)
    times, (warning,) = without_steps("/rudder/test", stepped, received)
    assert np.abs(times - measured).max() < 0.02 * SECOND
    assert "earlier times were shifted" in warning


@pytest.mark.parametrize("size", [-40, 40, 3600])
def test_a_sensor_clock_that_is_set_and_returned_is_repaired(size: int) -> None:
    measured, received = clocks()
    rows = np.arange(600)
    stepped = measured + np.where((rows >= 200) & (rows < 300), size * SECOND, 0)
    times, warnings = without_steps("/rudder/test", stepped, received)
    assert np.abs(times - measured).max() < 0.02 * SECOND
    assert len(warnings) == 2


def test_a_block_of_late_data_and_a_logger_that_repeats_values_are_no_steps() -> None:
    measured, received = clocks()
    late = np.concatenate([measured[:100], measured[160:300], measured[100:160], measured[300:]])
    held = measured[np.arange(600) // 40 * 40]
    for times in (late, held):
        unchanged, warnings = without_steps("/rudder/test", times, received)
        assert warnings == []
        np.testing.assert_array_equal(unchanged, times)


def test_a_pause_and_a_stalled_reception_are_no_steps() -> None:
    measured, received = clocks()
    gap = np.where(np.arange(600) >= 300, 60 * SECOND, 0)
    stalled = received.copy()
    stalled[200:260] = received[260]
    for times, of_reception in ((measured + gap, received + gap), (measured, stalled)):
        assert without_steps("/rudder/test", times, of_reception)[1] == []


def test_times_of_reception_that_are_not_steady_show_no_step_forward() -> None:
    measured = 10**9 * np.array([0, 0, 170, 3053, 3053, 3054])
    received = 10**9 * np.array([0, 0, 1, 1, 2551, 2665])
    times, warnings = without_steps("/vibration", measured, received)
    assert np.array_equal(times, measured)
    assert warnings == []


def test_a_few_times_of_reception_show_no_step_forward() -> None:
    measured = 10**9 * np.array([0, 0, 0, 0, 0, 0, 2568, 2675, 2825])
    received = 10**9 * np.array([571, 973, 973, 973, 973, 973, 973, 973, 1172])
    times, warnings = without_steps("/vibration", measured, received)
    assert np.array_equal(times, measured)
    assert warnings == []
