import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.pipeline import Analysis, analyse
from analysis.summary import markdown, sections, summarise
from shiplog import TrialLog


def test_the_json_has_what_is_promised(zigzag_analysis: Analysis) -> None:
    found = json.loads(json.dumps(summarise(zigzag_analysis), allow_nan=False))
    assert {"log", "model", "filter", "disturbance", "coefficients", "warnings"} <= set(found)
    for output in ("yaw_rate", "speed"):
        said = found["filter"][output]
        assert {"innovation_rms", "normalised_innovation_squared", "whiteness_p"} <= set(said)
    for name in ("a", "b1", "b2", "b3", "d", "e", "f", "g", "h"):
        assert {"value", "std", "unit"} <= set(found["coefficients"][name])
    assert found["coefficients"]["b2"]["unit"] == "1/(rad·s)"
    assert found["log"]["duration_secs"] == pytest.approx(500.0)
    assert found["log"]["channels"]["/yaw_rate/simulated"]["rate_hz"] == pytest.approx(10.0)


def test_the_numbers_are_the_analysis(zigzag_analysis: Analysis) -> None:
    found = summarise(zigzag_analysis)
    innovations = zigzag_analysis.estimates.innovations[:, 1]
    assert found["filter"]["speed"]["innovation_rms"] == pytest.approx(
        np.sqrt(np.nanmean(innovations**2))
    )
    settled = zigzag_analysis.disturbance.yaw[1000:]
    assert found["disturbance"]["yaw"]["mean"] == pytest.approx(np.mean(settled))


def test_the_papers_wave_is_said_to_colour_the_innovations(zigzag_analysis: Analysis) -> None:
    page = markdown(zigzag_analysis)
    assert "speed: innovations are NOT white" in page
    assert "yaw_rate: innovations are white" in page


def test_what_the_data_cannot_tell_is_not_printed_as_a_number(zigzag_analysis: Analysis) -> None:
    doubtful = replace(zigzag_analysis.yaw.coefficients["b1"], value=1e-4, std=1e-3)
    yaw = replace(
        zigzag_analysis.yaw, coefficients=zigzag_analysis.yaw.coefficients | {"b1": doubtful}
    )
    tables = sections(replace(zigzag_analysis, yaw=yaw))
    rows = {row[0]: row for table in tables for row in table.rows}
    assert rows["b1"][1] == "not determined"
    assert "1e-04" not in rows["b1"][1]
    assert rows["a"][1].startswith("-0.026")


def test_people_read_degrees_and_knots(zigzag_analysis: Analysis) -> None:
    rows = {row[0]: row for table in sections(zigzag_analysis) for row in table.rows}
    rms = zigzag_analysis.residuals[0].rms * 180 / np.pi
    assert rows["yaw_rate [deg/s]"][1] == f"{rms:.3g}"
    rms = zigzag_analysis.residuals[1].rms * 3600 / 1852
    assert rows["speed [kn]"][1] == f"{rms:.3g}"


def test_a_fitted_model_is_said_to_be_one(zigzag_log: TrialLog) -> None:
    found = analyse(replace(zigzag_log, vessel_toml=None))
    assert "a first model, fitted to this log" in markdown(found)
    assert summarise(found)["model"]["origin"] == "a first model, fitted to this log"
    assert "in proportion to the speed" in markdown(found)


def test_warnings_are_on_the_page(zigzag_analysis: Analysis) -> None:
    page = markdown(replace(zigzag_analysis, warnings=("the gyro slept",)))
    assert "## Warnings\n\n- the gyro slept" in page
