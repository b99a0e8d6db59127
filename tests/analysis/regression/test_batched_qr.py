"""Batched triangular systems, compared with numpy."""

import numpy as np
import pytest

from analysis.regression.batched_qr import solve_single
from shiplog.types import FloatArray


def triangular_factor(X: FloatArray, y: FloatArray) -> FloatArray:
    p = X.shape[1]
    return np.linalg.qr(np.column_stack((X, y)))[1][:p]


def matrix_with_singular_values(values: list[float], seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    p = len(values)
    left = np.linalg.qr(rng.standard_normal((3 * p, p)))[0]
    right = np.linalg.qr(rng.standard_normal((p, p)))[0]
    return (left * values) @ right


@pytest.mark.parametrize(
    "values",
    [
        [1.0],
        [1.0, 1.0, 1.0, 1.0],
        [2.0, 2.0, 1.0, 1e-3],
        [1.0, 1 + 1e-9, 1 - 1e-9, 1.0, 0.5, 0.5],
        [3.0, 1.0, 1e-1, 1e-2, 1e-4, 1e-4 * (1 + 1e-12)],
        [1.0, 1e-7],
    ],
)
def test_the_condition_number_equals_numpys(values: list[float]) -> None:
    for seed in range(20):
        X = matrix_with_singular_values(values, seed)
        scaled = X / np.linalg.norm(X, axis=0)
        expected = np.linalg.cond(scaled)
        condition = solve_single(triangular_factor(X, X[:, 0])).conditions[0]
        assert condition == pytest.approx(expected, rel=4e-15 * expected)


def test_orthogonal_columns_of_any_length_have_condition_number_one() -> None:
    X = np.eye(8, 5) * [1e-9, 1.0, 3.0, 1e12, 7.0]
    solution = solve_single(triangular_factor(X, X.sum(axis=1)))
    assert solution.conditions[0] == pytest.approx(1.0, rel=1e-15)
    assert solution.values[:, 0] == pytest.approx(np.ones(5), rel=1e-15)
    assert solution.inflations[:, 0] == pytest.approx(np.ones(5), rel=1e-15)


def test_inverse_and_inflations_equal_those_of_the_normal_equations() -> None:
    rng = np.random.default_rng(0)
    X = rng.standard_normal((40, 4)) * [1.0, 10.0, 0.1, 3.0]
    X[:, 3] += X[:, 1]
    solution = solve_single(triangular_factor(X, X[:, 0]))
    inverse = np.linalg.inv(X.T @ X)
    assert solution.inverses[:, :, 0] == pytest.approx(inverse, rel=1e-10, abs=1e-15)
    inflations = np.sqrt(np.diag(inverse)) * np.linalg.norm(X, axis=0)
    assert solution.inflations[:, 0] == pytest.approx(inflations, rel=1e-12)


def test_a_system_of_zeros_has_no_inverse() -> None:
    solution = solve_single(np.zeros((3, 4)))
    assert np.isinf(solution.conditions[0])
    assert not solution.inflations.any()
    assert not solution.inverses.any()
