"""Regression with a change of coefficients at an unknown instant, and its significance.

A coefficient that changes is an additional regressor: the coefficient's own, zero before the
instant. Its coefficient is the difference after minus before (Chow's test for a known instant). For
each coefficient, the instant with the smallest sum of squared residuals is estimated. Then the
difference is tested with Wald's statistic. Its errors allow for overlapping, correlated residuals
(`newey_west`) and for the small number of independent rows (Student's t distribution). Since all
instants and all coefficients are tried, the p-value is that of the largest statistic (sup-Wald).
Other coefficients that change at the same instant are added one at a time.

An instant lies between two blocks of rows, of each of which X'X and X'y are known.

References
----------
G. C. Chow, "Tests of equality between sets of coefficients in two linear regressions", Econometrica
28, 1960. D. W. K. Andrews, "Tests for parameter instability and structural change with unknown
change point", Econometrica 61, 1993, and "... A corrigendum", Econometrica 71, 2003. D. M. DeLong,
"Crossing probabilities for a square root boundary by a Bessel process", Communications in
Statistics 10, 1981.
"""

from math import exp, log, pi, sqrt
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.signals.distributions import student_tails
from shiplog.types import FloatArray

from .sliding import CORRELATION_SHARE, MAX_CONDITION
from .weak_form import SLIPSTREAM, Equation

MAX_FALSE_ALARM_RATE = 0.02  # of the test of one equation without a change
SIGNIFICANCE_LEVEL = 0.05  # of a coefficient among several that change together
MIN_INFORMATION_SHARE = 0.15  # of the information on a coefficient, on either side of a change
GUARD_SHARE = 0.75  # of a bump's length: rows so near to a change are ignored
MIN_SIDE_BUMPS = 2  # of rows on either side of a change, beside those ignored around it
MAX_MIXING_STEPS = 8  # iterations for the slipstream's share of the rudder; four are enough
MIN_STD = 1e-150  # a smaller standard error is zero


class Blocks(NamedTuple):
    """Sums over k successive blocks of rows with p regressors.

    Attributes
    ----------
    names
        The p regressors.
    units
        (p,) the lengths by which the columns were divided.
    grams
        (k, p, p) ``X'X`` of each block.
    moments
        (k, p) ``X'y`` of each block.
    tallies
        (k, 3) the number of known rows, the smallest and the largest excitation.
    edges_secs
        (k + 1,) the instants between the blocks, s since the signals' start.
    equation
        The equation.
    min_excitation
        The range of the excitation that each side of a change must have.
    min_relative_change
        The smallest change that is reported, relative to the value before.
    overlap_blocks
        The number of successive blocks whose rows share data.
    """

    names: tuple[str, ...]
    units: FloatArray
    grams: FloatArray
    moments: FloatArray
    tallies: FloatArray
    edges_secs: FloatArray
    equation: Equation
    min_excitation: float
    min_relative_change: float
    overlap_blocks: int

    @property
    def guard_blocks(self) -> int:
        """The number of blocks on either side of a change that are ignored."""
        block_secs = self.edges_secs[1] - self.edges_secs[0]
        return int(np.ceil(GUARD_SHARE * self.equation.bump_secs / block_secs))

    def part(self, start: int, stop: int) -> "Blocks":
        """Return the blocks from `start` to before `stop`."""
        return self._replace(
            grams=self.grams[start:stop],
            moments=self.moments[start:stop],
            tallies=self.tallies[start:stop],
            edges_secs=self.edges_secs[start : stop + 1],
        )


class ChangePointFit(NamedTuple):
    """Regression in which c coefficients change between two blocks.

    Attributes
    ----------
    block
        The first block after the change.
    columns
        The c regressors whose coefficients change.
    values
        (p + c,) the coefficients before the change, then the differences.
    influences
        (k, p + c) the influence of each block on the values.
    variance_factor
        The factor that enlarges variances for the degrees of freedom taken by the coefficients.
    degrees_of_freedom
        (c,) of Student's t distribution of each difference.
    p_values
        (c,) of each difference if the instant were known.
    log_odds_range
        The range of instants tried: log of Andrews' lambda, see `sup_wald_p_value`.
    """

    block: int
    columns: tuple[int, ...]
    values: FloatArray
    influences: FloatArray
    variance_factor: float
    degrees_of_freedom: FloatArray
    p_values: FloatArray
    log_odds_range: float


def detect_change(blocks: Blocks) -> ChangePointFit | None:
    """Detect the most significant change.

    Parameters
    ----------
    blocks
        The blocks of rows to search.

    Returns
    -------
    fit
        The regression with the change; None if no change is significant, or if all are smaller
        than ``blocks.min_relative_change``.
    """
    candidates = [i for i, name in enumerate(blocks.names) if name != SLIPSTREAM]
    fits = [fit for i in candidates if (fit := fit_change(blocks, (i,))) is not None]
    best = min(fits, key=lambda fit: fit.p_values[-1], default=None)
    if best is None or not is_significant(blocks, best):
        return None
    for _ in candidates:
        more = [fit_change(blocks, (*best.columns, i)) for i in candidates if i not in best.columns]
        valid = [fit for fit in more if fit is not None]
        added = min(valid, key=lambda fit: fit.p_values[-1], default=None)
        if added is None or not is_significant(blocks, added):
            break
        best = _without_insignificant(blocks, added)
    small = [
        relative_difference(best, c) < blocks.min_relative_change for c in range(len(best.columns))
    ]
    return None if all(small) else best


def relative_difference(fit: ChangePointFit, c: int) -> float:
    """Return the absolute change of the c-th changing coefficient, relative to its value before."""
    difference = fit.values[len(fit.values) - len(fit.columns) + c]
    return float(abs(difference / fit.values[fit.columns[c]]))


def _without_insignificant(blocks: Blocks, fit: ChangePointFit) -> ChangePointFit:
    """Return the fit without changing columns that are not significant, removed one by one."""
    while len(fit.columns) > 1 and fit.p_values.max() > SIGNIFICANCE_LEVEL:
        insignificant = int(np.argmax(fit.p_values))
        fewer = fit_change(
            blocks, (*fit.columns[:insignificant], *fit.columns[insignificant + 1 :])
        )
        if fewer is None:
            break
        fit = fewer
    return fit


def fit_change(blocks: Blocks, columns: tuple[int, ...]) -> ChangePointFit | None:
    """Fit a change of some coefficients at the instant with the smallest sum of squares.

    With a slipstream regressor, the slipstream changes in proportion with d. Its share of the
    rudder's effect is found by fixed-point iteration.

    Parameters
    ----------
    blocks
        The blocks of rows.
    columns
        Indices of the regressors whose coefficients change.

    Returns
    -------
    fit
        The regression; None where the rows do not determine it.
    """
    if SLIPSTREAM not in blocks.names or blocks.names.index("d") not in columns:
        return _fit_columns(blocks, columns)
    d, slipstream = (blocks.names.index(name) for name in ("d", SLIPSTREAM))
    changing, share, fit = len(blocks.names) + columns.index(d), 0.5, None
    for _ in range(MAX_MIXING_STEPS):
        fit = _fit_columns(_mix_slipstream(blocks, share), columns)
        if fit is None:
            return None
        rudder = fit.values[d] + fit.values[changing] / 2
        whole = rudder + fit.values[slipstream]
        share = float(np.clip((whole - (1 - share) * rudder) / whole, 0, 1))
    return fit


def _fit_columns(blocks: Blocks, columns: tuple[int, ...]) -> ChangePointFit | None:
    estimate = _estimate_instant(blocks, columns)
    if estimate is None:
        return None
    block, log_odds_range = estimate
    kept = np.arange(len(blocks.moments))
    kept = kept[(kept < block - blocks.guard_blocks) | (kept >= block + blocks.guard_blocks)]
    p, row_count = len(blocks.names), blocks.tallies[kept, 0].sum()
    regressors = np.eye(p)[
        :, [*range(p), *columns]
    ]  # of a block after the change, from those before
    transforms = np.tile(regressors, (len(kept), 1, 1))
    transforms[kept < block, :, p:] = 0
    grams = transforms.transpose(0, 2, 1) @ blocks.grams[kept] @ transforms
    moments = np.einsum("kji,kj->ki", transforms, blocks.moments[kept])
    inverse = inverse_gram(grams.sum(0))
    independent = row_count / (blocks.equation.overlap * CORRELATION_SHARE)
    freedom = independent - p - len(columns)
    if inverse is None or freedom <= 0:
        return None
    values = inverse @ moments.sum(0)
    influences = np.zeros((len(blocks.moments), len(values)))
    influences[kept] = (moments - grams @ values) @ inverse
    weights = np.zeros((len(blocks.moments), len(columns)))
    weights[kept] = np.einsum("ij,kjl,li->ki", inverse[p:], grams, inverse[:, p:])
    degrees_of_freedom = (
        1.5 * weights.sum(0) ** 2 / bartlett_variances(weights, blocks.overlap_blocks)
    )
    variance_factor = independent / freedom
    stds = np.sqrt(variance_factor * bartlett_variances(influences[:, p:], blocks.overlap_blocks))
    statistics = values[p:] / np.maximum(stds, MIN_STD)
    p_values = np.array(list(map(student_tails, statistics.tolist(), degrees_of_freedom.tolist())))
    return ChangePointFit(
        block, columns, values, influences, variance_factor, degrees_of_freedom, p_values,
        log_odds_range,
    )  # fmt: skip


def _estimate_instant(blocks: Blocks, columns: tuple[int, ...]) -> tuple[int, float] | None:
    """Estimate the instant of the change, by the smallest sum of squared residuals.

    Only instants are tried for which both sides have enough excitation and information on the
    columns. Returns the first block after the change and the log odds range of the instants tried,
    on the time scale of the information on the last column; None if there is no such instant.
    """
    inverse = inverse_gram(blocks.grams.sum(0))
    if inverse is None:
        return None
    shares = np.einsum("ij,kjl,li->ki", inverse[columns, :], blocks.grams, inverse[:, columns])
    shares = np.cumsum(shares, axis=0)[:-1] / shares.sum(0)
    allowed = ((shares >= MIN_INFORMATION_SHARE) & (shares <= 1 - MIN_INFORMATION_SHARE)).all(
        axis=1
    ) & _is_excited(blocks)
    allowed &= _is_long_enough(blocks)
    if not allowed.any():
        return None
    residual_moments = blocks.moments - blocks.grams @ (inverse @ blocks.moments.sum(0))
    S = np.cumsum(residual_moments, axis=0)[:-1][allowed][:, columns]
    G = np.cumsum(blocks.grams, axis=0)[:-1][allowed][:, columns]  # (k, c, p)
    Q = G[:, :, columns] - G @ inverse @ G.transpose(0, 2, 1)
    Q += 1e-9 * np.eye(len(columns))  # regularises columns that are equivalent to others
    gains = np.einsum("ki,ki->k", S, np.linalg.solve(Q, S[:, :, None])[:, :, 0])
    odds = shares[allowed, -1] / (1 - shares[allowed, -1])
    return int(np.flatnonzero(allowed)[np.argmax(gains)]) + 1, log(odds[-1] / odds[0])


def _is_long_enough(blocks: Blocks) -> NDArray[np.bool_]:
    """Return whether both sides of each edge between blocks are long enough, (k - 1,).

    Beside the rows that are ignored around a change, each side needs `MIN_SIDE_BUMPS` bumps in
    which the excitation differs from its median: on a straight approach the regressors are mostly
    noise, and so are the coefficients.
    """
    count, low, high = blocks.tallies.T
    middle = np.median((low[count > 0] + high[count > 0]) / 2)
    excited = np.maximum(high - middle, middle - low) >= blocks.min_excitation / 2
    before = np.cumsum(excited)[:-1]
    least = blocks.guard_blocks + MIN_SIDE_BUMPS * blocks.overlap_blocks
    return np.asarray(np.minimum(before, excited.sum() - before) >= least)


def _is_excited(blocks: Blocks) -> NDArray[np.bool_]:
    """Return whether both sides of each edge between blocks have enough excitation, (k - 1,)."""
    low, high = blocks.tallies[:, 1], blocks.tallies[:, 2]
    before = np.maximum.accumulate(high) - np.minimum.accumulate(low)
    after = np.maximum.accumulate(high[::-1]) - np.minimum.accumulate(low[::-1])
    return np.asarray(np.minimum(before[:-1], after[-2::-1]) >= blocks.min_excitation)


def inverse_gram(grams: FloatArray) -> FloatArray | None:
    """Return ``(X'X)^-1`` of X'X (p, p); None where it is too ill-conditioned."""
    sizes = np.sqrt(np.diag(grams))
    if not (sizes > 0).all():
        return None
    scaled = grams / np.outer(sizes, sizes)
    if np.linalg.cond(scaled) > MAX_CONDITION**2:
        return None
    return np.asarray(np.linalg.inv(scaled) / np.outer(sizes, sizes))


def bartlett_variances(influences: FloatArray, overlap_blocks: int) -> FloatArray:
    """Return Newey-West variances from influences of blocks (k, c): (c,).

    The sum of the squares of the sums over every `overlap_blocks` successive blocks, divided by
    their number; see `newey_west`.
    """
    sums = np.cumsum(np.pad(influences, ((overlap_blocks, overlap_blocks - 1), (0, 0))), axis=0)
    return np.asarray(
        ((sums[overlap_blocks:] - sums[:-overlap_blocks]) ** 2).sum(0) / overlap_blocks
    )


def is_significant(blocks: Blocks, fit: ChangePointFit) -> bool:
    """Whether the change of the last column is significant.

    The test allows for all instants (sup-Wald) and all coefficients (Bonferroni) tried.
    """
    candidates = sum(name != SLIPSTREAM for name in blocks.names)
    p_value = sup_wald_p_value(float(fit.p_values[-1]), fit.log_odds_range)
    return p_value * candidates < MAX_FALSE_ALARM_RATE


def sup_wald_p_value(p_value: float, log_odds_range: float) -> float:
    """Return the p-value of the largest Wald statistic over all instants tried.

    Parameters
    ----------
    p_value
        The p-value of the largest statistic as if its instant were known.
    log_odds_range
        log of Andrews' lambda, ``log(s2 (1 - s1) / (s1 (1 - s2)))`` for instants tried between the
        shares s1 and s2 of the trial.

    Returns
    -------
    p_value
        By DeLong's (1981) expansion of Andrews' distribution for one coefficient, exact in the
        tail.

    Examples
    --------
    >>> from math import log
    >>> round(sup_wald_p_value(0.0032, 2 * log(0.85 / 0.15)), 2)  # 5 % in Andrews' table
    0.05
    """
    z = -NormalDist().inv_cdf(max(p_value, 1e-300) / 2)
    if z <= 1:
        return 1.0
    density = exp(-(z**2) / 2) / sqrt(2 * pi)
    return float(min(1.0, density * (z * (1 - z**-2) * log_odds_range + 2 / z)))


def _mix_slipstream(blocks: Blocks, share: float) -> Blocks:
    """Return the blocks with a share of the slipstream added to the rudder: both change as one."""
    mixing = np.eye(len(blocks.names))
    d, slipstream = (blocks.names.index(name) for name in ("d", SLIPSTREAM))
    mixing[[d, slipstream], d] = 1 - share, share
    return blocks._replace(grams=mixing.T @ blocks.grams @ mixing, moments=blocks.moments @ mixing)
