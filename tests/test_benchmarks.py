import json
import subprocess
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
from analysis.replay.replay import analyse
from analysis.view.replay_review import write_replay_review
from benchmarks import filters, identification, identification_speed, logs, measure, replays
from benchmarks.bench import NOISE, VESSEL, head
from benchmarks.logs import NAMES, day_of_trial, write_repeated
from benchmarks.textbook import Filtered, filter_in_numpy
from benchmarks.windows import regression
from benchmarks.windows import require_same as require_same_windows
from shiplog import Signals, TrialLog, read, resample
from shiplog.ships import ship_model

SMALL = ["--short", "--hours", "0.1", "--growth", "0.02,0.05", "--info-hours", "0.15"]
MODEL = VESSEL.coefficients
GUIDES = ("/bounds", "/sigma_limits", "/model")  # straight lines: two points, whatever the log


@pytest.fixture(scope="module")
def trial() -> TrialLog:
    return day_of_trial(300 / 3600)


@pytest.fixture(scope="module")
def signals(trial: TrialLog) -> Signals:
    return head(resample(trial, channels=NAMES), 200)


@pytest.fixture(scope="module")
def gappy(signals: Signals) -> Signals:
    """Single samples, one sensor and both of them missing for a while."""
    values = {name: np.array(column) for name, column in signals.values.items()}
    values["yaw_rate"][[7, 50, 51]] = np.nan
    values["yaw_rate"][300:400] = np.nan
    values["speed"][350:500] = np.nan
    return replace(signals, values=values)


def test_every_line_runs_and_tells_a_ratio_and_never_fails_for_being_slow(tmp_path: Path) -> None:
    out, page = tmp_path / "out.json", tmp_path / "out.md"
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *SMALL, "--json", str(out), "--markdown", str(page)],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(out.read_text(encoding="utf-8"))
    works = [result["work"] for result in report["results"]]
    assert len(works) == 11
    for result in report["results"]:
        if find_spec("filterpy") is None and result["skipped"]:
            assert "filterpy" in result["skipped"]
        elif "--full" in result["work"] and result["skipped"]:
            assert "--full" in result["skipped"]
        else:
            assert result["ratio"] > 0, result
            assert result["met"] is None, "so short a log is held to nothing"
        assert result["work"] in page.read_text(encoding="utf-8")
    for length in report["growth"]["lengths"]:
        assert length["secs"] > 0
        assert length["review_bytes"] > 0
    assert all(secs > 0 for secs in report["our_stages"].values())
    assert report["machine"]["numpy"] == np.__version__


@pytest.mark.parametrize("which", ["signals", "gappy"])
def test_the_numpy_loop_is_the_same_filter(which: str, request: pytest.FixtureRequest) -> None:
    signals: Signals = request.getfixturevalue(which)
    require_same(signals, filter_in_numpy(signals, MODEL, NOISE))


@pytest.mark.parametrize("which", ["signals", "gappy"])
def test_the_filter_in_filterpy_is_the_same(which: str, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.with_filterpy import filter_in_filterpy  # noqa: PLC0415

    signals: Signals = request.getfixturevalue(which)
    require_same(signals, filter_in_filterpy(signals, MODEL, NOISE))


def require_same(signals: Signals, theirs: Filtered) -> None:
    ours = filter_states(signals, MODEL, NOISE)
    for name in Filtered._fields:
        one, other = getattr(ours, name), getattr(theirs, name)
        if name == "innovation_stds":  # of what was not measured filterpy tells none
            one = np.where(np.isfinite(ours.innovations), one, np.nan)
            other = np.where(np.isfinite(ours.innovations), other, np.nan)
        size = np.nanmax(np.abs(one), axis=0)
        np.testing.assert_allclose(other / size, one / size, rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("length", [50, 400])
def test_windows_find_what_a_pseudo_inverse_finds(length: int) -> None:
    X, y = regression(1000)
    require_same_windows(X, y, length)


def test_the_obvious_replay_finds_the_same_and_shows_the_same(
    trial: TrialLog, tmp_path: Path
) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.obvious import noise_of, replay  # noqa: PLC0415

    log = write_repeated(trial, 300 / 3600, tmp_path / "log.mcap")
    found = replay(log, tmp_path / "theirs.rrd", MODEL)
    signals = resample(read(log), channels=NAMES)
    noise = noise_of(signals)
    ours = filter_states(signals, MODEL, noise).states
    size = np.max(np.abs(ours), axis=0)
    np.testing.assert_allclose(found.filtered.states / size, ours / size, atol=1e-5)
    analysis = analyse(read(log))
    disturbance = analysis.disturbance
    for one, other in zip((disturbance.yaw, disturbance.surge), found.disturbance.T, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-5 * np.max(np.abs(one)))
    # the paper's regression takes w'' and v' from the filter, and finds the filter's model again
    last, wanted = found.coefficients[-1], np.array([MODEL.d, MODEL.g, MODEL.h])
    np.testing.assert_allclose(last[[4, 7, 8]], wanted, rtol=0.2)
    write_replay_review(analysis, tmp_path / "ours.rrd", text="")
    once = {"/summary", "/track/ships", "/track/ends", "/track/scale"}
    drawn = {e for e in entities(tmp_path / "ours.rrd") if not e.endswith(GUIDES)}
    drawn -= {e for e in drawn if e.startswith("/__")}
    assert drawn - once <= entities(tmp_path / "theirs.rrd")


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def test_a_stage_on_a_share_of_a_log_is_scaled_to_all_of_it(
    trial: TrialLog, tmp_path: Path
) -> None:
    pytest.importorskip("filterpy")
    from benchmarks.obvious import replay  # noqa: PLC0415

    log = write_repeated(trial, 2 * 300 / 3600, tmp_path / "log.mcap")
    found = replay(log, tmp_path / "out.rrd", MODEL, minutes=5)
    for name, whole in (("read", 24_000), ("filter", 6000), ("coefficients", 401)):
        stage = found.stages[name]
        assert abs(stage.whole - whole) <= 4
        assert stage.scaled_secs == pytest.approx(stage.secs * stage.whole / stage.done)
    assert abs(found.stages["read"].done - 12_000) <= 4


def test_a_long_log_is_the_day_again_and_again(trial: TrialLog, tmp_path: Path) -> None:
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


def test_the_memory_told_of_a_process_is_its_own_and_not_ours() -> None:
    ballast = np.ones(50_000_000)  # 400 MB
    small = measure.run([sys.executable, "-c", "pass"])
    large = measure.run([sys.executable, "-c", "x = b'1' * 200_000_000"])
    assert ballast[0] == 1
    assert small.secs > 0
    if small.peak_bytes is None or large.peak_bytes is None:
        pytest.skip("this system does not tell a process's peak of memory")
    assert small.peak_bytes < 100e6
    assert 200e6 < large.peak_bytes < 300e6


def test_a_process_that_fails_is_skipped_with_its_last_words() -> None:
    def failing() -> float:
        return measure.run([sys.executable, "-c", "raise SystemExit('no such thing')"]).secs

    result = measure.compare(measure.Line("work", "peer", failing, failing, at_least=2), 1)
    assert result.ratio is None
    assert result.met is None
    assert "no such thing" in result.skipped


def test_without_filterpy_its_line_is_skipped_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filters, "find_spec", lambda _: None)
    line = measure.Line("filter", "filterpy", lambda: 1.0, lambda: 1.0, same=require_filterpy)
    assert "pip install filterpy" in measure.compare(line, 1).skipped


def require_filterpy() -> None:
    filters.require_filterpy()


def test_a_log_too_long_for_the_disk_is_skipped_and_says_so(
    trial: TrialLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = namedtuple("usage", "total used free")(10, 10, 1_000_000)  # noqa: PYI024
    monkeypatch.setattr(logs.shutil, "disk_usage", lambda _: usage)
    found = replays.growth(trial, [720.0], tmp_path, 1)
    assert "GB free" in found.lengths[0].skipped
    assert found.exponent is None
    assert found.memory_met is None
    assert list(tmp_path.iterdir()) == []


def test_a_ratio_is_the_median_of_the_rounds_and_is_held_to_what_is_asked() -> None:
    ours, peer = iter([9.0, 1.0, 1.0, 1.0]), iter([10.0, 30.0, 20.0])
    line = measure.Line("work", "peer", lambda: next(ours), lambda: next(peer), at_least=20)
    result = measure.compare(line, 3)
    assert result.ratio == 20
    assert result.met
    most = measure.Line("work", "peer", lambda: 3.0, lambda: 1.0, at_most=2.5)
    result = measure.compare(most, 3)
    assert result.ratio == 3
    assert result.met is False


# ---- how far identification can be believed


def test_a_study_prints_its_table_and_tells_its_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    tied = ship_model("burylin-tied")
    found = identification.study("tied", "zigzag-20-20", tied, {"T3": 0.5}, 2, off=0.5)
    assert found.names == ("a", "b2", "b3", "d", "f", "g", "h")
    assert found.median["d"] < 0.2
    assert np.all(found.over_bound < 4)
    assert "| rms error over bound (1) |" in capsys.readouterr().out


def test_the_straightforward_fit_finds_what_ours_does() -> None:
    trial = identification.known_trial("zigzag-20-20", 1, 100.0, "white")
    ours = identification_speed._ours(trial)
    z = ours.minimum.unknowns.copy()
    z[:12] = identification_speed.peer(trial, ours)
    apart = ours.problem.predicted(z, 0) - ours.problem.predicted(ours.minimum.unknowns, 0)
    assert np.max(np.abs(apart / ours.residual_stds[0].usual)) < 0.2  # of the noise of one sample
