"""White noise and slow error of a heading, found from simulated errors of known size."""

from dataclasses import replace
from math import radians, sqrt

import numpy as np
import pytest
from filter_runs import signals_of
from scipy.signal import lfilter

from analysis.replay.heading_errors import heading_errors
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import load_vessel
from shiplog.types import FloatArray

DT, COUNT = 0.5, 2400
GYRO_STD, WHITE_STD = radians(0.002), radians(0.01)
BIAS = radians(0.02)


def gauss_markov(rng: np.random.Generator, std: float, secs: float) -> FloatArray:
    """Simulate a Gauss-Markov process of first order, (COUNT,), in its steady state."""
    a = np.exp(-DT / secs)
    noise = rng.standard_normal(COUNT) * std * sqrt(1 - a**2)
    noise[0] = rng.standard_normal() * std
    return np.asarray(lfilter([1], [1, -a], noise))


def stats_of(error: FloatArray, seed: int, gap: slice = slice(0), missing: int = 0) -> SignalStats:
    """Return the statistics of a turning ship with a biased gyro, and a heading with an error.

    The yaw rate has a gap; so many headings are missing at the end.
    """
    rng, at = np.random.default_rng(1000 + seed), DT * np.arange(COUNT)
    rate = radians(0.4) * np.sin(at / 40)
    heading = -radians(0.4) * 40 * np.cos(at / 40) + error
    measured = rate + BIAS + GYRO_STD * rng.standard_normal(COUNT)
    measured[gap] = np.nan
    outputs = np.column_stack((measured, np.full(COUNT, 7.0)))
    signals = signals_of(outputs, np.zeros(COUNT), np.full(COUNT, 100.0), DT)
    compass = heading + WHITE_STD * rng.standard_normal(COUNT)
    compass[COUNT - missing :] = np.nan
    signals = replace(signals, values=dict(signals.values) | {"compass": compass})
    return signal_stats(signals, load_vessel("table1")[0].paper_coefficients)


def test_white_noise_alone_is_no_slow_error() -> None:
    found = [heading_errors(stats_of(np.zeros(COUNT), seed), WHITE_STD) for seed in range(20)]
    assert sum(slow is not None for _, slow in found) <= 1
    assert all(std == pytest.approx(WHITE_STD, rel=0.1) for std, _ in found)


@pytest.mark.parametrize("gap", [slice(0), slice(1000, 1040)], ids=["complete", "with a gap"])
@pytest.mark.parametrize(("std_deg", "secs"), [(0.05, 5.0), (0.05, 20.0), (0.5, 40.0)])
def test_size_and_duration_of_a_slow_error_are_found(
    std_deg: float, secs: float, gap: slice
) -> None:
    found = []
    for seed in range(20):
        error = gauss_markov(np.random.default_rng(seed), radians(std_deg), secs)
        _, slow = heading_errors(stats_of(error, seed, gap), WHITE_STD)
        assert slow is not None
        found.append((slow.std, slow.secs))
    std, duration = np.median(found, axis=0)
    assert np.degrees(std) == pytest.approx(std_deg, rel=0.3)
    assert duration == pytest.approx(secs, rel=0.5)


def test_an_error_without_a_limit_lasts_as_long_as_the_trial() -> None:
    walk = radians(0.005) * np.cumsum(np.random.default_rng(0).standard_normal(COUNT))
    _, slow = heading_errors(stats_of(walk, 0), WHITE_STD)
    assert slow is not None
    assert slow.secs == pytest.approx(DT * (COUNT - 1))
    intensity = 2 * slow.std**2 / slow.secs
    assert intensity == pytest.approx(radians(0.005) ** 2 / DT, rel=0.6)


def test_a_fast_error_counts_as_white() -> None:
    rng = np.random.default_rng(0)
    error = gauss_markov(rng, radians(0.05), 0.5) + gauss_markov(rng, radians(0.1), 20.0)
    white, _ = heading_errors(stats_of(error, 0), WHITE_STD)
    assert np.degrees(white) == pytest.approx(0.05, rel=0.3)


def test_too_few_samples_show_no_error() -> None:
    stats = stats_of(
        gauss_markov(np.random.default_rng(0), radians(0.5), 20.0), 0, missing=COUNT - 40
    )
    assert heading_errors(stats, WHITE_STD) == (WHITE_STD, None)
