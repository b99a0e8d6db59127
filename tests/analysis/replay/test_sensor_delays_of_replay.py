"""Delays of sensors corrected before a replay and an identification."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.identification.runs import run_from_log
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.report.replay_json import replay_json
from shiplog import LogError, TrialLog

SHIFT_NS = 300_000_000
STATED = ReadingOptions(sensor_delays={"rudder": 0.3})


@pytest.fixture(scope="module")
def late_rudder(zigzag_log: TrialLog) -> TrialLog:
    """A log whose rudder has times that are 0.3 s late."""
    channels = [
        replace(c, measured_ns=c.measured_ns + SHIFT_NS, received_ns=c.received_ns + SHIFT_NS)
        if c.name == "rudder"
        else c
        for c in zigzag_log
    ]
    return replace(zigzag_log, channels=tuple(channels))


def test_a_replay_with_the_delay_stated_is_the_one_of_the_log_without_it(
    late_rudder: TrialLog, zigzag_log: TrialLog
) -> None:
    found, right = analyse(late_rudder, STATED), analyse(zigzag_log)
    assert np.array_equal(found.signals["rudder"], right.signals["rudder"])
    assert np.array_equal(found.estimates.states, right.estimates.states)
    assert found.findings.yaw.coefficients == right.findings.yaw.coefficients
    delays = replay_json(found.findings)["log"]["sensor_delays"]
    assert delays == {"rudder": {"secs": 0.3, "error_secs": None, "reference": None}}
    assert "rudder: its times are 0.3 s earlier than recorded, as stated" in found.findings.warnings


def test_a_run_of_an_identification_has_the_times_corrected(
    late_rudder: TrialLog, zigzag_log: TrialLog
) -> None:
    found, right = run_from_log(late_rudder, STATED), run_from_log(zigzag_log, ReadingOptions())
    assert np.array_equal(found.segments[0].signals["rudder"], right.segments[0].signals["rudder"])
    assert any("as stated" in text for text in found.warnings)


def test_a_log_without_heading_and_fixes_is_refused(zigzag_log: TrialLog) -> None:
    few = replace(
        zigzag_log, channels=tuple(c for c in zigzag_log if c.name not in ("heading", "position"))
    )
    with pytest.raises(LogError, match="no sensor delay can be estimated"):
        analyse(few, ReadingOptions(sensor_delays="auto"))
