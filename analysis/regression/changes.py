"""Changes of coefficients within a trial: which coefficient, when, and by how much.

The most significant change of the whole trial is detected first (`change_point`), then each side of
it is searched in turn (binary segmentation). Only the triangular factors of at most `MAX_BLOCKS`
blocks of rows are stored, so that a trial may be of any length.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf, nan, sqrt

import numpy as np

from shiplog.compiled import compiled
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.types import FloatArray

from .change_point import (
    SIGNIFICANCE_LEVEL,
    Blocks,
    ChangePointFit,
    bartlett_variances,
    detect_change,
    fit_change,
    inverse_gram,
    is_significant,
    relative_difference,
)
from .coefficients import Coefficient
from .sliding import MAX_INFLATION
from .weak_form import SLIPSTREAM, Equation, Rows, WeakForm, with_constant, with_slipstream
from .window_qr import rotate_row

BLOCKS_PER_BUMP = 6  # sets the resolution of a change's instant
MAX_BLOCKS = 4096
MAX_SPLIT_DEPTH = 3  # levels of the binary segmentation
MIN_RELATIVE_CHANGE = 0.01  # a smaller change is not reported
MIN_RELATIVE_CHANGE_FITTED = 0.1  # the same for yaw with a fitted model, whose errors mimic changes


@dataclass(frozen=True)
class Change:
    """Change of one coefficient at an instant.

    Attributes
    ----------
    name, unit
        The coefficient and its unit.
    from_secs, until_secs
        The interval in which the values hold, s since the signals' start.
    at_secs
        The instant of the change, s since the signals' start.
    before, after
        The values from `from_secs` to `at_secs` and from `at_secs` to `until_secs`.
    before_std, after_std
        Their standard deviations.
    relative_change
        The difference divided by the value before; NaN unless the value before is determined at
        two standard deviations.
    relative_change_half_width
        Half the width of its 95 % interval; NaN likewise.
    alternatives
        Other coefficients that may have changed instead: the data do not show which.
    """

    name: str
    unit: str
    from_secs: float
    at_secs: float
    until_secs: float
    before: float
    after: float
    before_std: float
    after_std: float
    relative_change: float
    relative_change_half_width: float
    alternatives: tuple[str, ...]

    @property
    def determined(self) -> bool:
        """Whether both values are over two standard deviations from zero."""
        return abs(self.before) > 2 * self.before_std and abs(self.after) > 2 * self.after_std

    @property
    def description(self) -> str:
        """The relative change with its 95 % interval if known, else the values before and after."""
        if np.isfinite(self.relative_change):
            half = 100 * self.relative_change_half_width
            digits = 0 if half >= 1 else 1
            return f"by {100 * self.relative_change:+.{digits}f} % ± {max(half, 0.1):.{digits}f} %"
        return f"from {self.before:.3g} to {self.after:.3g} {self.unit}"

    def __str__(self) -> str:
        """Return a warning in one line."""
        names = " or ".join((self.name, *self.alternatives))
        return (
            f"{names} changed {self.description} at {self.at_secs:.0f} s: the ship, its loading, "
            "the water depth or the weather changed, or the model does not hold on both sides"
        )


def determined_changes(
    changes: Iterable[Change], coefficients: Mapping[str, Coefficient]
) -> tuple[Change, ...]:
    """Return the changes of coefficients that the trial determines, as a whole and on both sides.

    Where one is not determined, the change of a sum of terms can appear as its own.

    Parameters
    ----------
    changes
        The changes found.
    coefficients
        The coefficients over the whole trial, by name.
    """
    return tuple(
        change for change in changes if change.determined and coefficients[change.name].determined
    )


class ShipChangeTest:
    """Test of both equations for changes of coefficients, from rows that come in chunks.

    A steady yaw moment may change; it is not reported.

    Parameters
    ----------
    equations
        The stage that computes the rows.
    model_is_fitted
        Whether the model was fitted to the same log. The slipstream is then unknown: a regressor
        takes up the effect of speed and revolutions on the rudder, and changes of yaw coefficients
        below `MIN_RELATIVE_CHANGE_FITTED` are not reported.
    """

    def __init__(self, equations: WeakForm, *, model_is_fitted: bool) -> None:
        yaw, count = equations.yaw.with_constant(), equations.row_count
        self._model_is_fitted = model_is_fitted
        rudder = yaw.with_slipstream() if model_is_fitted else yaw
        self._yaw = ChangeTest(
            rudder,
            count,
            min_relative_change=MIN_RELATIVE_CHANGE_FITTED
            if model_is_fitted
            else MIN_RELATIVE_CHANGE,
        )
        self._surge = ChangeTest(equations.surge, count)

    def add(self, yaw: Rows, surge: Rows) -> None:
        """Add the next rows."""
        yaw = with_constant(yaw)
        self._yaw.add(with_slipstream(yaw, surge) if self._model_is_fitted else yaw)
        self._surge.add(surge)

    def result(self) -> tuple[Change, ...]:
        """Return the changes in the order of time."""
        changes = *self._yaw.result(), *self._surge.result()
        return tuple(sorted(changes, key=lambda change: change.at_secs))


class ChangeTest:
    """Test of one equation for changes of coefficients, from rows that come in chunks.

    A `constant` among the regressors may change, too; that is a disturbance and not reported. A
    slipstream regressor (`with_slipstream`) changes in proportion with d.

    Parameters
    ----------
    equation
        The equation.
    count
        The number of rows of the whole trial.
    min_relative_change
        The smallest change that is reported, relative to the value before.
    """

    def __init__(
        self, equation: Equation, count: int, *, min_relative_change: float = MIN_RELATIVE_CHANGE
    ) -> None:
        self._equation, self._count, self._row_count = equation, count, 0
        self._min_relative_change = min_relative_change
        self._size = max(1, equation.overlap // BLOCKS_PER_BUMP, -(-count // MAX_BLOCKS))
        blocks, p = -(-count // self._size), len(equation.names)
        self._factors = np.zeros((blocks, p, p + 1))
        self._tallies = np.tile([0.0, inf, -inf], (blocks, 1))
        self._min_excitation = 0.0

    def add(self, rows: Rows) -> None:
        """Add the next rows."""
        columns = np.column_stack((rows.regressors, rows.target, rows.excitation))
        _add_to_blocks(self._factors, self._tallies, columns, self._row_count, self._size)
        self._row_count += len(columns)
        self._min_excitation = rows.min_excitation

    def result(self) -> tuple[Change, ...]:
        """Return the changes in the order of time."""
        blocks = self._blocks()
        if blocks is None:
            return ()
        last, guard_blocks = len(blocks.moments), blocks.guard_blocks
        at = _find_blocks(blocks, 0, last, MAX_SPLIT_DEPTH)
        changes: list[Change] = []
        for before, after in zip(
            [-guard_blocks, *at], [*at[1:], last + guard_blocks], strict=False
        ):
            part = blocks.part(before + guard_blocks, after - guard_blocks)  # between other changes
            fit = detect_change(part)
            changes += _significant_changes(part, fit) if fit else []
        return tuple(changes)

    def _blocks(self) -> Blocks | None:
        """Return the blocks, without regressors that are zero in all rows; None if all are zero."""
        upper = self._factors[:, :, :-1].transpose(0, 2, 1)
        grams, moments = upper @ self._factors[:, :, :-1], upper @ self._factors[:, :, -1:]
        sizes = np.sqrt(np.einsum("kii->i", grams))
        is_used = sizes > 0
        if not is_used.any():
            return None
        names, units = self._equation.names, sizes[is_used]
        starts = np.minimum(np.arange(len(grams) + 1) * self._size, self._count) - 0.5
        blocks = Blocks(
            tuple(name for name, used in zip(names, is_used, strict=True) if used),
            units,
            grams[:, is_used][:, :, is_used] / np.outer(units, units),
            moments[:, is_used, 0] / units,
            self._tallies,
            self._equation.bump_secs / 2 + starts * self._equation.stride_secs,
            self._equation,
            self._min_excitation,
            self._min_relative_change,
            max(2, -(-self._equation.overlap // self._size)),
        )
        return _without_redundant_slipstream(blocks) if SLIPSTREAM in blocks.names else blocks


@compiled
def _add_to_blocks(
    factors: FloatArray, tallies: FloatArray, rows: FloatArray, first: int, size: int
) -> None:
    """Add rows ``[X y excitation]`` (m, p + 2), overwritten, to blocks of `size` rows.

    `first` rows have been added before.
    """
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


def _without_redundant_slipstream(blocks: Blocks) -> Blocks:
    """Drop the slipstream regressor where the rudder explains it, as at a constant speed."""
    last, inverse = blocks.names.index(SLIPSTREAM), inverse_gram(blocks.grams.sum(0))
    if inverse is not None and sqrt(inverse[last, last]) <= MAX_INFLATION:
        return blocks
    return blocks._replace(
        names=blocks.names[:last],
        units=blocks.units[:last],
        grams=blocks.grams[:, :last, :last],
        moments=blocks.moments[:, :last],
    )


def _find_blocks(blocks: Blocks, start: int, stop: int, depth: int) -> list[int]:
    """Return the first block after each change between `start` and `stop`, recursively."""
    fit = detect_change(blocks.part(start, stop)) if depth else None
    if fit is None:
        return []
    at, guard_blocks = start + fit.block, blocks.guard_blocks
    earlier = _find_blocks(blocks, start, at - guard_blocks, depth - 1)
    return [*earlier, at, *_find_blocks(blocks, at + guard_blocks, stop, depth - 1)]


def _significant_changes(blocks: Blocks, fit: ChangePointFit) -> list[Change]:
    """Return the changes of coefficients that are large enough to report."""
    alternatives = _alternatives(blocks, fit) if len(fit.columns) == 1 else ()
    return [
        _change(blocks, fit, c, alternatives)
        for c, i in enumerate(fit.columns)
        if blocks.names[i] in COEFFICIENT_UNITS
        and relative_difference(fit, c) >= blocks.min_relative_change
    ]


def _change(blocks: Blocks, fit: ChangePointFit, c: int, alternatives: tuple[str, ...]) -> Change:
    from scipy.special import stdtrit  # noqa: PLC0415 - it takes long to import

    i, edges = fit.columns[c], blocks.edges_secs
    j = len(blocks.names) + c
    before, difference = fit.values[i], fit.values[j]
    share, of_before, of_difference = difference / before, *fit.influences[:, [i, j]].T
    influences = of_before, of_before + of_difference, (of_difference - share * of_before) / before
    stds = np.sqrt(
        fit.variance_factor * bartlett_variances(np.column_stack(influences), blocks.overlap_blocks)
    )
    is_determined = abs(before) > 2 * stds[0]
    return Change(
        name=blocks.names[i],
        unit=COEFFICIENT_UNITS[blocks.names[i]],
        from_secs=float(edges[0]),
        at_secs=float(edges[fit.block]),
        until_secs=float(edges[-1]),
        before=float(before / blocks.units[i]),
        after=float((before + difference) / blocks.units[i]),
        before_std=float(stds[0] / blocks.units[i]),
        after_std=float(stds[1] / blocks.units[i]),
        relative_change=float(share) if is_determined else nan,
        relative_change_half_width=float(-stdtrit(fit.degrees_of_freedom[c], 0.025) * stds[2])
        if is_determined
        else nan,
        alternatives=alternatives,
    )


def _alternatives(blocks: Blocks, fit: ChangePointFit) -> tuple[str, ...]:
    """Return the coefficients that may have changed instead.

    These are significant alone, and with them the change of the fit is not.
    """
    changes = []
    for i, name in enumerate(blocks.names):
        if name not in COEFFICIENT_UNITS or i in fit.columns:
            continue
        alone, both = fit_change(blocks, (i,)), fit_change(blocks, (i, *fit.columns))
        is_doubtful = both is None or both.p_values[-1] > SIGNIFICANCE_LEVEL
        if alone is not None and is_significant(blocks, alone) and is_doubtful:
            changes.append(name)
    return tuple(changes)
