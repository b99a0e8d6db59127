import numpy as np
import pytest

from analysis.regression.newey_west import (
    add_rows,
    empty_sums,
    newey_west_variances,
    window_variances,
)
from shiplog.types import FloatArray


def sandwich(rows: FloatArray, values: FloatArray, inverse: FloatArray, overlap: int) -> FloatArray:
    """The textbook's: autocovariances of the scores, weighted, between two inverses."""
    X, y = rows[:, :-1], rows[:, -1]
    scores = X * (y - X @ values)[:, None]
    S = scores.T @ scores
    for lag in range(1, min(overlap, len(y))):
        G = scores[lag:].T @ scores[:-lag]
        S += (1 - lag / overlap) * (G + G.T)
    return np.diag(inverse @ S @ inverse)


def rows_of(seed: int, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 3))
    y = X @ [1.0, 2.0, -3.0] + np.convolve(rng.standard_normal(n), np.ones(5), "same")
    return np.column_stack((X, y)), np.linalg.lstsq(X, y)[0], np.linalg.inv(X.T @ X)


@pytest.mark.parametrize("overlap", [1, 2, 7, 40, 90])
def test_runs_and_windows_are_the_textbooks_sandwich(overlap: int) -> None:
    rows, values, inverse = rows_of(0, 60)
    expected = sandwich(rows, values, inverse, overlap)
    runs = empty_sums(overlap, 3)
    add_rows(runs, rows, 0, values, inverse)
    assert newey_west_variances(runs, len(rows)) == pytest.approx(expected, rel=1e-10)
    spans = np.array([[0, 60], [0, 60], [5, 30]])
    found = window_variances(
        rows.T.copy(),
        spans,
        np.array([True, False, True]),
        np.tile(values[:, None], 3),
        np.tile(inverse[:, :, None], 3),
        overlap,
    )
    assert found[:, 0] == pytest.approx(expected, rel=1e-10)
    assert np.isnan(found[:, 1]).all()
    assert found[:, 2] == pytest.approx(sandwich(rows[5:30], values, inverse, overlap), rel=1e-10)


def test_how_the_rows_are_parted_changes_no_bit() -> None:
    rows, values, inverse = rows_of(1, 200)
    whole, parted = empty_sums(30, 3), empty_sums(30, 3)
    add_rows(whole, rows, 0, values, inverse)
    count = 0
    for part in np.split(rows, [0, 1, 17, 18, 99, 140]):
        add_rows(parted, part, count, values, inverse)
        count += len(part)
        newey_west_variances(parted, count)  # asked for between, it disturbs nothing
    assert (newey_west_variances(whole, 200) == newey_west_variances(parted, 200)).all()
