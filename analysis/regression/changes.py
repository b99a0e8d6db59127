"""Whether a coefficient changed during the trial: which one, when, and by how much.

The most surely told change of the whole trial is sought first (`split`), then each side of it is
searched for itself. Of the rows no more is kept than the triangular factors of some thousand
blocks, so that a trial may be of any length.
"""

from dataclasses import dataclass
from math import inf, nan, sqrt

import numpy as np
from scipy.special import stdtrit

from shiplog.compiled import compiled
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .change_point import (
    SIGNIFICANCE_LEVEL,
    Blocks,
    ChangePointFit,
    best_change,
    changed,
    inverse_of,
    is_sure,
    run_squares,
    share_of,
)
from .sliding import MAX_INFLATION
from .weak_form import SLIPSTREAM, Equation, Rows, WeakForm, with_constant, with_slipstream
from .window_qr import rotate_row

BLOCKS_PER_BUMP = 6  # blocks in a bump's length: so sharp is the instant
MAX_BLOCKS = 4096
MAX_SPLIT_DEPTH = 3  # how often a side is parted again
MIN_RELATIVE_CHANGE = 0.01  # of itself by which a coefficient must change, to be worth telling,
MIN_RELATIVE_CHANGE_FITTED = (
    0.1  # and where the model was guessed, which by itself makes smaller ones
)


@dataclass(frozen=True)
class Change:
    """A coefficient that is not the same before and after an instant."""

    name: str
    unit: str
    from_secs: float  # since the signals' start: from here it is `before`,
    at_secs: float  # from here `after`,
    until_secs: float  # until here
    before: float
    after: float
    before_std: float
    after_std: float
    relative_change: (
        float  # by which it changed, of the value before; NaN unless that one is determined
    )
    relative_change_half_width: float  # half of its 95 % interval
    alternatives: tuple[str, ...]  # any of these may have changed in its place

    @property
    def description(self) -> str:
        """By how much, or from what to what."""
        if np.isfinite(self.relative_change):
            half = 100 * self.relative_change_half_width
            digits = 0 if half >= 1 else 1
            return f"by {100 * self.relative_change:+.{digits}f} % ± {max(half, 0.1):.{digits}f} %"
        return f"from {self.before:.3g} to {self.after:.3g} {self.unit}"

    def __str__(self) -> str:
        """The change in a sentence."""
        alternatives = (
            f" (or {' or '.join(self.alternatives)} in its place)" if self.alternatives else ""
        )
        return (
            f"{self.name}{alternatives} differs before and after {self.at_secs:.0f} s "
            f"{self.description}: the ship, her loading, the depth, the "
            "weather, or a model that does not hold for both"
        )


class ShipChangeTest:
    """Looks for changes in the coefficients of both equations, whose rows come in chunks.

    A steady yaw moment may come and go. Where the model is a `guessed` one, nothing is known of
    the slipstream: whatever the speed and the revolutions may do to the rudder is allowed for, and
    no small changes of yaw are told.
    """

    def __init__(self, equations: WeakForm, *, guessed: bool) -> None:
        yaw, count = equations.yaw.with_constant(), equations.row_count
        self._guessed = guessed
        rudder = yaw.with_slipstream() if guessed else yaw
        self._yaw = ChangeTest(
            rudder, count, least=MIN_RELATIVE_CHANGE_FITTED if guessed else MIN_RELATIVE_CHANGE
        )
        self._surge = ChangeTest(equations.surge, count)

    def add(self, yaw: Rows, surge: Rows) -> None:
        """The next rows."""
        yaw = with_constant(yaw)
        self._yaw.add(with_slipstream(yaw, surge) if self._guessed else yaw)
        self._surge.add(surge)

    def result(self) -> tuple[Change, ...]:
        """What changed, in the order of time."""
        found = *self._yaw.result(), *self._surge.result()
        return tuple(sorted(found, key=lambda change: change.at_secs))


class ChangeTest:
    """Looks for changes in one equation's coefficients, `count` rows in all, in chunks.

    A `constant` among the regressors may change, too, and nothing is said of it: that is a
    disturbance. Where there is a slipstream (`with_slipstream`) it changes as d does. No change
    is told by a share of less than `least`.
    """

    def __init__(
        self, equation: Equation, count: int, *, least: float = MIN_RELATIVE_CHANGE
    ) -> None:
        self._equation, self._count, self._least, self._seen = equation, count, least, 0
        self._size = max(1, equation.overlap // BLOCKS_PER_BUMP, -(-count // MAX_BLOCKS))
        blocks, p = -(-count // self._size), len(equation.names)
        self._factors = np.zeros((blocks, p, p + 1))
        self._tallies = np.tile([0.0, inf, -inf], (blocks, 1))
        self._least_excitation = 0.0

    def add(self, rows: Rows) -> None:
        """The next rows."""
        every = np.column_stack((rows.regressors, rows.target, rows.excitation))
        _fold(self._factors, self._tallies, every, self._seen, self._size)
        self._seen += len(every)
        self._least_excitation = rows.min_excitation

    def result(self) -> tuple[Change, ...]:
        """What changed, in the order of time."""
        blocks = self._blocks()
        if blocks is None:
            return ()
        last, clear = len(blocks.products), blocks.clear
        at = _sought(blocks, 0, last, MAX_SPLIT_DEPTH)
        found: list[Change] = []
        for before, after in zip([-clear, *at], [*at[1:], last + clear], strict=False):
            part = blocks.part(before + clear, after - clear)  # between its neighbours
            split = changed(part)
            found += _told(part, split) if split else []
        return tuple(found)

    def _blocks(self) -> Blocks | None:
        """The blocks, without columns that are zero throughout; None if there is no telling."""
        upper = self._factors[:, :, :-1].transpose(0, 2, 1)
        squares, products = upper @ self._factors[:, :, :-1], upper @ self._factors[:, :, -1:]
        sizes = np.sqrt(np.einsum("kii->i", squares))
        kept = sizes > 0
        if not kept.any():
            return None
        every, units = self._equation.names, sizes[kept]
        starts = np.minimum(np.arange(len(squares) + 1) * self._size, self._count) - 0.5
        blocks = Blocks(
            tuple(name for name, there in zip(every, kept, strict=True) if there),
            units,
            squares[:, kept][:, :, kept] / np.outer(units, units),
            products[:, kept, 0] / units,
            self._tallies,
            self._equation.bump_secs / 2 + starts * self._equation.stride_secs,
            self._equation,
            self._least_excitation,
            self._least,
            max(2, -(-self._equation.overlap // self._size)),
        )
        return _without_needless(blocks) if SLIPSTREAM in blocks.names else blocks


@compiled
def _fold(
    factors: FloatArray, tallies: FloatArray, rows: FloatArray, first: int, size: int
) -> None:
    """Rows [X y excitation] (m, p + 2), used up, of which `first` came before, into blocks."""
    last = rows.shape[1] - 1
    for k in range(len(rows)):
        block = (first + k) // size
        is_known = True
        for j in range(last + 1):
            is_known = is_known and np.isfinite(rows[k, j])
        if is_known:
            rotate_row(factors[block], rows, k)
            tallies[block, 0] += 1
            tallies[block, 1] = min(tallies[block, 1], rows[k, last])
            tallies[block, 2] = max(tallies[block, 2], rows[k, last])


def _without_needless(blocks: Blocks) -> Blocks:
    """Without the slipstream, if the rudder alone can do what it does: at a speed that stays."""
    last, inverse = blocks.names.index(SLIPSTREAM), inverse_of(blocks.squares.sum(0))
    if inverse is not None and sqrt(inverse[last, last]) <= MAX_INFLATION:
        return blocks
    return blocks._replace(
        names=blocks.names[:last],
        units=blocks.units[:last],
        squares=blocks.squares[:, :last, :last],
        products=blocks.products[:, :last],
    )


def _sought(blocks: Blocks, start: int, stop: int, depth: int) -> list[int]:
    """The first blocks after each change between `start` and `stop`."""
    split = changed(blocks.part(start, stop)) if depth else None
    if split is None:
        return []
    at, clear = start + split.at, blocks.clear
    earlier = _sought(blocks, start, at - clear, depth - 1)
    return [*earlier, at, *_sought(blocks, at + clear, stop, depth - 1)]


def _told(blocks: Blocks, split: ChangePointFit) -> list[Change]:
    """The changes of a split that are a coefficient's, and not too small."""
    alternatives = _instead(blocks, split) if len(split.columns) == 1 else ()
    return [
        _change(blocks, split, c, alternatives)
        for c, i in enumerate(split.columns)
        if blocks.names[i] in COEFFICIENT_UNITS and share_of(split, c) >= blocks.least_share
    ]


def _change(blocks: Blocks, split: ChangePointFit, c: int, alternatives: tuple[str, ...]) -> Change:
    i, edges = split.columns[c], blocks.edges_secs
    j = len(blocks.names) + c
    before, difference = split.values[i], split.values[j]
    share, of_before, of_difference = difference / before, *split.influences[:, [i, j]].T
    every = of_before, of_before + of_difference, (of_difference - share * of_before) / before
    stds = np.sqrt(split.inflation * run_squares(np.column_stack(every), blocks.run))
    sure = abs(before) > 2 * stds[0]
    return Change(
        name=blocks.names[i],
        unit=COEFFICIENT_UNITS[blocks.names[i]],
        from_secs=float(edges[0]),
        at_secs=float(edges[split.at]),
        until_secs=float(edges[-1]),
        before=float(before / blocks.units[i]),
        after=float((before + difference) / blocks.units[i]),
        before_std=float(stds[0] / blocks.units[i]),
        after_std=float(stds[1] / blocks.units[i]),
        relative_change=float(share) if sure else nan,
        relative_change_half_width=float(-stdtrit(split.degrees[c], 0.025) * stds[2])
        if sure
        else nan,
        alternatives=alternatives,
    )


def _instead(blocks: Blocks, split: ChangePointFit) -> tuple[str, ...]:
    """The coefficients that might have changed alone: beside one the found one is in doubt."""
    found = []
    for i, name in enumerate(blocks.names):
        if name not in COEFFICIENT_UNITS or i in split.columns:
            continue
        alone, both = best_change(blocks, (i,)), best_change(blocks, (i, *split.columns))
        doubted = both is None or both.chances[-1] > SIGNIFICANCE_LEVEL
        if alone is not None and is_sure(blocks, alone) and doubted:
            found.append(name)
    return tuple(found)
