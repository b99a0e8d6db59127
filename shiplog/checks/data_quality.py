"""Warnings about the data of a log, in words for the person who can still repeat the trial."""

from collections.abc import Iterable, Iterator

from shiplog.errors import LogError
from shiplog.printable import counted
from shiplog.units import display_conversion

from .channel_stats import ChannelStats, LogStats, is_rudder_order
from .on_change import INTERPOLATION_KEY, INTERPOLATIONS

MAX_IRREGULAR_SHARE = 0.1  # of the intervals
MAX_RUDDER_INTERVAL_SECS = 5.0  # a steering gear moves a rudder by 12 deg in it
MIN_SAMPLES_PER_STAMP = 1.5  # from which the time stamps are taken to be coarse
MIN_TAIL_SECS = 10.0  # held at the end of a log, below which nothing is reported
MIN_ROWS_PER_VALUE = 1.5  # from which a table is taken to have empty cells on purpose


def data_warnings(stats: LogStats, names: tuple[str, ...]) -> list[str]:
    """Report the defects of some channels, a line for each defect that one or several have.

    A warning has what was found, the likely cause and the remedy.

    Parameters
    ----------
    stats
        Statistics of the log.
    names
        Channels to check, as keys of the log: `yaw_rate` or `yaw_rate/gyro`.

    Raises
    ------
    LogError
        A channel is missing, has an infinite value, or has measured times that run backwards:
        nothing can be computed from it.

    Examples
    --------
    >>> import shiplog
    >>> from shiplog.checks.log_stats import compute_log_stats
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> data_warnings(compute_log_stats(log), ("yaw_rate", "rudder"))
    []
    """
    channels = [stats[name] for name in names]
    for channel in channels:
        for text in unusable_causes(channel):
            raise LogError(f"{channel.topic} {text}: {stats.name}")
    return defect_warnings(channels, stats.span_ns[1])


def defect_warnings(channels: Iterable[ChannelStats], end_ns: int) -> list[str]:
    """Report the defects with which channels can still be used, as `data_warnings` does.

    Parameters
    ----------
    channels
        The statistics of the channels.
    end_ns
        End of the log, ns since 1970.
    """
    topics: dict[str, list[str]] = {}  # by the text, which channels from one clock share
    for channel in channels:
        for text in (*_channel_warnings(channel), *hold_warnings(channel, end_ns)):
            topics.setdefault(text, []).append(channel.topic)
    return [f"{', '.join(names)}: {text}" for text, names in topics.items()]


def hold_warnings(channel: ChannelStats, end_ns: int) -> Iterator[str]:
    """Report how a channel is held between its samples, and to the end of the log.

    Parameters
    ----------
    channel
        Statistics of the channel.
    end_ns
        End of the log, ns since 1970.

    Yields
    ------
    str
        Warnings, without the topic.
    """
    if channel.interpolation not in ("", *INTERPOLATIONS):
        yield (
            f"unknown {INTERPOLATION_KEY} {channel.interpolation!r} in its metadata, ignored; "
            f"use one of {', '.join(INTERPOLATIONS)}"
        )
    hold = channel.hold
    if hold:
        after = (end_ns - channel.valid_span_ns[1]) * 1e-9
        at_end = f" and for the last {after:.1f} s of the log" if after > 0 else ""
        samples = counted(channel.valid, "sample")
        if not hold.stated:
            yield (
                f"held at its last value between its {samples}, the longest interval "
                f"{hold.longest_secs:.1f} s{at_end}: it seems to be written only when it changes; "
                f'if it is sampled, set {INTERPOLATION_KEY} = "linear" in its layout'
            )
        elif after > max(hold.longest_secs, MIN_TAIL_SECS):
            yield (
                f"held at its last value for the last {after:.1f} s of the log, longer than "
                f"between any of its {samples}; if the sensor was lost, cut the log there"
            )
    if channel.name == "rudder" and not hold and channel.interval_secs > MAX_RUDDER_INTERVAL_SECS:
        yield (
            f"sampled every {channel.interval_secs:.3g} s, in which a rudder moves from side to "
            "side: what it did between the samples is not known, and coefficients may be wrong by "
            "more than their intervals; record it every second"
        )
    if is_rudder_order(channel):
        jump = f" (changes of up to {_displayed(channel, hold.largest_step)})" if hold else ""
        effect = (
            "it is followed at the rate of the steering gear, 2.5 deg/s unless the vessel file "
            "states rudder.rate"
            if hold
            else "the lag of the steering gear is taken for the ship's"
        )
        yield (
            f"seems to be the order, not the angle of the rudder{jump}; {effect}; use the rudder's "
            "feedback where there is one"
        )


def times_in_words(count: int) -> str:
    """Return a count in words.

    Examples
    --------
    >>> times_in_words(1), times_in_words(3)
    ('once', '3 times')
    """
    return "once" if count == 1 else f"{count} times"


def unusable_causes(channel: ChannelStats) -> Iterator[str]:
    """Report why nothing can be computed from a channel: infinite values, times that run back.

    Yields
    ------
    str
        The causes with their remedies, without the topic.
    """
    infinite, backward = channel.infinite, channel.backward_steps
    if infinite.count:
        yield (
            f"has {counted(infinite.count, 'infinite value')}, the first "
            f"{infinite.first_secs:.3f} s after its start; convert the log to CSV, replace "
            f"{'it' if infinite.count == 1 else 'them'} by nan and convert it back"
        )
    if backward.count:
        yield (
            "has measured times that run backwards "
            f"{times_in_words(backward.count)}, first by {backward.extent:.3f} s, "
            f"{backward.first_secs:.3f} s after its start; "
            "`shiplog convert IN.mcap OUT.mcap` sorts them"
        )


def _channel_warnings(channel: ChannelStats) -> Iterator[str]:
    if not channel.samples:
        yield "no samples; check that the sensor was connected and switched on"
        return
    yield from _time_warnings(channel)
    yield from _value_warnings(channel)


def _time_warnings(channel: ChannelStats) -> Iterator[str]:
    """Gaps, duplicates, irregular intervals, and clocks that disagree."""
    if channel.gaps:
        start, longest = max(channel.gaps, key=lambda gap: gap[1])
        yield (
            f"{counted(len(channel.gaps), 'gap')}, the longest {longest:.1f} s, {start:.1f} s "
            "after its start; samples were lost: check the sensor and its connection"
        )
    if channel.duplicate_times:
        yield _duplicate_times_warning(channel)
    if channel.irregular_share > MAX_IRREGULAR_SHARE and not channel.hold:
        low, high = channel.interval_range_secs
        yield (
            f"irregular sampling: {100 * channel.irregular_share:.0f} % of the intervals differ by "
            f"more than half from their median of {channel.interval_secs:.3g} s (percentiles 1 and "
            f"99: {low:.2g} and {high:.2g} s); check the time stamps and the load of the network"
        )
    if channel.received_early.count:
        yield (
            f"{counted(channel.received_early.count, 'sample')} received before being measured, by "
            f"up to {channel.received_early.extent:.3g} s; the sensor's clock is ahead of the "
            "recorder's: synchronise them"
        )


def _duplicate_times_warning(channel: ChannelStats) -> str:
    """Word the warning of repeated time stamps, which are coarse where most of them repeat."""
    text = f"{counted(channel.duplicate_times, 'sample')} with the same time as the one before"
    per_stamp = channel.valid / max(channel.valid - channel.duplicate_times, 1)
    if per_stamp < MIN_SAMPLES_PER_STAMP or not channel.interval_secs:
        return (
            f"{text}; the time stamps are too coarse or samples were recorded twice: "
            "check the sensor's clock and the recorder"
        )
    secs = f"{channel.interval_secs:.3g} s"
    return (
        f"{text}: {per_stamp:.3g} samples share each time stamp, {secs} apart; they are averaged, "
        f"motions within {secs} are lost, and the times may be up to {secs} wrong against other "
        "channels; the time stamps are too coarse, or samples were recorded twice: set "
        'rebuild = "uniform" in [time] of the layout of a table and convert it again, or record '
        "finer time stamps"
    )


def _value_warnings(channel: ChannelStats) -> Iterator[str]:
    """Missing, stuck and impossible values."""
    # where a table has a value in every n-th row only, the empty cells between are no defect
    empty_cells = channel.interval_secs > MIN_ROWS_PER_VALUE * channel.row_interval_secs
    if channel.missing and not empty_cells:
        share = 100 * channel.missing / channel.samples
        yield (
            f"{counted(channel.missing, 'sample')} ({share:.1f} %) not measured (NaN); "
            "the sensor gave no value: check it if that is unexpected"
        )
    stuck = channel.stuck
    if stuck:
        held = ", ".join(_displayed(channel, float(value)) for value in stuck.value)
        yield (
            f"stuck {times_in_words(stuck.count)}, longest at {held} for "
            f"{stuck.duration_secs:.1f} s, {stuck.start_secs:.1f} s after its start; the sensor "
            "froze: check it, and set these values to nan in a CSV of the log"
        )
    yield from _impossible_warnings(channel)
    for value, number in channel.sentinels:
        yield (
            f"{counted(number, 'sample')} of exactly {_displayed(channel, value)}, to which the "
            'channel jumps and from which it returns: it stands for "not available" and is not '
            "used; check the sensor, and write nan instead where the log is made"
        )
    if channel.spikes:
        number, first_ns = len(channel.spikes), channel.spikes.times_ns[0]
        yield (
            f"{counted(number, 'spike')} ({100 * number / channel.samples:.2g} %), up to "
            f"{_displayed(channel, channel.spikes.largest)} away from the samples around, the "
            f"first {(first_ns - channel.span_ns[0]) * 1e-9:.1f} s after its start: not used; "
            "check the sensor and its connection"
        )
    if channel.fixes:
        yield from channel.fixes.warnings()


def _impossible_warnings(channel: ChannelStats) -> Iterator[str]:
    count = channel.impossible.count
    if not count:
        return
    lowest, highest = channel.limits
    yield (
        f"{counted(count, 'impossible value')}, {_worst(channel)}; possible are "
        f"{_displayed(channel, lowest)} to {_displayed(channel, highest)}: "
        "not used; check the unit in the layout and the sensor"
    )


def _worst(channel: ChannelStats) -> str:
    """Describe the impossible values: the one repeated most, or the worst."""
    value, number = channel.impossible_value
    if 1 < number == channel.impossible.count:
        return f"all {_displayed(channel, value)}"
    if number > max(2, channel.impossible.count // 2):
        return f"{number} of them {_displayed(channel, value)}"
    return f"the worst {_displayed(channel, channel.impossible.extent)}"


def _displayed(channel: ChannelStats, value: float) -> str:
    """Format a value in the unit people use."""
    unit, factor = display_conversion(channel.name, channel.unit)
    return f"{value * factor:.4g} {unit}"
