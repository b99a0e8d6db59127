"""Tests of times that were not set: the other time is used, and no sample is lost."""

import numpy as np
import pytest

from shiplog.mcap.clock_repair import MessageColumns
from shiplog.mcap.unset_times import replace_unset_times

SECOND = 1_000_000_000
DATE = 1_700_000_000 * SECOND
CLOCK = np.arange(100) * SECOND


def columns(received: np.ndarray, measured: np.ndarray) -> dict[int, MessageColumns]:
    values = np.zeros((len(received), 1))
    return {1: MessageColumns("/rudder/test", np.arange(len(received)), received, measured, values)}


@pytest.mark.parametrize("start", [DATE, 0, 5 * SECOND])
def test_times_with_dates_or_since_the_start_are_unchanged(start: int) -> None:
    original = columns(start + CLOCK, start + CLOCK)
    result, warnings = replace_unset_times(original)
    assert warnings == []
    assert result[1] is original[1]


@pytest.mark.parametrize("unset", [np.zeros(100, np.int64), CLOCK - 1000 * SECOND])
def test_times_of_measurement_that_were_not_set_are_those_of_reception(unset: np.ndarray) -> None:
    result, (warning,) = replace_unset_times(columns(DATE + CLOCK, unset))
    np.testing.assert_array_equal(result[1].measured_ns, DATE + CLOCK)
    assert "time of measurement of 100 of 100 samples" in warning


def test_times_of_reception_that_were_not_set_are_those_of_measurement() -> None:
    result, (warning,) = replace_unset_times(columns(0 * CLOCK, DATE + CLOCK))
    np.testing.assert_array_equal(result[1].received_ns, DATE + CLOCK)
    assert "time of reception of 100 of 100 samples" in warning


@pytest.mark.parametrize("start_secs", [-1000, -50])
def test_a_log_before_1970_begins_at_zero(start_secs: int) -> None:
    times = CLOCK + start_secs * SECOND
    result, (warning,) = replace_unset_times(columns(times + SECOND, times))
    np.testing.assert_array_equal(result[1].measured_ns, CLOCK)
    np.testing.assert_array_equal(result[1].received_ns, CLOCK + SECOND)
    assert f"from {start_secs:.3f} s on" in warning
