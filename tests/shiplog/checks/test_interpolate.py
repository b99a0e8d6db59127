import numpy as np
import pytest

from shiplog.checks.interpolate import Interpolator


def probed(times: np.ndarray, values: np.ndarray, at: np.ndarray, gap: float, cuts: list[int]):  # noqa: ANN201
    probe = Interpolator(at, gap)
    for t, v in zip(np.split(times, cuts), np.split(values, cuts), strict=True):
        probe.add(t, v)
    return probe.result()


@pytest.mark.parametrize("seed", range(5))
def test_it_interpolates_as_numpy_does_whatever_the_cuts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times, values = np.sort(rng.uniform(0, 100, 60)), rng.normal(size=60)
    at = np.sort(rng.uniform(-10, 110, 200))
    for cuts in ([], [1], [1, 2, 2, 30], list(range(1, 60))):
        found = probed(times, values, at, np.inf, cuts)
        assert np.array_equal(found, np.interp(at, times, values))


@pytest.mark.parametrize("cuts", [[], [2], [1, 2, 3]])
def test_in_a_gap_there_is_nothing(cuts: list[int]) -> None:
    times = np.array([0.0, 1.0, 10.0, 11.0])
    found = probed(times, times, np.array([0.5, 1.0, 5.0, 10.0, 10.5]), 5.0, cuts)
    assert np.array_equal(found, [0.5, 1.0, np.nan, np.nan, 10.5], equal_nan=True)


def test_without_samples_nothing_is_known() -> None:
    assert np.isnan(Interpolator(np.arange(3.0)).result()).all()


@pytest.mark.parametrize("cuts", [[], [1], [2], [3], [1, 2, 3]])
def test_samples_at_one_time_are_as_to_numpy_whatever_the_cuts(cuts: list[int]) -> None:
    times, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 10.0, 20.0, 30.0])
    assert probed(times, values, np.arange(3.0), np.inf, cuts).tolist() == [0.0, 20.0, 30.0]
