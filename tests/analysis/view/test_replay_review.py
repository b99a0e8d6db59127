import shutil
import subprocess
import sys
from dataclasses import fields, replace
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from places import SAMPLE_DATA
from rerun.chunk import RrdReader
from rrd_content import tab_names, view_titles
from stderr_lines import foreign_lines

import shiplog
from analysis.disturbance.disturbances import Disturbance
from analysis.filters.base import Estimates
from analysis.regression.sliding import CoefficientHistory
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis, ReplayChunk
from analysis.replay.track import EMPTY_TRACK
from analysis.view.decimation import Decimator
from analysis.view.panels import limits
from analysis.view.replay_panels import (
    Drawn,
    equation_panels,
    history_panels,
    trial_panels,
)
from analysis.view.replay_review import write_replay_review
from analysis.view.series import Line, MeasuredSamples, Series
from analysis.view.series_builder import SeriesBuilder
from analysis.view.track_chart import draw_track
from analysis.view.viewer import view_review
from benchmarks.changed_ship import changed_trial
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog.errors import ShiplogError
from shiplog.types import Event, EventLevel
from shiplog.vessel.vessel_parser import load_vessel

RERUN = shutil.which("rerun", path=str(Path(sys.executable).parent))
GREY, BLUE = (140, 140, 140, 255), (66, 150, 245, 255)


def replayed(**sensors: float) -> Analysis:
    vessel, text = load_vessel("table1")
    settings = {key.replace("__", "."): value for key, value in sensors.items()}
    trial = simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=400,
        seed=1,
        sensors=suite("paper", settings),
        vessel_toml=text,
    )
    return analyse(shiplog.TrialLog("zigzag_20_20.mcap", trial.channels, {}, text))


Whole = TypeVar("Whole", Estimates, Disturbance)


def cut_of(whole: Whole, cut: slice) -> Whole:
    arrays = {f.name: getattr(whole, f.name) for f in fields(whole)}
    return replace(whole, **{name: a[cut] for name, a in arrays.items() if a is not None})


def part_of(analysis: Analysis, start: int, stop: int) -> ReplayChunk:
    """A chunk of the trial, though what was identified and the track are whole in each."""
    cut = slice(start, stop)
    estimates, found = analysis.estimates, analysis.disturbance
    return ReplayChunk(
        analysis.signals.part(start, stop),
        cut_of(estimates, cut),
        cut_of(found, cut),
        analysis.yaw_history,
        analysis.surge_history,
        analysis.track,
    )


def drawn_of(analysis: Analysis) -> Drawn:
    sketch = SeriesBuilder(analysis.findings.plan.clock, analysis.findings.plan.stats)
    sketch.add(analysis.as_chunk())
    return sketch.result()


@pytest.fixture(scope="module")
def analysis() -> Analysis:
    return replayed()


@pytest.fixture(scope="module")
def gappy() -> Analysis:
    return replayed(yaw_rate__dropout=0.1, yaw_rate__dropout_secs=20)


@pytest.fixture(scope="module")
def review(analysis: Analysis, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("review") / "trial.rrd"
    write_replay_review(analysis, path, text="# What was found")
    return path


def columns(path: Path, entity: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seconds, stamps and values, (n, k), of an entity."""
    batches = [
        chunk.to_record_batch()
        for chunk in RrdReader(path).stream()
        if chunk.entity_path == f"/{entity}" and not chunk.is_static
    ]
    assert batches, f"no entity {entity}"
    at, stamps, values = (
        np.concatenate([np.array(batch[name].to_pylist(), float) for batch in batches])
        if name == "Scalars:scalars"
        else np.concatenate([batch[name].to_numpy(zero_copy_only=False) for batch in batches])
        for name in ("time", "stamp", "Scalars:scalars")
    )
    order = np.argsort(at, kind="stable")
    return at[order].astype(np.int64) * 1e-9, stamps[order].astype(np.int64), values[order]


def static(path: Path, entity: str, component: str) -> list[Any]:
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == f"/{entity}" and chunk.is_static:
            batch = chunk.to_record_batch()
            if component in batch.schema.names:
                return list(batch[component].to_pylist()[0])
    pytest.fail(f"no {component} in {entity}")


def events_of(path: Path) -> Any:  # noqa: ANN401 - a record batch of pyarrow
    """The events of a review, as one batch."""
    chunks = (chunk for chunk in RrdReader(path).stream() if chunk.entity_path == "/events")
    (batch,) = (chunk.to_record_batch() for chunk in chunks)
    return batch


def layout(path: Path, component: str) -> list[Any]:
    """The values of one component of the blueprint, in no order."""
    reader = RrdReader(path)
    batches = (c.to_record_batch() for c in reader.stream(store=reader.blueprints()[0]))
    return [row[0] for b in batches if component in b.schema.names for row in b[component].tolist()]


def test_outputs_are_drawn_in_degrees_a_minute_and_knots(review: Path, analysis: Analysis) -> None:
    for name, state, scale in (("yaw_rate", 0, 180 / pi * 60), ("speed", 3, 3600 / 1852)):
        at, _, measured = columns(review, f"{name}/measured")
        np.testing.assert_allclose(at, analysis.signals.time_secs, atol=1e-9)
        np.testing.assert_allclose(measured[:, 0], analysis.signals[name] * scale, rtol=1e-12)
        _, _, drawn = columns(review, f"{name}/state")
        value, std = analysis.estimates.states[:, state], analysis.estimates.stds[:, state]
        expected = np.column_stack((value + 2 * std, value - 2 * std, value)) * scale
        np.testing.assert_allclose(drawn, expected, rtol=1e-9, atol=1e-12)


def test_inputs_disturbances_and_residuals(review: Path, analysis: Analysis) -> None:
    _, _, rudder = columns(review, "steering/rudder/measured")
    np.testing.assert_allclose(rudder[:, 0], np.degrees(analysis.signals["rudder"]), rtol=1e-12)
    found = analysis.disturbance
    _, _, yaw = columns(review, "disturbance_yaw/estimate")
    np.testing.assert_allclose(yaw[:, 0], np.degrees(found.yaw) * 1e6, rtol=1e-12)
    _, _, surge = columns(review, "disturbance_surge/estimate")
    np.testing.assert_allclose(surge[:, 0], found.surge * 1000, rtol=1e-12)
    _, _, band = columns(review, "disturbance_surge/bounds")
    np.testing.assert_allclose(
        band[0],
        np.array([2, -2]) * analysis.findings.disturbances["surge"].noise_std * 1000,
        rtol=1e-12,
    )
    _, _, residual = columns(review, "innovation_speed/normalised")
    expected = analysis.estimates.innovations[:, 1] / analysis.estimates.innovation_stds[:, 1]
    np.testing.assert_allclose(residual[:, 0], expected, rtol=1e-12)


def test_coefficients_stand_beside_the_model(review: Path, analysis: Analysis) -> None:
    at, _, drawn = columns(review, "coefficient_d/per_window")
    history = analysis.yaw_history
    column = history.names.index("d")
    shown = np.isfinite(drawn[:, 2])
    value, std = history.values[shown, column], history.stds[shown, column]
    np.testing.assert_allclose(at, history.time_secs, atol=1e-9)
    assert shown.mean() > 0.5
    np.testing.assert_allclose(drawn[shown, 2], value * 1e6, rtol=1e-9)
    np.testing.assert_allclose(drawn[shown, 0] - drawn[shown, 2], 2 * std * 1e6, rtol=1e-6)
    ends, _, model = columns(review, "coefficient_d/model")
    np.testing.assert_allclose(model[:, 0], analysis.findings.plan.vessel.coefficients.d * 1e6)
    np.testing.assert_allclose(ends, [0, analysis.signals.time_secs[-1]])


def test_both_timelines_have_the_same_instants(review: Path, analysis: Analysis) -> None:
    at, stamps, _ = columns(review, "yaw_rate/state")
    np.testing.assert_array_equal(stamps, analysis.signals.timestamps_ns)
    np.testing.assert_allclose((stamps - stamps[0]) * 1e-9, at, atol=1e-9)


def test_measured_is_drawn_under_the_estimate(review: Path) -> None:
    entities = {c.entity_path for c in RrdReader(review).stream() if c.entity_path.count("/") == 2}
    drawn = sorted(entity for entity in entities if entity.startswith("/yaw_rate/"))
    assert drawn == ["/yaw_rate/measured", "/yaw_rate/state"]  # Rerun's order: the last on top
    assert static(review, "yaw_rate/state", "SeriesLines:names") == ["±2σ", "±2σ", "estimate"]
    assert len(static(review, "yaw_rate/state", "SeriesLines:widths")) == 3


def test_the_heading_is_drawn_from_its_first_value_with_the_rudder_over_it(
    review: Path, analysis: Analysis
) -> None:
    _, _, heading = columns(review, "steering/heading/measured")
    measured = analysis.signals["heading"]
    known = measured[np.isfinite(measured)]
    np.testing.assert_allclose(heading[:, 0], np.degrees(known - known[0]), atol=1e-9)
    steering = next(t for t in view_titles(review) if t.startswith("heading from "))
    assert "; rudder: -20 to 20 [deg]" in steering


def test_the_blueprint_has_a_tab_for_each_kind_of_result_and_one_for_the_manoeuvre(
    review: Path,
) -> None:
    assert {name for name in tab_names(review) if name} == {
        "trial", "1 zig-zag 20°/20°", "filter", "coefficients",
    }  # fmt: skip
    titles = view_titles(review)
    for expected in (
        "yaw disturbance [10⁻⁶ deg/s³]", "surge disturbance [mm/s²]",
        "yaw rate innovation / expected σ", "speed innovation / expected σ",
        "track, north up: recorded positions", "track from the execute, approach heading up",
        "summary", "events",
    ):  # fmt: skip
        assert titles.count(expected) == 1
    for beginning in ("heading from ", "yaw rate [deg/min]: ", "speed [kn]: "):
        assert sum(title.startswith(beginning) for title in titles) == 2  # trial and manoeuvre
    coefficients = sorted(name.split()[0] for name in titles if "±" in name)
    assert coefficients == ["a", "b1", "b2", "b3", "d", "e", "f", "g", "h"]
    assert len(titles) == 2 * 3 + 8 + 9
    assert layout(review, "TimePanelBlueprint:timeline") == ["time"]


def test_constant_revolutions_are_in_a_title_and_others_have_a_panel(analysis: Analysis) -> None:
    drawn = drawn_of(analysis)
    *_, speed = trial_panels(drawn)
    assert speed.title.endswith("; at 80 rpm")
    (line,) = drawn["rpm/measured"].lines
    lower = replace(line, values=line.values * np.linspace(1.0, 0.5, len(line.values)))
    changed = {**drawn, "rpm/measured": replace(drawn["rpm/measured"], lines=(lower,))}
    assert trial_panels(changed)[-1].title == "rpm: 40 to 80"


def test_a_manoeuvre_is_an_event_and_a_part_of_the_track(review: Path) -> None:
    first = events_of(review)["TextLog:text"].to_pylist()[0][0]
    assert first == "0:00:10 manoeuvre 1: zig-zag 20°/20°, first to starboard, execute"
    assert static(review, "track/manoeuvres", "LineStrips2D:labels") == ["1"]
    labels = static(review, "manoeuvre_1/track/marks", "Points2D:labels")
    assert labels[:3] == ["execute", "execute 2", "overshoot 1"]


def test_the_text_is_on_the_page(review: Path) -> None:
    assert static(review, "summary", "TextDocument:text") == ["# What was found"]
    assert static(review, "summary", "TextDocument:media_type") == ["text/markdown"]


def test_name_and_properties(review: Path, analysis: Analysis) -> None:
    assert static(review, "__properties", "RecordingInfo:name") == ["zigzag_20_20.mcap"]
    start = static(review, "__properties", "RecordingInfo:start_time")
    assert start == [analysis.signals.start_ns]
    assert static(review, "__properties/trial", "vessel") == [analysis.findings.plan.vessel.name]


def test_the_same_analysis_has_the_same_names(
    review: Path, analysis: Analysis, gappy: Analysis, tmp_path: Path
) -> None:
    write_replay_review(analysis, tmp_path / "again.rrd", text="")
    write_replay_review(gappy, tmp_path / "other.rrd", text="")
    (first,), (again,), (other,) = (
        RrdReader(path).recordings()
        for path in (review, tmp_path / "again.rrd", tmp_path / "other.rrd")
    )
    assert (first.recording_id, first.application_id) == (again.recording_id, again.application_id)
    assert other.recording_id != first.recording_id


def test_rerun_verifies_the_file(review: Path) -> None:
    assert RERUN
    done = subprocess.run(
        [RERUN, "rrd", "verify", str(review)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_gap_is_not_drawn(gappy: Analysis, tmp_path: Path) -> None:
    path = tmp_path / "gappy.rrd"
    write_replay_review(gappy, path, text="")
    known = np.isfinite(gappy.signals["yaw_rate"])
    for entity in ("yaw_rate/measured", "innovation_yaw_rate/normalised"):
        at, _, values = columns(path, entity)
        drawn = np.isfinite(values[:, 0])
        np.testing.assert_allclose(at[drawn], gappy.signals.time_secs[known], atol=1e-9)
        gaps = [
            (a, b) for a, b in pairwise(gappy.signals.time_secs[known].tolist()) if b - a > 1.001
        ]
        assert gaps
        for start, end in gaps:  # Rerun breaks a line at NaN
            inside = (at > start + 1e-6) & (at < end - 1e-6)
            assert inside.any()
            assert not drawn[inside].any()


def measured_only(values: np.ndarray, cuts: tuple[int, ...] = ()) -> tuple[list[int], list[float]]:
    """Instants and values that are drawn of a sensor, its values given in chunks."""
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    samples = MeasuredSamples(max(5.0 * np.median(steps), 10.0) if len(steps) else 10.0)
    found = [
        samples.step(first, part[:, None])
        for first, part in zip((0, *cuts), np.split(values, cuts), strict=True)
    ]
    rows, columns = zip(*found, strict=True)
    return np.concatenate(rows).tolist(), np.concatenate(columns)[:, 0].tolist()


@pytest.mark.parametrize("cuts", [(), (25,), (40, 41, 69, 90)])
def test_a_slow_sensor_is_one_line(cuts: tuple[int, ...]) -> None:
    values = np.full(100, np.nan)
    values[::10] = 1.0
    values[40:70] = np.nan
    rows, seen = measured_only(values, cuts)
    assert np.isnan(seen).sum() == 0  # three seconds are four periods of this sensor
    assert rows == [0, 10, 20, 30, 70, 80, 90]
    values[30:90] = np.nan
    rows, seen = measured_only(values, cuts)
    assert np.isnan(seen).tolist() == [False, False, False, True, False]
    assert rows[3] == 21


def test_nothing_measured_is_nothing_drawn() -> None:
    assert measured_only(np.full(5, np.nan)) == ([], [])


def test_decimation_keeps_extremes_gaps_and_ends() -> None:
    rng = np.random.default_rng(1)
    count, points = 100_003, 2000
    at = np.arange(count) * 0.1
    first, second = rng.standard_normal((2, count))
    first[12_345], second[67_890] = 50.0, -60.0
    first[40_000:40_020] = np.nan  # shorter than a bucket
    second[50_000:60_000] = np.nan
    size = -(-count // (points // 4))
    for cuts in ((), (1, 12_345, 40_010, 70_000)):
        thinning = Decimator(size * 0.1)
        for part in np.split(np.column_stack((at, first, second)), cuts):
            lines = Line("first", part[:, 1], GREY), Line("second", part[:, 2], BLUE)
            thinning.add(Series("s", part[:, 0], lines))
        thin = thinning.result()
        assert len(thin.time_secs) <= points + 6
        for line, whole in zip(thin.lines, (first, second), strict=True):
            rows = np.round(thin.time_secs / 0.1).astype(int)
            assert np.all(np.diff(rows) > 0)
            np.testing.assert_array_equal(line.values, whole[rows])
            for start in range(0, count, size):
                bucket = whole[start : start + size]
                kept = line.values[(rows >= start) & (rows < start + size)]
                if np.isfinite(bucket).any():
                    assert np.nanmax(kept) == np.nanmax(bucket)
                    assert np.nanmin(kept) == np.nanmin(bucket)
                assert np.isnan(kept).any() == np.isnan(bucket).any()
        assert (thin.time_secs[0], thin.time_secs[-1]) == (at[0], at[-1])


def test_a_long_trial_is_decimated_unless_in_full(
    analysis: Analysis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("analysis.view.decimation.POINTS", 500)
    for full in (False, True):
        path = tmp_path / f"{full}.rrd"
        write_replay_review(analysis, path, text="", full=full)
        at, _, drawn = columns(path, "yaw_rate/state")
        value = np.degrees(analysis.estimates.states[:, 0]) * 60
        assert (len(at) == len(value)) == full
        assert len(at) > 100
        assert (drawn[:, 2].min(), drawn[:, 2].max()) == pytest.approx((value.min(), value.max()))
        assert static(path, "yaw_rate/state", "SeriesLines:names") == ["±2σ", "±2σ", "estimate"]
        at, _, _ = columns(path, "steering/rudder/measured")
        assert (len(at) == len(value)) == full


def test_a_review_drawn_in_chunks_is_the_same(analysis: Analysis) -> None:
    whole = drawn_of(analysis)
    sketch = SeriesBuilder(analysis.findings.plan.clock, analysis.findings.plan.stats)
    count = len(analysis.signals)
    for start in range(0, count, 777):
        sketch.add(part_of(analysis, start, min(start + 777, count)))
    for entity, series in sketch.result().items():
        if entity.startswith(("coefficient", "track")):
            continue  # given whole
        np.testing.assert_array_equal(series.time_secs, whole[entity].time_secs)
        for line, other in zip(series.lines, whole[entity].lines, strict=True):
            np.testing.assert_array_equal(line.values, other.values)


def test_wild_values_do_not_squeeze_an_axis() -> None:
    values = np.sin(np.arange(1000) / 50)
    values[3] = 1e6
    low, high = limits(values)
    assert -1.1 < low <= -1
    assert 1 <= high < 3
    assert limits(np.full(3, np.nan)) == (-1.0, 1.0)
    low, high = limits(np.full(3, 80.0))
    assert low < 80 < high


def test_wild_windows_do_not_squeeze_a_coefficient(analysis: Analysis) -> None:
    history = analysis.yaw_history
    values, stds = history.values.copy(), history.stds.copy()
    values[:40] *= -1e4
    stds[:40] *= 1e4
    wild = replace(analysis, yaw_history=replace(history, values=values, stds=stds))
    normal, drawn = (history_panels(a.findings, drawn_of(a))[0] for a in (analysis, wild))
    assert np.diff(drawn.limits) < 3 * np.diff(normal.limits)


def test_a_single_window_is_drawn_as_a_line(analysis: Analysis) -> None:
    history = analysis.yaw_history
    only = CoefficientHistory(
        history.names,
        history.time_secs[:1],
        history.values[:1],
        history.stds[:1],
        history.conditions[:1],
    )
    single = replace(analysis, yaw_history=only)
    for panel in history_panels(single.findings, drawn_of(single))[:6]:
        _, window = panel.series
        assert window.time_secs.tolist() == [0.0, analysis.signals.time_secs[-1]]
        assert all(len(line.values) == 2 for line in window.lines)


def test_a_coefficient_that_no_window_determines_is_not_drawn(
    analysis: Analysis, tmp_path: Path
) -> None:
    history = analysis.yaw_history
    values = history.values.copy()
    values[:, 1] = np.nan
    empty = CoefficientHistory(("f", "g", "h"), *(np.empty(s) for s in (0, (0, 3), (0, 3), 0)))
    some = replace(analysis, yaw_history=replace(history, values=values), surge_history=empty)
    names = [panel.name for panel in history_panels(some.findings, drawn_of(some))]
    assert names == [f"coefficient_{name}" for name in ("a", "b2", "b3", "d", "e")]
    none = replace(some, yaw_history=replace(history, values=np.full_like(values, np.nan)))
    write_replay_review(none, tmp_path / "none.rrd", text="")
    assert "coefficients" not in tab_names(tmp_path / "none.rrd")


def test_the_chart_has_east_right_and_north_up(review: Path, analysis: Analysis) -> None:
    (line,) = static(review, "track/line", "LineStrips2D:strips")
    expected = np.column_stack((analysis.track.east, -analysis.track.north))
    np.testing.assert_allclose(line, expected, rtol=1e-5, atol=1e-3)
    assert static(review, "track/ends", "Points2D:labels") == ["start", "end"]
    drawn = draw_track(analysis.findings, drawn_of(analysis))
    assert drawn is not None
    bow, stern = drawn.ships[0][0], drawn.ships[0][2:4].mean(axis=0)
    assert bow[1] < stern[1]  # headed north at first, and y points down
    length, unit = drawn.scale_label.split()
    assert drawn.scale[1, 0] - drawn.scale[0, 0] == float(length) * {"m": 1, "km": 1000}[unit]
    nowhere = replace(analysis, track=EMPTY_TRACK)
    assert draw_track(nowhere.findings, drawn_of(nowhere)) is None


def test_left_and_right_panels_belong_together(analysis: Analysis) -> None:
    yaw, surge = equation_panels(analysis.findings, drawn_of(analysis))
    assert len(yaw) == len(surge)


@pytest.mark.parametrize("name", ["missing/trial.rrd", "folder"])
def test_an_unwritable_path_leaves_nothing(name: str, analysis: Analysis, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(ShiplogError, match="cannot write"):
        write_replay_review(analysis, tmp_path / name, text="")
    assert [path.name for path in tmp_path.rglob("*")] == ["folder"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a screen cannot be taken away")
def test_without_a_screen_the_viewer_says_so(review: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ShiplogError, match="viewer cannot start here"):
        view_review(review)


def test_the_command_writes_a_review_without_a_warning_of_rerun(tmp_path: Path) -> None:
    """The process of the command does not import pandas, which Rerun's axes must survive."""
    sample = shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap")
    power = replace(sample["rpm"], name="shaft power", source="meter #1, port: à", unit="W")
    log, review = tmp_path / "trial 1, été.mcap", tmp_path / "review.rrd"
    shiplog.write(replace(sample, channels=(*sample, power)), log)
    command = [sys.executable, "-m", "shiplog", "replay", str(log), "-o", str(review)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert foreign_lines(done.stderr) == []
    assert all(layout(review, "TimeAxis:view_range"))


def test_a_change_of_a_coefficient_is_a_warning_at_its_instant(tmp_path: Path) -> None:
    vessel, toml = load_vessel("table1")
    log = changed_trial(
        vessel, "zigzag-20-20", {"d": 0.8}, at_secs=600.0, duration_secs=1200.0, seed=0,
        sensors=suite("white"), vessel_toml=toml,
    )  # fmt: skip
    execute = Event(log["yaw_rate"].measured_ns[0] + 10**9, "execute")
    found = analyse(replace(log, events=(execute,)))
    path = tmp_path / "changed.rrd"
    write_replay_review(found, path, text="")
    batch = events_of(path)
    levels = [row[0] for row in batch["TextLog:level"].to_pylist()]
    (warning,) = (number for number, level in enumerate(levels) if level == "WARN")
    text = batch["TextLog:text"].to_pylist()[warning][0]
    assert " replay: d changed by -19.9 %" in text
    at = batch["time"].to_numpy(zero_copy_only=False).astype(np.int64)[warning] * 1e-9
    assert abs(at - 600) < 100
    assert "events" in view_titles(path)


def test_events_are_texts_with_their_levels_on_both_timelines(
    analysis: Analysis, tmp_path: Path
) -> None:
    start_ns = analysis.signals.start_ns
    events = (
        Event(start_ns + 60 * 10**9, "execute, 20 starboard"),
        Event(start_ns + 61 * 10**9, "no data", "gps", EventLevel.WARNING),
    )
    path = tmp_path / "events.rrd"
    findings = replace(analysis.findings, events=events)
    write_replay_review(replace(analysis, findings=findings), path, text="")
    batch = events_of(path)
    texts = [row[0] for row in batch["TextLog:text"].to_pylist()]
    first = texts.index("0:01:00 operator: execute, 20 starboard")
    assert texts[first + 1] == "0:01:01 gps: no data"
    levels = [row[0] for row in batch["TextLog:level"].to_pylist()]
    assert levels[first : first + 2] == ["INFO", "WARN"]
    since = batch["time"].to_numpy(zero_copy_only=False).astype(np.int64)
    assert since[first : first + 2].tolist() == [60 * 10**9, 61 * 10**9]
    assert (np.diff(since) >= 0).all()
