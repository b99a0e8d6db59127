"""Check for stuck values: long runs of one value in a channel that otherwise varies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

from .quantiles import Quantiles

STUCK_PERIODS = 30  # a run of one value longer than this many sampling intervals,
STUCK_SECS = 5.0  # longer than this,
STUCK_RUNS = 30  # and longer than this many typical runs of its channel, is stuck
MAX_SMOOTH_REVERSALS = 0.25  # share of changes against the one before; 2/3 in white noise
MIN_JUMP_SHARE = 0.1  # of the median change, and
MIN_JUMP_DIGITS = 1.5  # of the smallest: a smooth channel that changes by less was at rest


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

    A channel without noise, such as a heading, is constant in a steady straight approach, too. Its
    first change after that is a single digit, or far below the median change, while a sensor that
    froze resumes with all that it missed. So where changes rarely reverse, the value must jump by
    more than `MIN_JUMP_SHARE` of the median change and `MIN_JUMP_DIGITS` of the smallest. A smooth
    sensor that freezes while the ship goes straight, or whose last change before it froze for the
    rest of the log is one digit, is therefore not found.

    Parameters
    ----------
    circular
        Whether values are angles in rad that may wrap: 2 pi to 0 is no jump.

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

    def __init__(self, *, circular: bool = False) -> None:
        self._circular = circular
        self._run_count = self._reversals = 0
        self._durations, self._jumps = Quantiles(), Quantiles()
        # rows of start, duration, jump before, jump after and value
        self._long_runs: list[FloatArray] = []
        self._start, self._count, self._jump = 0.0, 0, 0.0  # of the current run
        self._last: tuple[float, FloatArray] | None = None
        self._last_change: FloatArray | None = None

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
        differences = self._differences(rows)
        steps = _steps(rows, differences)
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
        self._count_reversals(differences[changes])
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
        short_runs = self._durations.values[self._durations.values <= min_secs]
        typical = float(np.median(short_runs))
        stuck &= durations > STUCK_RUNS * typical
        stuck &= np.nan_to_num(np.maximum(before, after), nan=np.inf) > self._min_jump(typical)
        if not stuck.any():
            return None
        longest = int(np.argmax(np.where(stuck, durations, -1.0)))
        held = np.array(values)[:, longest]
        return StuckStats(int(np.count_nonzero(stuck)), held, start[longest], durations[longest])

    def _min_jump(self, typical_secs: float) -> float:
        """Return the jump beside a stuck run that any other run does not have."""
        changes = self._jumps.values
        if not len(changes):
            return 0.0
        if typical_secs > 0:  # few digits: at a crest a value repeats, then moves by one digit
            return 2 * float(np.median(changes))
        if self._reversals > MAX_SMOOTH_REVERSALS * self._run_count:
            return 0.0  # noise never rests
        median, digit = float(np.median(changes)), float(changes.min())
        return max(MIN_JUMP_SHARE * median, MIN_JUMP_DIGITS * digit)

    def _differences(self, rows: FloatArray) -> FloatArray:
        """Return the change from each row to the next, (n - 1, k)."""
        differences: FloatArray = np.diff(rows, axis=0)
        if self._circular:
            wrapped = np.abs(differences) > np.pi
            differences[wrapped] = np.remainder(differences[wrapped] + np.pi, 2 * np.pi) - np.pi
        return differences

    def _count_reversals(self, changes: FloatArray) -> None:
        """Count the changes, (n, k), that are opposite to the one before."""
        last = changes[:1] if self._last_change is None else self._last_change
        along = (changes * np.concatenate((last, changes[:-1]))).sum(axis=1)
        self._reversals += int(np.count_nonzero(along < 0))
        self._last_change = changes[-1:]

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


def _steps(rows: FloatArray, differences: FloatArray) -> FloatArray:
    """Size of each change, (n - 1,); NaN beside a value that was not measured."""
    missing = np.isnan(rows)
    if not missing.any():
        return np.asarray(np.abs(differences).max(axis=1))
    steps: FloatArray = np.abs(np.nan_to_num(differences, nan=0.0)).max(axis=1)
    empty = np.asarray(missing.all(axis=1))
    steps[empty[1:] | empty[:-1] | (missing[1:] != missing[:-1]).any(axis=1)] = np.nan
    return steps
