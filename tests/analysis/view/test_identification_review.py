"""Review of an identified ship, read back from the file."""

import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fitted_runs import a_trial
from rerun.chunk import RrdReader
from trial_logs import as_log

from analysis.identification.fit.problem import residuals
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.view.identification_panels import autocorrelation, parameter_panels, run_sheets
from analysis.view.identification_review import write_identification_review
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import ShiplogError, TrialLog, load_vessel
from shiplog.ships.motion import MODEL_OUTPUTS


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
            for series in ("measured", "simulated"):
                assert f"/{origin}/{name}/{series}" in drawn
        assert f"/{origin}/correlation/yaw_rate" in drawn
    times, values = drawn["/run_1/yaw_rate/simulated"][0]
    expected = ship().fit.problem.predicted(ship().fit.minimum.unknowns, 0)[:, 0]
    np.testing.assert_allclose(values[:, 0], np.degrees(expected), rtol=1e-9)
    assert times[-1] == pytest.approx(400.0)


def test_residuals_are_measured_minus_simulated_over_their_standard_deviation() -> None:
    sheet = next(run_sheets(ship()))
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
    faint = [line for line in paper.lines if "mostly prior" in line.name]
    mostly_data = [line for line in paper.lines if "mostly prior" not in line.name]
    assert all(line.colour[3] < 100 for line in faint)
    assert sum(np.isfinite(x.values).sum() for x in faint) > 10 * sum(
        np.isfinite(x.values).sum() for x in mostly_data
    )


def test_a_value_that_is_not_identifiable_is_not_drawn() -> None:
    circle = identify([a_log("turning-circle-35", 2, 500.0)], "burylin")
    b1 = next(p for p in parameter_panels(circle) if p.name == "parameter_b1")
    assert "not identifiable" in b1.title
    assert np.isnan(b1.series[0].lines[0].values).all()


def test_validation_runs_have_a_measured_and_a_simulated_track() -> None:
    sheets = list(run_sheets(ship()))
    assert [sheet.track is not None for sheet in sheets] == [False, False, True]
    track = sheets[2].track
    assert track is not None
    assert track.simulated is not None
    apart = np.hypot(*(track.simulated[-1] - track.track[-1]))
    assert apart < 50.0


def test_a_run_without_a_heading_is_drawn() -> None:
    assert not a_trial().has("heading")
    names = [panel.name.split("/")[1] for panel in next(run_sheets(ship())).outputs]
    assert names == [name for name in MODEL_OUTPUTS if name in ("yaw_rate", "speed")]


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
    sheets = list(run_sheets(identify([replace(log, channels=channels)], "burylin")))
    measured, simulated = sheets[1].outputs[0].series
    assert measured.time_secs[0] == pytest.approx(simulated.time_secs[0], abs=0.2)
    assert measured.time_secs[-1] == pytest.approx(simulated.time_secs[-1], abs=0.2)
