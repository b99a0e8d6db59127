"""Resamplers of single channels: means about instants, linear interpolation, and hold."""

from math import floor, inf
from typing import Protocol

import numpy as np

from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.interpolate import mean_per_instant, valid_samples
from shiplog.types import Channel, FloatArray, is_sorted
from shiplog.units import CATALOGUE

from .clock import Clock

INSTANT_TOLERANCE = 1e-6  # of a time step, within which a sample is at an instant


class ChannelResampler(Protocol):
    """Places the samples of one channel, which come in chunks, on a clock."""

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the channel's samples in the next chunk of the log."""

    def ready(self, received_ns: int) -> int:
        """Return the number of instants that no further sample can change."""

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""


def channel_resampler(channel: ChannelStats, clock: Clock) -> ChannelResampler:
    """Return the resampler of a channel.

    Parameters
    ----------
    channel
        The statistics of the channel, which state whether it is held.
    clock
        The clock.
    """
    kind = CATALOGUE.get(channel.name)
    if channel.hold:
        steps = channel.hold.max_rate == inf
        return (_HoldResampler if steps else _RateLimitedResampler)(channel, clock)
    interpolated = kind is not None and (kind.commanded or kind.circular)
    if interpolated or channel.interpolation == "linear":
        return _LinearResampler(channel, clock)
    return _MeanResampler(channel, clock)


class _Samples:
    """The valid samples of one channel that are still needed for instants to come."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        self._channel, self._clock = channel, clock
        self._times: FloatArray = np.zeros(0)  # s since the clock's start
        self._values: FloatArray = np.zeros(0)
        self._seen = 0  # valid samples so far
        self._newest = -inf  # time of the last of them

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the channel's samples in the next chunk of the log."""
        channel = self._channel.select(chunk)
        if channel is not None:
            times, values = valid_samples(channel, self._clock.start_ns)
            if not is_sorted(times):
                order = np.argsort(times, kind="stable")
                times, values = times[order], values[order]
            self._seen += len(times)
            self._newest = float(times[-1]) if len(times) else self._newest
            self._append(times, values)
            # of the samples before the first instant, those of the last time are enough
            early = int(np.searchsorted(self._times, -self._clock.dt_secs))
            if early > 1:
                self._drop(int(np.searchsorted(self._times, self._times[early - 1])))

    def ready(self, received_ns: int) -> int:
        """Return the number of instants that no further sample can change.

        Parameters
        ----------
        received_ns
            All samples received before this time have been added.
        """
        if self._seen == self._channel.valid:
            return self._clock.count
        # in a gap of the channel, further samples are measured after this time
        silent = (received_ns - self._channel.max_delay_ns - self._clock.start_ns) * 1e-9
        in_gap = silent - self._newest > self._channel.gap_threshold_secs
        until = silent if in_gap else self._complete_until()
        return min(floor(max(until, 0.0) / self._clock.dt_secs), self._clock.count)

    def _append(self, times: FloatArray, values: FloatArray) -> None:
        self._times = np.concatenate((self._times, times))
        self._values = np.concatenate((self._values, values))

    def _complete_until(self) -> float:
        """Return the time up to which no further sample can change the signal, s."""
        return self._newest

    def _drop(self, count: int) -> None:
        self._times, self._values = self._times[count:], self._values[count:]


class _MeanResampler(_Samples):
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


class _HoldResampler(_Samples):
    """Zero-order hold: the mean of the held signal over a step centred at each instant.

    So a signal that is interpolated linearly between the instants has each step at the time of its
    sample on average, to a fraction of the time step. Before the first sample there is NaN; the
    last one is held to the end of the clock.
    """

    def ready(self, received_ns: int) -> int:
        """Return the number of instants that no further sample can change."""
        if self._seen == self._channel.valid:
            return self._clock.count
        silent = (received_ns - self._channel.max_delay_ns - self._clock.start_ns) * 1e-9
        until = max(silent, self._newest)
        return min(floor(max(until, 0.0) / self._clock.dt_secs), self._clock.count)

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""
        if not len(self._times):
            return np.full(end - first, np.nan)
        at = self._times / self._clock.dt_secs
        nearest = np.floor(at + 0.5).astype(np.int64)
        grid = np.arange(first, end)
        before = np.searchsorted(nearest, grid) - 1  # the last sample before each instant's step
        base = self._values[np.clip(before, 0, None)]
        within = slice(*np.searchsorted(nearest, (first, end)))
        # each sample counts for the rest of its step, from its own time on
        changes = np.diff(self._values, prepend=self._values[0])[within]
        weighted = changes * (nearest[within] + 0.5 - at[within])
        mean: FloatArray = base + np.bincount(
            nearest[within] - first, weighted, minlength=end - first
        )
        is_known = grid >= at[0] - INSTANT_TOLERANCE
        self._drop(max(int(within.stop) - 1, 0))
        return np.where(is_known, mean, np.nan)


class _RateLimitedResampler(_HoldResampler):
    """Orders followed at a constant rate, as by a steering gear (SOLAS II-1, regulation 29).

    The angle is taken to be the first order when that is given.
    """

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        super().__init__(channel, clock)
        self._rate = channel.hold.max_rate if channel.hold else inf
        self._angles: FloatArray = np.zeros(0)  # the angle when each order was given

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""
        if not len(self._times):
            return np.full(end - first, np.nan)
        grid = np.arange(first, end) * self._clock.dt_secs
        tolerance = INSTANT_TOLERANCE * self._clock.dt_secs
        last = np.searchsorted(self._times, grid + tolerance, side="right") - 1
        k = np.clip(last, 0, None)
        turned = self._turned(grid - self._times[k], self._values[k] - self._angles[k])
        angle: FloatArray = np.where(last >= 0, self._angles[k] + turned, np.nan)
        self._drop(int(k[-1]))
        return angle

    def _turned(self, secs: FloatArray, distance: FloatArray) -> FloatArray:
        """Return the angle turned since an order that is a distance away."""
        limit = self._rate * np.maximum(secs, 0.0)
        return np.clip(distance, -limit, limit)

    def _append(self, times: FloatArray, values: FloatArray) -> None:
        super()._append(times, values)
        angles = self._angles.tolist()
        for k in range(len(angles), len(self._times)):
            angle = self._values[k]
            if k:
                limit = self._rate * (self._times[k] - self._times[k - 1])
                distance = self._values[k - 1] - angles[-1]
                angle = angles[-1] + min(max(distance, -limit), limit)
            angles.append(angle)
        self._angles = np.array(angles, dtype=np.float64)

    def _drop(self, count: int) -> None:
        super()._drop(count)
        self._angles = self._angles[count:]


class _LinearResampler(_Samples):
    """Linear interpolation between samples; NaN inside a gap and beyond the ends."""

    def __init__(self, channel: ChannelStats, clock: Clock) -> None:
        super().__init__(channel, clock)
        self._last_angle, self._turns = 0.0, 0.0  # of a circular channel, turns so far

    def take(self, first: int, end: int) -> FloatArray:
        """Return the values at the instants `first` to `end` - 1, which must be ready."""
        dt, times, values = self._clock.dt_secs, self._times, self._values
        if not len(times):
            return np.full(end - first, np.nan)
        if self._channel.duplicate_times:
            times, values = mean_per_instant(times, values)
        grid = np.arange(first, end) * dt
        interpolated = np.interp(grid, times, values)
        after = np.searchsorted(times, grid - INSTANT_TOLERANCE * dt)
        inside = (after > 0) & (after < len(times))
        left = times[np.clip(after - 1, 0, None)]
        right = times[np.clip(after, None, len(times) - 1)]
        on_sample = np.abs(right - grid) <= INSTANT_TOLERANCE * dt
        is_valid = on_sample | (inside & (right - left <= self._channel.gap_threshold_secs))
        self._drop(int(np.searchsorted(self._times, times[max(int(after[-1]) - 1, 0)])))
        return np.where(is_valid, interpolated, np.nan)

    def _append(self, times: FloatArray, values: FloatArray) -> None:
        """Unwrap angles, so that they do not jump by a full turn, and append the samples."""
        kind = CATALOGUE.get(self._channel.name)
        if kind is not None and kind.circular and len(values):
            before = values[0] if self._seen == len(values) else self._last_angle
            steps = np.diff(values, prepend=before)
            turns = self._turns + np.cumsum(np.round(steps / (2 * np.pi)))
            self._last_angle, self._turns = float(values[-1]), float(turns[-1])
            values = values - 2 * np.pi * turns
        super()._append(times, values)

    def _complete_until(self) -> float:
        """Return the last time, or the one before where further samples may have the last time."""
        if not self._channel.duplicate_times:
            return self._newest
        before = int(np.searchsorted(self._times, self._newest)) - 1
        return float(self._times[before]) if before >= 0 else -inf
