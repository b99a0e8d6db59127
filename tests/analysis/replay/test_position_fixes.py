"""Fixes are interpolated at the samples of a run, but not across a gap."""

import numpy as np
from faults import dropout
from trial_logs import as_log

from analysis.identification.runs import run_from_log
from recorders.simulated.simulate import simulate
from shiplog import Vessel


def test_positions_inside_a_gap_are_not_interpolated(vessel: Vessel) -> None:
    trial = as_log(simulate(vessel, "zigzag-20-20", duration_secs=300.0, seed=2), "trial.mcap")
    run = run_from_log(dropout("position", 100.0, 80.0)(trial))
    positions = run.segments[0].fixes
    assert positions is not None
    (segment,) = run.segments
    time = segment.signals.time_secs
    missing = np.isnan(positions).all(axis=1)
    assert missing[(time > 101.5) & (time < 178.5)].all()
    assert not missing[(time > 1.5) & (time < 98.5)].any()
