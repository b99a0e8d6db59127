import numpy as np
import pytest
from scipy.stats import kstest

from analysis.replay.residuals import _Products, assess_innovations, whiteness
from analysis.signals.signal_stats import noise_level


def noises(count: int = 300, length: int = 2000) -> np.ndarray:
    return np.random.default_rng(1).standard_normal((count, length))


def test_p_values_of_white_noise_are_evenly_spread() -> None:
    p = [whiteness(noise).p for noise in noises()]
    assert kstest(p, "uniform").pvalue > 0.01


def test_noise_whose_strength_changes_is_still_white() -> None:
    strength = np.abs(np.sin(np.arange(2000) / 100))
    p = np.array([whiteness(noise * strength).p for noise in noises()])
    assert kstest(p, "uniform").pvalue > 0.01


def test_missing_samples_do_not_colour_white_noise() -> None:
    gaps = noises()
    gaps[:, 500:700] = np.nan
    gaps[:, ::7] = np.nan
    assert kstest([whiteness(noise).p for noise in gaps], "uniform").pvalue > 0.01


def test_a_slow_sine_far_below_the_noise_is_detected() -> None:
    sine = 0.4 * np.sin(np.arange(2000) / 100)
    assert max(whiteness(noise + sine).p for noise in noises(20)) < 0.01


def test_a_first_order_process_is_not_white() -> None:
    for noise in noises(20):
        coloured = noise.copy()
        for k in range(1, len(noise)):
            coloured[k] += 0.2 * coloured[k - 1]
        assert whiteness(coloured).p < 0.01


def test_too_few_samples_give_no_test_result() -> None:
    assert np.isnan(whiteness(np.array([1.0, -1.0, 2.0])).p)


def test_noise_larger_than_assumed_is_not_consistent() -> None:
    noise = noises(1)[0]
    right = assess_innovations("yaw_rate", "rad/s", noise, np.ones(2000), noise_measured=False)
    assert right.consistent
    assert right.mean_nis == pytest.approx(np.mean(noise**2))
    assert right.rms == pytest.approx(np.sqrt(np.mean(noise**2)))
    assert not assess_innovations(
        "yaw_rate", "rad/s", noise, np.full(2000, 0.9), noise_measured=False
    ).consistent
    assert not assess_innovations(
        "yaw_rate", "rad/s", noise, np.full(2000, 1.1), noise_measured=False
    ).consistent


def test_only_what_was_measured_is_counted() -> None:
    noise = noises(1)[0]
    noise[::2] = np.nan
    assert (
        assess_innovations("speed", "m/s", noise, np.ones(2000), noise_measured=False).count == 1000
    )


def test_noise_estimated_from_the_same_log_widens_the_band() -> None:
    ratios = []
    for noise in noises(400, 1000):
        found = assess_innovations(
            "speed", "m/s", noise, np.full(1000, noise_level(noise)), noise_measured=True
        )
        ratios.append(found.mean_nis)
    low, high = found.nis_band
    assert np.mean(ratios) == pytest.approx(1, abs=0.01)
    assert (high - low) / 2 == pytest.approx(2.576 * np.std(ratios), rel=0.1)


def test_a_slow_sensor_on_a_fast_clock_is_tested_over_its_own_measurements() -> None:
    sine = 0.5 * np.sin(np.arange(20_000) / 500)
    for noise in noises(10, 20_000):
        seldom = np.full(20_000, np.nan)
        seldom[::25] = noise[::25]
        assert whiteness(seldom).p > 1e-3
        assert whiteness(seldom + sine).p < 0.01


def test_untested_innovations_are_not_called_white() -> None:
    few = assess_innovations("speed", "m/s", np.ones(30), np.ones(30), noise_measured=False)
    assert few.white is None


@pytest.mark.parametrize("mean", [0.0, 30.0, 1e4, -1e6])
def test_a_mean_far_from_zero_does_not_change_the_whiteness_test(mean: float) -> None:
    noise = noises(1)[0]
    assert whiteness(noise + mean).p == pytest.approx(whiteness(noise).p, rel=1e-6)


def test_the_pairs_of_a_slow_sensor_with_losses_are_all_counted() -> None:
    """Their distance is at the very limit, where a rounding of 43 * 0.1 / 0.1 lost them."""
    noise = np.full(43 * 2000, np.nan)
    noise[::43] = noises(1)[0]
    noise[:: 43 * 7] = np.nan
    assert not np.isnan(whiteness(noise).p)
    at = np.flatnonzero(np.isfinite(noise))
    products = _Products(43.0)
    products.add(noise)
    for lag in range(1, 21):
        near = at[lag:] - at[:-lag] <= 1.5 * lag * 43
        assert products._sums[lag - 1, 0] == near.sum()


def test_the_size_of_the_correlation_is_that_of_the_process_and_has_its_lag() -> None:
    """Moving averages over 5 measurements, every second instant: the correlation is a/(1 + a^2)."""
    white = np.random.default_rng(3).standard_normal(200_005)
    for weight in (0.5, -0.5):
        values = np.full(400_000, np.nan)
        values[::2] = white[5:] + weight * white[:-5]
        found = assess_innovations(
            "speed", "m/s", values, np.ones(400_000), 0.1, noise_measured=False
        )
        assert found.correlation == pytest.approx(weight / (1 + weight**2), abs=0.01)
        assert found.correlation_lag_secs == pytest.approx(1.0)


def test_a_correlation_of_one_per_cent_in_a_long_log_is_significant_but_no_defect() -> None:
    noise = np.random.default_rng(4).standard_normal(864_001)
    stds = np.ones(864_000)
    small = noise[1:] + 0.01 * noise[:-1]
    large = noise[1:] + 0.1 * noise[:-1]
    found = assess_innovations("speed", "m/s", small, stds, noise_measured=False)
    assert found.whiteness_p < 1e-6
    assert found.white
    assert not assess_innovations("speed", "m/s", large, stds, noise_measured=False).white


def test_no_correlation_exceeds_one() -> None:
    """A few large innovations, of which gaps break some of the pairs."""
    values = np.full(1000, 1e-3) * np.sin(np.arange(1000.0))
    values[400:403] = 50.0
    values[403:440] = np.nan
    assert 0.5 < abs(whiteness(values).largest) <= 1.0
