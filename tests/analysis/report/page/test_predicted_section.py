"""The section of predicted indices: beside limits and what was sailed, or the reason without."""

import re
from dataclasses import replace
from functools import cache
from math import degrees

import pytest
from predicted_ships import ship_with_positions, ship_without_positions
from trial_reports import trial_report

from analysis.identification.identified_ship import IdentifiedShip
from analysis.report.page.numbering import manoeuvre_places
from analysis.report.page.predicted_section import PredictedSection, predicted_section
from analysis.report.page.report_page import report_page
from analysis.report.page.trial_json import trial_json


def section_of(ship: IdentifiedShip) -> PredictedSection:
    return predicted_section(ship, manoeuvre_places(trial_report())[0])


@cache
def page_of(*, positions: bool) -> str:
    ship = ship_with_positions() if positions else ship_without_positions()
    return report_page(replace(trial_report(), identified=ship))


def test_a_manoeuvre_that_was_sailed_has_its_measured_indices_beside_the_predicted_ones() -> None:
    starboard, port, zigzag, *others = section_of(ship_with_positions()).tables
    assert [row.measured for row in starboard.rows[:3]] == ["612.3 ± 15.7 m", "", "700.0 ± 17.6 m"]
    assert starboard.rows[0].index.place is not None
    assert starboard.rows[0].index.place.position == 1
    assert port.rows[0].index.place is not None
    assert port.rows[0].index.place.position == 2
    overshoot = next(row for row in zigzag.rows if row.index.name == "overshoot 1")
    assert overshoot.measured.startswith("10.5")
    assert not any(row.measured for table in others for row in table.rows)


def test_a_row_has_limit_verdict_and_largest_source() -> None:
    section = section_of(ship_with_positions())
    advance = section.tables[0].rows[0]
    assert (advance.index.limit, advance.index.paragraph) == ("4.5 L", "5.3.1")
    assert advance.index.verdict in ("meets", "fails", "not decided")
    assert advance.source in ("parameters", "choice of model", "rudder zero", "model error")
    assert advance.source_std.endswith(" m")
    overshoot = section.tables[2].rows[2].index
    limit = ship_with_positions().predictions[2].indices[2].criterion
    assert limit is not None
    assert overshoot.limit == f"{degrees(limit.limit):.1f}°"
    assert "extrapolated" in section.tables[0].note
    assert "approach speed" in section.basis


def test_without_the_length_no_value_is_in_lengths_and_the_drift_has_its_reason() -> None:
    section = section_of(ship_without_positions())
    assert "length is not given" in section.notes[0]
    advance = section.tables[0].rows[0]
    assert (advance.index.value, advance.index.lengths, advance.index.limit) == ("–", "", "")
    assert "not identifiable without positions or sway" in advance.index.note
    assert (advance.source, advance.source_std) == ("", "")


def test_without_predictions_the_section_has_the_reason() -> None:
    ship = replace(ship_with_positions(), predictions=(), approach=None, no_predictions="one run")
    section = section_of(ship)
    assert (section.tables, section.notes) == ((), ("Not predicted: one run.",))
    page = report_page(replace(trial_report(), identified=ship))
    assert "Not predicted: one run." in page


@pytest.mark.parametrize("positions", [True, False])
def test_the_page_has_a_table_of_each_standard_manoeuvre(positions: bool) -> None:
    page = page_of(positions=positions)
    assert page.count('class="short predicted"') == 6
    text = re.sub("<[^>]*>", " ", page[page.index('id="predicted"') :])
    assert "Turning circle 35° to port" in text
    assert ("not identifiable without positions or sway" in text) != positions
    assert page.count("Predicted by slipstream") == 1


def test_the_report_s_json_has_the_predictions() -> None:
    tree = trial_json(replace(trial_report(), identified=ship_with_positions()))
    assert len(tree["identified"]["predictions"]) == 6
