"""Panels of the review of an estimation."""

import numpy as np

from analysis.view.estimate_review import _panel
from analysis.view.series import Line, Series

TIME = np.arange(100.0)
GREY = (128, 128, 128, 255)


def series(*lines: tuple[str, np.ndarray]) -> Series:
    return Series("drawn", TIME, tuple(Line(name, values, GREY) for name, values in lines))


def test_axis_shows_the_band_of_a_constant_without_its_wide_beginning() -> None:
    value, band = np.full(100, 0.5), np.full(100, 0.2)
    band[:5] = 50.0
    drawn = series(("±2σ", value - band), ("±2σ", value + band), ("wind", value))
    low, high = _panel("wind", "wind", drawn).limits
    assert 0.2 < low < 0.3
    assert 0.7 < high < 0.8


def test_axis_of_small_innovations_shows_the_expected_band() -> None:
    guides = series(("±2σ", np.full(100, 2.0)), ("±2σ", np.full(100, -2.0)))
    low, high = _panel("x", "x", series(("x", 0.01 * np.sin(TIME))), guides).limits
    assert low < -2.0
    assert high > 2.0


def test_axis_of_an_estimate_without_standard_deviations_fits_its_values() -> None:
    drawn = series(("±2σ", np.full(100, np.nan)), ("x", np.sin(TIME)))
    low, high = _panel("x", "x", drawn).limits
    assert -1.1 < low < -1.0
    assert 1.0 < high < 1.1
