import numpy as np
import pytest

from analysis.signals.moments import Moments


@pytest.mark.parametrize("offset", [0.0, 1.0, 1e6])
def test_they_are_numpys_whatever_the_cuts(offset: float) -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(offset, 1.0, 10_000)
    values[rng.random(10_000) < 0.1] = np.nan
    values[7] = np.inf
    known = values[np.isfinite(values)]
    whole, parted = Moments(), Moments()
    whole.add(values)
    for part in np.split(values, [0, 1, 5000, 9999]):
        parted.add(part)
    for found in (whole, parted):
        assert found.count == len(known)
        assert found.mean == pytest.approx(np.mean(known), rel=1e-13)
        assert found.std == pytest.approx(np.std(known), rel=1e-9)
        assert found.mean_square == pytest.approx(np.mean(known**2), rel=1e-12)
        assert (found.min, found.max) == (known.min(), known.max())
    assert vars(whole)["_sums"].tobytes() == vars(parted)["_sums"].tobytes()


def test_of_nothing_they_are_no_number() -> None:
    empty = Moments()
    empty.add(np.array([np.nan, np.inf]))
    told = (empty.mean, empty.std, empty.mean_square, empty.min, empty.max)
    assert np.isnan(told).all()
