"""Logs drawn without a replay: panels, gaps, marks, tracks, and the review in Rerun."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from channels import START, Values, channel
from geographic import geographic_log
from places import SAMPLE_DATA
from rrd_content import static_components, tab_names, view_titles
from trial_logs import InChunks

import shiplog
from analysis.trial.log_manoeuvres import find_log_manoeuvres
from analysis.view.log_drawing import LogDrawing, draw_log
from analysis.view.log_panels import log_panels
from analysis.view.log_review import write_log_review
from analysis.view.panels import Panel
from shiplog.errors import LogError
from shiplog.types import Event, EventLevel, TrialLog

TIMES = np.arange(0.0, 101.0)
TURN = np.radians(30 + 20 * np.sin(TIMES / 10))  # a heading
RUDDER = np.radians(np.where(np.cos(TIMES / 10) > 0, 10.0, -10.0))
ZIGZAG = TrialLog(
    "zigzag.mcap",
    (channel(TURN, TIMES, "heading"), channel(RUDDER, TIMES, "rudder")),
)


def panels_of(*logs: TrialLog) -> list[Panel]:
    main, others = log_panels([draw_log(log) for log in logs])
    return [*main, *others]


def lines(panel: Panel) -> dict[str, Values]:
    return {line.name: line.values for series in panel.series for line in series.lines}


def test_the_rudder_of_a_zigzag_is_drawn_over_the_heading_from_that_at_the_start() -> None:
    (panel,) = panels_of(ZIGZAG)
    start = float(np.median(np.degrees(TURN[:11])))
    assert panel.title.startswith(f"heading from {start:.1f}°: ")
    assert panel.title.endswith("; rudder: -10 to 10 [deg]")
    np.testing.assert_allclose(lines(panel)["heading"], np.degrees(TURN) - start)
    np.testing.assert_allclose(lines(panel)["rudder"], np.degrees(RUDDER))
    assert panel.legend


def test_a_heading_just_west_of_north_is_0_and_not_360_degrees() -> None:
    heading = channel(np.full(101, -1e-4), TIMES, "heading")
    (panel,) = panels_of(replace(ZIGZAG, channels=(heading, ZIGZAG["rudder"])))
    assert panel.title.startswith("heading from 0.0°: ")


def test_in_a_turning_circle_heading_and_rudder_have_a_panel_each() -> None:
    heading = channel(np.radians(5 * TIMES) % (2 * np.pi), TIMES, "heading")
    log = replace(ZIGZAG, channels=(heading, ZIGZAG["rudder"]))
    assert [panel.title for panel in panels_of(log)] == [
        "heading [deg]: 0 to 500",
        "rudder [deg]: -10 to 10",
    ]


def test_yaw_rate_is_drawn_in_degrees_a_minute_with_its_range_in_the_title() -> None:
    (panel,) = panels_of(TrialLog("a", (channel(np.radians(TIMES / 60), TIMES),)))
    assert panel.title == "yaw rate [deg/min]: 0 to 100"
    np.testing.assert_allclose(lines(panel)["a"], TIMES, atol=1e-12)


def test_speeds_through_the_water_and_over_the_ground_share_a_panel() -> None:
    speeds = [channel(np.full(101, k), TIMES, n) for k, n in enumerate(("rpm", "heel"))]
    ground = channel(np.full(101, 8.0), TIMES, "speed_over_ground")
    water = channel(np.full(101, 9.0), TIMES, "speed")
    titles = [panel.title for panel in panels_of(TrialLog("a", (*speeds, ground, water)))]
    assert titles == [
        "speed and speed over ground [kn]: 15.55 to 17.49; at 0 rpm",
        "heel [deg]: 57.3",
    ]


def test_revolutions_have_a_panel_where_they_vary_or_have_a_gap_or_stand_alone() -> None:
    kept = np.r_[0:20, 45:101]
    speed = channel(np.full(101, 5.0), TIMES, "speed")
    for times, values in ((TIMES, 60 + TIMES / 10), (TIMES[kept], np.full(76, 80.0))):
        rpm = channel(values, times, "rpm")
        assert panels_of(TrialLog("a", (speed, rpm)))[-1].name == "channels_rpm"
    alone = channel(np.full(101, 80.0), TIMES, "rpm")
    assert [panel.title for panel in panels_of(TrialLog("a", (alone,)))] == ["rpm: 80"]


def test_a_quantity_in_an_unknown_unit_is_drawn_in_it_alone() -> None:
    odd = [
        replace(channel(TIMES / 1000, TIMES, name), unit="bar/h")
        for name in ("yaw_rate", "heading")
    ]
    log = TrialLog("a", (*odd, ZIGZAG["rudder"]))
    titles = [panel.title for panel in panels_of(log)]
    assert titles == [
        "rudder [deg]: -10 to 10",
        "yaw rate [bar/h]: 0 to 0.1",
        "heading [bar/h]: 0 to 0.1",
    ]


@pytest.mark.parametrize("count", [0, 1])
def test_a_log_of_one_sample_or_of_none_that_is_measured_has_a_review(
    tmp_path: Path, count: int
) -> None:
    values = np.where(np.arange(5) < count, 0.5, np.nan)
    log = TrialLog("a", (channel(values, name="heading"), channel(values, name="rudder")))
    write_log_review([draw_log(log)], tmp_path / "a.rrd", "")
    assert (len(view_titles(tmp_path / "a.rrd")) > 1) == (count == 1)


def test_a_gap_is_a_red_bar_at_the_foot_and_an_event() -> None:
    kept = np.r_[0:20, 45:101]
    log = TrialLog("a", (channel(np.sin(TIMES[kept]), TIMES[kept], "speed"),))
    drawing = draw_log(log)
    (panel,) = log_panels([drawing])[0]
    gaps = panel.series[-1]
    assert gaps.name == "gaps"
    assert gaps.time_secs.tolist() == [19.0, 45.0, 45.0]
    assert gaps.lines[0].values[:2].tolist() == [panel.limits[0]] * 2
    (event,) = drawing.events
    assert (event.level, event.source) == (EventLevel.WARNING, "speed/a")
    assert event.text == "a gap, 26.0 s"
    assert event.time_ns == START + 19 * 10**9
    assert any("1 gap, the longest 26.0 s" in text for text in drawing.warnings)


def test_marks_of_people_are_vertical_lines_and_other_events_are_not() -> None:
    events = Event(START + 5 * 10**9, "execute"), Event(START, "connected", "udp://x")
    (panel,) = panels_of(replace(ZIGZAG, events=events))
    marks = panel.series[0]
    assert marks.name == "00_marks"
    assert marks.time_secs.tolist() == [5.0, 5.0, 5.0]
    assert marks.lines[0].values[:2].tolist() == list(panel.limits)


def test_several_logs_are_drawn_from_their_own_start_with_a_colour_each() -> None:
    later = tuple(
        replace(each, measured_ns=each.measured_ns + 10**12, received_ns=each.received_ns + 10**12)
        for each in ZIGZAG
    )
    (panel,) = panels_of(ZIGZAG, replace(ZIGZAG, name="later.mcap", channels=later))
    names = [
        f"{log}, {each}" for log in ("zigzag.mcap", "later.mcap") for each in ("heading", "rudder")
    ]
    assert list(lines(panel)) == names
    assert all(series.time_secs[0] == 0.0 for series in panel.series)
    colours = [series.lines[0].colour for series in panel.series]
    assert colours[0] == colours[1] != colours[2] == colours[3]


def test_what_cannot_be_used_is_reported_and_the_rest_is_drawn() -> None:
    speed = np.full(101, 5.0)
    speed[50], backwards = np.inf, TIMES.copy()
    backwards[60] -= 10
    log = TrialLog("a", (channel(speed, TIMES, "speed"), channel(TIMES, backwards, "rpm")))
    drawing = draw_log(log)
    assert any("/speed/a has 1 infinite value" in text for text in drawing.warnings)
    assert any("/rpm/a has measured times that run backwards" in text for text in drawing.warnings)
    assert len(log_panels([drawing])[0]) == 2


def test_a_log_without_samples_cannot_be_viewed() -> None:
    with pytest.raises(LogError, match=r"nothing to view, no samples of shiplog: .*: a\.mcap"):
        draw_log(TrialLog("a.mcap", ()))


def test_chunks_change_nothing_of_a_drawing() -> None:
    log = shiplog.read(SAMPLE_DATA / "zigzag_10_10_dropouts.mcap")
    whole, parts = draw_log(log), draw_log(InChunks(log, [1.05, 17.0, 300.0]))
    assert list(whole.series) == list(parts.series)
    for one, other in zip(_all_series(whole), _all_series(parts), strict=True):
        np.testing.assert_array_equal(one.time_secs, other.time_secs)
        for a, b in zip(one.lines, other.lines, strict=True):
            np.testing.assert_array_equal(a.values, b.values)


def _all_series(drawing: LogDrawing) -> list:
    return [*(each for group in drawing.series.values() for each in group), drawing.track]


@pytest.fixture(scope="module")
def ship() -> LogDrawing:
    """Return the drawing of a log with positions on the earth, and with a mark."""
    log = geographic_log(shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap"))
    return draw_log(replace(log, events=(Event(log.span_ns[0], "execute"),)))


def test_the_review_of_a_log_has_its_panels_its_track_its_events_and_a_map(
    ship: LogDrawing, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "trial.rrd"
    write_log_review([ship], path, "# trial")
    panels = {panel.title for panel in log_panels([ship])[0]}
    others = {
        "track from its start, north up",
        "summary",
        "events",
        "map (tiles from the internet)",
    }
    assert set(view_titles(path)) == panels | others
    (points,) = static_components(path, "GeoLineStrings:line_strings")["/map/0"]
    assert points[0] == pytest.approx([60.0, 20.0], abs=1e-9)
    assert len(points) == 601
    (page,) = static_components(path, "TextDocument:text")["/summary"]
    assert page.startswith("# trial")
    assert capfd.readouterr().err == ""


def test_the_manoeuvres_of_a_log_have_tabs_colours_and_events(
    ship: LogDrawing, tmp_path: Path
) -> None:
    path = tmp_path / "trial.rrd"
    found = find_log_manoeuvres(shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap"))
    write_log_review([replace(ship, manoeuvres=found)], path, "")
    assert "1 zig-zag 20°/20°" in tab_names(path)
    assert static_components(path, "LineStrips2D:labels")["/track/0/manoeuvres"] == ["1"]
    labels = static_components(path, "Points2D:labels")
    assert labels["/manoeuvre_1/track/marks"][:2] == ["execute", "execute 2"]
    names = static_components(path, "SeriesLines:names")
    assert names["/channels_heading/00_execute_1"] == ["1 zig-zag 20°/20°"]
    assert names["/manoeuvre_1/speed/0_measured"] == ["measured"]
    without = [replace(ship, manoeuvres=replace(found, spans=()))]
    write_log_review(without, path, "")
    assert "/track/0/manoeuvres" not in static_components(path, "LineStrips2D:labels")


def test_a_gap_and_a_mark_are_named_in_the_legend() -> None:
    kept = np.r_[0:20, 45:101]
    log = TrialLog("a", (channel(np.sin(TIMES[kept]), TIMES[kept], "speed"),))
    assert log_panels([draw_log(log)])[0][0].legend
    assert not log_panels([draw_log(TrialLog("a", (channel(TIMES, TIMES, "speed"),)))])[0][0].legend


def test_the_review_of_several_logs_has_a_track_and_a_colour_for_each(
    ship: LogDrawing, tmp_path: Path
) -> None:
    path = tmp_path / "trial.rrd"
    write_log_review([ship, draw_log(replace(ZIGZAG, name="other.mcap"))], path, "")
    assert set(static_components(path, "LineStrips2D:strips")) == {
        f"/track/0/{part}" for part in ("line", "ships", "scale")
    }
    assert "events" not in view_titles(path)
    names = static_components(path, "SeriesLines:names")
    assert ["other.mcap, heading"] in names.values()


def test_a_long_log_is_decimated_and_keeps_its_extremes() -> None:
    values = np.sin(np.arange(100_000) / 5000)
    values[77_777] = 1.5
    drawing = draw_log(TrialLog("a", (channel(values, name="heel"),)))
    ((series,),) = drawing.series.values()
    assert len(series.time_secs) < 25_000
    assert np.degrees(1.5) == pytest.approx(series.lines[0].values.max())
