"""Tail probabilities, against scipy.special."""

from math import inf, isnan, nan

import pytest
from scipy.special import chdtrc, stdtr

from analysis.signals.distributions import chi_squared_tail, student_tails


@pytest.mark.parametrize("degrees_of_freedom", [1, 2, 3, 10, 19, 20, 57])
@pytest.mark.parametrize("x", [0.0, 1e-4, 0.3, 5.0, 20.0, 60.0, 900.0, inf])
def test_chi_squared_tail_is_that_of_scipy(x: float, degrees_of_freedom: int) -> None:
    expected = chdtrc(degrees_of_freedom, x)
    assert chi_squared_tail(x, degrees_of_freedom) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("degrees_of_freedom", [0.4, 1.0, 3.7, 30.0, 999.5])
@pytest.mark.parametrize("t", [-40.0, -2.0, -1e-5, 0.0, 0.01, 1.0, 1.7, 4.0, 600.0])
def test_tails_of_students_t_are_those_of_scipy(t: float, degrees_of_freedom: float) -> None:
    expected = 2 * stdtr(degrees_of_freedom, -abs(t))
    assert student_tails(t, degrees_of_freedom) == pytest.approx(expected, rel=1e-11, abs=1e-300)


def test_tails_with_many_degrees_of_freedom_are_those_of_scipy() -> None:
    for t in (0.3, 1.4, 2.0, 8.0):
        assert student_tails(t, 1e6) == pytest.approx(2 * stdtr(1e6, -t), rel=2e-8)


def test_an_infinite_statistic_has_no_tail_and_nan_remains_nan() -> None:
    assert student_tails(inf, 5.0) == student_tails(1e200, 5.0) == 0.0
    assert isnan(student_tails(nan, 5.0))
