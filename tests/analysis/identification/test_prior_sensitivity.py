"""Second fit from other priors: a value that does not move is determined by the data."""

from dataclasses import replace

import numpy as np
import pytest
from fitted_runs import a_trial, fitted

from analysis.identification.fit.output_error import output_error
from analysis.identification.fit.uncertainty import uncertainty
from analysis.identification.prior_sensitivity import PriorSensitivity, prior_sensitivity
from shiplog.ships import Model, ship_model


def with_prior(model: Model, name: str, std: float) -> Model:
    """Return the model with a prior on one of its parameters."""
    parameters = tuple(
        replace(p, prior_std=std, start=-8.0) if p.name == name else p for p in model.parameters
    )
    return replace(model, parameters=parameters)


def test_parameters_without_priors_have_no_share_of_prior() -> None:
    sensitivity = prior_sensitivity(*fitted())
    assert not sensitivity.other_minimum
    assert sensitivity.shares.max() < 0.01


def test_a_narrow_prior_has_all_the_share_and_a_wide_one_none() -> None:
    for std, least, most in ((1e-4, 0.99, 1.01), (100.0, 0.0, 0.05)):
        model = with_prior(ship_model("burylin"), "b3", std)
        fit = output_error([a_trial()], model)
        sensitivity = prior_sensitivity(fit, uncertainty(fit))
        shares = dict(zip(fit.problem.free_names, sensitivity.shares, strict=True))
        assert least <= shares["b3"] <= most
        assert shares["d"] < 0.05


def test_the_share_of_prior_is_its_share_of_the_information() -> None:
    """With one prior, as far as the model is linear between the two fits."""
    fit = output_error([a_trial()], with_prior(ship_model("burylin"), "b3", 0.4))
    estimates = uncertainty(fit)
    i = estimates.names.index("b3")
    assert 0.05 < estimates.prior_share[i] < 0.95
    assert prior_sensitivity(fit, estimates).shares[i] == pytest.approx(
        estimates.prior_share[i], rel=0.1
    )


@pytest.mark.parametrize("worse_by", [5.0, -5.0, np.inf])
def test_a_difference_in_cost_means_another_minimum(worse_by: float) -> None:
    assert PriorSensitivity(np.zeros(2), worse_by).other_minimum
