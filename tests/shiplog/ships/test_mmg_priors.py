"""Priors of the MMG model from a hull form, against other regressions of the literature."""

from itertools import product
from math import pi, sqrt

import numpy as np
import pytest

from shiplog.ships import ship_model
from shiplog.ships.hull_form import HullForm
from shiplog.ships.mmg_priors import LINEAR_SCATTER, beyond_regressions, mmg_with_hull
from shiplog.ships.model import Parameter

MMG = ship_model("mmg")
HULL = HullForm(breadth=0.16, draught=0.05, block_coefficient=0.7)
RUDDER = HullForm(rudder_area=0.018, rudder_aspect_ratio=1.8)
PROPELLER = HullForm(propeller_diameter=0.035, rudder_height=0.04)
FORMS = [
    HullForm(1 / slender, 1 / slender / flat, fullness)
    for slender, flat, fullness in product(
        np.linspace(5, 8, 7), np.linspace(2.3, 3.8, 6), np.linspace(0.55, 0.85, 7)
    )
]


def dimensions(form: HullForm) -> tuple[float, float, float]:
    return form.breadth or 0.0, form.draught or 0.0, form.block_coefficient or 0.0


def priors_of(form: HullForm) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in mmg_with_hull(MMG, form).parameters}


def changed_by(form: HullForm) -> set[str]:
    pairs = zip(mmg_with_hull(MMG, form).parameters, MMG.parameters, strict=True)
    return {new.name for new, old in pairs if new != old}


def clarke(form: HullForm) -> dict[str, float]:
    """D. Clarke et al., 1983, equations of the regression, in the dimensions of the model."""
    b, t, fullness = dimensions(form)
    unit, flat = pi * t, b / t
    return {
        "yv": -unit * (1 + 0.4 * fullness * flat),
        "yr": -unit * (-0.5 + 2.2 * b - 0.08 * flat),
        "nv": -unit * (0.5 + 2.4 * t),
        "nr": -unit * (0.25 + 0.039 * flat - 0.56 * b),
        "my": unit * (1 + 0.16 * fullness * flat - 5.1 * b * b),
    }


def older(form: HullForm) -> list[dict[str, float]]:
    """Wagner Smitt 1971, Norrbin 1971 and Inoue 1981, as Clarke compares them."""
    b, t, fullness = dimensions(form)
    unit, full, k = pi * t, fullness * b / t / pi, 2 * t
    return [
        {"yv": -5.0 * t, "yr": 1.02 * t, "nv": -1.94 * t, "nr": -0.65 * t},
        {
            "yv": -unit * (1.69 + 0.08 * full),
            "yr": -unit * (-0.645 + 0.38 * full),
            "nv": -unit * (0.64 - 0.04 * full),
            "nr": -unit * (0.47 - 0.18 * full),
        },
        {
            "yv": -(pi / 2 * k + 1.4 * fullness * b),
            "yr": pi / 4 * k,
            "nv": -k,
            "nr": -0.54 * k + k * k,
        },
    ]


def test_linear_derivatives_agree_with_clarke_within_the_widths() -> None:
    for form in FORMS:
        priors = priors_of(form)
        for name, value in clarke(form).items():
            assert abs(value - priors[name].start) < 2.5 * priors[name].prior_std, (name, form)


@pytest.mark.parametrize("name", LINEAR_SCATTER)
def test_the_widths_are_the_spread_of_the_regressions_but_at_least_15_percent(name: str) -> None:
    ratios = [
        each[name] / priors_of(form)[name].start - 1
        for form in FORMS
        for each in [clarke(form), *older(form)]
    ]
    spread = sqrt(np.mean(np.square(ratios)))
    assert LINEAR_SCATTER[name] == pytest.approx(max(spread, 0.15), abs=0.01)


def test_the_force_in_drift_agrees_with_kijimas_quadratic_one() -> None:
    drift = 0.35
    for form in FORMS:
        priors = priors_of(form)
        breadth, draught, fullness = dimensions(form)
        quadratic = (2.5 * draught / breadth * (1 - fullness) + 0.5) * drift**2
        cubic = -priors["yvvv"].start * drift**3
        assert abs(cubic - quadratic) < 2.5 * priors["yvvv"].prior_std * drift**3


def test_the_rudders_force_follows_from_area_slope_and_race() -> None:
    # the race of this propeller covers the whole rudder; Λ = 2.25 has half the slope 6.13
    wide = HullForm(rudder_area=0.02, rudder_aspect_ratio=2.25, propeller_diameter=0.04,
                    rudder_height=0.03, draught=0.05, block_coefficient=0.7)  # fmt: skip
    priors = priors_of(wide)
    assert priors["d"].start == 1.0
    race = 0.68 * (1 + priors["k"].start * (sqrt(1 + priors["ct"].start) - 1))
    assert priors["f0"].start == pytest.approx(0.02 * 3.065 * race**2)
    assert priors["f0"].prior_std == pytest.approx(0.25 * priors["f0"].start)
    assert priors["ct"].start == pytest.approx(
        MMG.parameter("r0").start * 0.05 / (0.82 * 0.7**2 * pi * 0.02**2)
    )


def test_the_mass_is_the_displacement() -> None:
    assert priors_of(HULL)["m"].start == pytest.approx(2 * 0.7 * 0.16)


@pytest.mark.parametrize(
    ("form", "names"),
    [
        (HullForm(), set()),
        (HullForm(breadth=0.16, draught=0.05), set()),
        (HullForm(breadth=0.16, block_coefficient=0.7), {"m"}),
        (RUDDER, {"f0"}),
        (HullForm(rudder_area=0.018), set()),
        (PROPELLER, {"d"}),
        (HullForm(0.4, 0.1, 0.7), {"m"}),
        (
            HULL,
            {
                *("m", "mx", "my", "iz", "yv", "yr", "nv", "nr", "yvvv", "yvrr"),
                *("xvv", "xvvvv", "xrr"),
            },
        ),
    ],
)
def test_only_those_priors_change_whose_inputs_are_known(form: HullForm, names: set[str]) -> None:
    assert changed_by(form) == names


def test_a_hull_narrows_what_its_regressions_determine() -> None:
    priors = priors_of(HULL)
    for name in ("my", "iz", "yv", "yr", "yvvv", "yvrr", "nv", "nr"):
        assert priors[name].prior_std < MMG.parameter(name).prior_std, name


def test_a_form_outside_the_regressions_is_named() -> None:
    assert beyond_regressions(HULL) == ""
    assert beyond_regressions(HullForm()) == ""
    assert beyond_regressions(HullForm(0.16, 0.02, 0.7)).startswith("B/T = 8")
    assert beyond_regressions(HullForm(0.16, 0.05, 0.4)).startswith("CB = 0.4")


def test_means_stay_within_the_limits_of_the_model() -> None:
    for form in (*FORMS, HullForm(0.16, 0.05, 0.7, 0.02, 1.8, 0.04, 0.001)):
        for parameter in mmg_with_hull(MMG, form).parameters:
            assert parameter.lowest <= parameter.start <= parameter.highest
            assert parameter.prior_std > 0
