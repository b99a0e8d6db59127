"""Rows of the equations in integral form, compared with the integrals of simulated trials."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.regression.weak_form import weak_form, with_constant, with_slipstream
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import Signals, TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


@pytest.fixture(scope="module")
def clean(vessel: Vessel) -> SimulatedTrial:
    return simulate(vessel, "pseudo-random", duration_secs=400.0, sensors=suite("none"))


@pytest.fixture(scope="module")
def signals(clean: SimulatedTrial) -> Signals:
    return resample(TrialLog("clean", clean.channels), channels=NAMES)


def test_the_true_coefficients_satisfy_every_row(signals: Signals, vessel: Vessel) -> None:
    for rows in weak_form(signals, vessel.coefficients):
        true = np.array([getattr(vessel.coefficients, name) for name in rows.equation.names])
        residual = rows.target - rows.regressors @ true
        # the time of a step of the revolutions is only known to one sample
        assert np.max(np.abs(residual)) < 1e-3 * np.max(np.abs(rows.target))


def test_a_row_equals_its_integral(signals: Signals, vessel: Vessel) -> None:
    yaw, _ = weak_form(signals, vessel.coefficients)
    k = 77
    t = signals.time_secs - yaw.centres_secs[k]
    s = np.clip(2 * t / yaw.equation.bump_secs, -1, 1)
    phi = (1 - s**2) ** 4
    phi /= np.trapezoid(phi, t)
    w = signals["yaw_rate"]
    assert yaw.regressors[k, 1] == pytest.approx(np.trapezoid(phi * w, t), rel=1e-9)
    assert yaw.regressors[k, 2] == pytest.approx(np.trapezoid(phi * w * np.abs(w), t), rel=1e-9)
    # the regressor of a is int phi w': compared with the derivative of the true yaw rate
    assert yaw.equation.names[0] == "a"
    yaw_acceleration = np.gradient(w, signals.dt_secs)
    assert yaw.regressors[k, 0] == pytest.approx(np.trapezoid(phi * yaw_acceleration, t), rel=1e-3)


def test_bumps_are_one_second_apart_and_inside_the_trial(signals: Signals, vessel: Vessel) -> None:
    yaw, surge = weak_form(signals, vessel.coefficients)
    assert np.diff(yaw.centres_secs) == pytest.approx(1.0)
    assert yaw.centres_secs[0] == pytest.approx(yaw.equation.bump_secs / 2)
    assert yaw.centres_secs[-1] + yaw.equation.bump_secs / 2 <= signals.time_secs[-1] + 1e-9
    assert yaw.equation.bump_secs == 60.0
    assert np.array_equal(yaw.centres_secs, surge.centres_secs)


def test_rows_are_nan_where_a_bump_overlaps_a_gap(signals: Signals, vessel: Vessel) -> None:
    values = dict(signals.values)
    values["yaw_rate"] = values["yaw_rate"].copy()
    values["yaw_rate"][2000:2100] = np.nan  # 200 s to 210 s
    yaw, surge = weak_form(replace(signals, values=values), vessel.coefficients)
    overlaps_gap = (yaw.centres_secs + 30 >= 200) & (yaw.centres_secs - 30 <= 209.9)
    assert np.array_equal(np.isnan(yaw.target), overlaps_gap)
    assert np.array_equal(np.isnan(surge.regressors[:, 0]), overlaps_gap)  # f w^2
    assert not np.isnan(surge.target).any()  # v alone


def test_samples_of_a_slow_sensor_are_interpolated(vessel: Vessel) -> None:
    sensors = suite("none", {"speed.rate_hz": 0.5})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=300.0, sensors=sensors)
    signals = resample(TrialLog("slow", trial.channels), channels=NAMES)
    assert np.isnan(signals["speed"]).sum() > 2000
    yaw, surge = weak_form(signals, vessel.coefficients)
    assert np.isfinite(yaw.regressors[3:-3]).all()
    true = np.array([getattr(vessel.coefficients, name) for name in surge.equation.names])
    residual = (surge.target - surge.regressors @ true)[3:-3]
    assert np.max(np.abs(residual)) < 0.02 * np.max(np.abs(surge.target[3:-3]))


def test_a_time_step_over_one_second_is_the_distance_of_bumps(vessel: Vessel) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=600.0, sensors=suite("none"))
    signals = resample(TrialLog("coarse", trial.channels), 2.0, NAMES)
    yaw, _ = weak_form(signals, vessel.coefficients)
    assert yaw.equation.stride_secs == 2.0
    assert np.diff(yaw.centres_secs) == pytest.approx(2.0)


def test_a_constant_adds_a_regressor_of_ones(signals: Signals, vessel: Vessel) -> None:
    yaw, _ = weak_form(signals, vessel.coefficients)
    extended = with_constant(yaw)
    assert extended.equation.names == (*yaw.equation.names, "constant")
    assert np.all(extended.regressors[:, -1] == 1)


def test_the_slipstream_regressor_is_proportional_to_rudder_times_revolutions(
    signals: Signals, vessel: Vessel
) -> None:
    """Compare to a few per cent, since speed and revolutions are means over a bump."""
    n, v = signals["rpm"], signals["speed"]
    by_speed = vessel.coefficients._replace(alpha1=1.0, alpha2=0.0)
    by_revolutions = vessel.coefficients._replace(alpha1=0.0, alpha2=1.0, alpha3=0.0)
    yaw, surge = weak_form(signals, by_speed)
    extended = with_slipstream(yaw, surge)
    assert extended.equation.names == (*yaw.equation.names, "slipstream")
    expected = weak_form(signals, by_revolutions)[0].regressors[:, 4]
    error = extended.regressors[:, -1] - expected
    assert np.sqrt(np.mean(error**2) / np.mean(expected**2)) < 0.05
    assert n.std() > 0.05 * n.mean()
    assert v.std() > 0.02 * v.mean()
