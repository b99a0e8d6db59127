import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.filters.kernels import MAX_REJECTED_IN_A_ROW as LIMIT
from analysis.filters.kernels import (
    correct,
    is_accepted,
    output_covariance,
    propagate,
)

seeds = given(seed=st.integers(0, 2**32 - 1))
often = settings(derandomize=True, deadline=None, max_examples=50)


def drawn(rng: np.random.Generator, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A state, its covariance, and what is measured of it."""
    root = rng.standard_normal((size, size)) * 10.0 ** rng.uniform(-4, 1, (size, 1))
    P = root @ root.T
    return rng.standard_normal(size), (P + P.T) / 2, rng.standard_normal((2, size))


def taken(
    x: np.ndarray, P: np.ndarray, c: np.ndarray, y: float, r: float
) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance after one measurement, taken in by the best gain."""
    x, P, Pc = x.copy(), P.copy(), np.empty(len(x))
    S = output_covariance(P, c, Pc) + r
    correct(x, P, Pc / S, Pc, y - c @ x, S)
    return x, P


def units(P: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.diag(P))
    return np.outer(scale, scale)


@seeds
@often
def test_an_outputs_variance_is_c_p_c(seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, P, C = drawn(rng, 4)
    Pc = np.empty(4)
    assert output_covariance(P, C[0], Pc) == pytest.approx(C[0] @ P @ C[0], rel=1e-9, abs=0)
    np.testing.assert_allclose(Pc, P @ C[0], rtol=1e-9, atol=1e-12 * np.abs(P).max())


@seeds
@often
def test_any_gain_is_taken_in_by_josephs_form_and_the_covariance_stays_symmetric(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, P, C = drawn(rng, 5)
    K, r, innovation = rng.standard_normal(5), 0.3, 0.7
    kept = np.eye(5) - np.outer(K, C[0])
    expected = kept @ P @ kept.T + r * np.outer(K, K)
    moved = x + K * innovation
    Pc = np.empty(5)
    S = output_covariance(P, C[0], Pc) + r
    correct(x, P, K, Pc, innovation, S)
    assert x == pytest.approx(moved, rel=1e-14)
    assert np.abs(P - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.array_equal(P, P.T)


@seeds
@often
def test_the_order_in_which_two_outputs_are_taken_in_does_not_matter(seed: int) -> None:
    """Nor whether they are taken in one after the other or at once."""
    rng = np.random.default_rng(seed)
    x, P, C = drawn(rng, 3)
    y, r = rng.standard_normal(2), np.array([0.2, 3.0])
    result = []
    for order in ((0, 1), (1, 0)):
        state, covariance = x, P
        for output in order:
            state, covariance = taken(state, covariance, C[output], y[output], r[output])
        result.append((state, covariance))
    S = C @ P @ C.T + np.diag(r)
    gain = np.linalg.solve(S, C @ P).T
    result.append((x + gain @ (y - C @ x), P - gain @ C @ P))
    for state, covariance in result[1:]:
        assert state == pytest.approx(result[0][0], rel=1e-9, abs=1e-9)
        assert np.abs((covariance - result[0][1]) / units(P)).max() < 1e-9


@seeds
@often
def test_a_covariance_goes_on_as_f_p_f_and_q_and_stays_symmetric(seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, P, _ = drawn(rng, 5)
    _, Q, _ = drawn(rng, 5)
    F = rng.standard_normal((5, 5))
    expected = F @ P @ F.T + Q
    propagate(P, F, Q, np.empty((5, 5)), 5)
    assert np.abs(P - expected).max() < 1e-13 * np.abs(expected).max()
    assert np.array_equal(P, P.T)


def accepted(innovations: list[float], output: int = 0) -> list[bool]:
    """Whether each of a row of innovations is accepted, with a variance of 4 and a gate of 6."""
    rejected_in_a_row = np.zeros(2, np.int64)
    return [is_accepted(e, 4.0, 6.0, output, rejected_in_a_row) for e in innovations]


def test_an_innovation_is_accepted_up_to_the_edge_of_the_gate() -> None:
    assert accepted([0.0, 11.9, -12.0, 12.0, 12.1, -12.1]) == [True] * 4 + [False] * 2


def test_after_the_limit_of_rejections_in_a_row_all_are_accepted() -> None:
    assert accepted([20.0] * (LIMIT + 3)) == [False] * LIMIT + [True] * 3


def test_one_sample_within_the_gate_starts_the_count_again() -> None:
    once = [20.0] * LIMIT
    assert accepted([*once, 1.0, *once]) == [False] * LIMIT + [True] + [False] * LIMIT
    assert accepted([*once, 20.0, 1.0, 20.0])[-3:] == [True, True, False]


def test_all_are_accepted_until_the_filter_has_caught_up() -> None:
    """To be within the gate is not enough: noise alone takes a sample there and out again."""
    once = [20.0] * (LIMIT + 1)
    assert accepted([*once, 11.9, 13.0, -2.1, 13.0])[LIMIT:] == [True] * 5
    assert accepted([*once, 13.0, 1.9, 13.0])[-3:] == [True, True, False]


def test_each_output_has_its_own_count() -> None:
    rejected_in_a_row = np.zeros(2, np.int64)
    for _ in range(LIMIT):
        assert not is_accepted(20.0, 4.0, 6.0, 0, rejected_in_a_row)
        assert is_accepted(1.0, 4.0, 6.0, 1, rejected_in_a_row)
    assert not is_accepted(20.0, 4.0, 6.0, 1, rejected_in_a_row)
    assert is_accepted(20.0, 4.0, 6.0, 0, rejected_in_a_row)
