"""The yaw angle of the comparisons is the integral of the yaw rate, however its samples are cut."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from shiplog.checks.consistency.coarse_record import Integrated


@pytest.mark.parametrize("cuts", [[], [1], [1, 2, 40]])
def test_the_integral_is_that_of_the_trapezoidal_rule(cuts: list[int]) -> None:
    rng = np.random.default_rng(1)
    times, rates = np.cumsum(rng.uniform(0.1, 2.0, 60)), rng.standard_normal((60, 1))
    integrated = Integrated()
    parts = zip(np.split(times, cuts), np.split(rates, cuts), strict=True)
    ours = np.concatenate([integrated(t, r) for t, r in parts])
    expected = cumulative_trapezoid(rates[:, 0], times, initial=0.0)
    assert ours[:, 0] == pytest.approx(expected, abs=1e-12)
