"""The sample logs agree with their references and come near to their truths."""

from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from filter_runs import FILTERS, SMOOTHABLE
from places import KVLCC2, SAMPLE_DATA
from tanker_logs import tanker_log

from analysis.check.compare import compare, logs_in
from analysis.replay.replay import analyse
from shiplog import TrialLog, load_vessel, read
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.settings import DISTURBANCES

LOGS = logs_in(SAMPLE_DATA)


@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_every_sample_log_agrees_with_its_reference(log: Path) -> None:
    comparison = compare(log)
    assert comparison.ok, str(comparison)


@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_the_filter_brings_every_sample_log_nearer_to_its_truth(log: Path) -> None:
    found, truth = analyse(read(log)), read(log.with_suffix(".truth.mcap"))
    at = (truth["yaw_rate"].measured_ns - found.signals.start_ns) * 1e-9
    inside = (at >= 0) & (at <= found.signals.time_secs[-1])
    for name, state in (("yaw_rate", 0), ("speed", 3)):
        times, values = found.signals.time_secs, found.estimates.states[:, state]
        estimated = np.interp(at[inside], times, values) - truth[name].values[inside]
        there = np.isfinite(found.signals[name])
        true = np.interp(times[there], at, truth[name].values)
        measured = found.signals[name][there] - true
        better = 3 if "dropouts" not in log.name or name == "speed" else 1  # a bias stays
        assert np.std(measured) / np.std(estimated) > better


@cache
def start_of(log: Path) -> TrialLog:
    """Return the first minutes of a sample log; the tests above replay the whole."""
    return read(log).between(0.0, 250.0)


KINDS = [(kind, False) for kind in FILTERS] + [(kind, True) for kind in SMOOTHABLE]
SETS = [list(s) for n in (1, 2, 3) for s in combinations(DISTURBANCES, n)]


@pytest.mark.parametrize(("kind", "smooth"), KINDS)
@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_every_filter_replays_every_sample_log(log: Path, kind: str, smooth: bool) -> None:
    found = analyse(start_of(log), settings={"filter.kind": kind, "filter.smooth": smooth})
    estimates = found.estimates
    assert np.isfinite(estimates.states).all()
    assert np.isfinite(estimates.stds).all()
    accepted = sum(residuals.count for residuals in found.findings.residuals)
    assert accepted > 0.7 * np.isfinite(estimates.innovations).sum()


@pytest.mark.parametrize("models", SETS, ids="+".join)
@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.stem)
def test_every_disturbance_model_runs_on_every_sample_log(log: Path, models: list[str]) -> None:
    found = analyse(start_of(log), settings={"disturbance.models": models})
    assert np.isfinite(found.disturbance.yaw).all()
    assert np.isfinite(found.disturbance.surge).all()
    assert (found.disturbance.yaw_wave is None) == ("wave" not in models)


def test_the_sample_logs_are_small_and_have_a_vessel_file() -> None:
    names = {log.stem for log in LOGS}
    assert {"turning_circle_35", "zigzag_20_20", "pseudo_random"} <= names
    assert any(name.startswith("zigzag_10_10") for name in names)
    for log in LOGS:
        assert log.stat().st_size < 1_000_000
        assert log.with_suffix(".ref.mcap").stat().st_size < 300_000
        assert read(log).vessel_toml is not None


def test_the_vessel_files_are_the_presets() -> None:
    for name, text in PRESETS.items():
        path = SAMPLE_DATA / "vessels" / f"{name}.toml"
        assert path.read_text(encoding="utf-8") == text
        assert load_vessel(path)[0].coefficients == load_vessel(name)[0].coefficients


RUNS = sorted(KVLCC2.glob("*/*.dat"))


@pytest.mark.slow
@pytest.mark.skipif(not RUNS, reason="the SIMMAN data are not in ../shared/data/kvlcc2")
@pytest.mark.parametrize(("kind", "smooth"), KINDS)
@pytest.mark.parametrize("run", RUNS, ids=lambda run: run.stem)
def test_every_filter_replays_every_run_of_the_kvlcc2(run: Path, kind: str, smooth: bool) -> None:
    found = analyse(tanker_log(run), settings={"filter.kind": kind, "filter.smooth": smooth})
    assert np.isfinite(found.estimates.states).all()
    assert np.isfinite(found.estimates.stds).all()
    assert found.estimates.rejected.mean() < 0.01
