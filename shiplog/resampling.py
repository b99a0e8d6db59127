"""Many clocks to one: a trial on a uniform grid, with nothing invented.

What the ship does (yaw rate, speed) is put on the nearest instant of the grid, several samples
averaged; where nothing was measured there is NaN. What is commanded (rudder, rpm) acts between
its samples too and is interpolated, but not across a gap.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import floor, inf

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.interpolate import valid_samples
from shiplog.checks.log_stats import compute_log_stats

from .errors import LogError, UsageError
from .types import Channel, FloatArray, Log, Signals, concatenate_signals, is_sorted
from .units import CATALOGUE

MAX_SAMPLES = 20_000_000  # of a grid that hardly anything stands on: beyond it the times are wrong
SPARSEST = 20  # instants of such a grid to a sample
MOST_INSTANTS = 1 << 18  # of a chunk: a silence of days comes in several


@dataclass(frozen=True, eq=False)
class Clock:
    """A uniform grid, and the channels that are to stand on it."""

    start_ns: int
    dt_secs: float
    count: int
    channels: Mapping[str, ChannelStats]

    @property
    def end_ns(self) -> int:
        """The last instant."""
        return self.start_ns + round((self.count - 1) * self.dt_secs * 1e9)


def resample(
    log: Log,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Signals:
    """Put a log's channels on one clock.

    `dt_secs` defaults to the usual period of the first of the channels, on whose samples the
    clock falls. It starts where all of them are known, and ends with the commanded ones, or else
    with the last of the others. `optional` channels are placed on it where the log has them.

    Raises `LogError` where a channel is missing or has fewer than two samples, or where the
    channels have no time in common.
    """
    return concatenate_signals(
        resample_chunks(
            log.chunks(), choose_clock(log, compute_log_stats(log), dt_secs, channels, optional)
        )
    )


def choose_clock(
    log: Log,
    found: LogStats,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Clock:
    """The clock for a log that was surveyed; all else as `resample` has it."""
    names = channels or tuple(c.name for c in found if not c.fields)
    if not names:
        raise LogError(f"no channel to resample; choose a log that has samples: {log.name}")
    used = {name: found[name] for name in names}
    for name, channel in used.items():
        _require_samples(log, name, channel)
    leader = used[names[0]]
    dt = leader.interval_secs if dt_secs is None else dt_secs
    if not 0 < dt < inf:
        raise UsageError(f"the time step must be positive, got {dt} s")
    start_ns, end_ns = _common_span(log, list(used.values()))
    steps = (end_ns - start_ns) * 1e-9 / dt + 1e-6
    if steps > MAX_SAMPLES and steps > SPARSEST * leader.valid:
        raise LogError(
            f"its times span {(end_ns - start_ns) / 8.64e13:.4g} days, too many steps of {dt:g} s; "
            f"correct the clock of one of {', '.join(names)}: {log.name}"
        )
    also = {name: found[name] for name in optional if name in found and found[name].valid > 1}
    return Clock(start_ns, dt, int(steps) + 1, used | also)


def resample_chunks(chunks: Iterable[tuple[Channel, ...]], clock: Clock) -> Iterator[Signals]:
    """A log that comes in chunks on the clock, in consecutive chunks from first instant to last.

    The chunks that come must follow one another in the order of reception.
    """
    placing = {name: _placing(channel, clock) for name, channel in clock.channels.items()}
    done, received_ns = 0, np.iinfo(np.int64).min
    for chunk in chunks:
        received_ns = max([received_ns, *(int(c.received_ns.max()) for c in chunk if len(c))])
        for place in placing.values():
            place.add(chunk)
        ready = min(place.ready(received_ns) for place in placing.values())
        while done < ready:
            end = min(done + MOST_INSTANTS, ready)
            values = {name: place.placed(done, end) for name, place in placing.items()}
            yield Signals(clock.start_ns, clock.dt_secs, values, done)
            done = end


def _require_samples(log: Log, name: str, channel: ChannelStats) -> None:
    if channel.fields:
        raise UsageError(
            f"channel {name!r} has components ({', '.join(channel.fields)}), "
            f"and a clock takes one value a sample; name others: {log.name}"
        )
    if channel.valid < 2 or channel.interval_secs == 0:
        has = {0: "no measured value", 1: "one sample"}.get(
            channel.valid, "all its samples at one instant"
        )
        raise LogError(
            f"channel {name!r} has {has}, and a replay needs it over time; "
            f"check the recorder or choose another log: {log.name}"
        )


def _common_span(log: Log, channels: list[ChannelStats]) -> tuple[int, int]:
    """From where all are known, on a sample of the first, to where the inputs cease."""
    begun = max(channel.valid_span_ns[0] for channel in channels)
    inputs: list[int] = []
    others: list[int] = []
    for channel in channels:
        commanded = channel.name in CATALOGUE and CATALOGUE[channel.name].commanded
        (inputs if commanded else others).append(channel.valid_span_ns[1])
    end = min([max(others or inputs), *inputs])
    start = _first_sample(log, channels[0], begun)
    if end <= start:
        names = ", ".join(c.name for c in channels)
        raise LogError(f"{names} were never recorded at the same time: {log.name}")
    return start, end


def _first_sample(log: Log, leader: ChannelStats, begun: int) -> int:
    """The first instant from `begun` on at which something was measured; `begun` if never."""
    for chunk in log.chunks():
        channel = leader.select(chunk)
        if channel is not None:
            known = channel.measured_ns[np.isfinite(channel.values)]
            if np.any(known >= begun):
                return int(known[known >= begun].min())
    return begun


def _placing(channel: ChannelStats, clock: Clock) -> "_Binning | _Interpolation":
    kind = CATALOGUE.get(channel.name)
    between = kind is not None and (kind.commanded or kind.circular)
    return (_Interpolation if between else _Binning)(channel, clock)


class _Placing:
    """Known samples of a channel on their way to the clock."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        self._channel, self._clock = channel, clock
        self._times, self._values = np.zeros(0), np.zeros(0)  # that are not done with
        self._seen = 0

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Take the next samples."""
        channel = self._channel.select(chunk)
        if channel is not None:
            times, values = valid_samples(channel, self._clock.start_ns)
            if not is_sorted(times):
                order = np.argsort(times, kind="stable")
                times, values = times[order], values[order]
            self._seen += len(times)
            self._times = np.concatenate((self._times, times))
            self._values = np.concatenate((self._values, self._prepared(values)))
            # of what was before the clock's first instant the last is enough
            early = int(np.searchsorted(self._times, -self._clock.dt_secs))
            self._drop(max(early - 1, 0))

    def ready(self, received_ns: int) -> int:
        """Before which instant of the clock no sample can change anything any more.

        All that was received before `received_ns` was added.
        """
        if self._seen == self._channel.valid:
            return self._clock.count
        last = float(self._times[-1]) if len(self._times) else -inf
        # of a channel that is silent: what is yet to come was measured after this
        silent = (received_ns - self._channel.max_delay_ns - self._clock.start_ns) * 1e-9
        until = silent if silent - last > self._channel.gap_threshold_secs else last
        return min(max(floor(until / self._clock.dt_secs), 0), self._clock.count)

    def _prepared(self, values: FloatArray) -> FloatArray:
        return values

    def _drop(self, count: int) -> None:
        self._times, self._values = self._times[count:], self._values[count:]


class _Binning(_Placing):
    """The mean of the samples nearest each instant; NaN where there is none."""

    def placed(self, first: int, end: int) -> FloatArray:
        """The values at the instants from `first` to before `end`, which must be ready."""
        cell = np.floor(self._times / self._clock.dt_secs + 0.5).astype(np.int64)
        before, upto = np.searchsorted(cell, (first, end))
        cell, values = cell[before:upto] - first, self._values[before:upto]
        self._drop(int(upto))
        count = np.bincount(cell, minlength=end - first)
        total = np.bincount(cell, weights=values, minlength=end - first)
        with np.errstate(invalid="ignore"):
            mean: FloatArray = total / count
        return mean


class _Interpolation(_Placing):
    """Linear between samples, NaN inside a gap and beyond the ends."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        super().__init__(channel, clock)
        self._last, self._turns = 0.0, 0.0  # of angles: the last, and the full turns so far

    def placed(self, first: int, end: int) -> FloatArray:
        """The values at the instants from `first` to before `end`, which must be ready."""
        dt, times = self._clock.dt_secs, self._times
        if not len(times):
            return np.full(end - first, np.nan)
        grid = np.arange(first, end) * dt
        placed = np.interp(grid, times, self._values)
        after = np.searchsorted(times, grid - 1e-6 * dt)
        inside = (after > 0) & (after < len(times))
        left, right = (
            times[np.clip(after - 1, 0, None)],
            times[np.clip(after, None, len(times) - 1)],
        )
        on_sample = np.abs(right - grid) <= 1e-6 * dt
        known = on_sample | (inside & (right - left <= self._channel.gap_threshold_secs))
        self._drop(max(int(after[-1]) - 1, 0))
        return np.where(known, placed, np.nan)

    def _prepared(self, values: FloatArray) -> FloatArray:
        """The values, angles without their jumps by a full turn."""
        kind = CATALOGUE.get(self._channel.name)
        if kind is None or not kind.circular or not len(values):
            return values
        first = values[0] if self._seen == len(values) else self._last
        steps = np.diff(values, prepend=first)
        turns = self._turns + np.cumsum(np.round(steps / (2 * np.pi)))
        self._last, self._turns = float(values[-1]), float(turns[-1])
        return values - 2 * np.pi * turns
