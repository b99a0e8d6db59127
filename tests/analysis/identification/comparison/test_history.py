"""ParameterHistory from two priors: what of them is an echo."""

from types import SimpleNamespace

import numpy as np

from analysis.identification.comparison.history import (
    ParameterHistory,
    begins_secs,
    run_secs,
    two_priors,
    with_breaks,
)

ANYWHERE = np.full(5, -np.inf), np.full(5, np.inf)


def courses(high: list[float], low: list[float]) -> ParameterHistory:
    values = np.array([high, low])[:, :, None]
    priors = np.array([[1.3], [0.7]])
    times = np.arange(float(len(high)))
    return ParameterHistory("m", ("d",), times, values, np.full(values.shape, 0.1), priors)


def test_a_copy_of_the_prior_echoes_wholly_and_what_came_together_not_at_all() -> None:
    found = courses([1.3, 1.3, 1.15, 1.0], [0.7, 0.7, 0.85, 1.0])
    np.testing.assert_allclose(found.prior_share[:, 0], [1.0, 1.0, 0.5, 0.0])


def test_errors_that_grow_are_more_than_an_echo() -> None:
    assert courses([2.2], [-0.2]).prior_share[0, 0] > 3.9


def test_courses_that_cross_and_part_again_have_learnt_nothing() -> None:
    found = courses([1.3, 1.0, 1.4, 1.0], [0.7, 1.0, 0.6, 1.0])
    assert found.mostly_prior[:, 0].tolist() == [True, True, True, False]


def test_a_gap_is_neither_echo_nor_knowledge() -> None:
    found = courses([1.3, np.nan, 1.4, 1.0], [0.7, 1.0, 0.6, 1.0])
    assert np.isnan(found.prior_share[1, 0])
    assert found.mostly_prior[:3, 0].all()
    assert found.median_prior_share[0] == np.median(found.prior_share[2:, 0])


def test_without_a_prior_nothing_is_an_echo() -> None:
    one = ParameterHistory(
        "m", ("d",), np.arange(2.0), np.array([[[1.0], [np.nan]]]), np.ones((1, 2, 1)),
        np.full((1, 1), np.nan),
    )  # fmt: skip
    assert one.prior_share[0, 0] == 0.0
    assert np.isnan(one.prior_share[1, 0])


def test_priors_lie_to_either_side_and_further_off_where_little_is_told() -> None:
    told = SimpleNamespace(values=np.array([2.0, -1.0, 1.0]), std=np.array([0.01, 0.2, 50.0]))
    high, low = two_priors(told, ANYWHERE)  # type: ignore[arg-type]
    np.testing.assert_allclose((high + low) / 2, told.values)
    np.testing.assert_allclose(np.abs(high - low) / 2, [0.6, 0.6, 1.0])


def test_a_value_of_zero_has_priors_that_differ() -> None:
    told = SimpleNamespace(values=np.array([0.0]), std=np.array([0.1]))
    high, low = two_priors(told, ANYWHERE)  # type: ignore[arg-type]
    assert high[0] != low[0]


def test_runs_are_put_end_to_end() -> None:
    class Run:
        dt_secs = 0.5

        def __len__(self) -> int:
            return 20

    runs = (Run(), Run(), Run())
    assert list(begins_secs(runs)) == [0.0, 10.0, 20.0]  # type: ignore[arg-type]
    assert run_secs(runs) == 30.0  # type: ignore[arg-type]


def test_between_runs_there_is_a_break() -> None:
    values = with_breaks([np.ones((2, 3)), np.zeros((1, 3))])
    assert values.shape == (4, 3)
    assert np.isnan(values[2]).all()
    np.testing.assert_array_equal(with_breaks([np.arange(2.0), np.array([5.0])]), [0, 1, 1, 5])


def test_priors_stay_within_the_limits_of_their_parameters() -> None:
    told = SimpleNamespace(values=np.array([0.5, 2.0]), std=np.array([9.0, 9.0]))
    bounds = np.array([0.02, -np.inf, -np.inf]), np.array([np.inf, 2.5, np.inf])
    high, low = two_priors(told, bounds)  # type: ignore[arg-type]
    np.testing.assert_allclose(np.sort([high, low], axis=0), [[0.02, 0.0], [1.0, 2.5]])
