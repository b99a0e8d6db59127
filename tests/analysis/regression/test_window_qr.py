"""Sliding-window least squares, compared with numpy's solution of each window."""

import numpy as np
import pytest

from analysis.regression.window_qr import (
    WindowSolutions,
    empty_window,
    push_rows,
    sliding_least_squares,
)
from shiplog.types import FloatArray


def regression(seed: int, m: int, p: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((m, p))
    return X, X @ np.arange(1.0, p + 1) + 0.1 * rng.standard_normal(m)


def solve_each_window(X: FloatArray, y: FloatArray, length: int) -> WindowSolutions:
    values, conditions = [], []
    for k in range(len(y) - length + 1):
        A, b = X[k : k + length], y[k : k + length]
        is_known = np.isfinite(A).all(axis=1) & np.isfinite(b)
        scale = np.linalg.norm(A[is_known], axis=0)
        is_used = scale > 0
        A = A[is_known][:, is_used] / scale[is_used]
        solution = np.full(X.shape[1], np.nan)
        solution[is_used] = np.linalg.lstsq(A, b[is_known], rcond=1e-17)[0] / scale[is_used]
        values.append(solution)
        conditions.append(np.linalg.cond(A))
    return WindowSolutions(np.array(values), np.array(conditions))


def assert_close(windows: WindowSolutions, expected: WindowSolutions, rel: float) -> None:
    np.testing.assert_allclose(windows.values, expected.values, rtol=rel, atol=0)
    np.testing.assert_allclose(windows.conditions, expected.conditions, rtol=rel)


@pytest.mark.parametrize(("p", "length"), [(1, 1), (1, 4), (3, 30), (6, 20), (6, 131), (6, 400)])
def test_each_window_equals_numpys_solution(p: int, length: int) -> None:
    X, y = regression(1, 400, p)
    assert_close(sliding_least_squares(X, y, length), solve_each_window(X, y, length), 1e-10)


def test_rounding_errors_do_not_grow_over_thousands_of_windows() -> None:
    X, y = regression(2, 3000, 6)
    windows, expected = sliding_least_squares(X, y, 500), solve_each_window(X, y, 500)
    error = np.linalg.norm(windows.values - expected.values, axis=1)
    error /= np.linalg.norm(expected.values, axis=1)
    assert np.median(error) < 1e-14
    assert error.max() < 1e-13


def test_errors_of_nearly_collinear_columns_are_bounded_by_the_condition_number() -> None:
    X, y = regression(3, 600, 4)
    X[:, 2] = X[:, 1] + 1e-7 * X[:, 2]
    scale = np.array([1e-12, 1.0, 1.0, 1e9])
    windows, expected = sliding_least_squares(X * scale, y, 100), solve_each_window(X, y, 100)
    np.testing.assert_allclose(windows.conditions, expected.conditions, rtol=1e-8)
    error = np.abs(windows.values * scale - expected.values) / np.abs(expected.values)
    assert (error.max(axis=1) < 1e-15 * 30 * expected.conditions).all()


def test_a_column_of_zeros_has_no_value_and_leaves_no_residue() -> None:
    X, y = regression(4, 500, 4)
    X[100:300, 2] = 0.0
    X[:, 2] *= 1e-6  # a residue of the other columns would be large relative to it
    windows = sliding_least_squares(X, y, 60)
    is_missing = np.isnan(windows.values)
    assert is_missing[100:241, 2].all()
    assert is_missing.sum() == 141
    assert_close(windows, solve_each_window(X, y, 60), 1e-10)


def test_rows_that_are_not_finite_occupy_a_place_and_are_ignored() -> None:
    X, y = regression(5, 400, 3)
    y[50:70], X[150, 1], X[151, 0], y[152] = np.nan, np.nan, np.inf, -np.inf
    assert_close(sliding_least_squares(X, y, 40), solve_each_window(X, y, 40), 1e-10)


def test_fewer_rows_than_columns_have_no_solution() -> None:
    X, y = regression(6, 50, 4)
    windows = sliding_least_squares(X, y, 3)
    assert np.isnan(windows.values).all()
    assert np.isinf(windows.conditions).all()
    y[10:30] = np.nan
    windows = sliding_least_squares(X, y, 10)
    assert np.isinf(windows.conditions[10:21]).all()
    assert np.isnan(windows.values[10:21]).all()


def test_there_is_no_window_before_its_first_full_length() -> None:
    X, y = regression(7, 9, 2)
    assert sliding_least_squares(X, y, 10).values.shape == (0, 2)
    with pytest.raises(ValueError, match="at least 1"):
        sliding_least_squares(X, y, 0)


@pytest.mark.parametrize("seed", range(5))
def test_results_do_not_depend_on_the_chunks_to_the_last_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X, y = regression(seed, 700, 3)
    y[rng.random(700) < 0.1] = np.nan
    X[200:300, 1] = 0.0
    length = int(rng.integers(1, 200))
    all_at_once = push_rows(empty_window(length, 3), X, y, X[:, 0])
    cuts = np.sort(rng.integers(0, 701, rng.integers(1, 60)))
    state = empty_window(length, 3)
    parts = [
        push_rows(state, *chunk)
        for chunk in zip(*(np.split(a, cuts) for a in (X, y, X[:, 0])), strict=True)
    ]
    for name in all_at_once.solutions._fields:
        together = np.concatenate([getattr(part.solutions, name) for part in parts], axis=-1)
        np.testing.assert_array_equal(together, getattr(all_at_once.solutions, name))
    np.testing.assert_array_equal(
        np.concatenate([part.tallies for part in parts]), all_at_once.tallies
    )


def test_a_tally_counts_the_known_rows_of_its_window() -> None:
    X, y = regression(8, 300, 2)
    y[100:120] = np.nan
    tallies = push_rows(empty_window(30, 2), X, y, X[:, 1]).tallies
    for k, tally in enumerate(tallies):
        known = X[k : k + 30, 1][np.isfinite(y[k : k + 30])]
        assert tally == pytest.approx([len(known), known.min(), known.max()], abs=0)


def test_identical_columns_are_singular() -> None:
    X, y = regression(9, 200, 3)
    X[:, 2] = X[:, 0]
    windows = sliding_least_squares(X, y, 50)
    assert (windows.conditions > 1e15).all()
    assert np.isnan(windows.values[np.isinf(windows.conditions)]).all()
