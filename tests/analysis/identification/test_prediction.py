"""Predictions of runs never seen: on the tanker KVLCC2, and on circles that can be computed."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from places import KVLCC2, PROJECT
from trial_logs import as_log

from analysis.identification.model_selection import rank_models
from analysis.identification.output_error import OutputError, output_error
from analysis.identification.prediction import (
    dead_reckoning,
    misfit,
    predict,
    turn,
    zigzag_overshoots,
)
from analysis.identification.segment import Segment, split_into_segments
from analysis.identification.uncertainty import uncertainty
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, UsageError, load_vessel, resample
from shiplog.ships import ship_model
from shiplog.tables.foreign import read_table
from shiplog.tables.layout import load_layout

LENGTH = 320.0
CHANNELS, OPTIONAL = ("yaw_rate", "speed", "rudder", "rpm"), ("sway", "heading")


@cache
def recorded(path: Path) -> tuple[TrialLog, Segment]:
    if not path.is_file():
        pytest.skip(f"the real recordings are not here: {path}")
    layout = load_layout(PROJECT / "sample_data" / "layouts" / f"simman_{path.parent.name}.toml")
    log = read_table(path, layout)
    return log, split_into_segments(resample(log, 1.0, CHANNELS, OPTIONAL), path.name)[0]


def marin(run: str) -> tuple[TrialLog, Segment]:
    return recorded(KVLCC2 / "marin" / f"MARIN_FREE_KVLCC2_{run}_m.dat")


def hsva() -> list[Segment]:
    runs = ("10_05", "10_10_P", "20_05", "20_10_S", "30_05", "35_05")
    return [recorded(KVLCC2 / "hsva" / f"HSVA_CPMC_KVLCC2_Z_{run}.dat")[1] for run in runs]


def off_the_circle(fit: OutputError) -> dict[str, float]:
    """By how many per cent the 35 degree circle is predicted wrongly."""
    log, trial = marin("tc_35")
    position = log["position"]
    at = (position.measured_ns - trial.signals.start_ns) * 1e-9
    there = [np.interp(trial.signals.time_secs, at, column) for column in position.values.T]
    rudder = trial.signals["rudder"]
    measured = turn(trial.measured, np.column_stack(there), rudder, trial.dt_secs)
    assert measured.advance / LENGTH == pytest.approx(3.122, abs=0.005)
    assert measured.tactical_diameter / LENGTH == pytest.approx(3.067, abs=0.005)
    assert measured.time_90_secs == pytest.approx(169.3, abs=0.5)
    outputs = predict(fit, trial)
    said = turn(outputs, dead_reckoning(outputs, trial.dt_secs), rudder, trial.dt_secs)
    return {
        name: 100 * (getattr(said, name) / getattr(measured, name) - 1)
        for name in measured.__dataclass_fields__
    }


def test_the_tankers_circle_is_predicted_from_marins_zigzags() -> None:
    segments = [marin("zz_10")[1], marin("zz_20")[1]]
    off = off_the_circle(output_error(segments, ship_model("three-dof"), length=LENGTH))
    assert abs(off["advance"]) < 3
    assert abs(off["transfer"]) < 10
    assert abs(off["tactical_diameter"]) < 5
    assert abs(off["time_90_secs"]) < 4
    # the balance of thrust and drag in the circle is near-singular: not yet what was asked for
    assert abs(off["steady_yaw_rate"]) < 16
    assert abs(off["steady_speed"]) < 22


def test_the_tankers_circle_is_predicted_from_hsvas_zigzags_of_another_tank() -> None:
    off = off_the_circle(output_error(hsva(), ship_model("three-dof"), length=LENGTH))
    assert abs(off["advance"]) < 6
    assert abs(off["transfer"]) < 10
    assert abs(off["tactical_diameter"]) < 5
    assert abs(off["time_90_secs"]) < 5
    assert abs(off["steady_yaw_rate"]) < 10
    assert abs(off["steady_speed"]) < 14


def test_zigzags_alone_choose_the_model_that_predicts_the_circle() -> None:
    names = ("nomoto", "norrbin", "slipstream", "three-dof")
    found = rank_models(
        [marin("zz_10")[1], marin("zz_20")[1]], [ship_model(name) for name in names], length=LENGTH
    )
    assert found[0].model.name == "three-dof"
    assert found[-1].model.name == "nomoto"
    assert found[0].score < 0.15


def test_real_residuals_make_white_noise_errors_several_times_too_small() -> None:
    segments = [marin("zz_10")[1], marin("zz_20")[1]]
    found = uncertainty(output_error(segments, ship_model("slipstream"), length=LENGTH))
    told = [i for i, name in enumerate(found.names) if name not in found.unidentifiable]
    assert len(told) >= 5
    assert np.median(found.std[told] / found.bound[told]) > 3


def test_a_fit_is_not_off_its_own_runs_by_much() -> None:
    _, trial = marin("zz_20")
    fit = output_error([trial], ship_model("three-dof"), length=LENGTH)
    assert np.nanmax(misfit(fit, trial)) < 0.15


def test_a_zigzag_of_the_papers_ship_overshoots_as_she_does() -> None:
    vessel, _ = load_vessel("table1")
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=suite("none"))
    fit = output_error(
        split_into_segments(resample(as_log(trial), channels=CHANNELS), "z.mcap"),
        ship_model("burylin"),
    )
    overshoots = zigzag_overshoots(
        fit, np.radians(20), np.radians(20), rudder_rate=np.radians(2.5),
        speed=10.3279556, rpm=80.0, duration_secs=520.0,
    )  # fmt: skip
    # heading extrema of 36.355, -34.744 and 33.923 degrees, from an independent simulation
    np.testing.assert_allclose(np.degrees(overshoots)[:2], [16.355, 14.744], atol=0.01)


def test_the_tankers_first_overshoots_are_predicted() -> None:
    segments = [marin("zz_10")[1], marin("zz_20")[1]]
    fit = output_error(segments, ship_model("three-dof"), length=LENGTH)
    for angle, measured in ((10, 9.39), (20, 15.59)):
        said = zigzag_overshoots(
            fit, np.radians(-angle), np.radians(angle), rudder_rate=np.radians(2.32),
            speed=7.97, rpm=91.7, duration_secs=600.0,
        )  # fmt: skip
        assert np.degrees(said[0]) == pytest.approx(measured, abs=2.5)


# ---- circles that can be computed


def test_the_figures_of_a_true_circle_are_its_own() -> None:
    dt, rate, radius, before = 0.1, 0.01, 500.0, 400.0
    time = np.arange(0, 800, dt)
    heading = 0.3 - rate * np.maximum(time - before / 5.0, 0)
    speed = rate * radius
    outputs = np.column_stack(
        (np.where(heading < 0.3, -rate, 0), np.full(len(time), speed), 0 * time, heading)
    )
    rudder = np.where(time > 50, -0.6, 0.0)
    found = turn(outputs, dead_reckoning(outputs, dt), rudder, dt)
    assert found.advance == pytest.approx(before + radius, rel=1e-3)
    assert found.transfer == pytest.approx(radius, rel=1e-3)
    assert found.tactical_diameter == pytest.approx(2 * radius, rel=1e-3)
    assert found.time_90_secs == pytest.approx(80 + np.pi / 2 / rate, abs=0.2)
    assert found.time_180_secs == pytest.approx(80 + np.pi / rate, abs=0.2)
    assert found.steady_yaw_rate == pytest.approx(rate)
    assert found.steady_speed == pytest.approx(speed)


def test_a_first_course_that_is_given_counts_for_the_first_samples_heading() -> None:
    time = np.arange(0, 500, 1.0)
    heading = 0.01 * time
    outputs = np.column_stack((0 * time + 0.01, 5 + 0 * time, 0 * time, heading))
    positions, rudder = dead_reckoning(outputs, 1.0), np.full(500, 0.6)
    noisy = outputs.copy()
    noisy[0, 3] += 0.05
    exact = turn(outputs, positions, rudder, 1.0)
    assert turn(noisy, positions, rudder, 1.0, course=0.0) == exact
    assert turn(noisy, positions, rudder, 1.0).advance > exact.advance + 20


def test_a_ship_that_does_not_come_round_has_no_diameter() -> None:
    time = np.arange(0, 100, 1.0)
    outputs = np.column_stack((0.02 + 0 * time, 5 + 0 * time, 0 * time, 0.02 * time))
    found = turn(outputs, dead_reckoning(outputs, 1.0), np.full(100, 0.6), 1.0)
    assert np.isfinite(found.advance)
    assert np.isnan(found.tactical_diameter)


def test_one_run_chooses_no_model() -> None:
    with pytest.raises(UsageError, match="two logs or more, or name the model"):
        rank_models([marin("zz_10")[1]], [ship_model("nomoto")])
