"""What is known of the drift: by positions, by the sway, or not at all."""

from dataclasses import replace

import numpy as np
import pytest
from fitted_runs import a_trial

from analysis.identification.fit.drift import (
    SWAY_PARAMETERS,
    drift_is_unknown,
    shows_drift,
    unobserved_parameters,
    without_sway,
)
from analysis.identification.fit.output_error import make_problem
from analysis.identification.fit.problem import Problem
from analysis.identification.fit.segment import Segment
from shiplog.ships import loadable_models, ship_model
from shiplog.ships.motion import MODEL_OUTPUTS


def a_problem(*segments: Segment, model: str = "slipstream") -> Problem:
    """Return the problem of a model and segments of a ship of 150 m."""
    return make_problem(segments, ship_model(model), length=150.0)


def test_positions_or_sway_in_one_segment_show_the_drift() -> None:
    blind = a_trial()
    fixes = np.zeros((len(blind), 2))
    sway = blind.measured.copy()
    sway[:, MODEL_OUTPUTS.index("sway")] = 0.1
    two = np.full_like(fixes, np.nan)
    two[3:5] = 0.0
    for useless in (np.full_like(fixes, np.nan), two):
        assert not shows_drift(a_problem(blind, replace(blind, fixes=useless)))
    assert shows_drift(a_problem(blind, replace(blind, fixes=fixes)))
    assert shows_drift(a_problem(replace(blind, measured=sway), blind))


def test_fixes_too_few_for_a_velocity_are_not_fitted() -> None:
    blind = a_trial()
    fixes = np.full((len(blind), 2), np.nan)
    fixes[3:5] = 0.0
    few, none = a_problem(replace(blind, fixes=fixes)), a_problem(blind)
    assert few.outputs == none.outputs
    assert few.size == none.size
    np.testing.assert_array_equal(few.start(), none.start())


@pytest.mark.parametrize(
    ("model", "names"),
    [("burylin", ()), ("slipstream", ("c1", "c2")), ("three-dof", ("yv", "yr", "cy", "yd"))],
)
def test_without_them_the_sway_equation_is_unobserved(model: str, names: tuple[str, ...]) -> None:
    blind = a_trial()
    assert unobserved_parameters(a_problem(blind, model=model)) == names
    assert drift_is_unknown(a_problem(blind, model=model)) == bool(names)
    seen = replace(blind, fixes=np.zeros((len(blind), 2)))
    assert unobserved_parameters(a_problem(seen, model=model)) == ()


def test_every_model_with_a_sway_has_parameters_of_its_sway_equation() -> None:
    for model in loadable_models()[0]:
        assert bool(set(model.names) & set(SWAY_PARAMETERS)) == ("sway" in model.outputs)


def test_a_sway_that_diverged_stays_so() -> None:
    outputs = np.array([[1.0, 2.0, 3.0, 4.0], [np.nan] * 4])
    assert without_sway(outputs)[0].tolist() == [1.0, 2.0, 0.0, 4.0]
    assert np.isnan(without_sway(outputs)[1]).all()
