"""Yaw rates from headings: as accurate as stated, whatever the times, gaps and portions."""

from itertools import pairwise
from math import degrees, radians

import numpy as np
import pytest
from scipy.signal import savgol_filter

from shiplog import Channel, LogError
from shiplog.screening.heading_rate import (
    HeadingDifferentiator,
    HeadingRate,
    choose_heading_rate,
    noise_of_heading,
)

START = 1_700_000_000_000_000_000


def heading(secs: np.ndarray, angles: np.ndarray) -> Channel:
    at = START + np.round(secs * 1e9).astype(np.int64)
    return Channel("heading", "HE", "rad", at, at + 5_000_000, angles)


@pytest.mark.parametrize("samples", [3, 5, 9])
def test_at_equal_intervals_it_is_the_filter_of_savitzky_and_golay(samples: int) -> None:
    rng = np.random.default_rng(1)
    angles = np.cumsum(rng.normal(size=300)) * 0.01
    rate = HeadingRate(samples, 0.2, 0.0)
    times, received, values = HeadingDifferentiator(rate).step(
        heading(np.arange(300) * 0.2, angles)
    )
    half = samples // 2
    expected = savgol_filter(angles, samples, 2, deriv=1, delta=0.2)[half:-half]
    np.testing.assert_allclose(values, expected, atol=1e-9)
    np.testing.assert_array_equal(times, START + np.arange(half, 300 - half) * 200_000_000)
    assert np.all(received - times == half * 200_000_000 + 5_000_000)


def test_a_steady_turn_through_north_has_its_rate_at_irregular_times() -> None:
    rng = np.random.default_rng(2)
    secs = np.cumsum(rng.uniform(0.1, 0.3, 4000))
    turn = np.remainder(0.02 * secs, 2 * np.pi)
    _, _, values = HeadingDifferentiator(HeadingRate(7, 0.2, 0.0)).step(heading(secs, turn))
    np.testing.assert_allclose(values, 0.02, rtol=1e-6)
    assert len(values) == 4000 - 6


def test_no_rate_is_computed_across_a_gap_or_from_missing_headings() -> None:
    secs = np.concatenate([np.arange(50) * 0.2, 60 + np.arange(50) * 0.2])
    angles = 0.01 * secs
    angles[20] = np.nan
    times, _, values = HeadingDifferentiator(HeadingRate(5, 0.2, 0.0)).step(heading(secs, angles))
    since = (times - START) * 1e-9
    assert not np.any((since > 9.5) & (since < 60.3))
    np.testing.assert_allclose(values, 0.01, rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_where_the_heading_is_cut_changes_no_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    secs = np.cumsum(rng.uniform(0.05, 0.35, 40_000))
    angles = rng.normal(size=40_000)
    angles[rng.random(40_000) < 0.1] = np.nan
    whole = heading(secs, angles)
    rate = HeadingRate(9, 0.2, 0.0)
    expected = HeadingDifferentiator(rate).step(whole)
    cuts = [0, *np.sort(rng.integers(0, 40_000, 30)).tolist(), 40_000]
    parts = HeadingDifferentiator(rate)
    found = [parts.step(whole.part(a, b)) for a, b in pairwise(cuts)]
    for column, of_whole in zip(zip(*found, strict=True), expected, strict=True):
        assert np.concatenate(column).tobytes() == of_whole.tobytes()


@pytest.mark.parametrize("noise_deg", [0.003, 0.01, 0.05, 0.2])
@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 10.0])
def test_the_noise_is_as_stated(noise_deg: float, rate_hz: float) -> None:
    rng = np.random.default_rng(7)
    secs = np.arange(20_000) / rate_hz
    turning = 0.5 * np.sin(secs / 60)
    angles = turning + radians(noise_deg) * rng.normal(size=20_000)
    rate = choose_heading_rate(angles, 1 / rate_hz, "/heading/HE")
    assert rate.heading_noise == pytest.approx(radians(noise_deg), rel=0.1)
    times, _, values = HeadingDifferentiator(rate).step(heading(secs, angles))
    error = values - 0.5 / 60 * np.cos((times - START) * 1e-9 / 60)
    assert float(np.std(error)) == pytest.approx(rate.noise, rel=0.1)
    assert rate.noise <= radians(0.0201) or rate.window_secs >= 10 - 2 / rate_hz


def test_the_bandwidth_is_that_of_the_response() -> None:
    rate = HeadingRate(21, 0.1, 0.0)
    secs = np.arange(5000) * 0.1
    angular = 2 * np.pi * rate.bandwidth_hz
    _, _, values = HeadingDifferentiator(rate).step(heading(secs, 0.01 * np.sin(angular * secs)))
    assert float(np.max(np.abs(values))) / (0.01 * angular) == pytest.approx(0.707, abs=0.01)


def test_a_rounded_heading_has_at_least_the_noise_of_its_rounding() -> None:
    secs = np.arange(3000) * 0.2
    rounded = np.round(np.degrees(0.3 * np.sin(secs / 100)), 1)
    assert degrees(noise_of_heading(np.radians(rounded))) >= 0.1 / np.sqrt(12) * 0.99


@pytest.mark.parametrize(("count", "interval"), [(4, 0.2), (1000, 6.0), (1000, 0.0)])
def test_a_heading_that_is_too_short_or_too_slow_is_refused(count: int, interval: float) -> None:
    with pytest.raises(LogError, match=r"no yaw rate can be derived from /heading/HE: it has"):
        choose_heading_rate(np.zeros(count), interval, "/heading/HE")
