"""Manoeuvres of a log found chunk by chunk."""

import numpy as np
import pytest
from channels import channel
from places import SAMPLE_DATA
from trial_logs import InChunks

import shiplog
from analysis.trial.log_manoeuvres import find_log_manoeuvres
from shiplog.errors import LogError
from shiplog.types import TrialLog


def test_chunks_change_nothing() -> None:
    log = shiplog.read(SAMPLE_DATA / "zigzag_10_10_dropouts.mcap")
    whole, parts = find_log_manoeuvres(log), find_log_manoeuvres(InChunks(log, [1.05, 17.0, 300.0]))
    assert whole.spans == parts.spans
    assert whole.spans[0].title == "zig-zag 10°/10°, first to starboard"
    for name, values in whole.signals.values().items():
        np.testing.assert_array_equal(values, parts.signals.values()[name])


def test_times_count_from_the_first_instant_of_steering_or_motion() -> None:
    log = shiplog.read(SAMPLE_DATA / "turning_circle_35.mcap")
    found = find_log_manoeuvres(log)
    assert found.start_ns == log.span_ns[0]
    assert found.spans[0].execute_secs == pytest.approx(10.0, abs=0.1)
    assert found.spans[0].later(5.0).execute_secs == found.spans[0].execute_secs + 5.0


def test_a_log_without_steering_and_motion_has_none_to_be_found() -> None:
    times = np.arange(0.0, 100.0)
    with pytest.raises(LogError, match="no manoeuvre can be found"):
        find_log_manoeuvres(TrialLog("a", (channel(times, times, "heel"),)))
