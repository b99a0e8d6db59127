"""Disturbances as smoothed states of the filter, against the truth of a simulated trial."""

from functools import cache
from math import pi, radians

import numpy as np
import pytest
from trial_logs import as_log

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_json import replay_json
from analysis.report.replay_tables import replay_markdown
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import Gust, WaveMoment
from shiplog import load_vessel

TRANSIENT_SECS = 60.0


STEP = (Gust(radians(2), 200.0),)
RAMP = tuple(Gust(radians(0.01), float(at)) for at in range(150, 600, 2))
WAVE = WaveMoment(radians(60), 10.0)


@cache
def disturbed(gusts: tuple[Gust, ...], wave: WaveMoment | None = None) -> SimulatedTrial:
    """A zig-zag with a yaw moment, stated as the equivalent rudder."""
    vessel, text = load_vessel("table1")
    return simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=600.0,
        seed=1,
        sensors=suite("white"),
        gusts=gusts,
        wave=wave,
        vessel_toml=text,
    )


@cache
def replayed(trial: SimulatedTrial, *models: str, smooth: bool) -> Analysis:
    settings = {
        "filter.kind": "extended", "filter.smooth": smooth, "disturbance.models": list(models),
        "disturbance.wave_frequency": 2 * pi / WAVE.period_secs if "wave" in models else None,
    }  # fmt: skip
    settings = {name: value for name, value in settings.items() if value is not None}
    return analyse(as_log(trial), ReadingOptions(), settings=settings)


def share_of_error(found: np.ndarray, result: Analysis, trial: SimulatedTrial) -> float:
    """The rms error of a yaw moment, as a share of the largest true one."""
    secs = result.signals.time_secs
    true = trial.trajectory.at(secs)["yaw_disturbance"]
    errors = (found - true)[secs > TRANSIENT_SECS]
    return float(np.sqrt(np.mean(errors**2)) / np.abs(true).max())


def error_of_step(result: Analysis) -> float:
    return share_of_error(result.disturbance.yaw, result, disturbed(STEP))


def test_a_smoothed_step_is_followed_more_than_twice_as_well_as_by_the_observer() -> None:
    assert error_of_step(replayed(disturbed(STEP), "constant", smooth=False)) > 0.2
    assert error_of_step(replayed(disturbed(STEP), "constant", smooth=True)) < 0.11


def test_the_standard_deviation_is_stated_and_the_summary_has_it() -> None:
    result = replayed(disturbed(STEP), "constant", smooth=True)
    summary = result.findings.disturbances["yaw"]
    yaw_stds = result.disturbance.stds[:, 0]
    assert np.all(yaw_stds > 0)
    assert summary.noise_std == pytest.approx(np.sqrt(np.mean(yaw_stds**2)), rel=1e-9)
    assert np.degrees(result.findings.disturbances["rudder"].at_end) > 1.8
    assert replayed(disturbed(STEP), "constant", smooth=False).disturbance.stds is None


def test_a_smoothed_ramp_is_followed_more_than_four_times_as_well_as_by_the_observer() -> None:
    trial = disturbed(RAMP)
    causal, smoothed = (
        share_of_error(result.disturbance.yaw, result, trial)
        for result in (replayed(trial, "ramp", smooth=smooth) for smooth in (False, True))
    )
    assert causal > 0.04
    assert smoothed < 0.01


def test_a_smoothed_wave_moment_is_followed_better_than_by_the_observer() -> None:
    trial, models = disturbed((), WAVE), ("constant", "wave")
    causal, smoothed = (
        share_of_error(result.disturbance.yaw + result.disturbance.yaw_wave, result, trial)
        for result in (replayed(trial, *models, smooth=smooth) for smooth in (False, True))
    )
    assert causal > 0.13
    assert smoothed < 0.11


def test_a_log_without_a_disturbance_has_none_and_the_remark_states_why() -> None:
    result = replayed(disturbed(()), "constant", smooth=True)
    assert not result.disturbance.yaw.any()
    assert not result.disturbance.surge.any()
    assert np.isnan(result.disturbance.stds).all()
    assert np.isnan(result.findings.disturbances["rudder"].noise_std)
    page = replay_markdown(result.findings)
    assert "yaw: no slow disturbance; Akaike's criterion" in page
    absent = replay_json(result.findings)["absent_disturbances"]
    assert set(absent) == {"yaw", "surge"}
    assert min(each["aic_reduction"] for each in absent.values()) > 0
