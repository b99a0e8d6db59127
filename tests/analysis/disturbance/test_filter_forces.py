"""Disturbances as smoothed states of the filter, against the truth of a simulated trial."""

from functools import cache
from math import radians

import numpy as np
import pytest
from trial_logs import as_log

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import Gust
from shiplog import load_vessel

TRANSIENT_SECS = 60.0


@cache
def stepped() -> SimulatedTrial:
    """A yaw moment equivalent to 2 degrees of rudder from 200 s on."""
    vessel, text = load_vessel("table1")
    return simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=600.0,
        seed=1,
        sensors=suite("white"),
        gusts=(Gust(radians(2), 200.0),),
        vessel_toml=text,
    )


@cache
def replayed(*, smooth: bool) -> Analysis:
    settings = {"filter.kind": "extended", "filter.smooth": smooth}
    return analyse(as_log(stepped()), ReadingOptions(), settings=settings)


def error_of_step(result: Analysis) -> float:
    """The rms error of the yaw moment, as a share of the step."""
    secs = result.signals.time_secs
    true = stepped().trajectory.at(secs)["yaw_disturbance"]
    errors = (result.disturbance.yaw - true)[secs > TRANSIENT_SECS]
    return float(np.sqrt(np.mean(errors**2)) / np.abs(true).max())


def test_a_smoothed_step_is_followed_more_than_twice_as_well_as_by_the_observer() -> None:
    assert error_of_step(replayed(smooth=False)) > 0.2
    assert error_of_step(replayed(smooth=True)) < 0.11


def test_the_standard_deviation_is_stated_and_the_summary_has_it() -> None:
    result = replayed(smooth=True)
    summary = result.findings.disturbances["yaw"]
    yaw_stds = result.disturbance.stds[:, 0]
    assert np.all(yaw_stds > 0)
    assert summary.noise_std == pytest.approx(np.sqrt(np.mean(yaw_stds**2)), rel=1e-9)
    assert np.degrees(result.findings.disturbances["rudder"].at_end) > 1.8
    assert replayed(smooth=False).disturbance.stds is None
