"""Check for stuck values: long runs of one value in a channel that otherwise varies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .quantiles import Quantiles

STUCK_PERIODS = 30  # a run of one value longer than this many sampling intervals,
STUCK_SECS = 5.0  # longer than this,
STUCK_RUNS = 30  # and longer than this many typical runs of its channel, is stuck


@dataclass(frozen=True, eq=False)
class StuckStats:
    """Stuck values of a channel.

    Attributes
    ----------
    count
        Number of runs of one value that are too long.
    value
        (k,) value of the longest run, one per component.
    start_secs
        Start of the longest run, in s since the channel's first sample.
    duration_secs
        Length of the longest run in s.
    """

    count: int
    value: FloatArray
    start_secs: float
    duration_secs: float


class StuckCheck:
    """Search for runs of equal values in a channel that comes chunk by chunk.

    A run is stuck if it is longer than `STUCK_SECS`, `STUCK_PERIODS` sampling intervals and
    `STUCK_RUNS` typical runs of the channel. A slow signal with few digits also repeats values, but
    then moves by one digit only. So where values usually repeat, the value must jump before or
    after the run by more than twice the median change.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.sin(np.arange(600.0))
    >>> values[100:300] = 0.5
    >>> check = StuckCheck()
    >>> check.add(0.1 * np.arange(600), values[:, None])
    >>> stuck = check.result(0.1)
    >>> stuck.count, round(float(stuck.duration_secs), 1)
    (1, 19.9)
    """

    def __init__(self) -> None:
        self._run_count = 0
        self._durations, self._jumps = Quantiles(), Quantiles()
        # rows of start, duration, jump before, jump after and value
        self._long_runs: list[FloatArray] = []
        self._start, self._count, self._jump = 0.0, 0, 0.0  # of the current run
        self._last: tuple[float, FloatArray] | None = None

    def add(self, times: FloatArray, rows: FloatArray) -> None:
        """Add the next samples.

        Parameters
        ----------
        times
            (n,) s since the channel's first sample, in ascending order.
        rows
            (n, k) values.
        """
        if self._last is None:
            self._start = times[0]
        else:
            times = np.concatenate(([self._last[0]], times))
            rows = np.concatenate((self._last[1][None], rows))
            self._count -= 1  # the last sample is counted again
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
        self._add_runs(starts, times[changes], counts, before, after, rows[changes])
        self._jumps.add(after[~np.isnan(after)])
        following = changes[-1] + 1
        self._start, self._count = times[following], len(rows) - following
        self._jump = after[-1]

    def result(self, interval_secs: float) -> StuckStats | None:
        """Return what was stuck, or None; to be called once, after all samples.

        Parameters
        ----------
        interval_secs
            Typical interval between samples in s.
        """
        if self._last is None:
            return None
        end, value = self._last
        start, jump = np.array([self._start]), np.array([self._jump])
        self._add_runs(
            start, np.array([end]), np.array([self._count]), jump, np.zeros(1), value[None]
        )
        start, durations, before, after, *values = np.concatenate(self._long_runs).T
        min_secs = max(STUCK_SECS, STUCK_PERIODS * interval_secs)
        stuck = np.asarray(durations > min_secs)
        if not stuck.any() or np.count_nonzero(stuck) == self._run_count:
            return None
        typical = np.median(self._durations.values[self._durations.values <= min_secs])
        stuck &= durations > STUCK_RUNS * typical
        if typical > 0:  # few digits: at the crest of a wave a value repeats, then moves one digit
            jump = np.nan_to_num(np.maximum(before, after), nan=np.inf)
            stuck &= jump > 2 * self._jumps.median()
        if not stuck.any():
            return None
        longest = int(np.argmax(np.where(stuck, durations, -1.0)))
        held = np.array(values)[:, longest]
        return StuckStats(int(np.count_nonzero(stuck)), held, start[longest], durations[longest])

    def _add_runs(
        self,
        starts: FloatArray,
        ends: FloatArray,
        counts: NDArray[np.int64],
        before: FloatArray,
        after: FloatArray,
        values: FloatArray,
    ) -> None:
        """Keep the durations of completed runs, and all data of the long ones."""
        durations = ends - starts
        self._run_count += len(durations)
        self._durations.add(np.repeat(durations, counts))
        long = durations > STUCK_SECS
        self._long_runs.append(np.column_stack((starts, durations, before, after, values))[long])


def _steps(rows: FloatArray) -> FloatArray:
    """Change from each row to the next, (n - 1,); NaN beside a value that was not measured."""
    missing = np.isnan(rows)
    if not missing.any():
        return np.asarray(np.abs(np.diff(rows, axis=0)).max(axis=1))
    filled = np.where(missing, 0.0, rows)
    steps: FloatArray = np.abs(np.diff(filled, axis=0)).max(axis=1)
    empty = np.asarray(missing.all(axis=1))
    steps[empty[1:] | empty[:-1] | (missing[1:] != missing[:-1]).any(axis=1)] = np.nan
    return steps
