"""Which terms of the wind are estimated, from what their regressors have beyond a slow force."""

from dataclasses import replace

import numpy as np
import pytest
from windy_trials import windy_analysis

from analysis.filters.wind_terms import WIND_TERMS
from analysis.replay.wind_choice import choose_wind, wind_walks
from analysis.signals.signal_stats import SignalStats
from shiplog import UsageError
from shiplog.vessel.settings import DisturbanceSettings

CONSTANT, RAMP, WAVE = (
    DisturbanceSettings(models=(model, "wind")) for model in ("constant", "ramp", "wave")
)
STEADY = "the wind is too steady in speed and angle: but for "


def stats_with(**shapes: np.ndarray) -> SignalStats:
    """The statistics of a trial with other regressors, each in m²/s² over the share of its time."""
    stats = windy_analysis().findings.plan.stats
    values = dict(stats.head.values) | shapes
    return replace(stats, head=replace(stats.head, values=values))


def shapes() -> dict[str, np.ndarray]:
    """A term that is constant, one that grows linearly, and one that turns."""
    t = np.linspace(0.0, 1.0, len(windy_analysis().signals))
    noise = 10 * np.random.default_rng(0).standard_normal((2, len(t)))
    return {
        "constant": 100 + noise[0],
        "linear": 100 * (1 + t) + noise[1],
        "turn": 100 * np.sin(9 * t),
    }


def test_a_term_that_is_constant_is_not_determined_beside_a_constant_moment() -> None:
    each = shapes()
    stats = stats_with(
        wind_oblique=each["turn"], wind_beam=each["constant"], wind_head=each["turn"]
    )
    chosen, undetermined = choose_wind(CONSTANT, (), stats)
    assert chosen == tuple(WIND_TERMS)  # a state all the same
    assert list(undetermined) == ["wind_beam"]
    assert undetermined["wind_beam"].startswith(STEADY)
    assert "it acts as a constant yaw moment" in undetermined["wind_beam"]


def test_a_term_that_grows_linearly_is_not_determined_beside_a_ramp_alone() -> None:
    each = shapes()
    stats = stats_with(wind_oblique=each["turn"], wind_beam=each["turn"], wind_head=each["linear"])
    assert "wind_head" not in choose_wind(CONSTANT, (), stats)[1]
    _, undetermined = choose_wind(RAMP, (), stats)
    assert undetermined["wind_head"].endswith("it acts as a ramp of the surge force")


def test_two_terms_of_one_shape_are_not_both_distinguished() -> None:
    each = shapes()
    stats = stats_with(
        wind_oblique=each["turn"], wind_beam=-2 * each["turn"] + 5, wind_head=each["turn"]
    )
    _, undetermined = choose_wind(CONSTANT, (), stats)
    assert list(undetermined) == ["wind_beam"]
    assert "and the other term of the wind" in undetermined["wind_beam"]


def test_a_steady_wind_is_distinguished_where_nothing_else_acts_steadily() -> None:
    each = shapes()
    stats = stats_with(**dict.fromkeys(WIND_TERMS, each["constant"]))
    _, undetermined = choose_wind(WAVE, (), stats)
    assert list(undetermined) == ["wind_beam"]
    assert undetermined["wind_beam"].endswith("it acts as the other term of the wind")
    _, undetermined = choose_wind(WAVE, ("rudder",), stats)
    assert list(undetermined) == ["wind_oblique", "wind_beam"]
    assert undetermined["wind_oblique"].endswith("it acts as the rudder zero")


def test_a_term_that_does_not_act_is_no_state() -> None:
    stats = stats_with(wind_beam=np.zeros(len(windy_analysis().signals)))
    chosen, undetermined = choose_wind(CONSTANT, (), stats)
    assert chosen == ("wind_oblique", "wind_head")
    assert undetermined["wind_beam"] == "there is no wind"


def test_a_calm_is_refused() -> None:
    calm = dict.fromkeys(WIND_TERMS, np.zeros(len(windy_analysis().signals)))
    with pytest.raises(UsageError, match="oblique wind, yaw: there is no wind;"):
        choose_wind(CONSTANT, (), stats_with(**calm))


def test_without_a_wind_among_the_disturbances_there_are_no_terms() -> None:
    assert choose_wind(DisturbanceSettings(), (), stats_with()) == ((), {})


def test_the_walks_have_the_units_of_the_terms() -> None:
    plan = windy_analysis().findings.plan
    walks = wind_walks(plan.vessel.paper_coefficients, plan.stats)
    assert {name: walk.unit for name, walk in walks.items()} == {
        name: term.unit for name, term in WIND_TERMS.items()
    }
    assert all(0 < walk.hourly_std < walk.std for walk in walks.values())
