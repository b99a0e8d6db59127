"""Screening of position fixes: no fix, impossible positions, and fixes that no ship can reach."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shiplog.geodesy import Positions, positions_of
from shiplog.types import Channel, FloatArray, TimeArray

SPEED_FACTOR, EXTRA_SPEED = 2.0, 10.0  # reach per second: factor on the top speed, and m/s more
MIN_TOP_SPEED = 15.0  # m/s; the speed log may be dead or in another unit
MARGIN = 100.0  # m, for noise and for coarse times and positions
MAX_ZERO_SECS = 60.0  # between a fix at 0, 0 and one that shows that the ship was there
BLOCK_SECS, BLOCK_STEP, BLOCK_SPEED = 10.0, 50.0, 10.0  # s, m, m/s: smaller steps join a block
LOOKBACK = 1024  # blocks
MAX_REJECTED_SHARE = 0.2  # of the fixes; beyond it the datum may have changed
MAX_IMPOSSIBLE_VALUES = 1000  # different ones of a channel that are counted by value
MAX_LISTED = 3  # kinds of impossible positions in a warning


@dataclass(frozen=True, eq=False)
class FixScreening:
    """The fixes of one channel that are not used, and why.

    Attributes
    ----------
    usable
        Number of fixes that are used.
    usable_span_ns
        First and last instant of a fix that is used; (0, 0) without any.
    start_ns
        The first instant of the channel.
    fields
        Names of the components, such as ``("latitude", "longitude")``.
    impossible
        Number of fixes by impossible value, such as ``{(91.0, 181.0): 30}``, of the first
        `MAX_IMPOSSIBLE_VALUES` different ones.
    impossible_count
        Number of fixes at all impossible values.
    first_impossible_secs
        Time of the first of these, s after `start_ns`.
    rejected_ns
        (m, 2) first and last instant of each stretch of rejected fixes.
    zero
        (m,) whether the stretch is of latitude 0, longitude 0: a receiver without a fix.
    counts
        (m,) number of fixes in each stretch.
    distances
        (m,) largest distance in m from a stretch to the used fix before it; NaN without any.
    max_speed
        The speed that a ship cannot exceed from one fix to the next, m/s.
    """

    usable: int
    usable_span_ns: tuple[int, int]
    start_ns: int
    fields: tuple[str, ...]
    impossible: dict[tuple[float, ...], int]
    impossible_count: int
    first_impossible_secs: float
    rejected_ns: TimeArray
    zero: NDArray[np.bool_]
    counts: NDArray[np.int64]
    distances: FloatArray
    max_speed: float

    def apply(self, channel: Channel) -> Channel:
        """Return a part of the channel with NaN in place of the fixes that are not used."""
        keep = positions_of(channel.fields, channel.values).measured
        if len(self.rejected_ns):
            order = np.argsort(self.rejected_ns[:, 0])
            starts, ends = self.rejected_ns[order].T
            ends = np.maximum.accumulate(ends)
            at = np.searchsorted(starts, channel.measured_ns, "right") - 1
            keep = keep & ((at < 0) | (channel.measured_ns > ends[at]))
        if keep.all():
            return channel
        return replace(channel, values=np.where(keep[:, None], channel.values, np.nan))

    def warnings(self) -> Iterator[str]:
        """Report the fixes that are not used: which, how many, when, and the remedy."""
        if self.impossible:
            yield self._impossible_warning()
        zero = self.counts[self.zero]
        if len(zero):
            yield (
                f"{_fixes(int(zero.sum()))} at latitude 0, longitude 0, the first "
                f"{self._secs(self.zero):.1f} s after its start; the receiver had no position: "
                "they are not used; check the receiver and its antenna"
            )
        if not self.zero.all():
            yield self._unreachable_warning()

    def in_words(self, position: tuple[float, ...]) -> str:
        """Return a position with the names of its components."""
        pairs = zip(self.fields, position, strict=False)
        return ", ".join(f"{field} {value:.10g}" for field, value in pairs)

    def _impossible_warning(self) -> str:
        listed = sorted(self.impossible.items(), key=lambda item: -item[1])
        values = [f"{count} at {self.in_words(value)}" for value, count in listed[:MAX_LISTED]]
        others = self.impossible_count - sum(count for _, count in listed[:MAX_LISTED])
        return (
            f"{_fixes(self.impossible_count)} at an impossible position ({', '.join(values)}"
            f"{f', {others} at others' if others else ''}), the first "
            f"{self.first_impossible_secs:.1f} s after its start; latitudes are within 90 deg and "
            "longitudes within 360 deg, and AIS prints 91, 181 without a position: they are not "
            "used; check the receiver and the columns of the layout"
        )

    def _unreachable_warning(self) -> str:
        far, count = ~self.zero, int(self.counts[~self.zero].sum())
        remedy = "check the receiver and its antenna"
        if count > MAX_REJECTED_SHARE * (count + self.usable):
            remedy = "the receiver's datum or origin may have changed: cut the log there"
        stretches = int(np.count_nonzero(far))
        return (
            f"{_fixes(count)} in {stretches} stretch{'es' if stretches > 1 else ''} that the ship "
            f"cannot reach, up to {_distance(float(self.distances[far].max()))} from the fixes "
            f"around them, the first {self._secs(far):.1f} s after its start (limit "
            f"{self.max_speed:.0f} m/s and {MARGIN:.0f} m); they are not used; {remedy}"
        )

    def _secs(self, stretches: NDArray[np.bool_]) -> float:
        return float(self.rejected_ns[stretches, 0].min() - self.start_ns) * 1e-9


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Blocks of consecutive fixes with small steps, which are used or rejected as a whole.

    Attributes
    ----------
    times
        (m, 2) times of the first and the last fix, ns.
    held_ns
        (m,) since when the last position is repeated, ns.
    ends
        (m, 2 k) components of the first and of the last fix.
    counts, moves
        (m,) number of fixes, and of those that differ from the one before.
    zero
        (m,) whether the block is at latitude 0, longitude 0.
    joins
        (m,) whether the block belongs to the one before, from which a chunk's end cuts it.
    """

    times: TimeArray
    held_ns: TimeArray
    ends: FloatArray
    counts: NDArray[np.int64]
    moves: NDArray[np.int64]
    zero: NDArray[np.bool_]
    joins: NDArray[np.bool_]

    def merged(self) -> "_Blocks":
        """Return the blocks with those joined that were cut by the ends of chunks."""
        first = np.flatnonzero(~self.joins)
        last = np.append(first[1:], len(self.joins)) - 1
        k = self.ends.shape[1] // 2
        return _Blocks(
            np.column_stack((self.times[first, 0], self.times[last, 1])),
            self.held_ns[last],
            np.column_stack((self.ends[first, :k], self.ends[last, k:])),
            np.add.reduceat(self.counts, first),
            np.add.reduceat(self.moves, first),
            self.zero[first],
            self.joins[first],
        )


class FixScreen:
    """Search for unusable fixes in a position channel that comes chunk by chunk.

    A fix is reachable from another within ``(2 v + 10 m/s) dt + 100 m``, where v is the top speed
    of the ship and dt the time since the position last changed, as a receiver may freeze. Where
    consecutive fixes are not, the longest sequence of reachable fixes is used; the others are
    rejected: single wild fixes, stretches of them, and wild fixes at the start. In comparing
    sequences, fixes that repeat the one before count little. Latitude 0, longitude 0 is used only
    near other fixes, within a minute.
    Where the chunks are cut changes no result.

    Examples
    --------
    >>> times = 10**9 * np.arange(5)
    >>> track = np.array([[0.0, 0.0], [8.0, 0.0], [9e5, 0.0], [24.0, 0.0], [32.0, 0.0]])
    >>> fixes = Channel("position", "gps", "m", times, times, track, ("north", "east"))
    >>> screen = FixScreen()
    >>> screen.add(fixes)
    >>> screen.result(max_speed=8.0).apply(fixes).values[:, 0].tolist()
    [0.0, 8.0, nan, 24.0, 32.0]
    """

    def __init__(self) -> None:
        self._fields: tuple[str, ...] = ()
        self._start_ns: int | None = None
        self._impossible: Counter[tuple[float, ...]] = Counter()  # by value
        self._impossible_count = 0
        self._first_impossible_ns = 0
        # of the last fix: since when its position is repeated, and its values
        self._last: tuple[TimeArray, FloatArray] | None = None
        self._pieces: list[_Blocks] = []

    def add(self, channel: Channel) -> None:
        """Add the next samples of the channel."""
        if not len(channel):
            return
        self._fields = channel.fields
        self._start_ns = int(channel.measured_ns[0]) if self._start_ns is None else self._start_ns
        measured = positions_of(channel.fields, channel.values).measured
        if not measured.all():
            self._count_impossible(channel, measured)
        times, values = channel.measured_ns[measured], channel.values[measured]
        if not len(times):
            return
        started = self._last is not None
        if self._last is not None:
            times = np.concatenate((self._last[0], times))
            values = np.concatenate((self._last[1], values))
        positions = positions_of(channel.fields, values)
        rows = np.arange(len(times) - 1)
        distances = positions.distances(rows, rows + 1)
        changed = np.append(True, distances > 0)
        held_ns = times[np.maximum.accumulate(np.where(changed, np.arange(len(times)), 0))]
        secs = np.abs(times[1:] - held_ns[:-1]) * 1e-9
        zero = positions.at_zero
        split = (distances > BLOCK_STEP + BLOCK_SPEED * secs) | (
            (secs > BLOCK_SECS) & (distances > 0)
        )
        split |= zero[1:] != zero[:-1]
        self._last = held_ns[-1:], values[-1:]
        # with `started`, fix 0 is the last one of the chunk before
        first = np.append(0, np.flatnonzero(split) + 1)
        if started:
            first = np.union1d(first[1:], [1])
        last = np.append(first[1:], len(times)) - 1
        joins = np.zeros(len(first), bool)
        joins[0] = started and not split[0]
        blocks = _Blocks(
            np.column_stack((times[first], times[last])),
            held_ns[last],
            np.column_stack((values[first], values[last])),
            last - first + 1,
            np.add.reduceat(changed.astype(np.int64), first),
            zero[first],
            joins,
        )
        self._pieces.append(blocks)

    def _count_impossible(self, channel: Channel, measured: NDArray[np.bool_]) -> None:
        """Count the samples out of range by value; NaN is counted elsewhere."""
        rows = np.flatnonzero(~measured & ~np.isnan(channel.values[:, :2]).any(axis=1))
        if not len(rows):
            return
        if not self._impossible:
            self._first_impossible_ns = int(channel.measured_ns[rows[0]])
        self._impossible_count += len(rows)
        values, first, counts = np.unique(
            channel.values[rows, :2], axis=0, return_index=True, return_counts=True
        )
        order = np.argsort(first)  # so that the ends of chunks do not change which are counted
        for value, count in zip(values[order].tolist(), counts[order].tolist(), strict=True):
            if tuple(value) in self._impossible or len(self._impossible) < MAX_IMPOSSIBLE_VALUES:
                self._impossible[tuple(value)] += count

    def result(self, max_speed: float) -> FixScreening:
        """Return which fixes are used.

        Parameters
        ----------
        max_speed
            Top speed of the ship by its speed log, m/s; 0 where unknown.
        """
        reach = SPEED_FACTOR * max(max_speed, MIN_TOP_SPEED) + EXTRA_SPEED
        start_ns = self._start_ns or 0
        first_impossible = (self._first_impossible_ns - start_ns) * 1e-9
        if not self._pieces:
            none = np.zeros(0)
            return FixScreening(
                0, (0, 0), start_ns, self._fields, dict(self._impossible), self._impossible_count,
                first_impossible, np.zeros((0, 2), np.int64), none > 0, none.astype(np.int64),
                none, reach,
            )  # fmt: skip
        columns = zip(*(vars(piece).values() for piece in self._pieces), strict=True)
        blocks = _Blocks(*(np.concatenate(column) for column in columns)).merged()
        between = _Reach(self._fields, blocks, reach)
        used = _longest_chain(blocks, between)
        rejected = np.flatnonzero(~used)
        distances = between.distances_to_used(rejected, np.flatnonzero(used))
        zero = blocks.zero[rejected]
        new = (np.diff(rejected, prepend=-2) > 1) | np.append(False, zero[1:] != zero[:-1])
        first = np.flatnonzero(new)  # of each stretch of rejected blocks
        last = np.append(first[1:], len(rejected))[: len(first)] - 1
        kept = blocks.times[used]
        return FixScreening(
            usable=int(blocks.counts[used].sum()),
            usable_span_ns=(int(kept.min()), int(kept.max())) if len(kept) else (0, 0),
            start_ns=start_ns,
            fields=self._fields,
            impossible=dict(self._impossible),
            impossible_count=self._impossible_count,
            first_impossible_secs=first_impossible,
            rejected_ns=np.column_stack(
                (blocks.times[rejected[first], 0], blocks.times[rejected[last], 1])
            ),
            zero=zero[first],
            counts=_reduced(np.add, blocks.counts[rejected], first),
            distances=_reduced(np.maximum, distances, first),
            max_speed=reach,
        )


class _Reach:
    """Which blocks of fixes can be reached from which."""

    def __init__(self, fields: tuple[str, ...], blocks: _Blocks, max_speed: float) -> None:
        k = len(fields)
        self._blocks, self._max_speed = blocks, max_speed
        self._count = len(blocks.times)
        # the first fixes of all blocks, then the last ones
        ends = np.concatenate((blocks.ends[:, :k], blocks.ends[:, k:]))
        self._positions: Positions = positions_of(fields, ends)

    def __call__(self, one: NDArray[np.intp], following: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether the start of `following` is within reach of the end of `one`, (m,)."""
        secs = np.abs(self._blocks.times[following, 0] - self._blocks.held_ns[one]) * 1e-9
        zero = self._blocks.zero[one] != self._blocks.zero[following]
        secs = np.where(zero, np.minimum(secs, MAX_ZERO_SECS), secs)
        distances = self._positions.distances(one + self._count, following)
        return np.asarray(distances <= self._max_speed * secs + MARGIN)

    def distances_to_used(self, rejected: NDArray[np.intp], used: NDArray[np.intp]) -> FloatArray:
        """Return the distance of each rejected block to the used one before it, or the first, m."""
        if not len(used):
            return np.full(len(rejected), np.nan)
        nearest = np.clip(np.searchsorted(used, rejected) - 1, 0, None)
        return self._positions.distances(rejected, used[nearest] + self._count)


def _longest_chain(blocks: _Blocks, reach: _Reach) -> NDArray[np.bool_]:
    """Return which blocks are on the longest sequence of blocks reachable one from another, (m,).

    By dynamic programming over the last `LOOKBACK` blocks and the best of those before.
    """
    count = len(blocks.times)
    rows = np.arange(count)
    if blocks.zero.all():
        return np.zeros(count, bool) if count else np.ones(0, bool)
    if reach(rows[:-1], rows[1:]).all():
        return np.ones(count, bool)
    scores = np.where(blocks.zero, 1e-6, 1.0) * (blocks.moves + 0.01 * blocks.counts)
    previous, best = np.full(count, -1), 0
    for j in range(1, count):
        before = rows[max(0, j - LOOKBACK) : j]
        if best < before[0]:
            before = np.append(best, before)
        before = before[reach(before, np.full(len(before), j))]
        if len(before):
            latest = len(before) - 1 - int(np.argmax(scores[before][::-1]))
            previous[j] = before[latest]
            scores[j] += scores[previous[j]]
        best = j if scores[j] > scores[best] else best
    used = np.zeros(count, bool)
    j = int(np.argmax(scores))
    while j >= 0:
        used[j], j = True, int(previous[j])
    return used if not blocks.zero[used].all() else np.zeros(count, bool)


def _reduced(function: np.ufunc, values: NDArray[Any], first: NDArray[np.intp]) -> NDArray[Any]:
    """Return `function` over each stretch of values, whose first rows are given, (m,)."""
    return np.asarray(function.reduceat(values, first)) if len(first) else values[:0]


def _fixes(count: int) -> str:
    return "1 fix" if count == 1 else f"{count} fixes"


def _distance(metres: float) -> str:
    return f"{metres / 1000:.1f} km" if metres >= 1000 else f"{metres:.0f} m"
