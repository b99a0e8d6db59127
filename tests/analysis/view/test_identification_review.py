"""Review of an identified ship, read back from the file."""

import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from rrd_content import static_components
from trial_logs import as_log

from analysis.identification.fit.problem import residuals
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.view.identification_layout import identification_blueprint
from analysis.view.identification_review import write_identification_review
from analysis.view.parameter_panels import parameter_panels
from analysis.view.residual_panels import autocorrelation
from analysis.view.run_sheets import RunSheet, run_sheets
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import ShiplogError, TrialLog, load_vessel


def a_log(manoeuvre: str, seed: int, seconds: float = 400.0) -> TrialLog:
    vessel, toml = load_vessel("table1")
    trial = simulate(
        vessel, manoeuvre, duration_secs=seconds, seed=seed, sensors=suite("white"),
        vessel_toml=toml,
    )  # fmt: skip
    return as_log(trial, f"{manoeuvre} {seed}.mcap")


@cache
def ship() -> IdentifiedShip:
    logs = [a_log("zigzag-20-20", 0), a_log("zigzag-10-10", 1)]
    return identify(logs, "burylin", validation_logs=[a_log("turning-circle-35", 2, 500.0)])


@pytest.fixture(scope="module")
def review(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("review") / "ship.rrd"
    write_identification_review(ship(), path)
    return path


@cache
def sheets() -> list[RunSheet]:
    return run_sheets(ship())


def sheet_of(origin: str) -> RunSheet:
    return next(sheet for sheet in sheets() if sheet.origin == origin)


def entities(path: Path) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """Return the scalars of a file, by entity: times in s and values."""
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for chunk in RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        if "Scalars:scalars" in batch.schema.names and "time" in batch.schema.names:
            times = batch.column("time").cast("int64").to_numpy() * 1e-9
            values = np.array(batch.column("Scalars:scalars").to_pylist(), float)
            found.setdefault(chunk.entity_path, []).append((times, values))
    return found


def test_rerun_verifies_the_file(review: Path) -> None:
    command = [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(review)]
    subprocess.run(command, check=True, capture_output=True)


def test_each_run_is_drawn_measured_and_simulated(review: Path) -> None:
    drawn = entities(review)
    for origin in ("run_1", "run_2", "validation_1"):
        for name in ("yaw_rate", "speed"):
            for series in ("0_measured", "1_simulated"):
                assert f"/{origin}/{name}/{series}" in drawn
        assert f"/{origin}/correlation/yaw_rate" in drawn
    times, values = drawn["/run_1/yaw_rate/1_simulated"][0]
    expected = ship().fit.problem.predicted(ship().fit.minimum.unknowns, 0)[:, 0]
    np.testing.assert_allclose(values[:, 0], np.degrees(expected) * 60, rtol=1e-9)
    assert times[-1] == pytest.approx(400.0)


def test_residuals_are_measured_minus_simulated_over_their_standard_deviation() -> None:
    sheet = sheet_of("run_1")
    drawn = sheet.residuals[0].series[0].lines[0].values
    fit = ship().fit
    residual = residuals(fit.problem, fit.minimum.unknowns)[0][:, 0]
    predicted = fit.problem.predicted(fit.minimum.unknowns, 0)[:, 0]
    _, std = fit.noises[0].stds(predicted, 0.1)
    np.testing.assert_allclose(drawn, (residual / std)[np.isfinite(residual)], rtol=1e-9)
    assert 0.9 < np.std(drawn) < 1.1


def test_white_residuals_stay_within_the_bounds_and_slow_ones_do_not() -> None:
    rng = np.random.default_rng(0)
    white = rng.standard_normal(5000)
    found, count = autocorrelation(white, 200)
    assert np.mean(np.abs(found[1:]) > 2 / np.sqrt(count)) < 0.1
    slow, _ = autocorrelation(np.sin(np.arange(5000) / 100) + 0.1 * white, 200)
    assert slow[50] > 0.8


def test_an_autocorrelation_is_over_the_pairs_of_finite_values() -> None:
    rng = np.random.default_rng(1)
    values = rng.standard_normal(300)
    values[rng.random(300) < 0.3] = np.nan
    found, count = autocorrelation(values, 20)
    pairs = [values[: 300 - k] * values[k:] for k in range(21)]
    np.testing.assert_allclose(found, [np.nanmean(p) / np.nanmean(pairs[0]) for p in pairs])
    assert count == np.isfinite(values).sum()


def test_each_parameter_has_its_interval_and_all_histories(review: Path) -> None:
    drawn = entities(review)
    estimates = ship().uncertainty
    for name in estimates.names:
        for series in ("interval", "a_paper", "kalman", "windows"):
            assert f"/parameter_{name}/{series}" in drawn
    i = estimates.names.index("d")
    panel = parameter_panels(ship())[i]
    prefixed = float(panel.title.split()[1]), float(panel.title.split()[3])
    assert prefixed[0] * 1e-6 == pytest.approx(estimates.values[i], abs=estimates.std[i])
    interval = panel.series[0].lines
    assert interval[0].values[0] - interval[1].values[0] == pytest.approx(
        2 * 1.96e6 * estimates.std[i]
    )


def test_estimates_that_are_mostly_prior_are_faint() -> None:
    d = next(p for p in parameter_panels(ship()) if p.name == "parameter_d")
    paper = next(s for s in d.series if s.name == "a_paper")
    faint = [line for line in paper.lines if line.colour[3] < 100]
    mostly_data = [line for line in paper.lines if line.colour[3] == 255]
    assert len(faint) == len(mostly_data) == 2  # a line for each prior
    assert paper.lines[0] is mostly_data[0]  # whose colour is in the legend
    assert sum(np.isfinite(x.values).sum() for x in faint) > 10 * sum(
        np.isfinite(x.values).sum() for x in mostly_data
    )


def test_a_value_that_is_not_identifiable_is_not_drawn() -> None:
    circle = identify([a_log("turning-circle-35", 2, 500.0)], "burylin")
    b1 = next(p for p in parameter_panels(circle) if p.name == "parameter_b1")
    assert "not identifiable" in b1.title
    assert np.isnan(b1.series[0].lines[0].values).all()


def test_every_run_has_a_measured_and_a_simulated_track() -> None:
    for sheet in sheets():
        assert sheet.chart is not None
        assert sheet.chart.simulated is not None
        apart = np.hypot(*(sheet.chart.simulated[-1] - sheet.chart.track[-1]))
        assert apart < 50.0
        assert "grey: measured, blue: simulated" in sheet.chart.title


def test_the_track_of_a_circle_is_marked_at_90_and_180_degrees() -> None:
    chart = sheet_of("validation_1").chart
    assert chart is not None
    assert [mark.label for mark in chart.marks] == ["90°", "180°"]
    assert not chart.parts  # the colours are those of measured and simulated


def test_the_review_shows_validation_then_fits_and_residuals_before_the_parameters(
    review: Path,
) -> None:
    origins = [sheet.origin for sheet in sheets()]
    assert origins == ["validation_1", "run_1", "run_2"]
    blueprint = identification_blueprint(ship(), sheets(), parameter_panels(ship()))
    names = [tab.name for tab in blueprint.root_container.contents]
    assert names == [
        "validation: turning-circle-35 2.mcap",
        "fitted: zigzag-20-20 0.mcap",
        "fitted: zigzag-10-10 1.mcap",
        "residuals",
        "parameters (faint: mostly prior)",
        "summary",
    ]
    texts = static_components(review, "TextDocument:text")
    (page,) = texts["/summary"]
    assert page.index("## Validation") < page.index("## Parameters")
    (errors,) = texts["/validation_1/errors"]
    assert "advance [m]" in errors


def test_a_run_with_several_manoeuvres_has_a_sheet_for_each() -> None:
    assert sheet_of("run_1").manoeuvres == ()  # its one zig-zag is the run
    log, other = a_log("zigzag-20-20", 3), a_log("zigzag-20-20", 4)
    after = log["rudder"].measured_ns[-1] - log["rudder"].measured_ns[0] + 100_000_000
    channels = tuple(
        replace(
            first,
            values=np.concatenate((first.values, second.values)),
            measured_ns=np.concatenate((first.measured_ns, second.measured_ns + after)),
            received_ns=np.concatenate((first.received_ns, second.received_ns + after)),
        )
        for first, second in zip(log.channels, other.channels, strict=True)
    )
    (sheet,) = run_sheets(identify([replace(log, channels=channels)], "nomoto"))
    assert [each.name for each in sheet.manoeuvres] == ["1 zig-zag 20°/20°", "2 zig-zag 20°/20°"]
    second = sheet.manoeuvres[1]
    assert second.start_secs > 380
    assert {panel.name for panel in second.panels} >= {
        f"run_1/manoeuvre_2/{name}" for name in ("steering", "yaw_rate", "speed")
    }
    assert set(dict(sheet.charts())) == {"run_1", "run_1/manoeuvre_1", "run_1/manoeuvre_2"}


def test_many_runs_are_in_a_tab_and_their_residuals_in_several() -> None:
    runs = [sheet_of("run_1")] * 9
    blueprint = identification_blueprint(ship(), runs, parameter_panels(ship()))
    fitted, residuals, *_ = blueprint.root_container.contents
    assert (fitted.name, len(fitted.contents)) == ("fitted", 9)
    assert (residuals.name, len(residuals.contents)) == ("residuals", 3)


def test_a_run_without_a_heading_is_drawn_without_it() -> None:
    log = a_log("zigzag-20-20", 0)
    channels = tuple(each for each in log.channels if each.name != "heading")
    (sheet,) = run_sheets(identify([replace(log, channels=channels)], "nomoto"))
    names = [panel.name for panel in sheet.motion]
    assert names == [f"run_1/{name}" for name in ("steering/rudder", "yaw_rate", "speed")]


def test_the_same_identification_has_the_same_recording_id_and_no_warning_of_rerun(
    review: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_identification_review(ship(), tmp_path / "again.rrd")
    assert capfd.readouterr().err == ""
    ids = [
        RrdReader(str(path)).recordings()[0].recording_id
        for path in (review, tmp_path / "again.rrd")
    ]
    assert ids[0] == ids[1]


def test_an_unwritable_path_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(ShiplogError):
        write_identification_review(ship(), tmp_path / "no" / "such" / "folder.rrd")
    assert not list(tmp_path.iterdir())


def test_a_segment_is_drawn_at_its_own_time() -> None:
    log = a_log("zigzag-20-20", 0)
    rudder = log["rudder"]
    at = (rudder.measured_ns - rudder.measured_ns[0]) * 1e-9
    values = np.where((at >= 180) & (at < 220), np.nan, rudder.values)
    channels = tuple(replace(c, values=values) if c is rudder else c for c in log.channels)
    _, later = run_sheets(identify([replace(log, channels=channels)], "burylin"))
    yaw_rate = next(panel for panel in later.motion if panel.name.endswith("/yaw_rate"))
    measured, simulated = yaw_rate.series
    assert later.start_secs == pytest.approx(simulated.time_secs[0])
    assert later.start_secs > 200
    assert measured.time_secs[0] == pytest.approx(simulated.time_secs[0], abs=0.2)
    assert measured.time_secs[-1] == pytest.approx(simulated.time_secs[-1], abs=0.2)
