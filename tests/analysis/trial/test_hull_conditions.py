"""Conditions of a trial from `[hull]` of the vessel file, and their lines of the form."""

from analysis.report.page.condition_rows import condition_groups
from analysis.trial.hull_conditions import with_hull_conditions
from analysis.trial.trial_analysis import TrialConditions
from shiplog.vessel.hull import Hull
from shiplog.vessel.vessel import Vessel

HULL = Hull(
    breadth=32.0, draught=10.0, block_coefficient=0.7, rudder_area=36.0, rudder_height=8.0,
    propeller_diameter=7.0, propeller_pitch_ratio=0.8, propeller_turning="left",
)  # fmt: skip
VESSEL = Vessel("a ship", None, length=200.0, hull=HULL)


def rows_of(stated: dict[str, str]) -> dict[str, str]:
    conditions = TrialConditions("a ship", 200.0, stated=with_hull_conditions(stated, VESSEL))
    return {row.label: row.text for group in condition_groups([conditions]) for row in group.rows}


def test_a_hull_fills_the_lines_of_the_form() -> None:
    rows = rows_of({})
    expected = {
        "Breadth B": "32 m",
        "Block coefficient CB": "0.7",
        "L/B": "6.25",
        "B/T": "3.2",
        "Rudder: total area": "36 m2",
        "Rudder: area / (L·T)": "0.018",
        "Rudder: aspect ratio": "1.7778",
        "Propeller: diameter": "7 m",
        "Propeller: pitch / diameter": "0.8",
        "Propeller: turning ahead": "left-handed",
        "Mean draught T": "10 m",
        "Draught forward": "",
    }
    assert {label: rows[label] for label in expected} == expected


def test_what_the_log_states_precedes_and_loadings_are_not_mixed() -> None:
    rows = rows_of({"breadth": "31 m", "draught_forward": "7 m", "draught_aft": "8 m"})
    assert (rows["Breadth B"], rows["Mean draught T"]) == ("31 m", "7.5 m")
    assert (
        with_hull_conditions({"displacement": "41000 t"}, VESSEL)
        .keys()
        .isdisjoint({"block_coefficient"})
    )


def test_a_given_dimension_is_printed_as_given_and_a_computed_one_rounded() -> None:
    hull = Hull(breadth=58.0, draught=20.8, displacement=312_622.5)
    stated = with_hull_conditions({}, Vessel("", None, length=320.0, hull=hull))
    assert (stated["displacement"], stated["block_coefficient"]) == ("312622.5 t", "0.7901")


def test_without_a_vessel_the_conditions_are_those_of_the_log() -> None:
    assert with_hull_conditions({"breadth": "31 m"}, None) == {"breadth": "31 m"}
    assert with_hull_conditions({}, Vessel("", None)) == {}
