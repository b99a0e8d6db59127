"""Change points, compared with an exhaustive search and with published critical values."""

from math import log

import numpy as np
import pytest
from scipy.stats import chi2

from analysis.regression.change_point import (
    GUARD_SHARE,
    MIN_INFORMATION_SHARE,
    Blocks,
    detect_change,
    fit_change,
    sup_wald_p_value,
)
from analysis.regression.weak_form import Equation
from shiplog.types import FloatArray

SIZE, OVERLAP = 4, 12


def regression(seed: int, change: float = 0.0, n: int = 480) -> tuple[FloatArray, FloatArray]:
    """Two regressors and a target whose noise is a moving sum; the first one changes halfway."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 2)) + np.array([1.0, 0.0])
    noise = np.convolve(rng.standard_normal(n + OVERLAP - 1), np.ones(OVERLAP) / OVERLAP, "valid")
    slope = 2.0 + change * (np.arange(n) >= n // 2)
    return X, X[:, 0] * slope - X[:, 1] + noise


def blocks_of(X: FloatArray, y: FloatArray) -> Blocks:
    parts = [(X[i : i + SIZE], y[i : i + SIZE]) for i in range(0, len(y), SIZE)]
    return Blocks(
        names=("a", "d"),
        units=np.ones(2),
        grams=np.array([x.T @ x for x, _ in parts]),
        moments=np.array([x.T @ b for x, b in parts]),
        tallies=np.array([[len(b), x[:, 0].min(), x[:, 0].max()] for x, b in parts]),
        edges_secs=np.arange(len(parts) + 1) * float(SIZE),
        equation=Equation(("a", "d"), 1.0, float(OVERLAP)),
        min_excitation=0.0,
        min_relative_change=0.0,
        overlap_blocks=OVERLAP // SIZE,
    )


@pytest.mark.parametrize("percent", [(10, 7.12), (5, 8.68), (1, 12.16)])
def test_p_values_agree_with_the_table_of_andrews(
    percent: tuple[float, float],
) -> None:
    """Andrews (2003), table I: one coefficient, 15 % trimmed on either side."""
    level, critical = percent
    p_value = float(chi2.sf(critical, 1))
    log_odds_range = 2 * log((1 - 0.15) / 0.15)
    assert 100 * sup_wald_p_value(p_value, log_odds_range) == pytest.approx(level, rel=0.08)


@pytest.mark.parametrize(("low", "high"), [(0.15, 0.85), (0.4, 0.8), (0.05, 0.3)])
def test_p_values_agree_with_simulated_brownian_bridges(low: float, high: float) -> None:
    rng, steps = np.random.default_rng(1), 1000
    bridges = np.cumsum(rng.standard_normal((8000, steps)), axis=1) / np.sqrt(steps)
    at = np.arange(1, steps + 1) / steps
    bridges -= at * bridges[:, -1:]
    tried = (at >= low) & (at <= high)
    largest = np.max(bridges[:, tried] ** 2 / (at * (1 - at))[tried], axis=1)
    critical = float(np.quantile(largest, 0.95))
    log_odds_range = log(high / (1 - high) / (low / (1 - low)))
    found = sup_wald_p_value(float(chi2.sf(critical, 1)), log_odds_range)
    assert found == pytest.approx(0.05, rel=0.25)


def exhaustive_block(X: FloatArray, y: FloatArray, column: int) -> int:
    """Return the first block after the change with the smallest sum of squared residuals."""
    leverage = np.linalg.inv(X.T @ X)
    weight = np.cumsum(np.einsum("ti,ij->tj", X, leverage)[:, column] ** 2)
    square_sums = {}
    for at in range(1, len(y) // SIZE):
        share = weight[at * SIZE - 1] / weight[-1]
        if MIN_INFORMATION_SHARE <= share <= 1 - MIN_INFORMATION_SHARE:
            after = X[:, column] * (np.arange(len(y)) >= at * SIZE)
            every = np.column_stack((X, after))
            residual = y - every @ np.linalg.lstsq(every, y)[0]
            square_sums[at] = residual @ residual
    return min(square_sums, key=square_sums.__getitem__)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("column", [0, 1])
def test_the_instant_is_that_of_an_exhaustive_search(seed: int, column: int) -> None:
    X, y = regression(seed, 0.3)
    found = fit_change(blocks_of(X, y), (column,))
    assert found is not None
    assert found.block == exhaustive_block(X, y, column)


def test_values_and_variances_equal_those_computed_from_the_rows() -> None:
    X, y = regression(3, 0.3)
    found = fit_change(blocks_of(X, y), (0,))
    assert found is not None
    guard_blocks = int(np.ceil(GUARD_SHARE * OVERLAP / SIZE)) * SIZE
    block = np.arange(len(y))
    kept = (block < found.block * SIZE - guard_blocks) | (
        block >= found.block * SIZE + guard_blocks
    )
    every = np.column_stack((X, X[:, 0] * (block >= found.block * SIZE)))
    values = np.linalg.lstsq(every[kept], y[kept])[0]
    assert found.values == pytest.approx(values, rel=1e-9)
    inverse = np.linalg.inv(every[kept].T @ every[kept])
    scores = (every * (y - every @ values)[:, None]) * kept[:, None]
    sums = scores.reshape(-1, SIZE, 3).sum(1) @ inverse
    overlap_blocks, variance = OVERLAP // SIZE, sums[:, 2] @ sums[:, 2]
    for lag in range(1, overlap_blocks):
        variance += 2 * (1 - lag / overlap_blocks) * (sums[lag:, 2] @ sums[:-lag, 2])
    ours = (
        np.sum(np.convolve(found.influences[:, 2], np.ones(overlap_blocks)) ** 2) / overlap_blocks
    )
    assert ours == pytest.approx(variance, rel=1e-9)
    independent = kept.sum() / (OVERLAP / 3)
    assert found.variance_factor == pytest.approx(independent / (independent - 3))


def test_only_the_changed_coefficient_is_detected() -> None:
    for seed in range(10):
        found = detect_change(blocks_of(*regression(seed, 0.4)))
        assert found is not None
        assert found.columns == (0,)
        assert abs(found.block * SIZE - 240) < 40


def test_the_rate_of_false_alarms_is_below_its_limit() -> None:
    """Count over 400 regressions with correlated noise."""
    alarms = sum(detect_change(blocks_of(*regression(seed))) is not None for seed in range(400))
    assert alarms <= 20


def test_no_change_is_detected_without_rows_or_with_identical_columns() -> None:
    X, y = regression(0, 0.4)
    blocks = blocks_of(X, y)
    assert detect_change(blocks.part(5, 5)) is None
    assert detect_change(blocks.part(7, 8)) is None
    assert detect_change(blocks_of(X[:, [0, 0]], y)) is None


def test_a_side_without_excitation_is_not_searched() -> None:
    X, y = regression(1, 0.4)
    still = blocks_of(X, y)
    still.tallies[: len(still.tallies) // 2, 1:] = 1.0
    moving = fit_change(still._replace(min_excitation=0.1), (0,))
    assert moving is not None
    assert moving.block > len(still.tallies) // 2
