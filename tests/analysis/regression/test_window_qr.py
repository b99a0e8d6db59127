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


def window_by_window(X: FloatArray, y: FloatArray, length: int) -> WindowSolutions:
    values, conditions = [], []
    for k in range(len(y) - length + 1):
        A, b = X[k : k + length], y[k : k + length]
        known = np.isfinite(A).all(axis=1) & np.isfinite(b)
        scale = np.linalg.norm(A[known], axis=0)
        kept = scale > 0
        A = A[known][:, kept] / scale[kept]
        found = np.full(X.shape[1], np.nan)
        found[kept] = np.linalg.lstsq(A, b[known], rcond=1e-17)[0] / scale[kept]
        values.append(found)
        conditions.append(np.linalg.cond(A))
    return WindowSolutions(np.array(values), np.array(conditions))


def require_same(found: WindowSolutions, expected: WindowSolutions, rel: float) -> None:
    np.testing.assert_allclose(found.values, expected.values, rtol=rel, atol=0)
    np.testing.assert_allclose(found.conditions, expected.conditions, rtol=rel)


@pytest.mark.parametrize(("p", "length"), [(1, 1), (1, 4), (3, 30), (6, 20), (6, 131), (6, 400)])
def test_every_window_is_numpys_own_regression(p: int, length: int) -> None:
    X, y = regression(1, 400, p)
    require_same(sliding_least_squares(X, y, length), window_by_window(X, y, length), 1e-10)


def test_the_error_is_that_of_the_floating_point_over_thousands_of_windows() -> None:
    X, y = regression(2, 3000, 6)
    found, expected = sliding_least_squares(X, y, 500), window_by_window(X, y, 500)
    off = np.linalg.norm(found.values - expected.values, axis=1)
    off /= np.linalg.norm(expected.values, axis=1)
    assert np.median(off) < 1e-14
    assert off.max() < 1e-13


def test_badly_scaled_and_nearly_collinear_columns_cost_no_more_than_their_condition() -> None:
    X, y = regression(3, 600, 4)
    X[:, 2] = X[:, 1] + 1e-7 * X[:, 2]
    scale = np.array([1e-12, 1.0, 1.0, 1e9])
    found, expected = sliding_least_squares(X * scale, y, 100), window_by_window(X, y, 100)
    np.testing.assert_allclose(found.conditions, expected.conditions, rtol=1e-8)
    error = np.abs(found.values * scale - expected.values) / np.abs(expected.values)
    assert (error.max(axis=1) < 1e-15 * 30 * expected.conditions).all()


def test_a_column_that_is_zero_throughout_a_window_is_refused_there_and_leaves_nothing() -> None:
    X, y = regression(4, 500, 4)
    X[100:300, 2] = 0.0
    X[:, 2] *= 1e-6  # a residue of the others would be large beside it
    found = sliding_least_squares(X, y, 60)
    refused = np.isnan(found.values)
    assert refused[100:241, 2].all()
    assert refused.sum() == 141
    require_same(found, window_by_window(X, y, 60), 1e-10)


def test_rows_that_are_not_finite_take_up_room_and_count_for_nothing() -> None:
    X, y = regression(5, 400, 3)
    y[50:70], X[150, 1], X[151, 0], y[152] = np.nan, np.nan, np.inf, -np.inf
    require_same(sliding_least_squares(X, y, 40), window_by_window(X, y, 40), 1e-10)


def test_fewer_rows_than_columns_tell_nothing() -> None:
    X, y = regression(6, 50, 4)
    found = sliding_least_squares(X, y, 3)
    assert np.isnan(found.values).all()
    assert np.isinf(found.conditions).all()
    y[10:30] = np.nan
    found = sliding_least_squares(X, y, 10)
    assert np.isinf(found.conditions[10:21]).all()
    assert np.isnan(found.values[10:21]).all()


def test_there_is_no_window_before_there_are_enough_rows() -> None:
    X, y = regression(7, 9, 2)
    assert sliding_least_squares(X, y, 10).values.shape == (0, 2)
    with pytest.raises(ValueError, match="one row at the least"):
        sliding_least_squares(X, y, 0)


@pytest.mark.parametrize("seed", range(5))
def test_how_the_rows_are_parted_changes_no_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X, y = regression(seed, 700, 3)
    y[rng.random(700) < 0.1] = np.nan
    X[200:300, 1] = 0.0
    length = int(rng.integers(1, 200))
    whole = push_rows(empty_window(length, 3), X, y, X[:, 0])
    cuts = np.sort(rng.integers(0, 701, rng.integers(1, 60)))
    state = empty_window(length, 3)
    parts = [
        push_rows(state, *chunk)
        for chunk in zip(*(np.split(a, cuts) for a in (X, y, X[:, 0])), strict=True)
    ]
    for name in whole.solutions._fields:
        together = np.concatenate([getattr(w.solutions, name) for w in parts], axis=-1)
        np.testing.assert_array_equal(together, getattr(whole.solutions, name))
    np.testing.assert_array_equal(np.concatenate([w.tallies for w in parts]), whole.tallies)


def test_the_tally_is_of_the_known_rows_of_each_window() -> None:
    X, y = regression(8, 300, 2)
    y[100:120] = np.nan
    tallies = push_rows(empty_window(30, 2), X, y, X[:, 1]).tallies
    for k, tally in enumerate(tallies):
        known = X[k : k + 30, 1][np.isfinite(y[k : k + 30])]
        assert tally == pytest.approx([len(known), known.min(), known.max()], abs=0)


def test_columns_that_are_the_same_are_singular() -> None:
    X, y = regression(9, 200, 3)
    X[:, 2] = X[:, 0]
    found = sliding_least_squares(X, y, 50)
    assert (found.conditions > 1e15).all()
    assert np.isnan(found.values[np.isinf(found.conditions)]).all()
