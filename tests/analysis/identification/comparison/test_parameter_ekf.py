"""The extended Kalman filter against the joint least squares that it approximates."""

from dataclasses import replace

import numpy as np
import pytest
from fitted_runs import TRUE, a_trial, fitted
from scipy.optimize import least_squares

from analysis.identification.comparison.history import two_priors
from analysis.identification.comparison.parameter_ekf import (
    _data_without_waves,
    _initial_estimate,
    _strides,
    _update_and_predict,
    parameter_ekf,
)
from analysis.identification.fit.nuisance import Nuisance
from analysis.identification.fit.output_error import output_error
from analysis.identification.fit.uncertainty import uncertainty
from shiplog.ships import ship_model


@pytest.mark.parametrize("model", ["burylin", "burylin-tied", "norrbin"])
def test_an_update_is_the_joint_least_squares_of_prior_and_samples(model: str) -> None:
    """Compared with scipy, by finite differences, on prior and samples together."""
    fit, estimates = fitted(model)
    problem = replace(fit.problem, waves=())
    covariance = np.diag((0.02 * np.abs(estimates.values)) ** 2)
    prior = _initial_estimate(fit, 0, estimates.values * 1.01, covariance)
    path, part = next(_strides(problem.segments[0], 20.0))
    measured, weight = (column[part] for column in _data_without_waves(fit, 0))
    result = _update_and_predict(problem, prior, path, measured, weight)
    p, s = len(estimates.values), len(problem.model.state)
    root = np.linalg.cholesky(np.linalg.inv(prior.covariance)).T

    def residual(z: np.ndarray) -> np.ndarray:
        out = problem.model.simulate(
            problem.parameters(prior.mean + z), (prior.mean + z)[p : p + s], path,
            len(measured), offset=(prior.mean + z)[p + s], scale=problem.scale,
        )[:, problem.columns]  # fmt: skip
        for k, (column, _) in enumerate(problem.biases):
            out[:, column] += (prior.mean + z)[p + s + 1 + k]
        samples = ((measured - out) * np.sqrt(weight))[1:]
        return np.concatenate((samples[np.isfinite(samples)], root @ z))

    sizes = np.sqrt(np.diag(prior.covariance))
    best = least_squares(residual, np.zeros(len(sizes)), x_scale=sizes, xtol=1e-14, ftol=1e-14)
    mean = prior.mean + best.x
    stds = np.sqrt(np.diag(np.linalg.inv(best.jac.T @ best.jac)))[:p]
    np.testing.assert_allclose(result.mean[:p] / stds, mean[:p] / stds, atol=0.02, rtol=0)
    np.testing.assert_allclose(np.sqrt(np.diag(result.covariance)[:p]), stds, rtol=1e-3)


def test_consecutive_strides_are_the_whole_run() -> None:
    fit, estimates = fitted()
    trial, model = fit.problem.segments[0], fit.problem.model
    state = fit.problem.start()[len(estimates.values) :][:4]
    whole = model.simulate(fit.parameters, state, trial.path, len(trial))
    parts = [whole[:1]]
    for path, part in _strides(trial, 2.0):
        run = model.propagate(fit.parameters, state, path, part.stop - part.start, np.eye(17)[:1])
        parts.append(run.outputs[1:])
        state = run.end
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("runs", [1, 2])
def test_from_priors_wrong_by_30_percent_it_converges_to_output_error(runs: int) -> None:
    fit, estimates = fitted(runs=runs)
    result = parameter_ekf(fit, two_priors(estimates, fit.problem.bounds))
    for values, stds in zip(result.values, result.stds, strict=True):
        np.testing.assert_array_less(np.abs(values[-1] - estimates.values), 1.0 * estimates.std)
        np.testing.assert_allclose(stds[-1], estimates.bound, rtol=0.25)
    assert result.time_secs[-1] == pytest.approx(runs * 400.0, abs=0.3)
    assert (np.diff(result.time_secs) >= 0).all()


def test_the_first_estimate_is_the_prior() -> None:
    fit, estimates = fitted()
    result = parameter_ekf(fit, two_priors(estimates, fit.problem.bounds))
    np.testing.assert_array_equal(result.values[:, 0], result.priors)
    np.testing.assert_allclose(result.prior_share[0], 1.0)


def test_a_parameter_without_excitation_stays_at_its_prior() -> None:
    """b1 and e on a run that ends before the rudder moves."""
    fit, estimates = fitted()
    quiet = replace(fit.problem, segments=(fit.problem.segments[0].part(0, 90),), waves=())
    short = replace(
        fit, problem=quiet, residual_stds=tuple(
            type(s)(s.effective[:90], s.typical[:90]) for s in fit.residual_stds
        ),
    )  # fmt: skip
    result = parameter_ekf(short, two_priors(estimates, fit.problem.bounds))
    assert result.prior_share[-1, estimates.names.index("e")] > 0.99
    assert result.mostly_prior[:, estimates.names.index("b1")].all()


def test_it_works_without_rudder_offset_and_biases() -> None:
    fit = output_error([a_trial()], ship_model("burylin"), nuisance=Nuisance.none())
    estimates = uncertainty(fit)
    result = parameter_ekf(fit, two_priors(estimates, fit.problem.bounds))
    d = estimates.names.index("d")
    np.testing.assert_allclose(result.values[:, -1, d], TRUE["d"], rtol=0.005)


def test_a_diverging_simulation_gives_nan() -> None:
    fit, estimates = fitted()
    priors = two_priors(estimates, fit.problem.bounds)
    priors[0, estimates.names.index("a")] = 50.0
    result = parameter_ekf(fit, priors)
    a = estimates.names.index("a")
    assert np.isnan(result.values[0, 5:, a]).all()
    assert np.isnan(result.prior_share[-1, a])
