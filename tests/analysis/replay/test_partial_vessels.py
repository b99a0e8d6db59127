"""A vessel file with parts of a ship, with and without a length given, means what it states."""

from dataclasses import replace

import pytest

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from shiplog import TrialLog
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.vessel_parser import parse_vessel

GEAR = "[rudder]\nmax = 0.6\nrate = 0.04\n"


@pytest.mark.parametrize("length", ["", "length = 120.0\n"])
@pytest.mark.parametrize("gear", ["", GEAR])
@pytest.mark.parametrize("given", [None, 90.0])
def test_a_part_of_a_ship_is_kept_and_the_model_is_fitted_to_the_log(
    zigzag_log: TrialLog, length: str, gear: str, given: float | None
) -> None:
    log = replace(zigzag_log, vessel_toml=None)
    vessel = parse_vessel(f"name = 'part'\n{length}{gear}", "part.toml")
    plan = analyse(log, ReadingOptions(vessel, length=given)).findings.plan
    assert "fitted to this log" in plan.model_origin
    assert plan.vessel.length == (given or (120.0 if length else None))
    assert plan.vessel.rudder_max == vessel.rudder_max
    assert plan.vessel.rudder_rate == vessel.rudder_rate


def test_a_length_given_changes_no_coefficient_of_the_vessel(zigzag_log: TrialLog) -> None:
    whole = parse_vessel(PRESETS["table1"], "table1.toml")
    plan = analyse(zigzag_log, ReadingOptions(whole, length=90.0)).findings.plan
    assert plan.vessel.coefficients == whole.coefficients
    assert plan.vessel.length == 90.0
