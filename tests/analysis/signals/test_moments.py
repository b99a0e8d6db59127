import numpy as np
import pytest

from analysis.signals.moments import Moments


@pytest.mark.parametrize("offset", [0.0, 1.0, 1e6])
def test_moments_equal_numpys_however_the_values_are_cut(offset: float) -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(offset, 1.0, 10_000)
    values[rng.random(10_000) < 0.1] = np.nan
    values[7] = np.inf
    finite = values[np.isfinite(values)]
    whole, in_parts = Moments(), Moments()
    whole.add(values)
    for part in np.split(values, [0, 1, 5000, 9999]):
        in_parts.add(part)
    for moments in (whole, in_parts):
        assert moments.count == len(finite)
        assert moments.mean == pytest.approx(np.mean(finite), rel=1e-13)
        assert moments.std == pytest.approx(np.std(finite), rel=1e-9)
        assert moments.mean_square == pytest.approx(np.mean(finite**2), rel=1e-12)
        assert (moments.min, moments.max) == (finite.min(), finite.max())
    assert vars(whole)["_sums"].tobytes() == vars(in_parts)["_sums"].tobytes()


def test_moments_without_values_are_nan() -> None:
    empty = Moments()
    empty.add(np.array([np.nan, np.inf]))
    results = (empty.mean, empty.std, empty.mean_square, empty.min, empty.max)
    assert np.isnan(results).all()
