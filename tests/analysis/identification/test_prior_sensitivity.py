"""A second run from other beliefs: what stays where it was was told by data."""

from dataclasses import replace

import numpy as np
import pytest
from fitted_runs import a_trial, fitted

from analysis.identification.output_error import output_error
from analysis.identification.prior_sensitivity import PriorSensitivity, prior_sensitivity
from analysis.identification.uncertainty import uncertainty
from shiplog.ships import Model, ship_model


def believing(model: Model, name: str, std: float) -> Model:
    """The model with a prior on one of its parameters."""
    parameters = tuple(
        replace(p, prior_std=std, start=-8.0) if p.name == name else p for p in model.parameters
    )
    return replace(model, parameters=parameters)


def test_what_the_data_tell_comes_back_from_another_start() -> None:
    found = prior_sensitivity(*fitted())
    assert not found.elsewhere
    assert found.shares.max() < 0.01


def test_a_firm_belief_is_an_echo_and_a_loose_one_is_none() -> None:
    for std, least, most in ((1e-4, 0.99, 1.01), (100.0, 0.0, 0.05)):
        model = believing(ship_model("burylin"), "b3", std)
        fit = output_error([a_trial()], model)
        again = prior_sensitivity(fit, uncertainty(fit))
        shares = dict(zip(fit.problem.free_names, again.shares, strict=True))
        assert least <= shares["b3"] <= most
        assert shares["d"] < 0.05


def test_the_share_is_that_of_the_information() -> None:
    """For one belief among data, as far as the model is linear between the two."""
    fit = output_error([a_trial()], believing(ship_model("burylin"), "b3", 0.4))
    told = uncertainty(fit)
    i = told.names.index("b3")
    assert 0.05 < told.prior_share[i] < 0.95
    assert prior_sensitivity(fit, told).shares[i] == pytest.approx(told.prior_share[i], rel=0.1)


@pytest.mark.parametrize("worse_by", [5.0, -5.0, np.inf])
def test_another_minimum_is_no_echo_but_is_told(worse_by: float) -> None:
    assert PriorSensitivity(np.zeros(2), worse_by).elsewhere
