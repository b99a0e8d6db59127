"""Values that stand still for long, where neither the channel nor its print usually does."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .quantiles import Quantiles

STUCK_PERIODS = 30  # a value that stands still for more usual periods than this,
STUCK_SECS = 5.0  # and for longer than this,
STUCK_RUNS = 30  # and for so many times what is usual in its channel, is stuck


@dataclass(frozen=True, eq=False)
class StuckStats:
    """How often a channel was stuck, and the longest of it."""

    count: int
    value: FloatArray  # (k,)
    start_secs: float  # since the channel's first sample
    lasted_secs: float


class StuckCheck:
    """Looks for runs of equal values in a channel that comes in chunks."""

    def __init__(self) -> None:
        self._runs = 0
        self._lasted, self._jumps = Quantiles(), Quantiles()
        self._long: list[FloatArray] = []  # rows of start, lasted, jump before, after, value
        self._start, self._count, self._jump = 0.0, 0, 0.0  # of the run that goes on
        self._last: tuple[float, FloatArray] | None = None

    def add(self, times: FloatArray, rows: FloatArray) -> None:
        """Take the next samples: (n,) s since the channel's first, in order, and (n, k)."""
        if self._last is None:
            self._start = times[0]
        else:
            times = np.concatenate(([self._last[0]], times))
            rows = np.concatenate((self._last[1][None], rows))
            self._count -= 1  # the last sample is seen again
        self._last = float(times[-1]), rows[-1]
        steps = _steps(rows)
        changes = np.flatnonzero(steps != 0)
        if not len(changes):
            self._count += len(rows)
            return
        starts = np.concatenate(([self._start], times[changes[:-1] + 1]))
        counts = np.diff(changes, prepend=-1)
        counts[0] += self._count
        after = steps[changes]
        before = np.concatenate(([self._jump], after[:-1]))
        self._note(starts, times[changes], counts, before, after, rows[changes])
        self._jumps.add(after[~np.isnan(after)])
        following = changes[-1] + 1
        self._start, self._count = times[following], len(rows) - following
        self._jump = after[-1]

    def result(self, interval_secs: float) -> StuckStats | None:
        """What was stuck of all that was added, told once; `usual_secs` between samples."""
        if self._last is None:
            return None
        end, value = self._last
        start, jump = np.array([self._start]), np.array([self._jump])
        self._note(start, np.array([end]), np.array([self._count]), jump, np.zeros(1), value[None])
        start, lasted, before, after, *values = np.concatenate(self._long).T
        least = max(STUCK_SECS, STUCK_PERIODS * interval_secs)
        long = np.asarray(lasted > least)
        if not long.any() or np.count_nonzero(long) == self._runs:
            return None
        usual = np.median(self._lasted.values[self._lasted.values <= least])
        long &= lasted > STUCK_RUNS * usual
        if usual > 0:  # printed coarsely: at a crest the print stands still, then moves one digit
            leap = np.nan_to_num(np.maximum(before, after), nan=np.inf)
            long &= leap > 2 * self._jumps.median()
        if not long.any():
            return None
        worst = int(np.argmax(np.where(long, lasted, -1.0)))
        held = np.array(values)[:, worst]
        return StuckStats(int(np.count_nonzero(long)), held, start[worst], lasted[worst])

    def _note(
        self,
        starts: FloatArray,
        ends: FloatArray,
        counts: NDArray[np.int64],
        before: FloatArray,
        after: FloatArray,
        values: FloatArray,
    ) -> None:
        """Keep what ended runs lasted, and all of the long ones."""
        lasted = ends - starts
        self._runs += len(lasted)
        self._lasted.add(np.repeat(lasted, counts))
        long = lasted > STUCK_SECS
        self._long.append(np.column_stack((starts, lasted, before, after, values))[long])


def _steps(rows: FloatArray) -> FloatArray:
    """By how much each row differs from the one before, (n - 1,); NaN next to one not measured."""
    gone = np.isnan(rows)
    if not gone.any():
        return np.asarray(np.abs(np.diff(rows, axis=0)).max(axis=1))
    filled = np.where(gone, 0.0, rows)
    steps: FloatArray = np.abs(np.diff(filled, axis=0)).max(axis=1)
    empty = np.asarray(gone.all(axis=1))
    steps[empty[1:] | empty[:-1] | (gone[1:] != gone[:-1]).any(axis=1)] = np.nan
    return steps
