"""Placement of a log's samples on a uniform clock, chunk by chunk."""

from collections.abc import Iterable, Iterator

import numpy as np

from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Channel, Log, Signals, concatenate_signals

from .channel_resamplers import channel_resampler
from .clock import Clock, choose_clock

MAX_CHUNK_INSTANTS = 1 << 18  # so that days without samples do not make one huge chunk


def resample(
    log: Log,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Signals:
    """Resample the channels of a log to one uniform clock.

    What the ship does (yaw rate, speed) is the mean of the samples within half a step of each
    instant, NaN where there is none. What is commanded (rudder, rpm) and angles are interpolated
    linearly, with NaN inside a gap; angles are unwrapped. A channel that is written only when its
    value changes, or whose metadata states ``interpolation = "hold"``, is held at its last value.

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
    resamplers = {
        name: channel_resampler(channel, clock) for name, channel in clock.channels.items()
    }
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
