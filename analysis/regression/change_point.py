"""A regression whose coefficients change at an instant that nobody knows.

One equation before the instant and another after it, which differ in a coefficient: that is a
regression with one more column, the coefficient's own, zero before the instant. Of each coefficient
the instant is taken that leaves the least squares, and Wald's test weighs the difference by errors
that allow for overlapping, coloured residuals (`newey_west`) and for how few of them could differ,
by Student's distribution. As every instant and every coefficient was tried, it is judged as the
largest of so many (Andrews, "Tests for parameter instability and structural change with unknown
change point", Econometrica 61, 1993, and 71, 2003). What else changed at the same instant is added
one by one.

The instant lies between two blocks of rows, of which X'X and X'y are known.
"""

from math import exp, log, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtr

from shiplog.types import FloatArray

from .sliding import CORRELATION_SHARE, MAX_CONDITION
from .weak_form import SLIPSTREAM, Equation

MAX_FALSE_ALARM_RATE = (
    0.02  # how often, at the most, an equation that never changed may be said to have done so
)
SIGNIFICANCE_LEVEL = 0.05  # a coefficient that need not have changed, at this level, has not
MIN_INFORMATION_SHARE = (
    0.15  # of what the rows tell of a coefficient, the least on either side of a change
)
GUARD_SHARE = 0.75  # of a bump's length: rows so near to the change belong to neither side
MAX_MIXING_STEPS = 8  # at finding the slipstream's share; four are enough
TINY = 1e-150  # an error below this is none


class Blocks(NamedTuple):
    """What is known of successive blocks of rows: X'X, X'y, and what the gates look at."""

    names: tuple[str, ...]
    units: FloatArray  # (p,) by which the columns were divided
    squares: FloatArray  # (k, p, p)
    products: FloatArray  # (k, p)
    tallies: FloatArray  # (k, 3) rows known, least and greatest excitation
    edges_secs: FloatArray  # (k + 1,)
    equation: Equation
    min_excitation: float
    least_share: float  # by which a coefficient must change
    run: int  # blocks over which the rows share data

    @property
    def clear(self) -> int:
        """How many blocks on either side of a change belong to neither."""
        block_secs = self.edges_secs[1] - self.edges_secs[0]
        return int(np.ceil(GUARD_SHARE * self.equation.bump_secs / block_secs))

    def part(self, start: int, stop: int) -> "Blocks":
        """The blocks from `start` to before `stop`."""
        return self._replace(
            squares=self.squares[start:stop],
            products=self.products[start:stop],
            tallies=self.tallies[start:stop],
            edges_secs=self.edges_secs[start : stop + 1],
        )


class ChangePointFit(NamedTuple):
    """A regression with columns that change between two blocks."""

    at: int  # the first block after the change
    columns: tuple[int, ...]
    values: FloatArray  # (p + c,) before, and the differences
    influences: FloatArray  # (k, p + c) of the blocks on the values
    inflation: float  # of their variances, for the freedom taken
    degrees: FloatArray  # (c,) of freedom of Student's distribution
    chances: FloatArray  # (c,) of so large a difference where nothing changed, one looked for
    spread: float  # of the instants tried, what makes the largest of them larger


def changed(blocks: Blocks) -> ChangePointFit | None:
    """The change that the blocks tell most surely, if they tell any."""
    candidates = [i for i, name in enumerate(blocks.names) if name != SLIPSTREAM]
    splits = [split for i in candidates if (split := best_change(blocks, (i,))) is not None]
    best = min(splits, key=lambda split: split.chances[-1], default=None)
    if best is None or not is_sure(blocks, best):
        return None
    for _ in candidates:
        more = [
            best_change(blocks, (*best.columns, i)) for i in candidates if i not in best.columns
        ]
        told = [split for split in more if split is not None]
        added = min(told, key=lambda split: split.chances[-1], default=None)
        if added is None or not is_sure(blocks, added):
            break
        best = _without_idle(blocks, added)
    small = [share_of(best, c) < blocks.least_share for c in range(len(best.columns))]
    return None if all(small) else best


def share_of(split: ChangePointFit, c: int) -> float:
    """How much of itself the c-th column changed by."""
    difference = split.values[len(split.values) - len(split.columns) + c]
    return float(abs(difference / split.values[split.columns[c]]))


def _without_idle(blocks: Blocks, split: ChangePointFit) -> ChangePointFit:
    """The split without columns of which it cannot be said that they had to change."""
    while len(split.columns) > 1 and split.chances.max() > SIGNIFICANCE_LEVEL:
        idle = int(np.argmax(split.chances))
        fewer = best_change(blocks, (*split.columns[:idle], *split.columns[idle + 1 :]))
        if fewer is None:
            break
        split = fewer
    return split


def best_change(blocks: Blocks, columns: tuple[int, ...]) -> ChangePointFit | None:
    """The likeliest instant at which these columns changed; None where none can be told.

    Where nothing is known of the rudder, how much of it is slipstream is found by turns.
    """
    if SLIPSTREAM not in blocks.names or blocks.names.index("d") not in columns:
        return _split_as_given(blocks, columns)
    d, slipstream = (blocks.names.index(name) for name in ("d", SLIPSTREAM))
    changing, share, split = len(blocks.names) + columns.index(d), 0.5, None
    for _ in range(MAX_MIXING_STEPS):
        split = _split_as_given(_mixed(blocks, share), columns)
        if split is None:
            return None
        rudder = split.values[d] + split.values[changing] / 2
        whole = rudder + split.values[slipstream]
        share = float(np.clip((whole - (1 - share) * rudder) / whole, 0, 1))
    return split


def _split_as_given(blocks: Blocks, columns: tuple[int, ...]) -> ChangePointFit | None:
    dated = _dated(blocks, columns)
    if dated is None:
        return None
    at, spread = dated
    kept = np.arange(len(blocks.products))
    kept = kept[(kept < at - blocks.clear) | (kept >= at + blocks.clear)]
    p, known = len(blocks.names), blocks.tallies[kept, 0].sum()
    regressors = np.eye(p)[:, [*range(p), *columns]]  # of a block after the change
    every = np.tile(regressors, (len(kept), 1, 1))
    every[kept < at, :, p:] = 0
    squares = every.transpose(0, 2, 1) @ blocks.squares[kept] @ every
    products = np.einsum("kji,kj->ki", every, blocks.products[kept])
    inverse = inverse_of(squares.sum(0))
    independent = known / (blocks.equation.overlap * CORRELATION_SHARE)
    freedom = independent - p - len(columns)
    if inverse is None or freedom <= 0:
        return None
    values = inverse @ products.sum(0)
    influences = np.zeros((len(blocks.products), len(values)))
    influences[kept] = (products - squares @ values) @ inverse
    weights = np.zeros((len(blocks.products), len(columns)))
    weights[kept] = np.einsum("ij,kjl,li->ki", inverse[p:], squares, inverse[:, p:])
    degrees = 1.5 * weights.sum(0) ** 2 / run_squares(weights, blocks.run)
    inflation = independent / freedom
    stds = np.sqrt(inflation * run_squares(influences[:, p:], blocks.run))
    chances = 2 * stdtr(degrees, -np.abs(values[p:]) / np.maximum(stds, TINY))  # Student's t
    return ChangePointFit(at, columns, values, influences, inflation, degrees, chances, spread)


def _dated(blocks: Blocks, columns: tuple[int, ...]) -> tuple[int, float] | None:
    """The instant that leaves the least squares, of those where both sides tell the columns.

    With it the spread of Andrews: log of the odds of the last instant over those of the first, in
    the time in which the rows tell of the column that is weighed.
    """
    inverse = inverse_of(blocks.squares.sum(0))
    if inverse is None:
        return None
    shares = np.einsum("ij,kjl,li->ki", inverse[columns, :], blocks.squares, inverse[:, columns])
    shares = np.cumsum(shares, axis=0)[:-1] / shares.sum(0)
    allowed = ((shares >= MIN_INFORMATION_SHARE) & (shares <= 1 - MIN_INFORMATION_SHARE)).all(
        axis=1
    ) & _moves(blocks)
    if not allowed.any():
        return None
    left = blocks.products - blocks.squares @ (inverse @ blocks.products.sum(0))
    S = np.cumsum(left, axis=0)[:-1][allowed][:, columns]
    G = np.cumsum(blocks.squares, axis=0)[:-1][allowed][:, columns]  # (k, c, p)
    Q = G[:, :, columns] - G @ inverse @ G.transpose(0, 2, 1)
    Q += 1e-9 * np.eye(len(columns))  # of columns that do nothing but what the others do
    gains = np.einsum("ki,ki->k", S, np.linalg.solve(Q, S[:, :, None])[:, :, 0])
    odds = shares[allowed, -1] / (1 - shares[allowed, -1])
    return int(np.flatnonzero(allowed)[np.argmax(gains)]) + 1, log(odds[-1] / odds[0])


def _moves(blocks: Blocks) -> NDArray[np.bool_]:
    """(k - 1,) whether enough moves both before and after each edge between blocks."""
    low, high = blocks.tallies[:, 1], blocks.tallies[:, 2]
    before = np.maximum.accumulate(high) - np.minimum.accumulate(low)
    after = np.maximum.accumulate(high[::-1]) - np.minimum.accumulate(low[::-1])
    return np.asarray(np.minimum(before[:-1], after[-2::-1]) >= blocks.min_excitation)


def inverse_of(squares: FloatArray) -> FloatArray | None:
    """Of X'X; None where the columns cannot be told from each other."""
    sizes = np.sqrt(np.diag(squares))
    if not (sizes > 0).all():
        return None
    scaled = squares / np.outer(sizes, sizes)
    if np.linalg.cond(scaled) > MAX_CONDITION**2:
        return None
    return np.asarray(np.linalg.inv(scaled) / np.outer(sizes, sizes))


def run_squares(influences: FloatArray, run: int) -> FloatArray:
    """The sum of the squares of the sums over every run of blocks, over its length; (c,)."""
    sums = np.cumsum(np.pad(influences, ((run, run - 1), (0, 0))), axis=0)
    return np.asarray(((sums[run:] - sums[:-run]) ** 2).sum(0) / run)


def is_sure(blocks: Blocks, split: ChangePointFit) -> bool:
    """Whether the last column changed, though every instant and every column was tried."""
    candidates = sum(name != SLIPSTREAM for name in blocks.names)
    chance = largest_of_instants(float(split.chances[-1]), split.spread)
    return chance * candidates < MAX_FALSE_ALARM_RATE


def largest_of_instants(chance: float, spread: float) -> float:
    """The chance of one instant turned into that of the worst of all, Andrews' distribution.

    By the expansion of DeLong ("Crossing probabilities for a square root boundary by a Bessel
    process", 1981) for one coefficient, exact in the tail; `spread` is log of Andrews' lambda.
    """
    z = float(-ndtri(max(chance, 1e-300) / 2))
    if z <= 1:
        return 1.0
    density = exp(-(z**2) / 2) / sqrt(2 * pi)
    return float(min(1.0, density * (z * (1 - z**-2) * spread + 2 / z)))


def _mixed(blocks: Blocks, share: float) -> Blocks:
    """The rudder's column with that share of the slipstream in it: both change as one."""
    mixing = np.eye(len(blocks.names))
    d, slipstream = (blocks.names.index(name) for name in ("d", SLIPSTREAM))
    mixing[[d, slipstream], d] = 1 - share, share
    return blocks._replace(
        squares=mixing.T @ blocks.squares @ mixing, products=blocks.products @ mixing
    )
