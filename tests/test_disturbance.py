from dataclasses import replace
from math import radians

import numpy as np
import pytest

from analysis.disturbance import observe_disturbance
from analysis.gauge import gauge
from analysis.kalman import noise_of
from recorders.sensors import suite
from recorders.simulate import Gust, simulate
from shiplog import Signals, TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STEP = radians(2)


def observed(vessel: Vessel, manoeuvre: str, noise: str, gusts: tuple[Gust, ...], **settings):  # noqa: ANN003, ANN201
    sensors = suite(noise, {k.replace("__", "."): v for k, v in settings.items()})
    trial = simulate(vessel, manoeuvre, duration_secs=600.0, seed=5, sensors=sensors, gusts=gusts)
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    noise_found = noise_of(gauge(signals, vessel.coefficients), vessel.coefficients, vessel.filter)
    truth = trial.trajectory.at(signals.time_secs)["yaw_disturbance"]
    found, courses = observe_disturbance(signals, vessel.coefficients, noise_found)
    return signals, found, courses, truth


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "turning-circle", "pseudo-random"])
@pytest.mark.parametrize("noise", ["white", "paper"])
def test_a_step_in_yaw_moment_is_found_within_5_percent(
    vessel: Vessel, manoeuvre: str, noise: str
) -> None:
    _, found, _, truth = observed(vessel, manoeuvre, noise, (Gust(STEP, 200.0),))
    settled = slice(4000, None)  # 200 s after its onset: four of the observer's periods
    assert np.mean(found.yaw[settled]) == pytest.approx(truth[-1], rel=0.05)
    assert np.max(np.abs(found.yaw[settled] / truth[-1] - 1)) < 0.15


def test_a_gust_comes_and_goes(vessel: Vessel) -> None:
    _, found, _, truth = observed(vessel, "zigzag-20-20", "white", (Gust(STEP, 150.0, 200.0),))
    size = truth.max()
    assert np.mean(found.yaw[3000:3490]) == pytest.approx(size, rel=0.05)
    assert np.mean(found.yaw[5000:]) == pytest.approx(0, abs=0.05 * size)


def test_without_disturbance_what_is_seen_is_the_sensors_noise(vessel: Vessel) -> None:
    _, found, courses, _ = observed(vessel, "zigzag-20-20", "white", ())
    assert np.std(found.yaw[1500:]) == pytest.approx(courses["yaw"].std, rel=0.4)
    assert np.std(found.surge[3000:]) == pytest.approx(courses["surge"].std, rel=0.6)


def test_a_slow_sensor_is_corrected_as_fast_as_a_quick_one(vessel: Vessel) -> None:
    _, found, _, truth = observed(
        vessel, "zigzag-20-20", "white", (Gust(STEP, 200.0),), yaw_rate__rate_hz=1.0
    )
    assert np.mean(found.yaw[320:]) == pytest.approx(truth[-1], rel=0.1)


def test_where_nothing_is_measured_the_disturbance_is_held(vessel: Vessel) -> None:
    signals, *_ = observed(vessel, "zigzag-20-20", "white", (Gust(STEP, 100.0),))
    values = dict(signals.values)
    values["yaw_rate"] = values["yaw_rate"].copy()
    values["yaw_rate"][4000:4300] = np.nan
    gapped: Signals = replace(signals, values=values)
    noise = noise_of(gauge(gapped, vessel.coefficients), vessel.coefficients, vessel.filter)
    found, _ = observe_disturbance(gapped, vessel.coefficients, noise)
    assert np.ptp(found.yaw[4000:4300]) == 0


def test_the_moment_is_told_as_the_rudder_that_would_do_the_same(vessel: Vessel) -> None:
    straight = (Gust(STEP, 100.0),)
    _, found, *_ = observed(vessel, "turning-circle-1", "white", straight)
    # at the approach speed two degrees, and little else while the ship goes nearly straight
    assert np.degrees(np.mean(found.rudder[2200:2600])) == pytest.approx(2.0, rel=0.08)


def test_a_force_is_found_in_surge(vessel: Vessel) -> None:
    c = vessel.coefficients
    trial = simulate(vessel, "zigzag-20-20", duration_secs=900.0, sensors=suite("white"))
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    noise = noise_of(gauge(signals, c), c, vessel.filter)
    # a model that believes in 2 % more thrust sees the ship held back by that much
    found, _ = observe_disturbance(signals, c._replace(h=1.02 * c.h), noise)
    assert np.mean(found.surge[6000:]) == pytest.approx(-0.02 * c.h * 80, rel=0.1)
