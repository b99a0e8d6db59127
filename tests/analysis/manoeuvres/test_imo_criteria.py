"""Limits of the norm at the break points of L/V, and the verdict from an interval."""

from math import degrees, nan, radians

import pytest

from analysis.manoeuvres.imo_criteria import RULES, applies, criterion_of, limit, probability_below
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.trial_index import Criterion, TrialIndex, Verdict

BY_NAME = {rule.name: rule for rule in RULES}
FIRST, SECOND = (BY_NAME[f"10/10 zig-zag, {which} overshoot"] for which in ("first", "second"))


@pytest.mark.parametrize(
    ("ratio", "first_deg", "second_deg"),
    [(9.99, 10.0, 25.0), (10.0, 10.0, 25.0), (20.0, 15.0, 32.5), (30.0, 20.0, 40.0),
     (60.0, 20.0, 40.0)],
)  # fmt: skip
def test_the_limits_of_overshoots_follow_the_ship_s_length_over_speed(
    ratio: float, first_deg: float, second_deg: float
) -> None:
    assert degrees(limit(FIRST, ratio * 5.0, 5.0)[0]) == pytest.approx(first_deg)
    assert degrees(limit(SECOND, ratio * 5.0, 5.0)[0]) == pytest.approx(second_deg)


@pytest.mark.parametrize(
    ("name", "lengths"),
    [("advance", 4.5), ("tactical diameter", 5.0), ("initial turning", 2.5),
     ("stopping, track reach", 15.0)],
)  # fmt: skip
def test_limits_of_distances_are_multiples_of_the_length(name: str, lengths: float) -> None:
    assert limit(BY_NAME[name], 100.0, 5.0)[0] == pytest.approx(100.0 * lengths)


def test_a_limit_that_needs_an_unknown_length_is_none() -> None:
    ship = {"length": nan, "test_speed": 5.0}
    angles = (radians(35.0), nan)
    circle = ManoeuvreKind.TURNING_CIRCLE
    assert criterion_of("advance", circle, angles, ship, astern=False) is None


def test_a_circle_of_small_rudder_and_a_stop_without_astern_are_not_judged() -> None:
    circle, stop = ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.STOPPING
    assert not applies(BY_NAME["advance"], circle, radians(20.0), nan, astern=False)
    assert applies(BY_NAME["advance"], circle, radians(-35.0), nan, astern=False)
    reach = BY_NAME["stopping, track reach"]
    assert not applies(reach, stop, nan, nan, astern=False)
    assert applies(reach, stop, nan, nan, astern=True)


@pytest.mark.parametrize(
    ("value", "verdict"),
    [(90.0, Verdict.MEETS), (110.0, Verdict.FAILS), (101.0, Verdict.UNDECIDED)],
)
def test_the_verdict_is_decided_where_the_limit_is_outside_the_interval(
    value: float, verdict: Verdict
) -> None:
    criterion = Criterion("advance", 100.0, "4.5 L", "")
    index = TrialIndex("advance", "Ad", value, "m", 2.0, value - 4, value + 4, criterion=criterion)
    assert index.verdict is verdict
    assert TrialIndex("advance", "Ad", value, "m", 2.0, value - 4, value + 4).verdict is None


def test_the_probability_without_uncertainty_is_certain() -> None:
    assert probability_below(10.0, 9.0, 0.0) == 1.0
    assert probability_below(10.0, 11.0, 0.0) == 0.0
