"""Smoothing without scipy equals that of scipy."""

import numpy as np
import pytest
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import savgol_filter

from analysis.manoeuvres.smoothing import fitted_slope, moving_mean, moving_median

VALUES = np.random.default_rng(0).standard_normal(300).cumsum()


@pytest.mark.parametrize("half", [0, 1, 15])
def test_a_moving_median_is_that_of_scipy(half: int) -> None:
    np.testing.assert_array_equal(moving_median(VALUES, half), median_filter(VALUES, 1 + 2 * half))


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_a_moving_mean_is_that_of_scipy(count: int) -> None:
    np.testing.assert_allclose(
        moving_mean(VALUES, count), uniform_filter1d(VALUES, count), atol=1e-12
    )


@pytest.mark.parametrize("half", [2, 9, 100])
def test_a_fitted_slope_is_that_of_scipy_to_both_ends(half: int) -> None:
    expected = savgol_filter(VALUES, 2 * half + 1, 2, deriv=1, delta=0.5)
    np.testing.assert_allclose(fitted_slope(VALUES, half, 0.5), expected, atol=1e-10)
