"""Histories from two priors, and their share of prior."""

from types import SimpleNamespace

import numpy as np

from analysis.identification.comparison.history import (
    ParameterHistory,
    start_times_secs,
    total_duration_secs,
    two_priors,
    with_breaks,
)

NO_BOUNDS = np.full(5, -np.inf), np.full(5, np.inf)


def history(high: list[float], low: list[float]) -> ParameterHistory:
    values = np.array([high, low])[:, :, None]
    priors = np.array([[1.3], [0.7]])
    times = np.arange(float(len(high)))
    return ParameterHistory("m", ("d",), times, values, np.full(values.shape, 0.1), priors)


def test_the_share_of_prior_is_1_for_a_copy_and_0_where_both_estimates_agree() -> None:
    result = history([1.3, 1.3, 1.15, 1.0], [0.7, 0.7, 0.85, 1.0])
    np.testing.assert_allclose(result.prior_share[:, 0], [1.0, 1.0, 0.5, 0.0])


def test_amplified_errors_exceed_a_share_of_1() -> None:
    assert history([2.2], [-0.2]).prior_share[0, 0] > 3.9


def test_estimates_that_cross_and_part_again_are_mostly_prior() -> None:
    result = history([1.3, 1.0, 1.4, 1.0], [0.7, 1.0, 0.6, 1.0])
    assert result.mostly_prior[:, 0].tolist() == [True, True, True, False]


def test_a_gap_has_no_share_of_prior() -> None:
    result = history([1.3, np.nan, 1.4, 1.0], [0.7, 1.0, 0.6, 1.0])
    assert np.isnan(result.prior_share[1, 0])
    assert result.mostly_prior[:3, 0].all()
    assert result.median_prior_share[0] == np.median(result.prior_share[2:, 0])


def test_a_method_without_priors_has_no_share_of_prior() -> None:
    one = ParameterHistory(
        "m", ("d",), np.arange(2.0), np.array([[[1.0], [np.nan]]]), np.ones((1, 2, 1)),
        np.full((1, 1), np.nan),
    )  # fmt: skip
    assert one.prior_share[0, 0] == 0.0
    assert np.isnan(one.prior_share[1, 0])


def test_priors_are_on_both_sides_and_further_apart_where_the_std_is_larger() -> None:
    estimates = SimpleNamespace(values=np.array([2.0, -1.0, 1.0]), std=np.array([0.01, 0.2, 50.0]))
    high, low = two_priors(estimates, NO_BOUNDS)  # type: ignore[arg-type]
    np.testing.assert_allclose((high + low) / 2, estimates.values)
    np.testing.assert_allclose(np.abs(high - low) / 2, [0.6, 0.6, 1.0])


def test_a_value_of_zero_has_two_different_priors() -> None:
    estimates = SimpleNamespace(values=np.array([0.0]), std=np.array([0.1]))
    high, low = two_priors(estimates, NO_BOUNDS)  # type: ignore[arg-type]
    assert high[0] != low[0]


def test_runs_are_put_end_to_end() -> None:
    class Run:
        dt_secs = 0.5

        def __len__(self) -> int:
            return 20

    runs = (Run(), Run(), Run())
    assert list(start_times_secs(runs)) == [0.0, 10.0, 20.0]  # type: ignore[arg-type]
    assert total_duration_secs(runs) == 30.0  # type: ignore[arg-type]


def test_runs_are_separated_by_a_break() -> None:
    values = with_breaks([np.ones((2, 3)), np.zeros((1, 3))])
    assert values.shape == (4, 3)
    assert np.isnan(values[2]).all()
    np.testing.assert_array_equal(with_breaks([np.arange(2.0), np.array([5.0])]), [0, 1, 1, 5])


def test_priors_stay_within_the_limits_of_their_parameters() -> None:
    estimates = SimpleNamespace(values=np.array([0.5, 2.0]), std=np.array([9.0, 9.0]))
    bounds = np.array([0.02, -np.inf, -np.inf]), np.array([np.inf, 2.5, np.inf])
    high, low = two_priors(estimates, bounds)  # type: ignore[arg-type]
    np.testing.assert_allclose(np.sort([high, low], axis=0), [[0.02, 0.0], [1.0, 2.5]])
