"""Warnings about the data of a log, in words for the person who can still repeat the trial."""

from collections.abc import Iterator

from shiplog.errors import LogError
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor

from .channel_stats import ChannelStats, LogStats

MAX_IRREGULAR_SHARE = 0.1  # of the intervals


def data_warnings(stats: LogStats, names: tuple[str, ...]) -> list[str]:
    """Report the defects of some channels, one line each.

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
    warnings = []
    for name in names:
        channel = stats[name]
        _require_usable(stats, channel)
        warnings += [f"{channel.topic}: {warning}" for warning in _channel_warnings(channel)]
    return warnings


def times_in_words(count: int) -> str:
    """Return a count in words.

    Examples
    --------
    >>> times_in_words(1), times_in_words(3)
    ('once', '3 times')
    """
    return "once" if count == 1 else f"{count} times"


def _require_usable(stats: LogStats, channel: ChannelStats) -> None:
    infinite, backward = channel.infinite, channel.backward_steps
    if infinite.count:
        raise LogError(
            f"{channel.topic} has {_count(infinite.count, 'infinite value')}, the first "
            f"{infinite.first_secs:.3f} s after its start; convert the log to CSV, replace "
            f"{'it' if infinite.count == 1 else 'them'} by nan and convert it back: {stats.name}"
        )
    if backward.count:
        raise LogError(
            f"the measured times of {channel.topic} run backwards "
            f"{times_in_words(backward.count)}, first by {backward.extent:.3f} s, "
            f"{backward.first_secs:.3f} s after its start; "
            f"`shiplog convert IN.mcap OUT.mcap` sorts them: {stats.name}"
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
            f"{_count(len(channel.gaps), 'gap')}, the longest {longest:.1f} s, {start:.1f} s after "
            "its start; samples were lost: check the sensor and its connection"
        )
    if channel.duplicate_times:
        yield (
            f"{_count(channel.duplicate_times, 'sample')} with the same time as the one before; "
            "the time stamps are too coarse or samples were recorded twice: "
            "check the sensor's clock and the recorder"
        )
    if channel.irregular_share > MAX_IRREGULAR_SHARE:
        low, high = channel.interval_range_secs
        yield (
            f"irregular sampling: {100 * channel.irregular_share:.0f} % of the intervals differ by "
            f"more than half from their median of {channel.interval_secs:.3g} s (percentiles 1 and "
            f"99: {low:.2g} and {high:.2g} s); check the time stamps and the load of the network"
        )
    if channel.received_early.count:
        yield (
            f"{_count(channel.received_early.count, 'sample')} received before being measured, by "
            f"up to {channel.received_early.extent:.3g} s; the sensor's clock is ahead of the "
            "recorder's: synchronise them"
        )


def _value_warnings(channel: ChannelStats) -> Iterator[str]:
    """Missing, stuck and impossible values."""
    if channel.missing:
        share = 100 * channel.missing / channel.samples
        yield (
            f"{_count(channel.missing, 'sample')} ({share:.1f} %) not measured (NaN); "
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
            f"{_count(number, 'sample')} of exactly {_displayed(channel, value)}, to which the "
            'channel jumps and from which it returns: it stands for "not available" and is not '
            "used; check the sensor, and write nan instead where the log is made"
        )
    if channel.fixes:
        yield from channel.fixes.warnings()


def _impossible_warnings(channel: ChannelStats) -> Iterator[str]:
    count = channel.impossible.count
    if not count:
        return
    lowest, highest = channel.limits
    yield (
        f"{_count(count, 'impossible value')}, {_worst(channel)}; possible are "
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
    kind = CATALOGUE.get(channel.name)
    if kind is None or channel.fields == GEOGRAPHIC:
        return f"{value:.4g} {channel.unit}"
    return f"{value * conversion_factor(kind.unit, kind.display_unit):.4g} {kind.display_unit}"


def _count(number: int, thing: str) -> str:
    return f"1 {thing}" if number == 1 else f"{number} {thing}s"
