"""Uniform clock of a resampled log: its start, time step and end."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats, is_rudder_order
from shiplog.errors import LogError, UsageError
from shiplog.types import ChunkedLog
from shiplog.units import CATALOGUE

# A clock is rejected as an error in the log's times if it exceeds both of these.
MAX_INSTANTS = 20_000_000
MAX_INSTANTS_PER_SAMPLE = 20  # of the first channel


@dataclass(frozen=True, eq=False)
class Clock:
    """A uniform clock, and the channels to be placed on it.

    Attributes
    ----------
    start_ns
        The first instant, ns since 1970-01-01 UTC.
    dt_secs
        The time step, s.
    count
        The number of instants.
    channels
        The statistics of the channels, by name.
    """

    start_ns: int
    dt_secs: float
    count: int
    channels: Mapping[str, ChannelStats]

    @property
    def end_ns(self) -> int:
        """The last instant, ns since 1970-01-01 UTC."""
        return self.start_ns + round((self.count - 1) * self.dt_secs * 1e9)


def choose_clock(
    log: ChunkedLog,
    stats: LogStats,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Clock:
    """Choose the clock for a log whose channel statistics are known.

    The clock starts at a sample of the first channel, as soon as all channels have a valid sample.
    It ends with the commanded channels (rudder, rpm), or, if there are none, with the last of the
    others. Channels that are held between their samples do not end it.

    Parameters
    ----------
    log
        The log; it is read as far as the first sample of the clock.
    stats
        Its statistics, from `compute_log_stats`.
    dt_secs
        The time step, s. By default the median interval of the first channel that is not held.
    channels
        The names of the channels to resample. By default all scalar channels of the log.
    optional
        Further channels, which do not affect the clock. Those that the log lacks are omitted.

    Raises
    ------
    LogError
        A channel is missing or has too few samples; the channels have no time in common;
        or the times span so long that they must be wrong.
    UsageError
        The time step is not positive, or a channel has several components.
    """
    names = channels or tuple(c.name for c in stats if not c.fields)
    if not names:
        raise LogError(f"no channel to resample; choose a log that has samples: {log.name}")
    used = {name: stats[name] for name in names}
    for name, channel in used.items():
        _require_samples(log, name, channel)
    first = next((channel for channel in used.values() if not channel.hold), used[names[0]])
    if dt_secs is None and first.interval_secs == 0:
        raise LogError(
            f"no channel has samples at two instants, from which a time step could be taken; "
            f"choose a longer log, or give dt_secs: {log.name}"
        )
    dt = first.interval_secs if dt_secs is None else dt_secs
    if not 0 < dt < inf:
        raise UsageError(f"the time step must be positive, got {dt} s")
    start_ns, end_ns = _common_span(log, list(used.values()), first)
    steps = (end_ns - start_ns) * 1e-9 / dt + 1e-6
    if steps > MAX_INSTANTS and steps > MAX_INSTANTS_PER_SAMPLE * first.valid:
        raise LogError(
            f"the times span {(end_ns - start_ns) / 8.64e13:.4g} days, too many steps of {dt:g} s; "
            f"correct the clock of one of {', '.join(names)}: {log.name}"
        )
    present = {
        name: stats[name]
        for name in optional
        if name in stats and (stats[name].valid > 1 or stats[name].hold)
    }
    return Clock(start_ns, dt, int(steps) + 1, used | present)


def with_steering_gear(clock: Clock, rate: float) -> Clock:
    """Return the clock with a held order of the rudder followed at the steering gear's rate.

    Other rudder channels stay as they are: the angle was measured, or is interpolated.

    Parameters
    ----------
    clock
        The clock, from `choose_clock`.
    rate
        Rate of the steering gear, rad/s.
    """
    rudder = clock.channels.get("rudder")
    if rudder is None or rudder.hold is None or not is_rudder_order(rudder):
        return clock
    followed = replace(rudder, hold=replace(rudder.hold, max_rate=rate))
    return replace(clock, channels={**clock.channels, "rudder": followed})


def _require_samples(log: ChunkedLog, name: str, channel: ChannelStats) -> None:
    if channel.fields:
        raise UsageError(
            f"channel {name!r} has components ({', '.join(channel.fields)}) and cannot be "
            f"resampled; name channels with one value per sample: {log.name}"
        )
    if channel.valid < 1 and channel.impossible.count:
        raise LogError(
            f"channel {name!r} has no possible value, {channel.impossible.count} of "
            f"{channel.samples} samples are impossible, up to {channel.impossible.extent:.4g} "
            f"{channel.unit}; correct its unit in the layout, or choose another log: {log.name}"
        )
    if channel.valid < 1 or not (channel.hold or channel.interval_secs > 0):
        content = {0: "no measured value", 1: "one sample"}.get(
            channel.valid, "all its samples at one instant"
        )
        raise LogError(
            f"channel {name!r} has {content}, and a replay needs it over time; "
            f"check the recorder or choose another log: {log.name}"
        )


def _common_span(
    log: ChunkedLog, channels: list[ChannelStats], first: ChannelStats
) -> tuple[int, int]:
    """Return the start and the end of the clock as `choose_clock` defines them, ns.

    It starts at a sample of the channel `first`.
    """
    all_valid_ns = max(channel.valid_span_ns[0] for channel in channels)
    commanded: list[int] = []
    measured: list[int] = []
    sampled = [channel for channel in channels if not channel.hold]
    for channel in sampled or channels:
        is_commanded = channel.name in CATALOGUE and CATALOGUE[channel.name].commanded
        (commanded if is_commanded else measured).append(channel.valid_span_ns[1])
    end = min([max(measured or commanded), *commanded])
    start = _first_sample(log, first, all_valid_ns)
    if end <= start:
        names = ", ".join(c.name for c in channels)
        raise LogError(
            f"{names} were never recorded at the same time; choose a log where they are: {log.name}"
        )
    return start, end


def _first_sample(log: ChunkedLog, channel: ChannelStats, earliest_ns: int) -> int:
    """Return the time of the first valid sample from `earliest_ns` on; that itself if none is."""
    for chunk in log.chunks():
        part = channel.select(chunk)
        if part is not None:
            valid = part.measured_ns[np.isfinite(part.values)]
            if np.any(valid >= earliest_ns):
                return int(valid[valid >= earliest_ns].min())
    return earliest_ns
