"""The benchmark of prediction: its logs, its truths, its errors and its tables."""

from dataclasses import replace
from math import radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import prediction
from benchmarks.prediction import SHORT_STUDY, StudySize, measure_predictions, measure_study
from benchmarks.prediction_results import (
    IdentifiedTrials,
    PredictedIndex,
    PredictionStudy,
    joined,
    load_study,
    save_study,
)
from benchmarks.prediction_tables import (
    ROWS,
    coverage,
    error_cell,
    section_lines,
    setting_table,
    summary_table,
    within_targets,
)
from benchmarks.reference_trials import SETTINGS, exact_manoeuvres, reference_ship, zigzag_logs
from shiplog import LogError

QUICK = replace(SHORT_STUDY, model="slipstream", log_secs=200.0)


@pytest.fixture(scope="module")
def trials() -> IdentifiedTrials:
    (only,) = measure_predictions(QUICK)
    return only


def trials_with(*predictions: PredictedIndex, setting: str = "sway") -> IdentifiedTrials:
    return IdentifiedTrials("tanker", setting, 1, "norrbin", 2.0, "", predictions)


def test_the_logs_are_of_zigzags_to_both_sides_and_follow_from_their_seed() -> None:
    ship = reference_ship("seiun-maru")
    logs = zigzag_logs(ship, SETTINGS["current"], 1, 150.0)
    again = zigzag_logs(ship, SETTINGS["current"], 1, 150.0)
    assert [log.name for log in logs] == [
        f"seiun-maru {angle} {side}.mcap"
        for angle in ("10/10", "20/20")
        for side in ("starboard", "port")
    ]
    for log, same in zip(logs, again, strict=True):
        channels = {channel.name: channel.values for channel in log}
        assert set(channels) == {
            "yaw_rate", "speed", "rudder", "rpm", "heading", "position",
        }  # fmt: skip
        for channel in same:
            np.testing.assert_array_equal(channel.values, channels[channel.name])
    other = zigzag_logs(ship, SETTINGS["current"], 2, 150.0)
    assert not np.array_equal(other[0]["rudder"].values, logs[0]["rudder"].values)


def test_the_settings_differ_by_sway_current_and_errors_of_the_sensors() -> None:
    ship = reference_ship("seiun-maru")
    calm, sway, current, poor = (
        {channel.name: channel for channel in zigzag_logs(ship, setting, 3, 100.0)[0]}
        for setting in SETTINGS.values()
    )
    assert "sway" in sway
    assert "sway" not in calm
    drifted = current["position"].values - calm["position"].values
    secs = np.ptp(calm["position"].measured_ns) / 1e9
    speed = np.hypot(*(drifted[-1] - drifted[0])) / secs
    assert speed == pytest.approx(0.5)
    assert len(poor["speed"]) < 0.6 * len(calm["speed"])
    assert np.std(poor["speed"].values[:50]) > 2 * np.std(calm["speed"].values[:100])


def test_the_exact_manoeuvres_are_circles_and_zigzags_to_both_sides_with_finite_indices() -> None:
    manoeuvres = list(exact_manoeuvres(reference_ship("seiun-maru")))
    assert [each.name for each in manoeuvres] == [
        f"{kind} {side}" for kind in ("circle", "10/10", "20/20") for side in ("starboard", "port")
    ]
    for each in manoeuvres:
        assert np.isfinite(list(each.indices.values())).all()
        assert min(each.indices.values()) > 0


def test_every_index_has_a_row_and_a_mild_zigzag_is_predicted_by_a_simple_model(
    trials: IdentifiedTrials,
) -> None:
    assert trials.model == "slipstream"
    assert trials.refusal == ""
    assert len(trials.predictions) == 2 * 7 + 4 * 2
    by_name = {(each.manoeuvre, each.index): each for each in trials.predictions}
    assert len(by_name) == len(trials.predictions)
    for side in ("starboard", "port"):
        assert abs(by_name[f"10/10 {side}", "overshoot 1"].error) < 3.0  # degrees


def test_the_predictions_of_an_identified_ship_are_found_by_rudder_and_switch_heading() -> None:
    manoeuvres = {each.name: each for each in exact_manoeuvres(reference_ship("seiun-maru"))}
    advance = SimpleNamespace(name="advance", value=330.0, low=300.0, high=360.0)
    circle = SimpleNamespace(
        manoeuvre=SimpleNamespace(rudder=-radians(35.0), switch=None), indices=(advance,)
    )
    overshoot = SimpleNamespace(name="overshoot 1", value=0.1, low=0.05, high=0.15)
    zigzag = SimpleNamespace(
        manoeuvre=SimpleNamespace(rudder=radians(20.0), switch=radians(20.0)), indices=(overshoot,)
    )
    ship: Any = SimpleNamespace(predictions=(circle, zigzag))
    assert prediction.predicted_values(ship, manoeuvres["circle port"]) == {
        "advance": (330.0, 300.0, 360.0)
    }
    assert prediction.predicted_values(ship, manoeuvres["20/20 starboard"]) == {
        "overshoot 1": (0.1, 0.05, 0.15)
    }
    assert prediction.predicted_values(ship, manoeuvres["circle starboard"]) == {}


def test_a_refused_identification_is_a_row_without_predictions(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_args: object, **_options: object) -> None:
        raise LogError("these logs identify nothing")

    monkeypatch.setattr(prediction, "identify", refuse)
    study = measure_study(QUICK, tmp_path / "study.json")
    assert "refused: these logs identify nothing" in capsys.readouterr().err
    (only,) = study.trials
    assert np.isnan([each.predicted for each in only.predictions]).all()
    text = "\n".join(section_lines(study))
    assert "| advance | 3 % | **none** |" in text
    assert "seed 1: these logs identify nothing" in text
    assert within_targets(study.trials)[0] == 0


def test_a_study_is_read_as_it_was_written(trials: IdentifiedTrials, tmp_path: Path) -> None:
    study = PredictionStudy("2026-11-30 12:00 UTC", (trials,))
    save_study(tmp_path / "a.json", study)
    again = load_study(tmp_path / "a.json")
    for name in ("true", "predicted", "low", "high"):
        np.testing.assert_allclose(
            [getattr(each, name) for each in again.trials[0].predictions],
            [getattr(each, name) for each in trials.predictions],
            rtol=1e-6,
        )
    assert replace(again.trials[0], predictions=(), secs=0.0) == replace(
        trials, predictions=(), secs=0.0
    )
    assert len(joined([study, again]).trials) == 2


def test_an_error_beyond_the_target_or_an_index_not_reached_is_in_bold() -> None:
    assert error_cell([1.0, -2.0], 3.0) == "-0.5 (2.0)"
    assert error_cell([1.0, -4.0], 3.0) == "**-1.5 (4.0)**"
    assert error_cell([1.0, np.inf], 3.0) == "**+1.0 (1.0), 1 of 2 not reached**"
    assert error_cell([np.inf], 3.0) == "**none**"


def test_errors_are_in_per_cent_and_those_of_overshoots_in_degrees() -> None:
    assert PredictedIndex("circle port", "advance", 500.0, 510.0).error == pytest.approx(2.0)
    overshoot = PredictedIndex("10/10 port", "overshoot 2", 0.1, 0.1 + np.pi / 180)
    assert overshoot.error == pytest.approx(1.0)


def test_coverage_is_of_the_intervals_that_there_are() -> None:
    inside = PredictedIndex("circle port", "advance", 500.0, 510.0, 490.0, 530.0)
    outside = replace(inside, low=505.0)
    without = replace(inside, low=np.nan, high=np.nan)
    assert coverage([trials_with(inside, inside, inside, outside, without)]) == (75.0, 4)
    assert np.isnan(coverage([trials_with(without)])[0])
    (*_, cell) = setting_table([trials_with(inside, outside)])[-2]
    assert cell == "**50 % of 2**"


def test_the_summary_shows_earlier_results_before_the_arrow() -> None:
    before = trials_with(PredictedIndex("circle port", "advance", 500.0, 600.0))
    now = trials_with(PredictedIndex("circle port", "advance", 500.0, 505.0))
    other = replace(before, ship="mariner")
    rows = {row[0]: row[1:] for row in summary_table([now], [before, other])}
    assert rows["advance"] == ("3 %", "20.0 → 1.0")
    assert rows["within the target"] == ("all", "0 of 1 → 1 of 1")
    assert [row[0] for row in setting_table([now])[1 : 1 + len(ROWS)]] == list(ROWS)


def test_the_short_study_is_of_one_ship() -> None:
    assert len(SHORT_STUDY.ships) * len(SHORT_STUDY.settings) * len(SHORT_STUDY.seeds) == 1
    assert len(StudySize().ships) == 5
