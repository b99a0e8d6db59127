import numpy as np
import pytest

from analysis.signals.signal_stats import SignalStatsCollector, noise_level, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


def test_what_is_usual_is_what_numpy_makes_of_the_whole(vessel: Vessel) -> None:
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
    parted = SignalStatsCollector(vessel.coefficients)
    for cuts in zip([0, 1, 999], [1, 999, len(w)], strict=True):
        parted.add(signals.part(*cuts))
    again = parted.result()
    for name in ("first", "std", "interval_secs", "noise_std"):
        assert np.array_equal(getattr(stats, name), getattr(again, name))
    assert (stats.yaw_rate_rms, stats.max_rudder_effect) == (
        again.yaw_rate_rms,
        again.max_rudder_effect,
    )


def test_noise_is_found_below_the_ships_motion(vessel: Vessel) -> None:
    sensors = suite("white", {"yaw_rate.white": 3e-4, "speed.white": 0.07, "speed.rate_hz": 2.0})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=sensors)
    signals = resample(TrialLog("x", trial.channels), channels=NAMES)
    assert noise_level(signals["yaw_rate"]) == pytest.approx(3e-4, rel=0.05)
    assert noise_level(signals["speed"]) == pytest.approx(0.07, rel=0.1)


def test_a_spike_and_a_gap_do_not_pass_for_noise() -> None:
    values = np.random.default_rng(2).standard_normal(5000)
    values[1000] += 500
    values[2000:2500] = np.nan
    assert noise_level(values) == pytest.approx(1, rel=0.05)


def test_a_signal_printed_to_few_digits_has_the_noise_of_its_rounding() -> None:
    values = np.round(np.sin(np.arange(5000) / 500), 2)
    assert noise_level(values) == pytest.approx(0.01 / np.sqrt(12), rel=0.5)


def test_four_samples_are_needed_to_tell_noise() -> None:
    assert np.isnan(noise_level(np.array([1.0, 2.0, np.nan])))
