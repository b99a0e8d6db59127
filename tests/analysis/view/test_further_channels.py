"""The channels that a replay does not use, as a review draws them."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from channels import START, channel
from places import SAMPLE_DATA
from rrd_content import static_components, tab_names, view_titles
from trial_logs import InChunks

import shiplog
from analysis.replay.passes import OPTIONAL_CHANNELS, REQUIRED_CHANNELS
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.view.further_channels import FurtherChannels
from analysis.view.panels import Panel
from analysis.view.replay_review import write_replay_review
from analysis.view.series import Series
from shiplog.resampling import Clock
from shiplog.screening import screen_values
from shiplog.types import Channel, Log, TrialLog

DURATION = 100.0  # s, of the clock
TIMES = np.arange(0.0, 101.0)


def panels_of(
    log: Log, *, start_ns: int = START, full: bool = False, sources: dict[str, str] | None = None
) -> dict[str, Panel]:
    """Return the panels of a log on a clock of `DURATION`, by title."""
    screened = screen_values(log, (*REQUIRED_CHANNELS, *OPTIONAL_CHANNELS), sources=sources)
    further = FurtherChannels(screened.screening, Clock(start_ns, 0.1, 1001, {}), full=full)
    for chunk in log.chunks():
        further.add(chunk)
    return {panel.title: panel for panel in further.panels()}


def panel_of(*channels: Channel) -> Panel:
    (panel,) = panels_of(TrialLog("a.mcap", channels)).values()
    return panel


def drawn(panel: Panel) -> dict[str, Series]:
    return {series.lines[0].name: series for series in panel.series}


def from_source(source: str, each: Channel, unit: str | None = None) -> Channel:
    return replace(each, source=source, unit=unit or each.unit)


def points(series: Series) -> list[list[float]]:
    return np.column_stack((series.time_secs, series.lines[0].values)).tolist()


@pytest.mark.parametrize(
    ("name", "unit", "title", "factor"),
    [
        ("heel", "rad", "heel [deg]", 180 / np.pi),
        ("roll", "rad", "roll [deg]", 180 / np.pi),
        ("pitch", "rad", "pitch [deg]", 180 / np.pi),
        ("power", "W", "power [kW]", 1e-3),
        ("torque", "Nm", "torque [kNm]", 1e-3),
        ("thrust", "N", "thrust [kN]", 1e-3),
        ("draught", "m", "draught [m]", 1.0),
        ("depth", "m", "depth [m]", 1.0),
        ("wind_speed", "m/s", "wind speed [kn]", 3600 / 1852),
        ("propeller_pitch", "1", "propeller pitch [%]", 100.0),
        ("satellites", "1", "satellites", 1.0),
        ("fuel_flow", "kg/h", "fuel flow [kg/h]", 1.0),
        ("thruster_azimuth", "rad", "thruster azimuth [deg]", 180 / np.pi),
    ],
)
def test_a_further_channel_is_drawn_at_its_own_times_in_the_unit_people_use(
    name: str, unit: str, title: str, factor: float
) -> None:
    times = (np.arange(300) / 3 + np.random.default_rng(1).uniform(0, 0.3, 300)).round(6)
    values = np.abs(np.sin(times / 10))
    panel = panel_of(from_source("a", channel(values, times, name), unit))
    (series,) = panel.series
    assert (panel.title, panel.legend) == (title, False)
    np.testing.assert_allclose(series.time_secs, times, rtol=0, atol=1e-9)
    np.testing.assert_allclose(series.lines[0].values, values * factor, rtol=1e-12)
    assert not series.steps


def test_nothing_is_drawn_of_what_a_replay_shows_and_of_what_a_log_lacks() -> None:
    log = shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap")
    assert {c.name for c in log} == {*REQUIRED_CHANNELS, "heading", "position"}
    assert list(panels_of(log, start_ns=log.span_ns[0])) == ["heading [deg]"]
    clock = from_source("gnss", channel(START * 1e-9 + TIMES, TIMES, "gnss_time"))
    assert panels_of(TrialLog("a.mcap", (clock,))) == {}
    empty = channel(np.full(101, np.nan), TIMES, "power")
    assert panels_of(TrialLog("a.mcap", (empty,))) == {}
    late = channel(np.ones(50), TIMES[:50] + DURATION + 1, "power")
    assert panels_of(TrialLog("a.mcap", (late,))) == {}


def test_sources_of_one_quantity_share_a_panel_with_a_legend() -> None:
    port, starboard = np.full(101, 80.0), np.full(101, 82.0) + np.arange(101) % 2
    log = TrialLog(
        "a.mcap",
        (
            from_source("port", channel(port, TIMES, "rpm")),
            from_source("starboard", channel(starboard, TIMES, "rpm")),
        ),
    )
    panel = panels_of(log)["rpm"]
    assert panel.legend
    assert list(drawn(panel)) == ["port (used)", "starboard"]
    assert drawn(panel)["starboard"].lines[0].values.tolist() == starboard.tolist()
    colours = {series.lines[0].colour for series in panel.series}
    assert len(colours) == 2
    chosen = panels_of(log, sources={"rpm": "starboard"})["rpm"]
    assert list(drawn(chosen)) == ["port", "starboard (used)"]


def test_one_source_of_a_channel_that_the_replay_uses_is_not_drawn_again() -> None:
    log = TrialLog("a.mcap", (channel(np.full(101, 80.0), TIMES, "rpm"),))
    assert panels_of(log) == {}


def test_an_order_is_drawn_in_steps_with_what_it_commands() -> None:
    rudder = channel(np.radians(np.sin(TIMES / 10)), TIMES, "rudder")
    order = channel(np.radians([5.0, 20.0, -20.0]), np.array([-30.0, 10.0, 60.0]), "rudder_order")
    panel = panel_of(rudder, from_source("bridge", order))
    assert panel.title == "rudder [deg]"
    series = drawn(panel)["rudder order, bridge"]
    assert series.steps
    np.testing.assert_allclose(
        points(series), [[0, 5], [10, 20], [60, -20], [60, -20], [100, -20]], rtol=1e-12
    )
    assert not drawn(panel)["a"].steps


def test_an_order_alone_has_its_own_panel_and_one_before_the_clock_holds_throughout() -> None:
    order = channel(np.array([2.0]), np.array([-5.0]), "heading_order")
    panel = panel_of(from_source("autopilot", order, "rad"))
    assert panel.title == "heading order [deg]"
    angle = np.degrees(2.0)
    np.testing.assert_allclose(points(panel.series[0]), [[0, angle], [100, angle]], rtol=1e-12)


def test_steps_are_drawn_where_the_metadata_state_hold_and_not_where_they_state_linear() -> None:
    power = from_source("a", channel(np.array([1e6, 2e6]), np.array([0.0, 50.0]), "power"))
    held = replace(power, metadata={"interpolation": "hold"})
    assert points(panel_of(held).series[0])[-1] == [100.0, 2000.0]
    order = from_source("order", channel(np.arange(101.0), TIMES, "power"))
    assert panel_of(order).series[0].steps
    linear = replace(order, metadata={"interpolation": "linear"})
    assert not panel_of(linear).series[0].steps


def test_a_gap_is_not_joined() -> None:
    times = np.delete(TIMES, slice(40, 60))
    series = panel_of(channel(times.copy(), times, "power")).series[0]
    (gap,) = np.flatnonzero(np.isnan(series.lines[0].values))
    assert 39 < series.time_secs[gap] < 60
    np.testing.assert_allclose(np.delete(series.time_secs, gap), times, atol=1e-9)


def test_angles_do_not_jump_and_compasses_agree_to_within_a_turn() -> None:
    angle = np.radians(358.0) + 0.2 * np.sin(TIMES / 20)
    gyro = from_source("gyro", channel(angle % (2 * np.pi), TIMES, "heading"))
    satellite = from_source("gps", channel((angle + 0.05) % (2 * np.pi), TIMES, "heading"))
    for channels in ((gyro, satellite), (satellite, gyro)):
        first, second = (series.lines[0].values for series in panel_of(*channels).series)
        assert np.abs(np.diff(first)).max() < 1.0
        np.testing.assert_allclose(np.abs(second - first), np.degrees(0.05), rtol=1e-9)


def test_values_that_no_ship_has_are_not_drawn_of_an_unused_source_either() -> None:
    good = np.radians(10 * np.sin(TIMES / 10))
    bad = np.where(np.arange(101) == 50, 9.99, good)
    channels = (
        from_source("a", channel(good, TIMES, "rudder")),
        from_source("b", channel(bad, TIMES, "rudder")),
    )
    series = drawn(panel_of(*channels))["b"]
    assert 50.0 not in series.time_secs
    assert len(series.time_secs) == 100


def test_a_sample_of_an_earlier_time_is_not_drawn() -> None:
    times = np.array([0.0, 1.0, 3.0, 2.0, 4.0])
    each = channel(times.copy(), times, "power")
    each = replace(each, received_ns=START + 10**9 * np.arange(5))
    assert panel_of(each).series[0].time_secs.tolist() == [0, 1, 3, 4]


def test_components_are_lines_of_their_own() -> None:
    stamps = START + (TIMES * 1e9).astype(np.int64)
    values = np.column_stack((TIMES, -TIMES))
    each = Channel("acceleration", "mru", "m/s2", stamps, stamps, values, ("x", "y"))
    panel = panel_of(each)
    (series,) = panel.series
    assert [line.name for line in series.lines] == ["mru x", "mru y"]
    assert series.lines[1].values.tolist() == (-TIMES).tolist()
    assert panel.legend


def many_channels() -> TrialLog:
    rng = np.random.default_rng(2)
    fast = np.sort(rng.uniform(-20, 120, 5000)).round(6)
    fast = fast[(fast < 30) | (fast > 45)]
    noise = rng.standard_normal(len(fast))
    order = np.sort(rng.uniform(-20, 120, 12)).round(6)
    return TrialLog(
        "a.mcap",
        (
            channel(0.5 * noise, fast, "roll"),
            channel((6.2 + 0.3 * noise) % (2 * np.pi), fast, "wind_direction"),
            channel(np.where(noise > 2.5, np.nan, noise), fast, "pitch", lag=0.3),
            from_source("port", channel(80 + noise, fast, "rpm")),
            from_source("starboard", channel(81 + noise, fast, "rpm")),
            channel(np.radians(np.arange(12.0)), order, "rudder_order"),
        ),
    )


@pytest.mark.parametrize("points_kept", [500, 20_000])
@pytest.mark.parametrize("cuts", [[20.0], [0.001, 19.99, 20.01, 50.0, 51.0, 66.6, 139.0]])
def test_where_a_log_is_cut_changes_no_series(
    points_kept: int, cuts: Sequence[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("analysis.view.decimation.POINTS", points_kept)
    log = many_channels()
    whole, parts = panels_of(log), panels_of(InChunks(log, list(cuts)))
    assert list(whole) == list(parts)
    assert len(whole) == 5
    for title, panel in whole.items():
        for series, part in zip(panel.series, parts[title].series, strict=True):
            np.testing.assert_array_equal(series.time_secs, part.time_secs)
            for line, other in zip(series.lines, part.lines, strict=True):
                np.testing.assert_array_equal(line.values, other.values)


def test_a_long_channel_keeps_its_extremes_or_every_sample_in_full(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("analysis.view.decimation.POINTS", 500)
    log = many_channels()
    times = (log["roll"].measured_ns - START) * 1e-9
    on_clock = np.degrees(log["roll"].values[(times >= 0) & (times <= DURATION)])
    few, all_ = (panels_of(log, full=full)["roll [deg]"].series[0] for full in (False, True))
    assert np.isfinite(all_.lines[0].values).sum() == len(on_clock)
    assert len(few.time_secs) < 1000
    for series in (few, all_):
        values = series.lines[0].values
        assert (np.nanmin(values), np.nanmax(values)) == (on_clock.min(), on_clock.max())
        assert np.isnan(values).sum() == 1


# ---- in the review


@pytest.fixture(scope="module")
def log(zigzag_log: TrialLog) -> TrialLog:
    """Return a zig-zag with two shafts, an order, and a source and a quantity of several words."""
    rudder, rpm, heading = (zigzag_log[name] for name in ("rudder", "rpm", "heading"))
    start = int(rudder.measured_ns[0])
    stamps = start + 10**9 * np.array([10, 200])
    order = Channel("rudder_order", "bridge", "rad", stamps, stamps, np.radians([20.0, -20.0]))
    power = replace(rpm, name="power", source="shaft meter #1", unit="W", values=rpm.values * 2e5)
    further = (
        from_source("port", rpm),
        replace(rpm, source="starboard", values=rpm.values * 1.01),
        order,
        power,
        replace(heading, name="bow azimuth", source="unit"),
    )
    channels = (*(c for c in zigzag_log if c.name != "rpm"), *further)
    return replace(zigzag_log, channels=channels)


@pytest.fixture(scope="module")
def analysis(log: TrialLog) -> Analysis:
    return analyse(log)


def test_the_review_has_a_view_of_each_further_quantity(
    log: TrialLog, analysis: Analysis, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "trial.rrd"
    write_replay_review(analysis, path, text="", log=log)
    counts = Counter(view_titles(path))
    for title in ("rudder [deg]", "rpm", "power [kW]", "bow azimuth [deg]"):
        assert counts[title] == 1
    assert "further channels" in tab_names(path)
    names = {
        entity: each
        for entity, each in static_components(path, "SeriesLines:names").items()
        if entity.startswith("/further/")
    }
    assert names == {
        "/further/0_rudder/0_simulated": ["simulated"],
        "/further/0_rudder/1_rudder_order_bridge": ["rudder order, bridge"],
        "/further/1_rpm/0_port_used_": ["port (used)"],
        "/further/1_rpm/1_starboard": ["starboard"],
        "/further/2_power/0_shaft_meter_1": ["shaft meter #1"],
        "/further/3_bow_azimuth/0_unit": ["unit"],
    }
    modes = static_components(path, "SeriesLines:interpolation_mode")
    stepped = {entity for entity, mode in modes.items() if mode == [2]}
    assert stepped == {"/further/0_rudder/1_rudder_order_bridge"}
    assert capfd.readouterr().err == ""


def test_without_further_channels_the_review_has_no_tab_of_them(
    log: TrialLog, tmp_path: Path
) -> None:
    few = tuple(c for c in log if c.name in REQUIRED_CHANNELS and c.source != "starboard")
    bare = replace(log, channels=few)
    path = tmp_path / "trial.rrd"
    write_replay_review(analyse(bare), path, text="", log=bare)
    assert not [e for e in static_components(path, "SeriesLines:names") if e.startswith("/further")]
    assert "further channels" not in tab_names(path)


def test_entities_of_one_panel_differ_even_if_only_signs_distinguish_the_sources() -> None:
    first, second = (channel(np.ones(101) * k, TIMES, "power") for k in (1, 2))
    panel = panel_of(from_source("a b", first), from_source("a#b", second))
    entities = [f"{panel.name}/{series.name}" for series in panel.series]
    assert len(set(entities)) == 2
