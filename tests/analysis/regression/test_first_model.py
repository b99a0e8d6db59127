"""A first model fitted to simulated trials."""

import numpy as np
import pytest

from analysis.regression.coefficients import WholeTrialRegression
from analysis.regression.first_model import SPEED_PROPORTIONAL_RUDDER, fit_first_model
from analysis.regression.weak_form import weak_form
from analysis.signals.signal_stats import signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, Signals, TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


def simulated_signals(
    vessel: Vessel, manoeuvre: str, duration: float, **settings: float
) -> Signals:
    sensors = suite("paper", {k.replace("__", "."): v for k, v in settings.items()})
    trial = simulate(vessel, manoeuvre, duration_secs=duration, seed=1, sensors=sensors)
    return resample(TrialLog("trial", trial.channels), channels=NAMES)


def fitted(signals: Signals, name: str) -> Vessel:
    yaw_rows, surge_rows = weak_form(signals, SPEED_PROPORTIONAL_RUDDER)
    yaw, surge = (
        WholeTrialRegression(yaw_rows.equation, constant=True),
        WholeTrialRegression(surge_rows.equation),
    )
    yaw.add(yaw_rows)
    surge.add(surge_rows)
    return fit_first_model(yaw, surge, signal_stats(signals, SPEED_PROPORTIONAL_RUDDER), name)


def test_the_coefficients_of_a_simple_ship_are_recovered(vessel: Vessel) -> None:
    c = vessel.coefficients._replace(
        b3=0.0, b2=-2.0, alpha1=1.0, alpha2=0.0, alpha3=0.0, d=2e-5, e=0.0
    )
    ship = Vessel("simple", c)
    found = fitted(simulated_signals(ship, "zigzag-20-20", 800.0), "x").coefficients
    for name, tolerance in (("a", 0.02), ("b2", 0.15), ("d", 0.02), ("f", 0.15), ("h", 0.15)):
        assert getattr(found, name) == pytest.approx(getattr(c, name), rel=tolerance), name


def test_the_constant_compensates_a_gyro_bias(vessel: Vessel) -> None:
    plain = fitted(simulated_signals(vessel, "zigzag-20-20", 600.0), "x").coefficients
    biased = fitted(
        simulated_signals(vessel, "zigzag-20-20", 600.0, yaw_rate__bias=float(np.radians(0.02))),
        "x",
    ).coefficients
    assert biased.a == pytest.approx(plain.a, rel=0.03)
    assert biased.d == pytest.approx(plain.d, rel=0.03)


@pytest.mark.parametrize(("manoeuvre", "duration"), [("turning-circle", 4.0)])
def test_a_log_that_is_too_short_is_rejected(
    vessel: Vessel, manoeuvre: str, duration: float
) -> None:
    with pytest.raises(LogError, match="give a vessel file with --vessel"):
        fitted(simulated_signals(vessel, manoeuvre, duration), "short.mcap")


def test_a_ship_at_rest_is_rejected() -> None:
    still = {name: np.zeros(4000) for name in NAMES}
    with pytest.raises(LogError, match="too little motion to fit yaw and surge"):
        fitted(Signals(0, 0.1, still), "quiet.mcap")
