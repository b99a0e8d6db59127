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
from shiplog.ships import loadable_models, ship_model
from shiplog.ships.motion import MODEL_OUTPUTS


def test_positions_or_sway_in_one_segment_show_the_drift() -> None:
    blind = a_trial()
    fixes = np.zeros((len(blind), 2))
    sway = blind.measured.copy()
    sway[:, MODEL_OUTPUTS.index("sway")] = 0.1
    assert not shows_drift([blind, replace(blind, fixes=np.full_like(fixes, np.nan))])
    assert shows_drift([blind, replace(blind, fixes=fixes)])
    assert shows_drift([replace(blind, measured=sway), blind])


@pytest.mark.parametrize(
    ("model", "names"),
    [("burylin", ()), ("slipstream", ("c1", "c2")), ("three-dof", ("yv", "yr", "cy", "yd"))],
)
def test_without_them_the_sway_equation_is_unobserved(model: str, names: tuple[str, ...]) -> None:
    blind = a_trial()
    assert unobserved_parameters(ship_model(model), [blind]) == names
    assert drift_is_unknown(ship_model(model), [blind]) == bool(names)
    seen = replace(blind, fixes=np.zeros((len(blind), 2)))
    assert unobserved_parameters(ship_model(model), [seen]) == ()


def test_every_model_with_a_sway_has_parameters_of_its_sway_equation() -> None:
    for model in loadable_models()[0]:
        assert bool(set(model.names) & set(SWAY_PARAMETERS)) == ("sway" in model.outputs)


def test_a_sway_that_diverged_stays_so() -> None:
    outputs = np.array([[1.0, 2.0, 3.0, 4.0], [np.nan] * 4])
    assert without_sway(outputs)[0].tolist() == [1.0, 2.0, 0.0, 4.0]
    assert np.isnan(without_sway(outputs)[1]).all()
