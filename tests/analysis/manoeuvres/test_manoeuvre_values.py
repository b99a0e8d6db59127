"""Quantities that the indices are computed from, on motions that can be computed by hand."""

import numpy as np
import pytest

from analysis.manoeuvres.manoeuvre_values import with_sway
from analysis.manoeuvres.trial_signals import TrialSignals

RATE, SPEED, DRIFT = 0.01, 5.0, 0.1  # rad/s, m/s, rad


def test_the_drift_of_a_steady_turn_is_constant_up_to_the_ends_of_the_log() -> None:
    heading = RATE * np.arange(0.0, 100.0, 0.5)
    course = heading - DRIFT  # the bow points into a turn to starboard
    positions = SPEED / RATE * np.column_stack((np.sin(course), -np.cos(course)))
    none, speed = np.full(len(heading), np.nan), np.full(len(heading), SPEED * np.cos(DRIFT))
    turn = TrialSignals(0.5, none, heading, none, speed, none, positions, none, none, none)
    drift = -np.arctan2(with_sway(turn).sway, speed)
    assert drift == pytest.approx(DRIFT, abs=1e-3)
