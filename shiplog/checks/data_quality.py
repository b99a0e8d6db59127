"""What is wrong with a log's data, in words: for the person who could still sail again."""

from collections.abc import Iterator

from shiplog.errors import LogError
from shiplog.types import TrialLog
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor

from .channel_stats import ChannelStats, LogStats
from .log_stats import compute_log_stats

IRREGULAR_SHARE = 0.1  # of the intervals, which may be more than half off the usual one


def examine(log: TrialLog, names: tuple[str, ...]) -> list[str]:
    """What is wrong with these channels of a log, a sentence each; nothing where all is well.

    `names` are keys as `log[...]` takes them.

    Raises `LogError` where a channel is missing, holds an infinite value, or has measured times
    that run backwards: with these nothing can be computed.
    """
    return data_warnings(compute_log_stats(log), names)


def data_warnings(found: LogStats, names: tuple[str, ...]) -> list[str]:
    """As `examine`, of a log that was surveyed."""
    said = []
    for name in names:
        channel = found[name]
        _require_usable(found, channel)
        if channel.samples:
            said += [f"{channel.topic}: {fault}" for fault in _faults(channel)]
        else:
            said.append(f"{channel.topic}: no samples")
    return said


def _require_usable(found: LogStats, channel: ChannelStats) -> None:
    infinite, back = channel.infinite, channel.backward_steps
    if infinite.count:
        raise LogError(
            f"{channel.topic} has {_count(infinite.count, 'infinite value')}, the first "
            f"{infinite.first_secs:.3f} s after its start; convert the log to CSV, make it nan "
            f"there and convert it back: {found.name}"
        )
    if back.count:
        raise LogError(
            f"the measured times of {channel.topic} run backwards {times_in_words(back.count)}, "
            f"first by {back.extent:.3f} s, {back.first_secs:.3f} s after its start; "
            f"`shiplog convert IN.mcap OUT.mcap` sorts them: {found.name}"
        )


def _faults(channel: ChannelStats) -> Iterator[str]:
    if channel.gaps:
        start, longest = max(channel.gaps, key=lambda gap: gap[1])
        count = _count(len(channel.gaps), "gap")
        yield f"{count}, the longest {longest:.1f} s, {start:.1f} s after its start"
    if channel.duplicate_times:
        yield f"{_count(channel.duplicate_times, 'sample')} with the time of the one before"
    if channel.missing:
        share = 100 * channel.missing / channel.samples
        yield f"{_count(channel.missing, 'sample')} ({share:.1f} %) not measured (NaN)"
    yield from _stuck(channel)
    yield from _impossible(channel)
    if channel.irregular_share > IRREGULAR_SHARE:
        low, high = channel.interval_range_secs
        yield (
            f"irregular: {100 * channel.irregular_share:.0f} % of its intervals are more than half "
            f"off the usual {channel.interval_secs:.3g} s; they go from {low:.2g} to {high:.2g} s"
        )
    if channel.received_early.count:
        yield (
            f"{_count(channel.received_early.count, 'sample')} received before measured, by up to "
            f"{channel.received_early.extent:.3g} s: the sensor's clock is ahead of the recorder's"
        )


def _stuck(channel: ChannelStats) -> Iterator[str]:
    stuck = channel.stuck
    if stuck:
        held = ", ".join(_shown(channel, float(value)) for value in stuck.value)
        yield (
            f"stuck {times_in_words(stuck.count)}, longest at {held} for "
            f"{stuck.lasted_secs:.1f} s, {stuck.start_secs:.1f} s after its start"
        )


def _impossible(channel: ChannelStats) -> Iterator[str]:
    """Values that no ship has."""
    count = channel.impossible.count
    if not count:
        return
    if channel.fields:
        yield f"{_count(count, 'impossible position')}, beyond 90 or 180 deg"
    else:
        kind = CATALOGUE[channel.name]
        yield (
            f"{_count(count, 'impossible value')}, such as "
            f"{_shown(channel, channel.impossible.extent)}; between "
            f"{_shown(channel, kind.lowest)} and {_shown(channel, kind.highest)} is possible"
        )


def _shown(channel: ChannelStats, value: float) -> str:
    """A value as a person reads it."""
    kind = CATALOGUE.get(channel.name)
    if kind is None or channel.fields == GEOGRAPHIC:
        return f"{value:.4g} {channel.unit}"
    return f"{value * conversion_factor(kind.unit, kind.display_unit):.4g} {kind.display_unit}"


def _count(number: int, thing: str) -> str:
    return f"1 {thing}" if number == 1 else f"{number} {thing}s"


def times_in_words(count: int) -> str:
    """How often, as it is said."""
    return "once" if count == 1 else f"{count} times"
