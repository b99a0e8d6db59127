"""The paper's own scheme: it is as printed, and its estimates are mostly its prior."""

import numpy as np
import pytest
from fitted_runs import TRUE, a_trial, fitted

from analysis.identification.comparison.history import two_priors
from analysis.identification.comparison.paper_scheme import (
    IDENTIFIED_NAMES,
    paper_scheme,
    paper_states,
    regression_rows,
    solve_window,
    window_coefficients,
)
from analysis.identification.comparison.windows import window_estimates
from analysis.regression.coefficients import fit_coefficients
from analysis.regression.weak_form import weak_form
from shiplog import load_vessel

PRIOR = load_vessel("table1")[0].coefficients


def test_a_window_is_the_least_squares_solution_of_its_rows() -> None:
    signals = a_trial().signals
    states = paper_states(signals, PRIOR)
    ends, result = window_coefficients(signals, PRIOR, states)
    k = int(np.searchsorted(ends, 310.0))
    stop = round(ends[k] / 0.1)
    expected = []
    for rows in regression_rows(signals, PRIOR, states):
        part = rows[stop - 2000 : stop]
        size = np.linalg.norm(part[:, :-1], axis=0)
        expected += (
            np.linalg.lstsq(part[:, :-1] / size, part[:, -1], rcond=None)[0] / size
        ).tolist()
    np.testing.assert_allclose(result[k], expected, rtol=1e-6)


def test_with_the_true_coefficients_as_prior_it_returns_them() -> None:
    signals = a_trial().signals
    states = paper_states(signals, PRIOR, as_printed=False)
    result = np.concatenate(
        [solve_window(rows) for rows in regression_rows(signals, PRIOR, states)]
    )
    error = dict(zip(IDENTIFIED_NAMES, result / np.array(PRIOR[:9]) - 1, strict=True))
    assert abs(error["a"]) < 0.05
    assert abs(error["d"]) < 0.05
    assert abs(error["h"]) < 0.05


def test_its_estimates_from_two_priors_stay_apart() -> None:
    fit, estimates = fitted()
    result = paper_scheme(fit, two_priors(estimates, fit.problem.bounds))
    assert result is not None
    prior_share = dict(zip(result.names, result.median_prior_share, strict=True))
    assert prior_share["d"] > 0.5
    assert prior_share["b1"] > 1.0
    assert result.mostly_prior.mean() > 0.7


def test_other_models_have_no_history() -> None:
    fit, estimates = fitted("norrbin")
    assert paper_scheme(fit, two_priors(estimates, fit.problem.bounds)) is None
    assert window_estimates(fit) is None


def test_a_diverged_filter_gives_nan() -> None:
    assert np.isnan(solve_window(np.full((20, 4), np.nan))).all()


@pytest.mark.parametrize("model", ["burylin", "burylin-tied"])
def test_windows_in_weak_form_are_those_of_a_replay(model: str) -> None:
    fit, _ = fitted(model, runs=2)
    result = window_estimates(fit)
    assert result is not None
    yaw = fit_coefficients(weak_form(a_trial().signals, PRIOR)[0])[1]
    first = len(yaw.time_secs)
    np.testing.assert_allclose(
        result.values[0, :first, result.names.index("d")], yaw.values[:, yaw.names.index("d")]
    )
    assert np.isnan(result.values[0, first]).all()  # the break between the runs
    assert result.time_secs[first + 1] > 400.0
    estimates = result.values[0, :, result.names.index("d")]
    assert np.nanmedian(estimates) == pytest.approx(TRUE["d"], rel=0.02)
