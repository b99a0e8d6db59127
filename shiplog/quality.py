"""What is wrong with a log's data, in words: for the person who could still sail again."""

from collections.abc import Iterator

import numpy as np

from .clock import gap_threshold_secs, gaps, usual_period_secs
from .errors import LogError
from .schema import GEOGRAPHIC
from .types import Channel, FloatArray, TrialLog
from .units import CATALOGUE, factor

STUCK_PERIODS = 30  # a value that stands still for more usual periods than this,
STUCK_SECS = 5.0  # and for longer than this,
STUCK_RUNS = 30  # and for so many times what is usual in its channel, is stuck
IRREGULAR_SHARE = 0.1  # of the intervals, which may be more than half off the usual one

_GLOBE = {"latitude": 90.0, "longitude": 180.0}


def examine(log: TrialLog, names: tuple[str, ...]) -> list[str]:
    """What is wrong with these channels of a log, a sentence each; nothing where all is well.

    `names` are keys as `log[...]` takes them.

    Raises `LogError` where a channel is missing, holds an infinite value, or has measured times
    that run backwards: with these nothing can be computed.
    """
    said = []
    for name in names:
        channel = log[name]
        _require_usable(log, channel)
        if not len(channel):
            said.append(f"{channel.topic}: no samples")
            continue
        said += [f"{channel.topic}: {fault}" for fault in _faults(channel)]
    return said


def _require_usable(log: TrialLog, channel: Channel) -> None:
    times = channel.measured_ns
    infinite = np.flatnonzero(np.isinf(_rows(channel)).any(axis=1))
    if len(infinite):
        at = (times[infinite[0]] - times[0]) * 1e-9
        raise LogError(
            f"{channel.topic} has {_count(len(infinite), 'infinite value')}, the first {at:.3f} s "
            f"after its start; convert the log to CSV, make it nan there and convert it back: "
            f"{log.name}"
        )
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        at, by = (times[back[0]] - times[0]) * 1e-9, (times[back[0]] - times[back[0] + 1]) * 1e-9
        raise LogError(
            f"the measured times of {channel.topic} run backwards {times_in_words(len(back))}, "
            f"first by {by:.3f} s, {at:.3f} s after its start; "
            f"`shiplog convert IN.mcap OUT.mcap` sorts them: {log.name}"
        )


def _faults(channel: Channel) -> Iterator[str]:
    silent = gaps(channel)
    if silent:
        start, longest = max(silent, key=lambda gap: gap[1])
        count = _count(len(silent), "gap")
        yield f"{count}, the longest {longest:.1f} s, {start:.1f} s after its start"
    repeated = int(np.count_nonzero(np.diff(channel.measured_ns) == 0))
    if repeated:
        yield f"{_count(repeated, 'sample')} with the time of the one before"
    missing = int(np.count_nonzero(np.isnan(_rows(channel)).all(axis=1)))
    if missing:
        share = 100 * missing / len(channel)
        yield f"{_count(missing, 'sample')} ({share:.1f} %) not measured (NaN)"
    yield from _stuck(channel)
    yield from _impossible(channel)
    yield from _irregular(channel)
    early = channel.measured_ns - channel.received_ns
    if np.any(early > 0):
        yield (
            f"{_count(int(np.count_nonzero(early > 0)), 'sample')} received before measured, by up "
            f"to {early.max() * 1e-9:.3g} s: the sensor's clock is ahead of the recorder's"
        )


def _stuck(channel: Channel) -> Iterator[str]:
    """Values that stand still for long, where neither the channel nor its print usually does."""
    kind = CATALOGUE.get(channel.name)
    if (kind is not None and kind.commanded) or len(channel) < 2:
        return
    values = _rows(channel)
    steps = _steps(values)
    changes = np.flatnonzero(steps != 0)
    starts, ends = np.append(0, changes + 1), np.append(changes, len(values) - 1)
    times = (channel.measured_ns - channel.measured_ns[0]) * 1e-9
    lasted: FloatArray = times[ends] - times[starts]
    least = max(STUCK_SECS, STUCK_PERIODS * usual_period_secs(channel))
    long = np.asarray(lasted > least)
    if bool(long.all()) or not bool(long.any()):
        return
    usual = np.median(np.repeat(lasted[~long], (ends - starts + 1)[~long]))
    long &= lasted > STUCK_RUNS * usual
    if usual > 0:  # printed coarsely: at a crest the print stands still and then moves one digit
        jumps = np.concatenate([[0.0], steps[changes], [0.0]])
        leap = np.nan_to_num(np.maximum(jumps[:-1], jumps[1:]), nan=np.inf)
        long &= leap > 2 * np.nanmedian(steps[changes])
    if np.any(long):
        worst = int(np.argmax(np.where(long, lasted, -1.0)))
        held = ", ".join(_shown(channel, float(value)) for value in values[starts[worst]])
        yield (
            f"stuck {times_in_words(int(np.count_nonzero(long)))}, longest at {held} for "
            f"{lasted[worst]:.1f} s, {times[starts[worst]]:.1f} s after its start"
        )


def _steps(values: FloatArray) -> FloatArray:
    """By how much each row differs from the one before, (n - 1,); NaN next to one not measured."""
    gone = np.isnan(values)
    filled = np.where(gone, 0.0, values)
    steps: FloatArray = np.abs(np.diff(filled, axis=0)).max(axis=1)
    empty = np.asarray(gone.all(axis=1))
    steps[empty[1:] | empty[:-1] | (gone[1:] != gone[:-1]).any(axis=1)] = np.nan
    return steps


def _impossible(channel: Channel) -> Iterator[str]:
    """Values that no ship has."""
    kind = CATALOGUE.get(channel.name)
    if channel.fields:
        limits = [_GLOBE.get(field, np.inf) for field in channel.fields]
        bad = np.abs(channel.values) > np.array(limits)
        if np.any(bad) and channel.fields == GEOGRAPHIC:
            count = int(np.count_nonzero(bad.any(axis=1)))
            yield f"{_count(count, 'impossible position')}, beyond 90 or 180 deg"
    elif kind is not None:
        beyond = np.maximum(kind.lowest - channel.values, channel.values - kind.highest)
        count = int(np.count_nonzero(beyond > 0))
        if count:
            worst = float(channel.values[int(np.nanargmax(beyond))])
            yield (
                f"{_count(count, 'impossible value')}, such as {_shown(channel, worst)}; between "
                f"{_shown(channel, kind.lowest)} and {_shown(channel, kind.highest)} is possible"
            )


def _irregular(channel: Channel) -> Iterator[str]:
    """A rate that is not one, gaps and equal times apart."""
    steps = np.diff(channel.measured_ns) * 1e-9
    steps = steps[(steps > 0) & (steps <= gap_threshold_secs(channel))]
    usual = usual_period_secs(channel)
    if len(steps) < 10:
        return
    off = float(np.mean(np.abs(steps - usual) > 0.5 * usual))
    if off > IRREGULAR_SHARE:
        low, high = np.percentile(steps, [1, 99])
        yield (
            f"irregular: {100 * off:.0f} % of its intervals are more than half off the usual "
            f"{usual:.3g} s; they go from {low:.2g} to {high:.2g} s"
        )


def _rows(channel: Channel) -> FloatArray:
    """The values as (n, k)."""
    return channel.values.reshape(len(channel), -1) if len(channel) else np.zeros((0, 1))


def _shown(channel: Channel, value: float) -> str:
    """A value as a person reads it."""
    kind = CATALOGUE.get(channel.name)
    if kind is None or channel.fields == GEOGRAPHIC:
        return f"{value:.4g} {channel.unit}"
    return f"{value * factor(kind.unit, kind.display_unit):.4g} {kind.display_unit}"


def _count(number: int, thing: str) -> str:
    return f"1 {thing}" if number == 1 else f"{number} {thing}s"


def times_in_words(count: int) -> str:
    """How often, as it is said."""
    return "once" if count == 1 else f"{count} times"
