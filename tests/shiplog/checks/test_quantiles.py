import numpy as np
import pytest

import shiplog.checks.quantiles
from shiplog.checks.quantiles import Quantiles


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shiplog.checks.quantiles, "HELD", 5000)


def thinned(*parts: np.ndarray) -> Quantiles:
    found = Quantiles()
    for part in parts:
        found.add(part)
    return found


def test_a_short_stream_is_kept_whole() -> None:
    values = np.random.default_rng(0).normal(size=5000)
    found = thinned(*np.split(values, [1, 1, 300, 4999]))
    assert np.array_equal(found.values, values)
    assert found.median() == np.median(values)


def test_of_nothing_there_is_no_median() -> None:
    assert np.isnan(thinned().median())
    assert np.isnan(thinned(np.zeros(0)).median())


@pytest.mark.parametrize("seed", range(4))
def test_how_a_stream_is_cut_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=rng.integers(5001, 200_000))
    cuts = np.sort(rng.integers(0, len(values), 50))
    one, other = thinned(values), thinned(*np.split(values, cuts))
    assert np.array_equal(one.values, other.values)
    assert 1000 < len(one.values) <= 5000
    assert np.isin(one.values, values).all()


def test_quantiles_of_a_long_stream_are_about_right_whatever_its_rhythm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A stream of period 512 would mislead one that takes every so many-eth run."""
    monkeypatch.setattr(shiplog.checks.quantiles, "HELD", 100_000)
    n = np.arange(1_000_000)
    values = (n // 256) % 2 + np.random.default_rng(1).normal(0, 0.01, len(n))
    assert np.mean(thinned(values).values) == pytest.approx(0.5, abs=0.1)
    drifting = np.random.default_rng(2).normal(n * 1e-6, 1.0)
    assert thinned(drifting).median() == pytest.approx(np.median(drifting), abs=0.1)
