"""Identification with extreme settings, and with vessel files that state parts of a ship."""

from functools import cache

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.identification.vessel_file import vessel_toml
from analysis.replay.reading_options import ReadingOptions
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, TrialLog, UsageError, load_vessel
from shiplog.errors import VesselError
from shiplog.vessel.vessel_parser import parse_vessel

pytestmark = pytest.mark.usefixtures("fit_alone")
MODEL, FIXED = "burylin-tied", {"T3": 0.5}  # the fastest fit
LENGTH = "length = 120.0\n"
GEAR = "[rudder]\nmax = 0.6\nrate = 0.04\n"
SETTINGS = """
[filter]
kind = "extended"
gate = 1e9
process_ratio = 1e-6

[disturbance]
models = ["ramp", "wave"]
yaw_frequency = 0.001

[identifier]
window_secs = 1e6
"""


@cache
def short_log() -> TrialLog:
    vessel, _ = load_vessel("table1")
    return as_log(
        simulate(vessel, "zigzag-20-20", duration_secs=150.0, seed=2, sensors=suite("white"))
    )


@cache
def identified(text: str = "", length: float | None = None) -> IdentifiedShip:
    vessel = parse_vessel(f"name = 'part'\n{text}", "part.toml") if text else None
    options = ReadingOptions(vessel, length=length)
    return identify(short_log(), MODEL, fixed=FIXED, options=options)


@pytest.mark.parametrize(
    ("length", "gear", "given"),
    [(LENGTH, "", None), ("", GEAR, None), (LENGTH, GEAR, 90.0)],
)
def test_a_part_of_a_ship_is_written_again_and_changes_no_parameter(
    length: str, gear: str, given: float | None
) -> None:
    ship = identified(length + gear, given)
    assert ship.parameters == identified().parameters
    written = parse_vessel(vessel_toml(ship), "written.toml")
    stated = given or (120.0 if length else None)
    assert ship.length_given == (stated is not None)
    assert written.length == stated
    assert written.gear_given == (("max", "rate") if gear else ())
    assert not gear or (written.rudder_max, written.rudder_rate) == (0.6, 0.04)


def test_the_alphas_alone_are_no_part_of_a_ship_and_what_they_lack_is_named() -> None:
    with pytest.raises(VesselError, match=r"\[yaw\] lacks T1, T2, T3, c2, c3; \[surge\] lacks"):
        identified(GEAR + "alpha1 = 0.02\nalpha2 = 0.001\nalpha3 = 0.07\n")


def test_settings_of_a_replay_change_no_parameter() -> None:
    assert identified(SETTINGS).parameters == identified().parameters


@pytest.mark.parametrize("length", [0.0, -100.0, np.nan, np.inf, 1e300])
def test_a_length_that_no_ship_has_is_refused(length: float) -> None:
    with pytest.raises(UsageError, match="length"):
        identified("", length)


@pytest.mark.parametrize("value", [1e300, np.nan, np.inf, -np.inf])
def test_a_fixed_value_that_no_fit_complies_with_is_named(value: float) -> None:
    with pytest.raises((UsageError, LogError), match=r"^.*\bT3\b.*$") as error:
        identify(short_log(), MODEL, fixed={"T3": value})
    assert "\n" not in str(error.value)


def test_a_time_constant_fixed_at_zero_gives_finite_parameters() -> None:
    ship = identify(short_log(), MODEL, fixed={"T3": 0.0})
    assert np.isfinite(list(ship.parameters.values())).all()
