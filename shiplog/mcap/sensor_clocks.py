"""Steps of a sensor's clock, which the steady times of reception show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import TimeArray, is_sorted

from .clock_steps import (
    MAX_INTERVAL_SPREAD,
    MIN_SAMPLES_BESIDE_STEP,
    backward_rows,
    earlier_rows,
    falling_rows,
    sampling_interval,
)
from .forward_steps import MIN_FORWARD_NS, MIN_PAUSE_INTERVALS

MIN_STEADY_INTERVALS = 16  # of times of reception; fewer may be alike by chance
LAG_SAMPLES = 32  # on each side of a step, for the time from measurement to reception
_SECOND_NS = 1e9


@dataclass(frozen=True)
class _Step:
    """A step of the measured times: the first row after it, and its size in ns."""

    row: int
    size: int


def without_steps(
    topic: str, measured_ns: TimeArray, received_ns: TimeArray
) -> tuple[TimeArray, list[str]]:
    """Remove the steps of a sensor's clock, against the steady times of reception.

    The part in which the time from measurement to reception is the shortest is taken as right.

    Parameters
    ----------
    topic
        The topic, for messages.
    measured_ns, received_ns
        (n,) times in the order of the file, ns.

    Returns
    -------
    measured_ns, warnings
        The times of measurement without the steps, and what was removed. Unchanged where the times
        of reception run back.
    """
    if len(received_ns) < 2 or not is_sorted(received_ns):
        return measured_ns, []
    lag = measured_ns - received_ns
    if is_sorted(measured_ns) and int(lag.max()) - int(lag.min()) < MIN_FORWARD_NS:
        return measured_ns, []
    steps = _steps(measured_ns, received_ns)
    if not steps:
        return measured_ns, []
    rows = [step.row for step in steps]
    right = int(np.argmin([abs(float(np.median(part))) for part in np.split(lag, rows)]))
    offsets = np.concatenate([[0], np.cumsum([step.size for step in steps])])
    shifts = np.repeat(offsets - offsets[right], np.diff([0, *rows, len(lag)]))
    warnings = [
        f"{topic}: the clock of the sensor was set {'back' if step.size < 0 else 'forward'} by "
        f"{abs(step.size) / _SECOND_NS:.3f} s, "
        f"{(received_ns[step.row] - received_ns[0]) / _SECOND_NS:.1f} s after its start, the times "
        f"of reception go on; its {'earlier' if number < right else 'later'} times were shifted by "
        "this: check the sensor's clock"
        for number, step in enumerate(steps)
    ]
    return measured_ns - shifts, warnings


def _steps(measured: TimeArray, received: TimeArray) -> list[_Step]:
    """Return the steps of the clock.

    Samples in another order have steps back, too. Those of a clock give the same times twice, or
    are beside a step forward of the same size; else no step forward is known to be one.
    """
    interval, _ = sampling_interval(received)
    if interval == 0.0:
        return []
    falls = [] if is_sorted(measured) else falling_rows(measured)[0]
    confirmed = {*backward_rows(measured), *earlier_rows(measured)} if falls else set()
    rows = sorted({*_forward_rows(measured, received), *falls})
    steps = [s for s in _lag_steps(measured - received, rows) if abs(s.size) > interval]
    for before, step, after in zip([None, *steps], steps, [*steps[1:], None], strict=False):
        beside = [other.size for other in (before, after) if other is not None]
        is_returned = any(abs(size + step.size) <= interval for size in beside)
        if step.size < 0 and step.row not in confirmed and not is_returned:
            return [s for s in steps if s.row in confirmed]
    return steps


def _forward_rows(measured: TimeArray, received: TimeArray) -> NDArray[np.intp]:
    """Return the rows after gaps in the measured times that the times of reception do not have.

    None where the times of reception are not steady, and where the intervals differ: a logger that
    repeats the last known value has such gaps.
    """
    interval, spread = sampling_interval(received)
    has_few = np.count_nonzero(np.diff(received)) < MIN_STEADY_INTERVALS
    if has_few or spread > MAX_INTERVAL_SPREAD * interval:
        return np.empty(0, np.intp)
    if abs(sampling_interval(measured)[0] - interval) > MAX_INTERVAL_SPREAD * interval:
        return np.empty(0, np.intp)
    gaps = np.diff(measured)
    limit = max(MIN_PAUSE_INTERVALS * interval, MIN_FORWARD_NS)
    rows = np.flatnonzero((gaps > limit) & (np.diff(received) < 0.5 * gaps)) + 1
    return rows[np.minimum(rows, len(measured) - rows) >= MIN_SAMPLES_BESIDE_STEP]


def _lag_steps(lag: TimeArray, rows: Sequence[int]) -> list[_Step]:
    """Return by how much the lag changes at each row, by medians up to the rows beside it."""
    ends = [0, *rows, len(lag)]
    return [
        _Step(
            row,
            round(
                float(np.median(lag[row : min(row + LAG_SAMPLES, ends[number + 2])]))
                - float(np.median(lag[max(row - LAG_SAMPLES, ends[number]) : row]))
            ),
        )
        for number, row in enumerate(rows)
    ]
