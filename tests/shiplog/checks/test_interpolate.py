"""Interpolation of samples that come in chunks, against numpy."""

import numpy as np
import pytest

from shiplog.checks.interpolate import Interpolator


def interpolated(
    times: np.ndarray, values: np.ndarray, at: np.ndarray, gap: float, cuts: list[int]
) -> np.ndarray:
    interpolator = Interpolator(at, gap)
    for t, v in zip(np.split(times, cuts), np.split(values, cuts), strict=True):
        interpolator.add(t, v)
    return interpolator.result()


@pytest.mark.parametrize("seed", range(5))
def test_it_interpolates_as_numpy_does_whatever_the_cuts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times, values = np.sort(rng.uniform(0, 100, 60)), rng.normal(size=60)
    at = np.sort(rng.uniform(-10, 110, 200))
    for cuts in ([], [1], [1, 2, 2, 30], list(range(1, 60))):
        result = interpolated(times, values, at, np.inf, cuts)
        assert np.array_equal(result, np.interp(at, times, values))


@pytest.mark.parametrize("cuts", [[], [2], [1, 2, 3]])
def test_values_inside_a_gap_are_nan(cuts: list[int]) -> None:
    times = np.array([0.0, 1.0, 10.0, 11.0])
    result = interpolated(times, times, np.array([0.5, 1.0, 5.0, 10.0, 10.5]), 5.0, cuts)
    assert np.array_equal(result, [0.5, 1.0, np.nan, np.nan, 10.5], equal_nan=True)


def test_without_samples_all_values_are_nan() -> None:
    assert np.isnan(Interpolator(np.arange(3.0)).result()).all()


@pytest.mark.parametrize("cuts", [[], [1], [2], [3], [1, 2, 3]])
def test_samples_of_equal_times_are_averaged_whatever_the_cuts(
    cuts: list[int],
) -> None:
    times, values = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 10.0, 20.0, 30.0])
    assert interpolated(times, values, np.arange(3.0), np.inf, cuts).tolist() == [0.0, 15.0, 30.0]
