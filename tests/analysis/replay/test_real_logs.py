"""Real runs and the sample data give no false alarm; what is wrong with them is reported."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from places import KVLCC2, LAYOUTS, SAMPLE_DATA
from tanker_logs import tanker_log

from analysis.check.compare import logs_in
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from shiplog import Channel, LogError, TrialLog, Vessel, read
from shiplog.checks.consistency.consistency_check import consistency_findings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.layouts.layout import load_layout
from shiplog.tables.foreign import read_table

EXCESS = "worth more than the largest rudder angle"
BIASED = ("MARIN_FREE", "zigzag_10_10_dropouts")  # 0.005 deg/s in each of MARIN's runs; simulated
LOGS = [*sorted(KVLCC2.glob("*/*.dat")), *logs_in(SAMPLE_DATA), SAMPLE_DATA / "bridge.csv"]


@cache
def log_of(path: Path) -> TrialLog:
    if path.suffix == ".mcap":
        return read(path)
    if path.suffix == ".dat":
        return tanker_log(path)
    return read_table(path, load_layout(LAYOUTS / "bridge.toml"))


def test_the_real_runs_are_here() -> None:
    if not KVLCC2.is_dir():
        pytest.skip("the SIMMAN data are not in ../shared/data/kvlcc2")
    assert sum(path.suffix == ".dat" for path in LOGS) >= 9


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_the_channels_of_real_runs_and_sample_data_do_not_contradict_each_other(
    path: Path,
) -> None:
    kinds = [finding.kind for finding in consistency_findings(log_of(path))]
    assert kinds == (["bias"] if path.stem.startswith(BIASED) else [])


@pytest.mark.parametrize("path", [*LOGS, *SAMPLE_DATA.glob("*.ref.mcap")], ids=lambda p: p.stem)
def test_no_channel_of_real_runs_and_sample_data_is_stuck(path: Path) -> None:
    assert not [
        channel.topic for channel in compute_log_stats(log_of(path)).channels if channel.stuck
    ]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_no_sample_of_real_runs_and_sample_data_is_a_spike(path: Path) -> None:
    assert not [c.topic for c in compute_log_stats(log_of(path), strict=True) if c.spikes]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.stem)
def test_the_disturbance_of_real_runs_and_sample_data_is_not_beyond_the_rudder(path: Path) -> None:
    assert not [text for text in analyse(log_of(path)).findings.warnings if EXCESS in text]


def test_a_reversed_rudder_needs_a_disturbance_beyond_the_largest_rudder(
    zigzag_log: TrialLog, vessel: Vessel
) -> None:
    channels = tuple(replace(c, values=-c.values) if c.name == "rudder" else c for c in zigzag_log)
    found = analyse(replace(zigzag_log, channels=channels), ReadingOptions(vessel))
    (warning,) = [text for text in found.findings.warnings if EXCESS in text]
    assert "(35°)" in warning
    assert "check the signs and units of rudder and yaw rate" in warning


def test_a_log_of_seconds_shows_no_change_of_coefficients() -> None:
    """Random walks of 6.5 s, which any coefficients fit; not all of them have a model."""
    replayed = 0
    for seed in range(50):
        try:
            found = analyse(random_walks(seed))
        except LogError:
            continue
        replayed += 1
        assert found.findings.changes == ()
    assert replayed >= 25


def random_walks(seed: int) -> TrialLog:
    """Return a log of random walks of 6.5 s, such as of a ship at rest."""
    rng = np.random.default_rng(seed)
    at = 1_700_000_000_000_000_000 + 50_000_000 * np.arange(130)
    steps = {"yaw_rate": 1e-3, "speed": 0.02, "rudder": 0.01, "rpm": 0.5}
    starts = {"yaw_rate": 0.0, "speed": 5.0, "rudder": 0.0, "rpm": 80.0}
    units = {"yaw_rate": "rad/s", "speed": "m/s", "rudder": "rad", "rpm": "rpm"}
    channels = tuple(
        Channel(name, "walk", units[name], at, at,
                starts[name] + np.cumsum(step * rng.standard_normal(len(at))))
        for name, step in steps.items()
    )  # fmt: skip
    return TrialLog("walks.mcap", channels)
