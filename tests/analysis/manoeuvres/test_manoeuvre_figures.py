"""Time histories of a manoeuvre: where a drift angle from positions is known."""

from dataclasses import replace

import numpy as np
import pytest
from places import SAMPLE_DATA

import shiplog
from analysis import analyse_trial
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreSeries
from shiplog import TrialLog


def series_of(log: TrialLog) -> ManoeuvreSeries:
    return analyse_trial(log).manoeuvres[0].series


@pytest.fixture(scope="module")
def log() -> TrialLog:
    return shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap")


def test_a_drift_angle_ends_before_the_track_and_does_not_jump(log: TrialLog) -> None:
    series = series_of(log)
    known = np.flatnonzero(np.isfinite(series.drift))
    assert series.time_secs[known[0]] > series.time_secs[0] + 5.0
    assert series.time_secs[known[-1]] < series.time_secs[-1] - 5.0
    assert np.isfinite(series.drift[known[0] : known[-1]]).all()
    # a simulated ship without sway: what is drawn is the error of the method
    assert np.degrees(np.nanmax(np.abs(series.drift))) < 0.15


def test_no_drift_angle_is_drawn_after_the_last_fix(log: TrialLog) -> None:
    position = log["position"]
    kept = position.measured_ns < position.measured_ns[0] + 300 * 10**9
    short = replace(
        position,
        measured_ns=position.measured_ns[kept],
        received_ns=position.received_ns[kept],
        values=position.values[kept],
    )
    cut = replace(log, channels=tuple(short if c is position else c for c in log.channels))
    series = series_of(cut)
    last = series.time_secs[np.isfinite(series.drift)][-1]
    assert last < 300.0 - 10.0 - 5.0  # the execute is at 10 s
    assert np.degrees(np.nanmax(np.abs(series.drift))) < 0.15
