import json
from dataclasses import replace

import numpy as np
import pytest

from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_json import replay_json
from shiplog import TrialLog
from shiplog.types import Event


def test_the_json_has_the_documented_keys(zigzag_analysis: Analysis) -> None:
    found = json.loads(json.dumps(replay_json(zigzag_analysis.findings), allow_nan=False))
    assert {"log", "model", "residuals", "disturbances", "coefficients", "warnings"} <= set(found)
    for output in ("yaw_rate", "speed"):
        assert {"rms", "mean_nis", "whiteness_p", "correlation", "correlation_lag_secs"} <= set(
            found["residuals"][output]
        )
    for name in ("a", "b1", "b2", "b3", "d", "e", "f", "g", "h"):
        assert {"value", "std", "unit"} <= set(found["coefficients"][name])
    assert found["coefficients"]["b2"]["unit"] == "1/(rad·s)"
    assert found["log"]["duration_secs"] == pytest.approx(500.0)
    assert found["log"]["channels"]["/yaw_rate/simulated"]["rate_hz"] == pytest.approx(10.0)


def test_the_numbers_are_those_of_the_analysis(zigzag_analysis: Analysis) -> None:
    found = replay_json(zigzag_analysis.findings)
    innovations = zigzag_analysis.estimates.innovations[:, 1]
    assert found["residuals"]["speed"]["rms"] == pytest.approx(np.sqrt(np.nanmean(innovations**2)))
    settled = zigzag_analysis.disturbance.yaw[1000:]
    assert found["disturbances"]["yaw"]["mean"] == pytest.approx(np.mean(settled))


def test_a_fitted_model_is_named_in_the_json(zigzag_log: TrialLog) -> None:
    found = replay_json(analyse(replace(zigzag_log, vessel_toml=None)).findings)
    assert found["model"]["origin"] == "first model, fitted to this log"


def test_the_settings_and_the_wave_are_in_the_json(zigzag_log: TrialLog) -> None:
    settings = {
        "filter.wave": True,
        "filter.wave_frequency": 0.6,
        "filter.wave_std": 1e-3,
        "disturbance.models": ["constant", "wave"],
        "disturbance.wave_frequency": 0.5,
    }
    found = replay_json(analyse(zigzag_log, settings=settings).findings)
    assert found["settings"]["filter"]["kind"] == "extended"
    assert found["settings"]["disturbance"]["models"] == ("constant", "wave")
    assert found["settings"]["identifier"] == {"window_secs": 200.0}
    assert found["wave"]["frequency"] == 0.6
    assert {"yaw", "yaw_as_rudder", "surge", "yaw_wave", "surge_wave"} == set(found["disturbances"])
    assert replay_json(analyse(zigzag_log).findings)["wave"] is None


def test_the_events_of_the_log_are_in_the_json(zigzag_log: TrialLog) -> None:
    event = Event(zigzag_log.span_ns[0] + 10**10, "execute")
    found = replay_json(analyse(replace(zigzag_log, events=(event,))).findings)
    (entry,) = found["events"]
    assert (entry["text"], entry["since_start_secs"], entry["level"]) == ("execute", 10.0, "info")
    assert found["events_omitted"] == 0
