"""Predicted manoeuvres in tables, JSON, validation and vessel file, with and without positions."""

import json
from dataclasses import replace
from functools import cache
from math import degrees, isfinite, radians

import pytest
from predicted_ships import MARINER, ship_with_positions, ship_without_positions

from analysis.identification.fit.drift import DRIFT_INDICES
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.vessel_file import vessel_toml
from analysis.report.identification_json import identification_json
from analysis.report.identification_tables import identification_tables
from analysis.report.predicted_tables import largest_source, prediction_tables
from analysis.view.run_sheets import run_sheets
from shiplog.cli.console import print_tables
from shiplog.text_table import TextTable


def table_of(ship: IdentifiedShip) -> TextTable:
    (table,) = prediction_tables(ship)
    return table


@cache
def tree(*, positions: bool) -> dict:  # type: ignore[type-arg]
    ship = ship_with_positions() if positions else ship_without_positions()
    return json.loads(json.dumps(identification_json(ship), allow_nan=False))  # type: ignore[no-any-return]


def rows_after(table: TextTable, manoeuvre: str) -> list[tuple[str, ...]]:
    """Return the rows of one manoeuvre."""
    first = next(i for i, row in enumerate(table.rows) if row[0] == manoeuvre)
    rest = table.rows[first + 1 :]
    end = next((i for i, row in enumerate(rest) if not any(row[1:])), len(rest))
    return list(rest[:end])


# ---- the table


def test_all_standard_manoeuvres_are_in_the_table_to_both_sides() -> None:
    names = [row[0] for row in table_of(ship_with_positions()).rows if not any(row[1:])]
    assert names == [
        f"{kind} to {side}"
        for kind in ("turning circle 35°", "zig-zag 10°/10°", "zig-zag 20°/20°")
        for side in ("starboard", "port")
    ]


def test_an_index_has_value_interval_limit_verdict_and_largest_source() -> None:
    ship = ship_with_positions()
    rows = rows_after(table_of(ship), "turning circle 35° to starboard")
    advance = ship.predictions[0].indices[0]
    (metres, lengths) = rows[:2]
    assert metres[0] == "advance [m]"
    assert float(metres[1]) == pytest.approx(advance.value, abs=1.0)
    low, high = map(float, metres[2].split(" to "))
    assert (low, high) == pytest.approx((advance.low, advance.high), abs=1.0)
    assert metres[5] == {"choice of model": "models"}.get(
        largest_source(advance), largest_source(advance)
    )
    assert float(lengths[1]) == pytest.approx(advance.value / MARINER.length, abs=0.05)
    assert lengths[3:5] == ("4.5", "meets")


def test_angles_are_in_degrees_with_their_limits() -> None:
    rows = rows_after(table_of(ship_with_positions()), "zig-zag 20°/20° to port")
    overshoot = next(row for row in rows if row[0] == "overshoot 1 [deg]")
    index = ship_with_positions().predictions[-1].indices[2]
    assert float(overshoot[1]) == pytest.approx(degrees(index.value), abs=0.1)
    assert overshoot[3] == "25.0"


def test_the_table_fits_80_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    print_tables([table_of(ship_with_positions())])
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    assert "(continued)" not in printed


def test_the_remarks_state_models_approach_and_extrapolation() -> None:
    remarks = " ".join(table_of(ship_with_positions()).remarks)
    assert "Predicted by slipstream (100 %)" in remarks
    assert "m/s" in remarks
    assert "turning circle 35° to port: extrapolated: the logs have rudder angles up to" in remarks


def test_without_predictions_there_is_no_table() -> None:
    alone = replace(ship_with_positions(), predictions=(), approach=None, no_predictions="one run")
    assert prediction_tables(alone) == ()
    result = identification_json(alone)
    assert (result["predictions"], result["no_predictions"]) == ([], "one run")


def test_models_have_weight_track_misfit_and_fault() -> None:
    ship = ship_with_positions()
    (candidate,) = ship.candidates
    faulty = replace(candidate, fault="at its limit: m", weight=0.0)
    table = identification_tables(replace(ship, candidates=(candidate, faulty)))[0]
    columns = [column.replace("\n", " ") for column in table.columns]
    assert columns[-3:] == ["track [%]", "weight [%]", "fault"]
    assert [row[-2] for row in table.rows] == ["100", "0"]
    assert all(float(row[-3]) > 0 for row in table.rows)
    assert [row[-1] for row in table.rows] == ["", "limit"]
    assert table.remarks[1] == "Faults: slipstream: at its limit: m."


# ---- JSON


def test_json_has_predictions_in_si_with_sources_limits_and_probability() -> None:
    predictions = tree(positions=True)["predictions"]
    circle, zigzag = predictions[0], predictions[2]
    assert circle["rudder"] == pytest.approx(radians(35.0))
    assert (circle["switch_heading"], zigzag["switch_heading"]) == (None, pytest.approx(0.17453293))
    advance = circle["indices"][0]
    assert (advance["name"], advance["unit"]) == ("advance", "m")
    low, high = advance["interval_95"]
    assert low < advance["value"] < high
    assert set(advance["sources"]) == {
        "parameters", "choice of model", "rudder zero", "model error",
    }  # fmt: skip
    assert advance["criterion"]["limit"] == pytest.approx(4.5 * MARINER.length)
    assert 0 <= advance["probability"] <= 1
    assert advance["in_lengths"] == pytest.approx(advance["value"] / MARINER.length)
    assert tree(positions=True)["approach"]["length_given"]


# ---- without positions and sway


def test_without_positions_the_drift_is_no_number_anywhere() -> None:
    ship, result = ship_without_positions(), tree(positions=False)
    for name in ("c1", "c2"):
        assert result["parameters"][name]["value"] is None
        assert "positions" in result["parameters"][name]["recommended_manoeuvre"]
    for circle in result["predictions"][:2]:
        by_name = {index["name"]: index for index in circle["indices"]}
        for name in DRIFT_INDICES:
            assert by_name[name]["value"] is None
            assert by_name[name]["interval_95"] == [None, None]
            assert "not identifiable without positions or sway" in by_name[name]["note"]
        for name in ("time to 90°", "steady yaw rate", "steady speed"):
            assert by_name[name]["value"] > 0
    zigzags = result["predictions"][2:]
    assert all(index["value"] is not None for each in zigzags for index in each["indices"])
    rows = rows_after(table_of(ship), "turning circle 35° to port")
    assert [row[1] for row in rows[:3]] == ["–"] * 3


def test_without_positions_a_warning_names_the_remedy() -> None:
    (warning,) = (each for each in ship_without_positions().warnings if "drift" in each)
    assert "(c1, c2)" in warning
    assert "log the position (GNSS) or the sway velocity" in warning
    assert not any("drift" in each for each in ship_with_positions().warnings)


def test_without_positions_the_vessel_file_cautions_against_its_drift() -> None:
    text = vessel_toml(ship_without_positions())
    assert "# Its drift is not identifiable without positions or sway" in text
    (line,) = (each for each in text.splitlines() if each.startswith("c1 = "))
    assert "NOT IDENTIFIABLE without positions or sway" in line


def test_without_positions_a_validation_has_no_simulated_drift() -> None:
    (validation,) = ship_without_positions().validations
    assert "sway" not in validation.rms
    assert isfinite(validation.rms["track"])
    assert {each.name for each in validation.indices}.isdisjoint(DRIFT_INDICES)
    assert not validation.diverged
    tables = identification_tables(ship_without_positions())
    assert any("tracks are without drift" in text for table in tables for text in table.remarks)


def test_the_review_draws_no_simulated_sway_without_positions() -> None:
    for ship, drawn in ((ship_with_positions(), True), (ship_without_positions(), False)):
        panels = [panel for sheet in run_sheets(ship) for panel in sheet.motion]
        assert any("sway" in panel.name for panel in panels) == drawn


def test_a_length_that_is_not_given_gives_no_limit_in_lengths() -> None:
    ship = ship_without_positions()
    limits = [index.criterion for each in ship.predictions for index in each.indices]
    assert {each.name for each in limits if each} == {"20/20 zig-zag, first overshoot"}
    assert not any(isfinite(i.in_lengths) for each in ship.predictions for i in each.indices)
    assert "length is not given" in table_of(ship).remarks[-1]
