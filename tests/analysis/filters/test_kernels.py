import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.filters.kernels import PATIENCE, believable, correct, project, propagate

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
    S = project(P, c, Pc) + r
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
    assert project(P, C[0], Pc) == pytest.approx(C[0] @ P @ C[0], rel=1e-9, abs=0)
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
    S = project(P, C[0], Pc) + r
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
    found = []
    for order in ((0, 1), (1, 0)):
        state, covariance = x, P
        for output in order:
            state, covariance = taken(state, covariance, C[output], y[output], r[output])
        found.append((state, covariance))
    S = C @ P @ C.T + np.diag(r)
    gain = np.linalg.solve(S, C @ P).T
    found.append((x + gain @ (y - C @ x), P - gain @ C @ P))
    for state, covariance in found[1:]:
        assert state == pytest.approx(found[0][0], rel=1e-9, abs=1e-9)
        assert np.abs((covariance - found[0][1]) / units(P)).max() < 1e-9


@seeds
@often
def test_a_covariance_goes_on_as_f_p_f_and_q_and_stays_symmetric(seed: int) -> None:
    rng = np.random.default_rng(seed)
    _, P, _ = drawn(rng, 5)
    _, Q, _ = drawn(rng, 5)
    F = rng.standard_normal((5, 5))
    expected = F @ P @ F.T + Q
    propagate(P, F, Q, np.empty((5, 5)))
    assert np.abs(P - expected).max() < 1e-13 * np.abs(expected).max()
    assert np.array_equal(P, P.T)


def believed(innovations: list[float], output: int = 0) -> list[bool]:
    off = np.zeros(2, np.int64)
    return [believable(e, 4.0, 6.0, output, off) for e in innovations]


def test_what_is_within_the_gate_is_believed_up_to_its_edge() -> None:
    assert believed([0.0, 11.9, -12.0, 12.0, 12.1, -12.1]) == [True] * 4 + [False] * 2


def test_what_is_off_once_more_than_the_patience_is_believed_for_as_long_as_it_lasts() -> None:
    assert believed([20.0] * (PATIENCE + 3)) == [False] * PATIENCE + [True] * 3


def test_one_sample_within_the_gate_makes_the_filter_patient_again() -> None:
    once = [20.0] * PATIENCE
    assert believed([*once, 1.0, *once]) == [False] * PATIENCE + [True] + [False] * PATIENCE
    assert believed([*once, 20.0, 1.0, 20.0])[-3:] == [True, True, False]


def test_what_is_believed_is_so_until_the_filter_has_come_up_to_it() -> None:
    """Within the gate is not enough: noise alone takes it there and out again."""
    once = [20.0] * (PATIENCE + 1)
    assert believed([*once, 11.9, 13.0, -2.1, 13.0])[PATIENCE:] == [True] * 5
    assert believed([*once, 13.0, 1.9, 13.0])[-3:] == [True, True, False]


def test_each_output_has_its_own_patience() -> None:
    off = np.zeros(2, np.int64)
    for _ in range(PATIENCE):
        assert not believable(20.0, 4.0, 6.0, 0, off)
        assert believable(1.0, 4.0, 6.0, 1, off)
    assert not believable(20.0, 4.0, 6.0, 1, off)
    assert believable(20.0, 4.0, 6.0, 0, off)
