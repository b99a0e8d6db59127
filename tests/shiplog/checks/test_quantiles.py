"""Quantiles of streams, whole and reduced."""

import numpy as np
import pytest

from shiplog.checks.quantiles import Quantiles


def quantiles_of(*parts: np.ndarray, most: int = 5000) -> Quantiles:
    quantiles = Quantiles(most)
    for part in parts:
        quantiles.add(part)
    return quantiles


def test_a_short_stream_is_kept_whole() -> None:
    values = np.random.default_rng(0).normal(size=5000)
    quantiles = quantiles_of(*np.split(values, [1, 1, 300, 4999]))
    assert np.array_equal(quantiles.values, values)
    assert quantiles.median() == np.median(values)


def test_without_values_the_median_is_nan() -> None:
    assert np.isnan(quantiles_of().median())
    assert np.isnan(quantiles_of(np.zeros(0)).median())


@pytest.mark.parametrize("seed", range(4))
def test_the_cuts_of_a_stream_do_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=rng.integers(5001, 200_000))
    cuts = np.sort(rng.integers(0, len(values), 50))
    one, other = quantiles_of(values), quantiles_of(*np.split(values, cuts))
    assert np.array_equal(one.values, other.values)
    assert 1000 < len(one.values) <= 5000
    assert np.isin(one.values, values).all()


def test_quantiles_of_a_long_stream_are_about_right_whatever_its_period() -> None:
    """Keeping every n-th run would be misled by a stream of period 512."""
    n = np.arange(1_000_000)
    values = (n // 256) % 2 + np.random.default_rng(1).normal(0, 0.01, len(n))
    assert np.mean(quantiles_of(values, most=100_000).values) == pytest.approx(0.5, abs=0.1)
    drifting = np.random.default_rng(2).normal(n * 1e-6, 1.0)
    assert quantiles_of(drifting, most=100_000).median() == pytest.approx(
        np.median(drifting), abs=0.1
    )
