"""Heading and position as channels of single values, which the filter takes as measurements.

The heading that is interpolated on the clock repeats each sample at several instants. These
channels have one value for each sample, at the instant next to it. Up to half a step lies between
the two, in which a turning ship changes its heading by more than a compass errs: a heading is
extrapolated to the instant.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Protocol

import numpy as np

from analysis.filters.noise_model import FURTHER_OUTPUTS
from shiplog import Channel
from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.geodesy import LocalFrame, positions_of
from shiplog.resampling import Clock
from shiplog.types import FloatArray

COMPASS, NORTH, EAST = FURTHER_OUTPUTS
MIN_SLOPE_SECS, MAX_SLOPE_SECS = 0.9, 5.0  # over which a heading's rate of change is taken


def with_measured_channels(clock: Clock, log_stats: LogStats) -> Clock:
    """Return the clock with the channels that heading and position give, as far as there are any.

    Positions are of use with a heading only.
    """
    channels = dict(clock.channels)
    sources = {"heading": (COMPASS,), "position": (NORTH, EAST)}
    for source, names in sources.items():
        if source not in log_stats or log_stats[source].valid < 2:
            break
        for name in names:
            channels[name] = _single(log_stats[source], name)
    return replace(clock, channels=channels)


def _single(channel: ChannelStats, name: str) -> ChannelStats:
    """Return the statistics of a channel of single values in place of another's."""
    unit = channel.unit if name == COMPASS else "m"
    return replace(
        channel, name=name, unit=unit, fields=(), fixes=None, strict=False, hold=None,
        interpolation="",
    )  # fmt: skip


class RawChunks(Protocol):
    """A log, as far as its chunks of raw channels are read."""

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Yield the consecutive chunks."""
        ...


class MeasuredChannels:
    """A log with the channels that its heading and its position give, if the clock has them.

    Parameters
    ----------
    log
        The log.
    clock
        The clock of the replay.
    log_stats
        The statistics of the log's channels.
    """

    def __init__(self, log: RawChunks, clock: Clock, log_stats: LogStats) -> None:
        self._log, self._clock = log, clock
        self._heading = log_stats["heading"] if COMPASS in clock.channels else None
        self._position = log_stats["position"] if NORTH in clock.channels else None

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Yield the chunks of the log, with the channels added."""
        self._last = np.zeros(0), np.zeros(0)  # times, s, and values of the last headings
        self._frame: LocalFrame | None = None  # its datum is the first position
        for chunk in self._log.chunks():
            heading = self._heading.select(chunk) if self._heading else None
            position = self._position.select(chunk) if self._position else None
            added = [self._compass(heading)] if heading is not None else []
            if position is not None:
                added += self._coordinates(position)
            yield (*chunk, *added)

    def _compass(self, heading: Channel) -> Channel:
        """Return the heading at the clock's instants, without jumps by full turns."""
        values = heading.values.copy()
        known = np.flatnonzero(np.isfinite(values))
        secs = (heading.measured_ns[known] - self._clock.start_ns) * 1e-9
        before, dt = len(self._last[0]), self._clock.dt_secs
        times = np.concatenate((self._last[0], secs))
        angles = np.unwrap(np.concatenate((self._last[1], values[known])))
        to_instant = np.floor(secs / dt + 0.5) * dt - secs
        values[known] = angles[before:] + _slopes(times, angles)[before:] * to_instant
        if len(times):
            kept = np.searchsorted(times, times[-1] - MAX_SLOPE_SECS)
            self._last = times[kept:], angles[kept:]
        return replace(heading, name=COMPASS, values=values)

    def _coordinates(self, position: Channel) -> list[Channel]:
        """Return north and east of the first position."""
        positions = positions_of(position.fields, position.values)
        self._frame = self._frame or LocalFrame.at_first(positions)
        if self._frame is None:
            return []
        local = self._frame.to_local(positions)
        return [
            replace(position, name=name, unit="m", fields=(), values=values)
            for name, values in ((NORTH, local.north), (EAST, local.east))
        ]


def _slopes(times: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the rate of change up to each sample (n,); 0 where there is none shortly before."""
    before = np.searchsorted(times, times - MIN_SLOPE_SECS, side="right") - 1
    secs = times - times[before]
    near = (before >= 0) & (secs <= MAX_SLOPE_SECS)
    slopes = np.zeros(len(times))
    slopes[near] = (angles - angles[before])[near] / secs[near]
    return slopes
