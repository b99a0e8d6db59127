"""A log is prepared for a fit with the same care as for a replay."""

from dataclasses import replace

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.runs import Run, common_vessel, run_from_log
from analysis.replay.plan import plan_replay
from recorders.simulated.simulate import simulate
from shiplog import LogError, TrialLog, Vessel
from shiplog.vessel.hull import Hull


@pytest.fixture(scope="module")
def trial(vessel: Vessel) -> TrialLog:
    return as_log(simulate(vessel, "zigzag-20-20", duration_secs=300.0, seed=2), "trial.mcap")


def test_good_data_give_no_warning(trial: TrialLog) -> None:
    assert run_from_log(trial).warnings == ()


def test_a_log_is_read_once_more_after_its_statistics_and_its_first_instant(
    trial: TrialLog,
) -> None:
    class Counted(TrialLog):
        passes = 0

        def chunks(self):  # type: ignore[no-untyped-def]  # noqa: ANN202
            Counted.passes += 1
            return super().chunks()

    log = Counted(trial.name, trial.channels, trial.metadata)
    assert run_from_log(log).segments[0].fixes is not None
    assert Counted.passes == 3


@pytest.mark.parametrize("factor", [0.0, 1 / (60 * 1852)])
def test_a_position_that_hardly_moves_is_not_used_and_named(trial: TrialLog, factor: float) -> None:
    channels = [
        replace(c, values=factor * c.values) if c.name == "position" else c for c in trial.channels
    ]
    run = run_from_log(replace(trial, channels=tuple(channels)))
    assert run.segments[0].fixes is None
    assert sum("at one place throughout the log" in text for text in run.warnings) == 1


def test_two_sources_of_sway_are_compared(trial: TrialLog) -> None:
    speed = trial["speed"]
    rng = np.random.default_rng(1)
    right = replace(speed, name="sway", source="dvl", values=0.1 * rng.standard_normal(len(speed)))
    wrong = replace(right, source="old", values=9.0 + right.values)
    run = run_from_log(replace(trial, channels=(*trial.channels, right, wrong)))
    assert any("sway: 2 sources" in warning for warning in run.warnings)


def test_what_a_replay_reports_about_channels_is_reported_here_too(trial: TrialLog) -> None:
    rpm = trial["rpm"]
    late = rpm.take(np.flatnonzero(rpm.measured_ns - rpm.measured_ns[0] > 60e9))
    log = replace(trial, channels=tuple(late if c.name == "rpm" else c for c in trial.channels))
    (of_replay,) = [w for w in plan_replay(log).warnings if w.startswith("rpm: starts")]
    assert any(of_replay in warning for warning in run_from_log(log).warnings)


def test_contradictions_are_kept_to_explain_an_error_of_the_fit(trial: TrialLog) -> None:
    reversed_rate = replace(trial["yaw_rate"], values=-trial["yaw_rate"].values)
    channels = tuple(reversed_rate if c.name == "yaw_rate" else c for c in trial.channels)
    (contradiction, *_) = run_from_log(replace(trial, channels=channels)).contradictions
    assert "yaw_rate" in contradiction


def run_of(name: str, vessel: Vessel) -> Run:
    return Run(name, (), vessel, (), data_lost=False)


def test_a_hull_that_one_log_states_holds_for_all(vessel: Vessel) -> None:
    stated = replace(vessel, hull=Hull(breadth=32.0))
    runs = [run_of("a", vessel), run_of("b", stated), run_of("c", stated)]
    assert common_vessel(runs, None) == stated
    assert common_vessel(runs, vessel) == vessel


def test_logs_of_two_loadings_are_refused(vessel: Vessel) -> None:
    runs = [
        run_of(name, replace(vessel, hull=Hull(draught=draught)))
        for name, draught in (("laden", 10.0), ("ballast", 6.0))
    ]
    with pytest.raises(LogError, match=r"\[hull\] of ballast differs from that of laden"):
        common_vessel(runs, None)
