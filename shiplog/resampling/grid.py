"""Placement of a log's samples on a uniform clock, chunk by chunk."""

from collections.abc import Iterable, Iterator
from math import floor, inf

import numpy as np

from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.interpolate import valid_samples
from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Channel, FloatArray, Log, Signals, concatenate_signals, is_sorted
from shiplog.units import CATALOGUE

from .clock import Clock, choose_clock

MAX_CHUNK_INSTANTS = 1 << 18  # so that days without samples do not make one huge chunk
INSTANT_TOLERANCE = 1e-6  # of a time step, within which a sample is at an instant


def resample(
    log: Log,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Signals:
    """Resample the channels of a log to one uniform clock.

    What the ship does (yaw rate, speed) is the mean of the samples within half a step of each
    instant, NaN where there is none. What is commanded (rudder, rpm) and angles are interpolated
    linearly, with NaN inside a gap; angles are unwrapped.

    Parameters
    ----------
    log
        A log in memory or in its file.
    dt_secs
        The time step, s. By default the median interval of the first channel.
    channels
        The names of the channels, each as in ``log[name]``. By default all scalar channels.
    optional
        Further channels, which do not affect the clock. Those that the log lacks are omitted.

    Returns
    -------
    signals
        From the first sample of the first channel after all `channels` have a valid sample to the
        end of the commanded ones.

    Raises
    ------
    LogError
        A channel is missing or has fewer than two samples; the channels have no time in common;
        or the times span so long that they must be wrong.
    UsageError
        The time step is not positive, or a channel has several components.

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> signals = resample(log, 1.0, ("rudder", "yaw_rate"))
    >>> len(signals), list(signals)
    (601, ['rudder', 'yaw_rate'])
    """
    clock = choose_clock(log, compute_log_stats(log), dt_secs, channels, optional)
    return concatenate_signals(resample_chunks(log.chunks(), clock))


def resample_chunks(chunks: Iterable[tuple[Channel, ...]], clock: Clock) -> Iterator[Signals]:
    """Resample the chunks of a log to a clock.

    Where the chunks are cut does not change the result.

    Parameters
    ----------
    chunks
        The consecutive chunks of a log, in the order of reception.
    clock
        The clock, from `choose_clock`.

    Yields
    ------
    signals
        Consecutive chunks from the first instant of the clock to the last, each as soon as no
        further sample can change it.
    """
    resamplers = {name: _resampler(channel, clock) for name, channel in clock.channels.items()}
    done, received_ns = 0, np.iinfo(np.int64).min
    for chunk in chunks:
        received_ns = max([received_ns, *(int(c.received_ns.max()) for c in chunk if len(c))])
        for resampler in resamplers.values():
            resampler.add(chunk)
        ready = min(resampler.ready(received_ns) for resampler in resamplers.values())
        while done < ready:
            end = min(done + MAX_CHUNK_INSTANTS, ready)
            values = {name: resampler.take(done, end) for name, resampler in resamplers.items()}
            yield Signals(clock.start_ns, clock.dt_secs, values, done)
            done = end


def _resampler(channel: ChannelStats, clock: Clock) -> "_MeanResampler | _LinearResampler":
    kind = CATALOGUE.get(channel.name)
    interpolated = kind is not None and (kind.commanded or kind.circular)
    return (_LinearResampler if interpolated else _MeanResampler)(channel, clock)


class _ChannelResampler:
    """The valid samples of one channel that are still needed for instants to come."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        self._channel, self._clock = channel, clock
        self._times, self._values = np.zeros(0), np.zeros(0)  # s since the clock's start
        self._seen = 0  # valid samples so far

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the channel's samples in the next chunk of the log."""
        channel = self._channel.select(chunk)
        if channel is not None:
            times, values = valid_samples(channel, self._clock.start_ns)
            if not is_sorted(times):
                order = np.argsort(times, kind="stable")
                times, values = times[order], values[order]
            self._seen += len(times)
            self._times = np.concatenate((self._times, times))
            self._values = np.concatenate((self._values, self._prepared(values)))
            # of the samples before the first instant, the last one is enough
            early = int(np.searchsorted(self._times, -self._clock.dt_secs))
            self._drop(max(early - 1, 0))

    def ready(self, received_ns: int) -> int:
        """Return the number of instants that no further sample can change.

        Parameters
        ----------
        received_ns
            All samples received before this time have been added.
        """
        if self._seen == self._channel.valid:
            return self._clock.count
        last = float(self._times[-1]) if len(self._times) else -inf
        # in a gap of the channel, further samples are measured after this time
        silent = (received_ns - self._channel.max_delay_ns - self._clock.start_ns) * 1e-9
        until = silent if silent - last > self._channel.gap_threshold_secs else last
        return min(max(floor(until / self._clock.dt_secs), 0), self._clock.count)

    def _prepared(self, values: FloatArray) -> FloatArray:
        return values

    def _drop(self, count: int) -> None:
        self._times, self._values = self._times[count:], self._values[count:]


class _MeanResampler(_ChannelResampler):
    """The mean of the samples nearest each instant; NaN where there is none."""

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""
        nearest = np.floor(self._times / self._clock.dt_secs + 0.5).astype(np.int64)
        before, upto = np.searchsorted(nearest, (first, end))
        nearest, values = nearest[before:upto] - first, self._values[before:upto]
        self._drop(int(upto))
        count = np.bincount(nearest, minlength=end - first)
        total = np.bincount(nearest, weights=values, minlength=end - first)
        with np.errstate(invalid="ignore"):
            mean: FloatArray = total / count
        return mean


class _LinearResampler(_ChannelResampler):
    """Linear interpolation between samples; NaN inside a gap and beyond the ends."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        super().__init__(channel, clock)
        self._last_angle, self._turns = 0.0, 0.0  # of a circular channel, turns so far

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""
        dt, times = self._clock.dt_secs, self._times
        if not len(times):
            return np.full(end - first, np.nan)
        grid = np.arange(first, end) * dt
        interpolated = np.interp(grid, times, self._values)
        after = np.searchsorted(times, grid - INSTANT_TOLERANCE * dt)
        inside = (after > 0) & (after < len(times))
        left = times[np.clip(after - 1, 0, None)]
        right = times[np.clip(after, None, len(times) - 1)]
        on_sample = np.abs(right - grid) <= INSTANT_TOLERANCE * dt
        is_valid = on_sample | (inside & (right - left <= self._channel.gap_threshold_secs))
        self._drop(max(int(after[-1]) - 1, 0))
        return np.where(is_valid, interpolated, np.nan)

    def _prepared(self, values: FloatArray) -> FloatArray:
        """Unwrap angles, so that they do not jump by a full turn."""
        kind = CATALOGUE.get(self._channel.name)
        if kind is None or not kind.circular or not len(values):
            return values
        before = values[0] if self._seen == len(values) else self._last_angle
        steps = np.diff(values, prepend=before)
        turns = self._turns + np.cumsum(np.round(steps / (2 * np.pi)))
        self._last_angle, self._turns = float(values[-1]), float(turns[-1])
        return values - 2 * np.pi * turns
