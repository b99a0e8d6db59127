"""Drawings aligned at the execute of their first manoeuvre: times, tracks, headings, review."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import SAMPLE_DATA
from rrd_content import static_components, view_titles

import shiplog
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.trial.log_manoeuvres import LogManoeuvres, find_log_manoeuvres
from analysis.view.execute_alignment import (
    aligned_at_execute,
    first_execute_of,
    track_from_execute,
)
from analysis.view.log_drawing import FirstExecute, LogDrawing, draw_log
from analysis.view.log_panels import log_panels
from analysis.view.log_review import write_log_review
from analysis.view.series import GREY, Line, Series


@pytest.fixture(scope="module")
def found() -> LogManoeuvres:
    return find_log_manoeuvres(shiplog.read(SAMPLE_DATA / "turning_circle_35.mcap"))


@pytest.fixture(scope="module")
def drawing() -> LogDrawing:
    return draw_log(shiplog.read(SAMPLE_DATA / "turning_circle_35.mcap"))


@pytest.fixture(scope="module")
def execute(found: LogManoeuvres) -> FirstExecute:
    first = first_execute_of(found)
    assert first is not None
    return first


def test_the_execute_is_the_instant_at_which_the_rudder_was_ordered(
    execute: FirstExecute, drawing: LogDrawing
) -> None:
    assert execute.manoeuvre == "turning circle 35° to starboard"
    assert execute.at_ns - drawing.zero_ns == pytest.approx(10e9, abs=0.1e9)


def test_a_speed_run_has_no_execute(found: LogManoeuvres) -> None:
    run = replace(found.spans[0], kind=ManoeuvreKind.SPEED_RUN)
    assert first_execute_of(replace(found, spans=(run,))) is None
    assert first_execute_of(replace(found, spans=(run, *found.spans))) is not None


def test_times_count_from_the_execute(drawing: LogDrawing, execute: FirstExecute) -> None:
    aligned = aligned_at_execute(drawing, execute)
    secs = (execute.at_ns - drawing.zero_ns) * 1e-9
    assert aligned.zero_ns == execute.at_ns
    for quantity, group in drawing.series.items():
        for before, after in zip(group, aligned.series[quantity], strict=True):
            np.testing.assert_allclose(after.time_secs, before.time_secs - secs)
    (rudder,) = next(group for q, group in aligned.series.items() if q.name == "rudder")
    moved = np.abs(rudder.lines[0].values) > 0.5
    assert rudder.time_secs[moved][0] == pytest.approx(0.2, abs=0.2)


def test_the_heading_of_a_circle_counts_from_that_before_the_execute(
    drawing: LogDrawing, execute: FirstExecute
) -> None:
    aligned = aligned_at_execute(drawing, execute)
    panel = log_panels([aligned, replace(aligned, name="again")])[0][0]
    assert panel.title.startswith("heading from that before the execute: ")
    heading = panel.series[0]
    before = heading.lines[0].values[heading.time_secs <= 0]
    assert abs(float(np.median(before))) < 0.1


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0])
def test_a_track_runs_up_along_its_approach_from_the_place_at_the_execute(heading: float) -> None:
    times = np.arange(-20.0, 40.0, 3.0)
    made = 50 + 20j + 7.0 * times * np.exp(1j * heading)
    lines = Line("north", made.real, GREY), Line("east", made.imag, GREY)
    track = track_from_execute(Series("track", times, lines), heading)
    np.testing.assert_allclose(track, np.column_stack((7.0 * times, 0 * times)), atol=1e-9)


def test_a_review_of_an_aligned_and_another_log_states_from_what_each_counts(
    drawing: LogDrawing, execute: FirstExecute, tmp_path: Path
) -> None:
    aligned = aligned_at_execute(drawing, execute)
    write_log_review([aligned, replace(drawing, name="other.mcap")], tmp_path / "a.rrd", "")
    (page,) = static_components(tmp_path / "a.rrd", "TextDocument:text")["/summary"]
    assert "from the execute of its turning circle 35° to starboard, 10.0 s after its start" in page
    assert "from the start of each other log" in page
    titles = view_titles(tmp_path / "a.rrd")
    assert "track from the execute, approach heading up or track from its start, north up" in titles
