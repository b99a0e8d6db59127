"""The benchmarks: every line runs, both sides of a comparison compute the same, limits apply."""

import json
import runpy
import sys
from collections import namedtuple
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from places import PROJECT
from rerun.chunk import RrdReader

from analysis.filters.factory import filter_states
from analysis.identification.parallel import usable_cores
from analysis.replay.replay import analyse
from analysis.view.replay_review import write_replay_review
from benchmarks import (
    filters,
    identification,
    identification_speed,
    logs,
    measure,
    ranking,
    replays,
    stages,
    start_up,
)
from benchmarks.bench import NOISE, VESSEL, Bench, head
from benchmarks.logs import NAMES, day_of_trial, write_repeated
from benchmarks.measure import Limit
from benchmarks.textbook import FilterResult, filter_in_numpy
from benchmarks.windows import random_regression, verify_windows
from shiplog import Signals, TrialLog, read, resample
from shiplog.ships import ship_model

MODEL = VESSEL.coefficients
TRACK_PARTS = ("ships", "ends", "scale", "manoeuvres", "marks")  # beside the line
CONSTANT_LINES = (
    "/bounds",
    "/sigma_limits",
    "/model",
    "/00_execute_1",
)  # two points, however long the log


@pytest.fixture(scope="module")
def trial() -> TrialLog:
    return day_of_trial(300 / 3600)


@pytest.fixture(scope="module")
def signals(trial: TrialLog) -> Signals:
    return head(resample(trial, channels=NAMES), 200)


@pytest.fixture(scope="module")
def gappy(signals: Signals) -> Signals:
    """Signals in which single samples, one sensor, and both sensors are missing for a while."""
    values = {name: np.array(column) for name, column in signals.values.items()}
    values["yaw_rate"][[7, 50, 51]] = np.nan
    values["yaw_rate"][300:400] = np.nan
    values["speed"][350:500] = np.nan
    return replace(signals, values=values)


@pytest.mark.slow
def test_every_line_runs_and_reports_a_ratio_and_slowness_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, page = tmp_path / "out.json", tmp_path / "out.md"
    options = ["--short", "--json", str(out), "--markdown", str(page)]
    monkeypatch.chdir(PROJECT)
    monkeypatch.setattr(sys, "argv", ["benchmarks", *options])
    runpy.run_module("benchmarks", run_name="__main__")
    report = json.loads(out.read_text(encoding="utf-8"))
    assert len(report["results"]) == 20
    for result in report["results"]:
        if result["skipped"]:
            assert any(reason in result["skipped"] for reason in skip_reasons()), result
        else:
            assert result["ratio"] > 0, result
            assert result["met"] is None, "the limits do not apply to so short a log"
        assert result["work"] in page.read_text(encoding="utf-8")
    for cost in report["growth"]["costs"]:
        assert cost["secs"] > 0
        assert cost["review_bytes"] > 0
    assert all(secs > 0 for secs in report["our_stages"].values())
    assert report["machine"]["numpy"] == np.__version__


def skip_reasons() -> list[str]:
    """Return why a line may be skipped in a short run on this machine."""
    reasons = ["without --short"]
    if find_spec("filterpy") is None:
        reasons += ["filterpy", "--full"]
    return reasons if usable_cores() > 1 else [*reasons, "two cores"]


@pytest.mark.parametrize("which", ["signals", "gappy"])
def test_the_numpy_loop_is_the_same_filter(which: str, request: pytest.FixtureRequest) -> None:
    signals: Signals = request.getfixturevalue(which)
    verify_filter(signals, filter_in_numpy(signals, MODEL, NOISE))


@pytest.mark.parametrize("which", ["signals", "gappy"])
def test_filterpy_is_the_same_filter(which: str, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.with_filterpy import filter_in_filterpy  # noqa: PLC0415

    signals: Signals = request.getfixturevalue(which)
    verify_filter(signals, filter_in_filterpy(signals, MODEL, NOISE))


def verify_filter(signals: Signals, theirs: FilterResult) -> None:
    ours = filter_states(signals, MODEL, NOISE)
    for name in FilterResult._fields:
        one, other = getattr(ours, name), getattr(theirs, name)
        if name == "innovation_stds":  # filterpy has none where nothing was measured
            one = np.where(np.isfinite(ours.innovations), one, np.nan)
            other = np.where(np.isfinite(ours.innovations), other, np.nan)
        size = np.nanmax(np.abs(one), axis=0)
        np.testing.assert_allclose(other / size, one / size, rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("length", [50, 400])
def test_windows_compute_the_coefficients_of_a_pseudo_inverse(length: int) -> None:
    X, y = random_regression(1000)
    verify_windows(X, y, length)


def test_the_straightforward_replay_estimates_and_draws_the_same(
    trial: TrialLog, tmp_path: Path
) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.straightforward import (  # noqa: PLC0415
        straightforward_replay,
        white_noise_of,
    )

    log = write_repeated(trial, 300 / 3600, tmp_path / "log.mcap")
    theirs = straightforward_replay(log, tmp_path / "theirs.rrd", MODEL)
    signals = resample(read(log), channels=NAMES)
    noise = white_noise_of(signals)
    ours = filter_states(signals, MODEL, noise).states
    size = np.max(np.abs(ours), axis=0)
    np.testing.assert_allclose(theirs.filtered.states / size, ours / size, atol=1e-5)
    analysis = analyse(read(log))
    disturbance = analysis.disturbance
    for one, other in zip((disturbance.yaw, disturbance.surge), theirs.disturbance.T, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-5 * np.max(np.abs(one)))
    # the paper's regression takes w'' and v' from the filter, and so returns the filter's model
    last, model = theirs.coefficients[-1], np.array([MODEL.d, MODEL.g, MODEL.h])
    np.testing.assert_allclose(last[[4, 7, 8]], model, rtol=0.2)
    write_replay_review(analysis, tmp_path / "ours.rrd", text="")
    static = {"/summary", "/events", *(f"/track/{part}" for part in TRACK_PARTS)}
    drawn = {e for e in entities(tmp_path / "ours.rrd") if not e.endswith(CONSTANT_LINES)}
    drawn -= {e for e in drawn if e.startswith(("/__", "/manoeuvre_"))}  # ours alone
    assert drawn - static <= entities(tmp_path / "theirs.rrd")


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def test_the_time_of_a_stage_on_part_of_a_log_is_scaled_to_the_whole(
    trial: TrialLog, tmp_path: Path
) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.straightforward import straightforward_replay  # noqa: PLC0415

    log = write_repeated(trial, 2 * 300 / 3600, tmp_path / "log.mcap")
    theirs = straightforward_replay(log, tmp_path / "out.rrd", MODEL, minutes=5)
    for name, whole in (("read", 24_000), ("filter", 6000), ("coefficients", 401)):
        stage = theirs.stages[name]
        assert abs(stage.whole - whole) <= 4
        assert stage.scaled_secs == pytest.approx(stage.secs * stage.whole / stage.done)
    assert abs(theirs.stages["read"].done - 12_000) <= 4


def test_a_long_log_repeats_the_day_with_shifted_times(trial: TrialLog, tmp_path: Path) -> None:
    log = read(write_repeated(trial, 2.5 * 300 / 3600, tmp_path / "long.mcap"))
    for channel in log:
        assert len(channel) == 7500
        np.testing.assert_allclose(np.diff(channel.measured_ns), 1e8, atol=1e4)
        assert np.all(np.diff(channel.received_ns) > 0)
        day = trial[channel.name].values
        np.testing.assert_array_equal(channel.values[:3000], day[:3000])
        np.testing.assert_array_equal(channel.values[3000:6000], day[:3000])
        np.testing.assert_array_equal(channel.values[6000:], day[:1500])
    assert log.vessel_toml == trial.vessel_toml


def test_the_processor_time_of_a_process_leaves_out_its_waits() -> None:
    waiting = measure.run([sys.executable, "-c", "import time; time.sleep(0.5)"])
    if waiting.processor_secs is None:
        pytest.skip("this system does not report the processor time of a process")
    assert 0 < waiting.processor_secs < waiting.secs - 0.4


def test_the_memory_reported_for_a_process_is_its_own_and_not_ours() -> None:
    ballast = np.ones(50_000_000)  # 400 MB
    small = measure.run([sys.executable, "-c", "pass"])
    large = measure.run([sys.executable, "-c", "x = b'1' * 200_000_000"])
    assert ballast[0] == 1
    assert small.secs > 0
    if small.peak_bytes is None or large.peak_bytes is None:
        pytest.skip("this system does not report the peak memory of a process")
    assert small.peak_bytes < 100e6
    assert 200e6 < large.peak_bytes < 300e6


def test_a_process_that_fails_is_skipped_with_its_last_error_line() -> None:
    def failing() -> float:
        return measure.run([sys.executable, "-c", "raise SystemExit('no such thing')"]).secs

    result = measure.compare_with_peer(
        measure.Comparison("work", "peer", failing, failing, Limit(at_least=2)), 1
    )
    assert result.ratio is None
    assert result.met is None
    assert "no such thing" in result.skipped


def test_a_line_without_filterpy_is_skipped_with_a_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(filters, "find_spec", lambda _: None)
    line = measure.Comparison(
        "filter", "filterpy", lambda: 1.0, lambda: 1.0, verify=require_filterpy
    )
    assert "pip install filterpy" in measure.compare_with_peer(line, 1).skipped


def require_filterpy() -> None:
    filters.require_filterpy()


def test_a_log_too_long_for_the_disk_is_skipped_with_a_reason(
    trial: TrialLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = namedtuple("usage", "total used free")(10, 10, 1_000_000)  # noqa: PYI024
    monkeypatch.setattr(logs.shutil, "disk_usage", lambda _: usage)
    growth = replays.measure_growth(trial, [720.0], tmp_path, 1)
    assert "GB free" in growth.costs[0].skipped
    assert growth.exponent is None
    assert growth.memory_met is None
    assert list(tmp_path.iterdir()) == []


def test_a_ratio_is_the_median_of_the_rounds_and_is_held_to_its_limit() -> None:
    ours, peer = iter([9.0, 1.0, 1.0, 1.0]), iter([10.0, 30.0, 20.0])
    line = measure.Comparison(
        "work", "peer", lambda: next(ours), lambda: next(peer), Limit(at_least=20)
    )
    result = measure.compare_with_peer(line, 3)
    assert result.ratio == 20
    assert result.met
    most = measure.Comparison("work", "peer", lambda: 3.0, lambda: 1.0, Limit(at_most=2.5))
    result = measure.compare_with_peer(most, 3)
    assert result.ratio == 3
    assert result.met is False


def test_a_limit_in_seconds_applies_to_our_time_whatever_the_ratio() -> None:
    line = measure.Comparison("work", "peer", lambda: 11.0, lambda: 2.0, Limit(at_most_secs=12))
    result = measure.compare_with_peer(line, 3)
    assert result.ratio == 5.5
    assert result.met
    assert str(line.limit) == "at most 12 s"
    slow = replace(line, ours=lambda: 13.0)
    assert measure.compare_with_peer(slow, 3).met is False


def test_a_first_run_finds_an_empty_cache_which_is_deleted_afterwards(tmp_path: Path) -> None:
    check = (
        "import os, pathlib; cache = pathlib.Path(os.environ['NUMBA_CACHE_DIR']);"
        f"assert cache.parent == pathlib.Path({str(tmp_path)!r}) and not any(cache.iterdir());"
        "(cache / 'loop').touch()"
    )
    for _ in range(2):
        assert start_up.first_run_secs([sys.executable, "-c", check], tmp_path) > 0
    assert list(tmp_path.iterdir()) == []


def test_the_first_run_is_the_same_replay_without_warm_up(trial: TrialLog, tmp_path: Path) -> None:
    bench = Bench(trial, tmp_path / "log.mcap", tmp_path, 240.0, 0.1)
    warm, first = start_up.start_up_lines(bench)
    assert warm.warm_up
    assert not first.warm_up
    assert first.verify is None
    assert first.peer.args == warm.ours.args
    assert start_up.SAMPLE.is_file()


def test_a_ranking_is_the_same_with_any_number_of_threads() -> None:
    if usable_cores() < 2:
        with pytest.raises(measure.SkippedError, match="two cores"):
            ranking.verify_ranking()
    else:
        ranking.verify_ranking()


def test_every_folder_and_module_of_a_stage_exists() -> None:
    for names in stages.STAGES.values():
        assert all(find_spec(name) is not None for name in names)


# ---- the accuracy of identification


def test_a_study_prints_its_table_and_returns_its_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    tied = ship_model("burylin-tied")
    result = identification.study("tied", "zigzag-20-20", tied, {"T3": 0.5}, 2, start_error=0.5)
    assert result.names == ("a", "b2", "b3", "d", "f", "g", "h")
    assert result.median["d"] < 0.2
    assert np.all(result.over_bound < 4)
    assert "| rms error / bound (1) |" in capsys.readouterr().out


def test_the_fit_by_scipy_agrees_with_ours() -> None:
    trial = identification.simulated_trial("zigzag-20-20", 1, 100.0, "white")
    ours = identification_speed.fit_without_nuisance(trial)
    z = ours.minimum.unknowns.copy()
    z[:12] = identification_speed.peer_fit(trial, ours)
    difference = ours.problem.predicted(z, 0) - ours.problem.predicted(ours.minimum.unknowns, 0)
    noise = ours.residual_stds[0].typical  # of a single sample
    assert np.max(np.abs(difference / noise)) < 0.2
