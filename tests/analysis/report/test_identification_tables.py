"""Tables and JSON of an identified ship: headings, units, and what is not identifiable."""

import json
from dataclasses import replace
from functools import cache

import pytest
from trial_logs import as_log

from analysis.identification.fit.fix_blocks import GROUND_VELOCITY
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.report.identification_json import identification_json
from analysis.report.identification_tables import identification_tables
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, load_vessel
from shiplog.text_table import TextTable


def a_log(manoeuvre: str, seed: int) -> TrialLog:
    vessel, toml = load_vessel("table1")
    trial = simulate(
        vessel, manoeuvre, duration_secs=300.0, seed=seed, sensors=suite("white"),
        vessel_toml=toml,
    )  # fmt: skip
    return as_log(trial, f"{manoeuvre}.mcap")


@cache
def ship() -> IdentifiedShip:
    log, circle = a_log("zigzag-20-20", 0), a_log("turning-circle-35", 1)
    return identify(log, "burylin", validation_logs=circle)


def tables() -> dict[str, TextTable]:
    return {table.title.split(":")[0]: table for table in identification_tables(ship())}


def test_each_table_has_as_many_cells_as_columns() -> None:
    assert list(tables()) == [
        "Parameters", "Share of prior by method", "Fit", "Validation", "Manoeuvring indices",
    ]  # fmt: skip
    for table in tables().values():
        assert {len(row) for row in table.rows} == {len(table.columns)}


def test_a_parameter_has_its_interval_its_bound_and_its_share_of_prior() -> None:
    table = tables()["Parameters"]
    assert [column.replace("\n", " ") for column in table.columns] == [
        "parameter", "value", "95 % interval", "Cramér-Rao bound", "share of prior", "unit",
    ]  # fmt: skip
    rows = {row[0]: row for row in table.rows}
    i = ship().uncertainty.names.index("d")
    assert float(rows["d"][1]) == pytest.approx(ship().parameters["d"], rel=1e-4)
    half = 1.96 * ship().uncertainty.std[i]
    assert float(rows["d"][2].removeprefix("± ")) == pytest.approx(half, rel=0.05)
    assert rows["alpha1"][1:3] == ("0.0171", "fixed")


def test_a_run_has_its_residual_rms_its_rudder_zero_and_its_gyro_bias() -> None:
    table = tables()["Fit"]
    assert [column.replace("\n", " ") for column in table.columns] == [
        "log", "duration [s]", "yaw rate [deg/s]", "speed [kn]", "rudder zero [deg]",
        "gyro bias [deg/s]", "swell period [s]",
    ]  # fmt: skip
    assert table.rows[0][:2] == ("zigzag-20-20.mcap", "300")


def test_velocities_of_positions_are_outputs_in_knots() -> None:
    known = ship()
    outputs = (*known.fit.problem.outputs, *GROUND_VELOCITY)
    fit = replace(known.fit, problem=replace(known.fit.problem, outputs=outputs))
    rms = {**known.runs[0].rms, "velocity_north": 1852 / 3600, "velocity_east": 926 / 3600}
    (table,) = (
        table
        for table in identification_tables(
            replace(known, fit=fit, runs=(replace(known.runs[0], rms=rms),))
        )
        if table.title.startswith("Fit")
    )
    at = table.columns.index("velocity north\n[kn]")
    assert table.columns[at + 1] == "velocity east\n[kn]"
    assert table.rows[0][at : at + 2] == ("1", "0.5")


def test_json_holds_numbers_in_si_and_none_where_nothing_is_identifiable() -> None:
    tree = json.loads(json.dumps(identification_json(ship()), allow_nan=False))
    assert tree["parameters"]["d"]["value"] == ship().parameters["d"]
    for name in ship().uncertainty.unidentifiable:
        entry = tree["parameters"][name]
        assert (entry["value"], entry["interval_95"], entry["identifiable"]) == (None, None, False)
        assert entry["recommended_manoeuvre"]
    (run,), (validation,) = tree["fit"], tree["validation"]
    assert run["residual_rms"]["yaw_rate"] == ship().runs[0].rms["yaw_rate"]
    assert {index["name"] for index in validation["indices"]} >= {"advance", "transfer"}
