"""Sheets of manoeuvres: panels, track with marks, colours, and events."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind, ManoeuvreMark
from analysis.view.manoeuvre_sheets import (
    MANOEUVRE_COLOURS,
    ManoeuvreSheet,
    manoeuvre_colour,
    manoeuvre_events,
    manoeuvre_sheet,
    with_manoeuvres,
)
from analysis.view.motion_panels import MotionHistory
from analysis.view.series import GREY, Line, Series
from analysis.view.track_chart import TrackChart, make_chart

RADIUS, RATE = 500.0, 0.01  # m, rad/s, of a circle to starboard that is steady from the execute
EXECUTE, END = 100.0, 100.0 + 2 * pi / RATE
TIMES = np.arange(0.0, END + 100)
TURNED = RATE * np.clip(TIMES - EXECUTE, 0.0, None)
SPAN = ManoeuvreSpan(
    number=2, kind=ManoeuvreKind.TURNING_CIRCLE, title="turning circle 35° to starboard",
    start_secs=10.0, execute_secs=EXECUTE, end_secs=END, approach_heading=pi / 2,
    marks=(
        ManoeuvreMark("execute", 0.0),
        ManoeuvreMark("90°", pi / 2 / RATE),
        ManoeuvreMark("180°", pi / RATE),
    ),
)  # fmt: skip
AHEAD = np.where(TIMES < EXECUTE, RADIUS * RATE * (TIMES - EXECUTE), RADIUS * np.sin(TURNED))
ABEAM = RADIUS * (1 - np.cos(TURNED))
# the approach is to the east: ahead is east, starboard is south
TRACK = Series("track", TIMES, (Line("north", -ABEAM, GREY), Line("east", AHEAD, GREY)))
HISTORY = MotionHistory(
    TIMES,
    np.where(TIMES < EXECUTE, 0.0, 0.6),
    np.full(len(TIMES), 80.0),
    {"heading": pi / 2 + TURNED, "yaw_rate": np.gradient(TURNED), "speed": np.full(len(TIMES), 5)},
)


@pytest.fixture(scope="module")
def sheet() -> ManoeuvreSheet:
    return manoeuvre_sheet(SPAN, HISTORY, [TRACK], 150.0, "m")


@pytest.fixture(scope="module")
def whole_chart() -> TrackChart:
    positions = np.column_stack((-ABEAM, AHEAD))
    chart = make_chart("track", positions, TIMES, None, None)
    assert chart is not None
    return chart


def test_a_sheet_has_heading_rudder_yaw_rate_and_speed_over_the_manoeuvre(
    sheet: ManoeuvreSheet,
) -> None:
    assert sheet.name == "2 turning circle 35°"
    titles = [panel.title for panel in sheet.panels]
    assert titles[0].startswith("heading from 90.0°: 0 to 359")
    assert titles[1].startswith("rudder: 0 to 34")
    assert titles[2].startswith("yaw rate [deg/min]: 0 to 34")
    assert titles[3] == "speed [kn]: 9.719"
    assert (sheet.start_secs, sheet.end_secs) == (EXECUTE - 30, END)
    for panel in sheet.panels:
        for series in panel.series:
            assert sheet.start_secs <= series.time_secs[0] <= series.time_secs[-1] <= END


def test_the_execute_is_a_vertical_line(sheet: ManoeuvreSheet) -> None:
    stroke = sheet.panels[0].series[0]
    assert stroke.time_secs.tolist() == [EXECUTE] * 3
    assert stroke.lines[0].values[:2].tolist() == list(sheet.panels[0].limits)


def test_the_track_runs_up_from_the_execute_and_is_marked_at_90_and_180_degrees(
    sheet: ManoeuvreSheet,
) -> None:
    assert sheet.chart is not None
    marks = {mark.label: mark.point for mark in sheet.chart.marks}
    # (to starboard, astern): y points down
    np.testing.assert_allclose(marks["execute"], [0, 0], atol=0.1)
    np.testing.assert_allclose(marks["90°"], [RADIUS, -RADIUS], atol=0.1)
    np.testing.assert_allclose(marks["180°"], [2 * RADIUS, 0], atol=0.1)


def test_without_positions_a_sheet_has_no_track() -> None:
    nowhere = replace(TRACK, time_secs=np.zeros(0), lines=tuple(
        replace(line, values=np.zeros(0)) for line in TRACK.lines
    ))  # fmt: skip
    assert manoeuvre_sheet(SPAN, HISTORY, [nowhere], None, "m").chart is None
    assert manoeuvre_sheet(SPAN, HISTORY, [], None, "m").chart is None


def test_on_the_track_of_the_trial_a_manoeuvre_has_its_number_its_colour_and_its_turns(
    whole_chart: TrackChart,
) -> None:
    chart = with_manoeuvres(whole_chart, [SPAN])
    assert chart is not None
    (part,) = chart.parts
    assert (part.label, part.colour) == ("2", manoeuvre_colour(SPAN))
    np.testing.assert_allclose(part.points[0], [0, 0], atol=1e-9)
    assert [mark.label for mark in chart.marks] == ["90°", "180°"]
    assert with_manoeuvres(None, [SPAN]) is None


def test_neighbouring_manoeuvres_differ_in_colour() -> None:
    spans = [replace(SPAN, number=number) for number in range(1, 13)]
    colours = [manoeuvre_colour(span) for span in spans]
    assert all(len(set(colours[i : i + 6])) == 6 for i in range(len(colours) - 5))
    assert len(set(MANOEUVRE_COLOURS)) == len(MANOEUVRE_COLOURS)


def test_events_of_a_manoeuvre_are_its_marks_and_its_end() -> None:
    events = manoeuvre_events([SPAN], 10**18)
    assert [event.text for event in events] == [
        "turning circle 35° to starboard, execute", "90°", "180°", "end",
    ]  # fmt: skip
    assert {event.source for event in events} == {"manoeuvre 2"}
    assert events[0].time_ns == 10**18 + 100 * 10**9
