"""Spikes of the sensors reach neither the states, nor the disturbances, nor the coefficients."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from trial_logs import InChunks, as_log

from analysis.replay.plan import plan_replay
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_json import replay_json
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel
from shiplog.checks.log_stats import compute_log_stats

SIZES = {"yaw_rate": radians(1.0), "speed": 3.0, "rudder": radians(10.0)}
SHARE = 0.001


def with_spikes(log: TrialLog, seed: int) -> tuple[TrialLog, dict[str, int]]:
    """Return a log with spikes of either sign, and their number by channel."""
    rng, channels, counts = np.random.default_rng(seed), [], {}
    for each in log.channels:
        channel = each
        if channel.name in SIZES:
            hit = rng.random(len(channel)) < SHARE
            hit[:3] = hit[-3:] = False
            sizes = SIZES[channel.name] * rng.choice((-1.0, 1.0), len(channel))
            channel = replace(each, values=each.values + np.where(hit, sizes, 0.0))
            counts[channel.name] = int(hit.sum())
        channels.append(channel)
    return replace(log, channels=tuple(channels)), counts


@pytest.mark.parametrize("seed", [1, 2])
def test_results_are_those_without_spikes_to_within_their_errors(
    zigzag_log: TrialLog, zigzag_analysis: Analysis, seed: int
) -> None:
    log, counts = with_spikes(zigzag_log, seed)
    found, clean = analyse(log), zigzag_analysis
    removed = {c.name: len(c.spikes) for c in found.findings.plan.log_stats if c.spikes}
    assert removed == counts
    assert not any(test.rejected for test in found.findings.residuals)
    for name, count in counts.items():
        assert any(
            text.startswith(f"/{name}/") and f": {count} spike" in text
            for text in found.findings.warnings
        )
        assert (
            replay_json(found.findings)["log"]["channels"][f"/{name}/simulated"]["spikes"] == count
        )
    for equation in ("yaw", "surge"):
        spiky, truth = (getattr(each.findings, equation).coefficients for each in (found, clean))
        for key, coefficient in truth.items():
            assert abs(spiky[key].value - coefficient.value) < 0.3 * coefficient.std
            assert spiky[key].std == pytest.approx(coefficient.std, rel=0.05)
    for kind in ("rudder", "surge"):
        difference = getattr(found.disturbance, kind) - getattr(clean.disturbance, kind)
        noise_std = clean.findings.disturbances[kind].noise_std
        assert np.nanmax(np.abs(difference)) < 0.5 * noise_std


def test_where_the_log_is_cut_changes_no_spike_and_no_result(zigzag_log: TrialLog) -> None:
    log, _ = with_spikes(zigzag_log, 3)
    whole, cut = plan_replay(log), plan_replay(InChunks(log, [3.7, 200.05, 200.15, 431.0]))
    for one, other in zip(whole.log_stats, cut.log_stats, strict=True):
        assert (one.spikes is None) == (other.spikes is None)
        if one.spikes and other.spikes:
            assert np.array_equal(one.spikes.times_ns, other.spikes.times_ns)
    assert np.array_equal(whole.yaw_solution.values, cut.yaw_solution.values)
    assert np.array_equal(whole.surge_solution.values, cut.surge_solution.values)


DIGITS = {"yaw_rate": radians(0.1), "speed": 0.25, "rudder": radians(1.0), "rpm": 1.0}
MANOEUVRES = ("zigzag-20-20", "zigzag-10-10", "turning-circle", "pseudo-random", "spiral")


@pytest.mark.parametrize("seed", range(50))
def test_no_sample_of_a_clean_log_is_removed(vessel: Vessel, seed: int) -> None:
    """Five manoeuvres, sampled at 10 to 0.5 Hz, with noise and with digits as coarse as it."""
    settings = {f"{name}.rate_hz": (10.0, 5.0, 2.0, 1.0, 0.5)[seed // 10] for name in DIGITS}
    settings |= {"rudder.white": radians(0.1) * (seed % 3), "heading.white": radians(0.1)}
    sensors = suite(("paper", "white")[seed % 2], settings)
    manoeuvre = MANOEUVRES[seed % 5]
    log = as_log(simulate(vessel, manoeuvre, duration_secs=300.0, seed=seed, sensors=sensors))
    coarse = [
        replace(c, values=np.round(c.values / DIGITS[c.name]) * DIGITS[c.name])
        for c in log.channels
        if c.name in DIGITS
    ]
    for each in (log, replace(log, channels=tuple(coarse))):
        assert not [c.topic for c in compute_log_stats(each, strict=True) if c.spikes]
