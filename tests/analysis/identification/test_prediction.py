"""Predictions of runs that were not fitted: of the tanker KVLCC2 and of the paper's ship."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from places import KVLCC2
from tanker_logs import tanker_log
from trial_logs import as_log

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment, split_into_segments
from analysis.identification.fit.uncertainty import uncertainty
from analysis.identification.held_out import misfit
from analysis.identification.model_selection import rank_models
from analysis.identification.prediction import dead_reckoning, manoeuvre_motion, predict
from analysis.identification.simulated_manoeuvres import (
    Approach,
    best_estimate,
    simulate_zigzags,
)
from analysis.manoeuvres.turning_circle import turning_circle
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, UsageError, load_vessel, resample
from shiplog.ships import ship_model
from shiplog.vessel.vessel import with_length

LENGTH = 320.0
CHANNELS, OPTIONAL = ("yaw_rate", "speed", "rudder", "rpm"), ("sway", "heading")


@cache
def recorded(path: Path) -> tuple[TrialLog, Segment]:
    if not path.is_file():
        pytest.skip(f"the real recordings are not here: {path}")
    log = tanker_log(path)
    return log, split_into_segments(resample(log, 1.0, CHANNELS, OPTIONAL), path.name)[0]


def marin(run: str) -> tuple[TrialLog, Segment]:
    return recorded(KVLCC2 / "marin" / f"MARIN_FREE_KVLCC2_{run}_m.dat")


@cache
def marin_zigzag_fit() -> OutputError:
    segments = [marin("zz_10")[1], marin("zz_20")[1]]
    return output_error(segments, ship_model("three-dof"), length=LENGTH)


def hsva() -> list[Segment]:
    runs = ("10_05", "10_10_P", "20_05", "20_10_S", "30_05", "35_05")
    return [recorded(KVLCC2 / "hsva" / f"HSVA_CPMC_KVLCC2_Z_{run}.dat")[1] for run in runs]


def circle_errors(fit: OutputError) -> dict[str, float]:
    """Return the errors of the predicted 35° turning circle, %."""
    log, trial = marin("tc_35")
    position = log["position"]
    at = (position.measured_ns - trial.signals.start_ns) * 1e-9
    there = [np.interp(trial.signals.time_secs, at, column) for column in position.values.T]
    rudder = trial.signals["rudder"]
    motion = manoeuvre_motion(trial.measured, np.column_stack(there))
    measured = turning_circle(motion, rudder, trial.dt_secs)
    assert measured.advance / LENGTH == pytest.approx(3.122, abs=0.005)
    assert measured.tactical_diameter / LENGTH == pytest.approx(3.067, abs=0.005)
    assert measured.time_90_secs == pytest.approx(169.3, abs=0.5)
    outputs = predict(fit, trial)
    motion = manoeuvre_motion(outputs, dead_reckoning(outputs, trial.dt_secs))
    predicted = turning_circle(motion, rudder, trial.dt_secs)
    return {
        name: 100 * (getattr(predicted, name) / getattr(measured, name) - 1)
        for name in measured.__dataclass_fields__
    }


def test_turning_circle_is_predicted_from_marin_zigzags() -> None:
    errors = circle_errors(marin_zigzag_fit())
    assert abs(errors["advance"]) < 3
    assert abs(errors["transfer"]) < 10
    assert abs(errors["tactical_diameter"]) < 5
    assert abs(errors["time_90_secs"]) < 4
    # the balance of thrust and drag in the circle is near-singular: the goal is not reached yet
    assert abs(errors["steady_yaw_rate"]) < 16
    assert abs(errors["steady_speed"]) < 22


def test_turning_circle_is_predicted_from_zigzags_of_another_tank() -> None:
    errors = circle_errors(output_error(hsva(), ship_model("three-dof"), length=LENGTH))
    assert abs(errors["advance"]) < 6
    assert abs(errors["transfer"]) < 10
    assert abs(errors["tactical_diameter"]) < 5
    assert abs(errors["time_90_secs"]) < 5
    assert abs(errors["steady_yaw_rate"]) < 10
    assert abs(errors["steady_speed"]) < 14


def test_zigzags_select_the_model_that_predicts_the_circle() -> None:
    names = ("nomoto", "norrbin", "slipstream", "three-dof")
    candidates = rank_models(
        [marin("zz_10")[1], marin("zz_20")[1]],
        [ship_model(name) for name in names],
        vessel=with_length(None, LENGTH),
    )
    assert candidates[0].model.name == "three-dof"
    assert candidates[-1].model.name == "nomoto"
    assert candidates[0].score < 0.15


def test_coloured_residuals_enlarge_the_white_noise_errors_of_real_runs() -> None:
    segments = [marin("zz_10")[1], marin("zz_20")[1]]
    estimates = uncertainty(output_error(segments, ship_model("slipstream"), length=LENGTH))
    determined = [
        i for i, name in enumerate(estimates.names) if name not in estimates.unidentifiable
    ]
    assert len(determined) >= 5
    assert np.median(estimates.std[determined] / estimates.bound[determined]) > 3


def test_misfit_of_a_fitted_run_is_small() -> None:
    _, trial = marin("zz_20")
    fit = output_error([trial], ship_model("three-dof"), length=LENGTH)
    assert np.nanmax(misfit(fit, trial)) < 0.15


def test_simulated_zigzag_has_the_overshoots_of_an_independent_simulation() -> None:
    vessel, _ = load_vessel("table1")
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=suite("none"))
    fit = output_error(
        split_into_segments(resample(as_log(trial), channels=CHANNELS), "z.mcap"),
        ship_model("burylin"),
    )
    ship = best_estimate(fit, Approach(200.0, 10.3279556, 80.0, np.radians(2.5)))
    (zigzag,) = simulate_zigzags(ship, np.radians(20), np.radians(20))
    # heading extrema of 36.355, -34.744 and 33.923 degrees, from an independent simulation
    np.testing.assert_allclose(np.degrees(zigzag.overshoots)[:2], [16.355, 14.744], atol=0.01)


def test_first_overshoots_of_the_tanker_are_predicted() -> None:
    fit = marin_zigzag_fit()
    for angle, measured in ((10, 9.39), (20, 15.59)):
        ship = best_estimate(fit, Approach(LENGTH, 7.97, 91.7, np.radians(2.32)))
        (zigzag,) = simulate_zigzags(ship, np.radians(-angle), np.radians(angle))
        assert np.degrees(zigzag.overshoots[0]) == pytest.approx(measured, abs=2.5)


def test_model_selection_requires_two_runs() -> None:
    with pytest.raises(UsageError, match="two logs or more, or name the model"):
        rank_models([marin("zz_10")[1]], [ship_model("nomoto")])
