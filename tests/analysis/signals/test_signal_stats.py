import copy
import pickle
from dataclasses import fields

import numpy as np
import pytest

from analysis.signals.signal_stats import SignalStatsCollector, noise_level, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


def test_statistics_equal_numpys_of_the_whole_trial(vessel: Vessel) -> None:
    sensors = suite("white", {"speed.rate_hz": 2.0, "yaw_rate.dropout": 0.1})
    trial = simulate(vessel, "pseudo-random", duration_secs=300.0, sensors=sensors)
    signals = resample(TrialLog("x", trial.channels), channels=NAMES)
    stats, w, v = signal_stats(signals, vessel.coefficients), signals["yaw_rate"], signals["speed"]
    assert (stats.count, stats.dt_secs) == (len(w), signals.dt_secs)
    assert stats.sample_counts == (np.isfinite(w).sum(), np.isfinite(v).sum())
    assert stats.first.tolist() == [w[np.isfinite(w)][0], v[np.isfinite(v)][0]]
    assert stats.std == pytest.approx([np.nanstd(w), np.nanstd(v)], rel=1e-12)
    assert stats.interval_secs == pytest.approx([0.1, 0.5])
    assert stats.yaw_rate_rms == pytest.approx(np.sqrt(np.nanmean(w**2)), rel=1e-12)
    assert (stats.median_speed, stats.max_speed) == (np.nanmedian(v), np.nanmax(v))
    assert stats.median_rpm == np.median(signals["rpm"])
    collector = SignalStatsCollector(vessel.coefficients)
    for cuts in zip([0, 1, 999], [1, 999, len(w)], strict=True):
        collector.add(signals.part(*cuts))
    in_chunks = collector.result()
    for name in ("first", "std", "interval_secs", "noise_std"):
        assert np.array_equal(getattr(stats, name), getattr(in_chunks, name))
    assert (stats.yaw_rate_rms, stats.max_rudder_effect) == (
        in_chunks.yaw_rate_rms,
        in_chunks.max_rudder_effect,
    )


def test_noise_is_estimated_beneath_the_ships_motion(vessel: Vessel) -> None:
    sensors = suite("white", {"yaw_rate.white": 3e-4, "speed.white": 0.07, "speed.rate_hz": 2.0})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=sensors)
    signals = resample(TrialLog("x", trial.channels), channels=NAMES)
    assert noise_level(signals["yaw_rate"]) == pytest.approx(3e-4, rel=0.05)
    assert noise_level(signals["speed"]) == pytest.approx(0.07, rel=0.1)


def test_a_spike_and_a_gap_do_not_count_as_noise() -> None:
    values = np.random.default_rng(2).standard_normal(5000)
    values[1000] += 500
    values[2000:2500] = np.nan
    assert noise_level(values) == pytest.approx(1, rel=0.05)


def test_a_signal_printed_to_few_digits_has_the_noise_of_its_rounding() -> None:
    values = np.round(np.sin(np.arange(5000) / 500), 2)
    assert noise_level(values) == pytest.approx(0.01 / np.sqrt(12), rel=0.5)


def test_the_noise_of_fewer_than_four_samples_is_nan() -> None:
    assert np.isnan(noise_level(np.array([1.0, 2.0, np.nan])))


def test_statistics_survive_pickling_and_deepcopy(vessel: Vessel) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=60.0, sensors=suite("white"))
    signals = resample(TrialLog("x", trial.channels), channels=NAMES)
    stats = signal_stats(signals, vessel.coefficients)
    pickled = pickle.loads(pickle.dumps(stats))  # noqa: S301 - our own bytes
    for copied in (pickled, copy.deepcopy(stats)):
        for field in fields(stats):
            value, copied_value = getattr(stats, field.name), getattr(copied, field.name)
            if field.name == "head":
                assert copied_value.start_ns == value.start_ns
                for name in NAMES:
                    assert np.array_equal(copied_value[name], value[name], equal_nan=True)
            else:
                assert np.array_equal(copied_value, value)
