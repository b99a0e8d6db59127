"""Delays of sensors: estimated where the log shows them, refused where it does not."""

import pickle
from collections.abc import Mapping
from dataclasses import replace
from math import radians

import numpy as np
import pytest
from trial_logs import InChunks, as_log

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, TrialLog, Vessel
from shiplog.errors import UsageError
from shiplog.screening import ScreenedLog, StatedDelays, screen_log, screen_without_delays
from shiplog.types import Log

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
SENSORS = {"heading.white": radians(0.1), "position.white": 0.5, "speed.uniform": 0.05}


def late(log: TrialLog, delays: Mapping[str, float]) -> TrialLog:
    """Return the log with the times of some channels later than those of the motion."""
    shifts = {name: round(secs * 1e9) for name, secs in delays.items()}
    return replace(
        log,
        channels=tuple(
            replace(
                c,
                measured_ns=c.measured_ns + shifts.get(c.name, 0),
                received_ns=c.received_ns + shifts.get(c.name, 0),
            )
            for c in log.channels
        ),
    )


def screened(log: Log, delays: StatedDelays) -> ScreenedLog:
    def screen(recorded: Log) -> ScreenedLog:
        return screen_log(recorded, NAMES, ("heading", "position"), purpose="a test")

    return screen_without_delays(log, delays, screen)


@pytest.fixture(scope="module")
def trial(vessel: Vessel) -> TrialLog:
    sensors = suite("paper", SENSORS)
    return as_log(simulate(vessel, "zigzag-20-20", duration_secs=900.0, seed=4, sensors=sensors))


def test_delays_of_heading_and_speed_are_estimated_within_their_errors(trial: TrialLog) -> None:
    found = screened(late(trial, {"heading": 1.2, "speed": 2.5}), "auto")
    delays = {each.name: each for each in found.screening.delays}
    assert set(delays) == {"heading", "speed"}
    for name, truth, most in (("heading", 1.2, 0.1), ("speed", 2.5, 0.5)):
        error = delays[name].error_secs
        assert error is not None
        assert 0 < error < most
        assert abs(delays[name].secs - truth) < 2 * error
    assert any(
        text.startswith("heading: its times are 1.2") and "(standard error) earlier" in text
        for text in found.warnings
    )


@pytest.mark.parametrize("name", ["yaw_rate", "position"])
def test_of_two_channels_the_later_one_is_corrected(trial: TrialLog, name: str) -> None:
    (delay,) = screened(late(trial, {name: 2.5}), "auto").screening.delays
    assert delay.name == name
    assert delay.secs == pytest.approx(2.5, abs=0.4)
    assert delay.reference == {"yaw_rate": "heading", "position": "speed"}[name]


def test_channels_without_delay_keep_their_times(trial: TrialLog) -> None:
    found = screened(trial, "auto")
    assert found.screening.delays == ()
    assert sum("no certain delay" in text for text in found.warnings) == 2
    for chunk, recorded in zip(found.chunks(), trial.chunks(), strict=True):
        for one, other in zip(chunk, recorded, strict=True):
            assert np.array_equal(one.measured_ns, other.measured_ns)


def test_what_the_log_does_not_show_is_named(trial: TrialLog) -> None:
    without = replace(trial, channels=tuple(c for c in trial if c.name != "position"))
    found = screened(late(without, {"heading": 1.2}), "auto")
    assert [each.name for each in found.screening.delays] == ["heading"]
    assert any(
        text.startswith("speed: its times are as recorded: its delay cannot be estimated")
        for text in found.warnings
    )


def test_a_log_that_shows_no_delay_is_refused_with_the_causes(trial: TrialLog) -> None:
    without = replace(trial, channels=tuple(c for c in trial if c.name in NAMES))
    with pytest.raises(LogError, match=r"can be estimated from .* the heading cannot be"):
        screened(without, "auto")


def test_a_straight_course_shows_no_delay(vessel: Vessel) -> None:
    straight = simulate(
        vessel, "zigzag-20-20", duration_secs=20.0, seed=1, sensors=suite("white", SENSORS)
    )
    with pytest.raises(LogError, match="no sensor delay can be estimated"):
        screened(as_log(straight), "auto")


def test_fixes_with_much_noise_give_too_large_a_standard_error_of_the_speed(vessel: Vessel) -> None:
    sensors = suite("paper", SENSORS | {"position.white": 3.0})
    noisy = as_log(simulate(vessel, "zigzag-20-20", duration_secs=600.0, seed=1, sensors=sensors))
    found = screened(late(noisy, {"speed": 2.0}), "auto")
    assert found.screening.delays == ()
    assert any("speed" in text and "has a standard error of" in text for text in found.warnings)


def test_stated_delays_shift_times_and_nothing_else(trial: TrialLog) -> None:
    found = screened(trial, {"heading": 1.2, "rudder": 0.25})
    (chunk,) = found.chunks()
    for one, other in zip(chunk, trial, strict=True):
        shift = {"heading": 1_200_000_000, "rudder": 250_000_000}.get(one.name, 0)
        assert np.array_equal(one.measured_ns, other.measured_ns - shift)
        assert np.array_equal(one.received_ns, other.received_ns)
        assert np.array_equal(one.values, other.values)
    assert found.warnings[0] == "heading: its times are 1.2 s earlier than recorded, as stated"
    assert (
        found.screening.stats["rudder"].span_ns[0] == trial["rudder"].measured_ns[0] - 250_000_000
    )


@pytest.mark.parametrize("secs", [0.0, -1.0, 61.0, float("nan"), float("inf")])
def test_a_delay_that_no_sensor_has_is_refused(trial: TrialLog, secs: float) -> None:
    with pytest.raises(UsageError, match="more than 0 and at most 60 s"):
        screened(trial, {"heading": secs})


def test_a_delay_of_a_channel_that_is_not_there_is_refused(trial: TrialLog) -> None:
    with pytest.raises(LogError, match=r"no channel 'headin', .*did you mean 'heading'"):
        screened(trial, {"headin": 1.0})


def test_a_derived_yaw_rate_shows_no_delay_of_the_heading(trial: TrialLog) -> None:
    without = replace(
        trial, channels=tuple(c for c in trial if c.name not in ("yaw_rate", "position"))
    )

    def screen(recorded: Log) -> ScreenedLog:
        return screen_log(recorded, NAMES, ("heading",), purpose="a test", derive=["yaw_rate"])

    with pytest.raises(LogError, match="no sensor delay can be estimated"):
        screen_without_delays(without, "auto", screen)


def test_where_the_chunks_are_cut_changes_no_delay_and_a_pickled_screening_applies_it(
    trial: TrialLog,
) -> None:
    log = late(trial, {"heading": 1.2})
    whole, cut = screened(log, "auto"), screened(InChunks(log, [33.3, 34.0, 250.7]), "auto")
    assert whole.screening.delays == cut.screening.delays
    again = ScreenedLog(log, pickle.loads(pickle.dumps(whole.screening)))  # noqa: S301 - our own
    (chunk,), (expected,) = again.chunks(), whole.chunks()
    for one, other in zip(chunk, expected, strict=True):
        assert np.array_equal(one.measured_ns, other.measured_ns)
