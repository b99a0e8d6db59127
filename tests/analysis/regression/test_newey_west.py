"""Newey-West errors, compared with the textbook formula."""

import numpy as np
import pytest

from analysis.regression.newey_west import (
    add_rows,
    empty_sums,
    newey_west_variances,
    window_variances,
)
from shiplog.types import FloatArray


def textbook_variances(
    rows: FloatArray, values: FloatArray, inverse: FloatArray, overlap: int
) -> FloatArray:
    """Return the variances by the textbook: weighted autocovariances between two inverses."""
    X, y = rows[:, :-1], rows[:, -1]
    scores = X * (y - X @ values)[:, None]
    S = scores.T @ scores
    for lag in range(1, min(overlap, len(y))):
        G = scores[lag:].T @ scores[:-lag]
        S += (1 - lag / overlap) * (G + G.T)
    return np.diag(inverse @ S @ inverse)


def regression(seed: int, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 3))
    y = X @ [1.0, 2.0, -3.0] + np.convolve(rng.standard_normal(n), np.ones(5), "same")
    return np.column_stack((X, y)), np.linalg.lstsq(X, y)[0], np.linalg.inv(X.T @ X)


@pytest.mark.parametrize("overlap", [1, 2, 7, 40, 90])
def test_variances_equal_those_of_the_textbook(overlap: int) -> None:
    rows, values, inverse = regression(0, 60)
    expected = textbook_variances(rows, values, inverse, overlap)
    state = empty_sums(overlap, 3)
    add_rows(state, rows, 0, values, inverse)
    assert newey_west_variances(state, len(rows)) == pytest.approx(expected, rel=1e-10)
    spans = np.array([[0, 60], [0, 60], [5, 30]])
    variances = window_variances(
        rows.T.copy(),
        spans,
        np.array([True, False, True]),
        np.tile(values[:, None], 3),
        np.tile(inverse[:, :, None], 3),
        overlap,
    )
    assert variances[:, 0] == pytest.approx(expected, rel=1e-10)
    assert np.isnan(variances[:, 1]).all()
    assert variances[:, 2] == pytest.approx(
        textbook_variances(rows[5:30], values, inverse, overlap), rel=1e-10
    )


def test_results_do_not_depend_on_the_chunks_to_the_last_bit() -> None:
    rows, values, inverse = regression(1, 200)
    at_once, in_chunks = empty_sums(30, 3), empty_sums(30, 3)
    add_rows(at_once, rows, 0, values, inverse)
    count = 0
    for part in np.split(rows, [0, 1, 17, 18, 99, 140]):
        add_rows(in_chunks, part, count, values, inverse)
        count += len(part)
        newey_west_variances(in_chunks, count)  # computing them early does not change the state
    assert (newey_west_variances(at_once, 200) == newey_west_variances(in_chunks, 200)).all()
