"""Steps of a recorder's clock: detection in the order of a file, before samples are sorted."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import TimeArray

LEVEL_SAMPLES = 8  # on each side of a step, for its size; longer bursts are not jitter
MIN_SAMPLES_BESIDE_STEP = 3  # of a channel on each side; fewer do not show a step
MIN_GAP_INTERVALS = 3.0  # in sorted times, by which a clock set back differs from another order
MAX_DEVIATION_INTERVALS = 0.75  # of a smaller change of level, jitter is the cause
MAX_INTERVAL_SPREAD = 0.5  # relative to the interval, of a channel sampled at a steady rate


@dataclass(frozen=True)
class ChannelTimes:
    """The times of one channel in the order of the file.

    Attributes
    ----------
    name
        The topic, for messages.
    positions
        (n,) places of the messages in the file, increasing, common to all channels.
    times_ns
        (n,) times by one clock, ns.
    """

    name: str
    positions: NDArray[np.int64]
    times_ns: TimeArray


@dataclass(frozen=True)
class ClockStep:
    """A step of a clock at one place of a file.

    Attributes
    ----------
    position
        The first place in the file after the step.
    size_ns
        The change of the clock, ns; negative if it was set back.
    before_ns, after_ns
        The last time before the step and the first after it, ns.
    names
        The channels that show the step.
    steady_names
        The channels of steady rate whose times go on without a step at this place.
    """

    position: int
    size_ns: int
    before_ns: int
    after_ns: int
    names: tuple[str, ...]
    steady_names: tuple[str, ...]


def sampling_interval(times_ns: TimeArray) -> tuple[float, float]:
    """Return the median interval of successive times and the spread of the intervals, ns.

    Parameters
    ----------
    times_ns
        (n,) times in the order of the file.

    Returns
    -------
    interval, spread
        The median of the positive intervals, and 1.48 times the median absolute deviation from
        it; zeros where fewer than two intervals are positive.

    Examples
    --------
    >>> sampling_interval(np.array([0, 10, 20, 31, 40, 20, 30]))
    (10.0, 0.0)
    """
    intervals = np.diff(times_ns[: 1 << 16])
    intervals = intervals[intervals > 0]
    if len(intervals) < 2:
        return 0.0, 0.0
    interval = float(np.median(intervals))
    return interval, 1.48 * float(np.median(np.abs(intervals - interval)))


def change_of_level(times_ns: TimeArray, row: int, interval: float) -> float:
    """Return by how much the times from a row on deviate from the continuation of those before.

    The median over a few samples on each side, so that a single late message has no effect.

    Parameters
    ----------
    times_ns
        (n,) times in the order of the file.
    row
        The first row after the supposed step, from 1 to n - 1.
    interval
        The sampling interval, ns.

    Examples
    --------
    >>> float(change_of_level(np.array([0, 10, 20, 30, 5, 15, 25, 35]), 4, 10.0))
    -35.0
    """
    count = min(LEVEL_SAMPLES, row, len(times_ns) - row)
    after = times_ns[row : row + count]
    before = times_ns[row - count : row][::-1]
    return float(np.median(after - before - (2 * np.arange(count) + 1) * interval))


def backward_rows(times_ns: TimeArray) -> list[int]:
    """Return the rows of a channel at which its clock was set back.

    Late messages and MCAP chunks in another order are no steps: sorting gives a steady clock. A
    clock set back gives the same times twice, so that sorted samples are too dense.

    Parameters
    ----------
    times_ns
        (n,) times in the order of the file.

    Examples
    --------
    >>> clock = 10 * np.arange(40)
    >>> backward_rows(np.where(clock < 200, clock, clock - 73))
    [20]
    >>> backward_rows(np.concatenate([clock[:10], clock[20:], clock[10:20]]))
    []
    """
    rows, interval = falling_rows(times_ns)
    return _rows_with_repeated_times(times_ns, rows, interval)


def earlier_rows(times_ns: TimeArray) -> list[int]:
    """Return the rows after which all times are earlier than before, with a gap between them.

    So is a clock that was set back by more than it had run; parts of a log in another order
    have no gap between them when they are sorted, except where samples are missing.

    Parameters
    ----------
    times_ns
        (n,) times in the order of the file.

    Examples
    --------
    >>> clock = 10 * np.arange(40)
    >>> earlier_rows(np.where(clock < 200, clock, clock - 4000))
    [20]
    >>> earlier_rows(np.concatenate([clock[20:], clock[:20]]))
    []
    """
    rows, interval = falling_rows(times_ns)
    if not rows:
        return []
    _, spread = sampling_interval(times_ns)
    limit = max(MIN_GAP_INTERVALS * interval, 8.0 * spread)
    ordered = np.sort(times_ns)
    found = []
    for row, before, after in _parts_at(times_ns, rows):
        last = int(after.max())
        following = int(np.searchsorted(ordered, last, "right"))
        if last < before.min() and ordered[following] - last > limit:
            found.append(row)
    return found


def steps_back(channels: Sequence[ChannelTimes]) -> list[ClockStep]:
    """Return the steps back of the clock that the channels have in common.

    Where the times before and after a step do not overlap, it must be in all channels of steady
    rate: else a part of the file is in another order, and samples are missing.

    Parameters
    ----------
    channels
        The channels, with their times in the order of the file.
    """
    repeated = [backward_rows(c.times_ns) for c in channels]
    earlier = [earlier_rows(c.times_ns) for c in channels]
    steps = common_steps(
        channels, [sorted({*a, *b}) for a, b in zip(repeated, earlier, strict=True)]
    )
    return [step for step in steps if _is_confirmed(step, channels, repeated)]


def common_steps(channels: Sequence[ChannelTimes], rows: Sequence[list[int]]) -> list[ClockStep]:
    """Join the steps of single channels that lie at one place of the file.

    Parameters
    ----------
    channels
        The channels, with their times in the order of the file.
    rows
        The first rows after the steps of each channel.

    Returns
    -------
    steps
        In the order of the file. The size is the median over the channels.
    """
    spans = sorted(
        (int(channel.positions[row - 1]), int(channel.positions[row]))
        for channel, steps in zip(channels, rows, strict=True)
        for row in steps
    )
    places: list[tuple[int, int]] = []
    for first, last in spans:
        if places and first < places[-1][1]:
            places[-1] = max(first, places[-1][0]), min(last, places[-1][1])
        else:
            places.append((first, last))
    return [_step_at(channels, rows, last) for _, last in places]


def is_steady(channel: ChannelTimes) -> bool:
    """Whether a channel is sampled at a steady rate, so that its intervals show a step."""
    interval, spread = sampling_interval(channel.times_ns)
    return len(channel.times_ns) > LEVEL_SAMPLES and spread < MAX_INTERVAL_SPREAD * interval


def continued_times(channel: ChannelTimes, steps: Sequence[ClockStep]) -> TimeArray:
    """Return the times of a channel with the steps taken out.

    Parameters
    ----------
    channel
        The times in the order of the file.
    steps
        The steps of their clock.

    Returns
    -------
    times_ns
        (n,) times, ns: those before the first step are unchanged.
    """
    times = channel.times_ns.copy()
    for step in steps:
        times[np.searchsorted(channel.positions, step.position) :] -= step.size_ns
    return times


def falling_rows(times: TimeArray) -> tuple[list[int], float]:
    """Return the rows at which the level of the times falls, and the sampling interval."""
    interval, spread = sampling_interval(times)
    if interval == 0.0:
        return [], 0.0
    limit = max(MAX_DEVIATION_INTERVALS * interval, 4.0 * spread)
    rows = np.flatnonzero(np.diff(times) < 0) + 1
    if len(rows) > len(times) // LEVEL_SAMPLES:
        return [], interval  # network jitter or parallel writers, all over the log
    rows = rows[np.minimum(rows, len(times) - rows) >= MIN_SAMPLES_BESIDE_STEP]
    levels = {int(row): change_of_level(times, int(row), interval) for row in rows}
    return _separate_rows({row: level for row, level in levels.items() if level < -limit}), interval


def _parts_at(times: TimeArray, rows: list[int]) -> Iterator[tuple[int, TimeArray, TimeArray]]:
    """Yield each row with the times from the row before it, and up to the row after it."""
    ends = [0, *rows, len(times)]
    for number, row in enumerate(rows):
        yield row, times[ends[number] : row], times[row : ends[number + 2]]


def _is_confirmed(
    step: ClockStep, channels: Sequence[ChannelTimes], repeated: Sequence[list[int]]
) -> bool:
    """Whether times repeat after a step, or all channels of steady rate have it."""
    for channel, rows in zip(channels, repeated, strict=True):
        if int(np.searchsorted(channel.positions, step.position)) in rows:
            return True
    return not any(
        is_steady(channel) and _has_both_sides(channel, step.position)
        for channel in channels
        if channel.name not in (*step.names, *step.steady_names)
    )


def _has_both_sides(channel: ChannelTimes, position: int) -> bool:
    row = int(np.searchsorted(channel.positions, position))
    return min(row, len(channel.times_ns) - row) >= MIN_SAMPLES_BESIDE_STEP


def _separate_rows(levels: dict[int, float]) -> list[int]:
    """Return of rows close to each other the one with the greatest step."""
    rows: list[int] = []
    for row in sorted(levels):
        if rows and row - rows[-1] < LEVEL_SAMPLES:
            if levels[row] < levels[rows[-1]]:
                rows[-1] = row
        else:
            rows.append(row)
    return rows


def _rows_with_repeated_times(times: TimeArray, rows: list[int], interval: float) -> list[int]:
    """Return the rows after which times of before occur a second time."""
    if not rows:
        return []
    ordered = np.sort(times)
    spans = [
        (max(int(times[row]), int(before.min())), min(int(times[row - 1]), int(after.max())))
        for row, before, after in _parts_at(times, rows)
    ]
    outside = np.ones(len(ordered) - 1, bool)
    for first, last in spans:
        outside &= (ordered[1:] <= first) | (ordered[:-1] >= last)
    ordered_interval = float(np.median(np.diff(ordered)))
    if outside.sum() >= max(LEVEL_SAMPLES, len(ordered) // 20):
        interval = float(np.median(np.diff(ordered)[outside]))
    elif _is_even(np.diff(ordered), ordered_interval):
        interval = ordered_interval
    if interval <= 0:
        return []  # most samples have one time: nothing to compare with
    repeated = []
    for row, (first, last) in zip(rows, spans, strict=True):
        count = np.searchsorted(ordered, last, "right") - np.searchsorted(ordered, first)
        expected = (last - first) / interval + 1
        if times[row - 1] - times[row] < 3 * interval or (
            last - first >= 3 * interval and count - expected > 0.4 * expected
        ):
            repeated.append(row)
    return repeated


def _is_even(intervals: TimeArray, typical: float) -> bool:
    return bool(np.mean(np.abs(intervals - typical) < 0.4 * typical) > 0.9)


def _step_at(
    channels: Sequence[ChannelTimes], rows: Sequence[list[int]], position: int
) -> ClockStep:
    """Measure the step at a place of the file in all channels."""
    sizes, names, last, first = [], [], [], []
    for channel, steps in zip(channels, rows, strict=True):
        row = int(np.searchsorted(channel.positions, position))
        if not 0 < row < len(channel.times_ns):
            continue
        last.append(int(channel.times_ns[row - 1]))
        first.append(int(channel.times_ns[row]))
        if row in steps:
            interval, _ = sampling_interval(channel.times_ns)
            sizes.append(change_of_level(channel.times_ns, row, interval))
            names.append(channel.name)
    size = float(np.median(sizes))
    steady_names = [
        channel.name
        for channel in channels
        if channel.name not in names and _goes_on(channel, position, size)
    ]
    return ClockStep(
        position, round(size), max(last), min(first), tuple(names), tuple(steady_names)
    )


def _goes_on(channel: ChannelTimes, position: int, size: float) -> bool:
    """Whether a channel of steady rate contradicts a step at a place of the file."""
    row = int(np.searchsorted(channel.positions, position))
    if not is_steady(channel) or not 0 < row < len(channel.times_ns):
        return False
    interval, _ = sampling_interval(channel.times_ns)
    level = change_of_level(channel.times_ns, row, interval)
    return abs(size) > interval and abs(level) < 0.5 * abs(size)
