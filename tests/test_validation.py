"""A fit against runs it never saw: tracks that agree, and figures that are right or not there."""

from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from conftest import as_log

from analysis.identify.output_error import OutputError, output_error
from analysis.identify.runs import run_of
from analysis.identify.validation import (
    Figure,
    Validation,
    first_course,
    first_order,
    rms_of,
    validate,
)
from recorders.sensors import suite
from recorders.simulate import simulate
from shiplog import TrialLog, load_vessel
from shiplog.ships import ship_model

VESSEL, TOML = load_vessel("table1")


@cache
def a_log(manoeuvre: str, seconds: float, noise_deg: float = 0.0, seed: int = 0) -> TrialLog:
    sensors = suite("none", {"heading.white": radians(noise_deg)} if noise_deg else None)
    trial = simulate(
        VESSEL, manoeuvre, duration_secs=seconds, seed=seed, sensors=sensors, vessel_toml=TOML
    )
    return as_log(trial, f"{manoeuvre}-{seed}.mcap")


@cache
def the_ship() -> OutputError:
    """The ship that sails, as if an identification had found her to the last digit."""
    (trial,) = run_of(a_log("zigzag-20-20", 300.0)).trials
    return output_error([trial], ship_model("burylin"), known=VESSEL.coefficients._asdict())


def validated(log: TrialLog) -> Validation:
    (found,) = validate(the_ship(), run_of(log))
    return found


def figures(log: TrialLog) -> dict[str, Figure]:
    return {figure.name: figure for figure in validated(log).figures}


def without(log: TrialLog, *names: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name not in names))


def fixes(log: TrialLog, *, after_secs: float = 0.0, course_deg: float = 0.0) -> TrialLog:
    """The log with its fixes from some time on, the whole track turned to a course."""
    position = log["position"]
    c, s = np.cos(radians(course_deg)), np.sin(radians(course_deg))
    turned = replace(position, values=position.values @ np.array([[c, s], [-s, c]]))
    start = int(np.searchsorted(position.measured_ns, position.measured_ns[0] + after_secs * 1e9))
    kept = turned.part(start, len(position))
    return replace(log, channels=tuple(kept if c is position else c for c in log.channels))


CIRCLE_SECS = 500.0
ADVANCE, DIAMETER = 1149.0, 1474.0  # m, of the paper's ship at 35 degrees


def circle(noise_deg: float = 0.0, seed: int = 0) -> TrialLog:
    return a_log("turning-circle-35", CIRCLE_SECS, noise_deg, seed)


# ---- tracks


@pytest.mark.parametrize("course_deg", [0.0, 90.0, -150.0])
def test_the_fixes_give_a_ship_without_heading_her_first_course(course_deg: float) -> None:
    found = validated(without(fixes(circle(), course_deg=course_deg), "heading"))
    assert found.rms["track"] < 5
    told = {figure.name: figure.measured for figure in found.figures}
    assert told["advance"] == pytest.approx(ADVANCE, rel=0.005)
    assert told["tactical diameter"] == pytest.approx(DIAMETER, rel=0.005)


def test_without_heading_fixes_that_tell_no_course_are_left_alone() -> None:
    log = without(fixes(circle(), course_deg=90.0), "heading")
    late = validated(fixes(log, after_secs=30.0))  # the rudder moves at 10 s
    assert late.rms["track"] < 5  # by speed and yaw rate
    (trial,), (places,) = run_of(log).trials, run_of(log).positions
    assert places is not None
    assert first_course(trial, places) == pytest.approx(radians(90), abs=1e-3)
    rough = places + np.random.default_rng(0).normal(0, 20, places.shape)
    assert first_course(trial, rough) is None
    assert first_course(trial, places[::-1] * 0.0) is None


def test_fixes_that_begin_late_are_laid_on_the_track_where_they_begin() -> None:
    found = validated(fixes(a_log("zigzag-20-20", 300.0), after_secs=60.0))
    assert found.rms["track"] < 5
    assert np.isnan(found.measured_track[0]).all()


@pytest.mark.parametrize("after_secs", [5.0, 60.0])
def test_figures_of_a_track_are_right_or_not_there(after_secs: float) -> None:
    whole, late = figures(circle()), figures(fixes(circle(), after_secs=after_secs))
    on_track = {"advance", "transfer", "tactical diameter"}
    expected = set(whole) if after_secs < 10 else set(whole) - on_track
    assert set(late) == expected
    for name in expected:
        assert late[name].measured == pytest.approx(whole[name].measured, rel=1e-3), name


def test_a_run_without_heading_and_position_is_validated_all_the_same() -> None:
    found = validated(without(circle(), "heading", "position"))
    assert "heading" not in found.rms
    told = {figure.name: figure for figure in found.figures}
    assert told["advance"].measured == pytest.approx(ADVANCE, rel=0.02)
    assert abs(told["tactical diameter"].error) < 0.02 * told["tactical diameter"].measured


def test_a_ship_that_runs_away_on_a_held_out_log_is_said() -> None:
    fit = the_ship()
    fast = replace(fit.problem, values=fit.problem.values * -40.0)
    (found,) = validate(replace(fit, problem=fast), run_of(circle()))
    assert found.ran_away
    assert found.figures == ()
    assert np.isfinite(found.measured_track).all()


def test_the_rms_is_of_what_is_known() -> None:
    assert rms_of(np.array([3.0, np.nan, -4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms_of(np.full(3, np.nan)))


# ---- where figures begin


def test_figures_count_from_where_the_rudder_leaves_its_rest() -> None:
    rudder = np.radians(np.interp(np.arange(100.0), [0, 40, 54, 99], [0.1, 0.1, 35, 35]))
    assert first_order(rudder, 1.0) == 40
    assert first_order(np.zeros(100), 1.0) is None
