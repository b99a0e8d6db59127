"""Warnings about sensors that seem dead, and about channels that start late or end early."""

from collections.abc import Iterator

import numpy as np

from shiplog.checks.channel_stats import GAP_SECS, LogStats
from shiplog.resampling import Clock

MAX_ASTERN_SHARE = 0.01  # of the samples; a single one may be noise about zero
MIN_TURN_RATE = np.radians(0.1)  # rad/s, range of the yaw rate beyond which the ship has turned
MIN_COMPARED_CHANNELS = 4  # of which most start and end together
MIN_SHIFT_SECS = 0.8  # of a whole channel against the others
MIN_WAY = 1.0  # m/s, median speed beyond which the ship makes way


def channel_warnings(log_stats: LogStats) -> Iterator[str]:
    """Warn of sensors that seem dead, and of going astern.

    Parameters
    ----------
    log_stats
        Statistics of the log's channels.

    Yields
    ------
    str
        A warning, in a sentence.
    """
    yield from _dead_sensor_warnings(log_stats)
    for name in ("speed", "rpm"):
        share = log_stats[name].negative_share
        if share > MAX_ASTERN_SHARE:
            yield f"{name}: negative in {share:.0%} of the samples; the model does not hold astern"


def _dead_sensor_warnings(log_stats: LogStats) -> Iterator[str]:
    """Warn of sensors whose value never changes although the ship moved."""
    names = [n for n in ("yaw_rate", "speed", "rudder", "heading") if n in log_stats]
    ranges = {name: np.ptp(log_stats[name].value_range) for name in names}
    turned = ranges["yaw_rate"] > MIN_TURN_RATE
    for name, value_range in ranges.items():
        if value_range == 0 and (turned or name in {"yaw_rate", "speed"}):
            yield (
                f"{log_stats[name].topic}: constant throughout the log; "
                "if the sensor was dead, choose another source; if the values are too small for "
                "their digits, correct their unit"
            )
    if log_stats["speed"].median > MIN_WAY and log_stats["rpm"].value_range == (0.0, 0.0):
        yield (
            f"{log_stats['rpm'].topic}: 0 throughout the log although the ship makes way; "
            "the model needs the revolutions"
        )


def late_channel_warnings(log_stats: LogStats) -> Iterator[str]:
    """Warn of channels that start and end later than the others by one time, or earlier.

    The channels of a recorder start and end together; a channel that is shifted as a whole has
    late or early time stamps.

    Parameters
    ----------
    log_stats
        Statistics of the log's channels.

    Yields
    ------
    str
        A warning, in a sentence.
    """
    channels = [channel for channel in log_stats if channel.valid > 1 and not channel.hold]
    if len(channels) < MIN_COMPARED_CHANNELS:
        return
    spans = np.array([channel.valid_span_ns for channel in channels])
    shifts = (spans - np.median(spans, axis=0).astype(np.int64)) * 1e-9
    usual_interval = float(np.median([channel.interval_secs for channel in channels]))
    for channel, (start, end) in zip(channels, shifts.tolist(), strict=True):
        interval = max(channel.interval_secs, usual_interval)
        shift = (start + end) / 2
        if abs(end - start) > 1.5 * interval or abs(shift) < max(2.5 * interval, MIN_SHIFT_SECS):
            continue
        when, cause = ("after", "late") if shift > 0 else ("before", "early")
        yield (
            f"{channel.topic}: starts and ends {abs(shift):.1f} s {when} the others; likely "
            f"its time stamps are {cause} by this delay; compare them with the other clocks, and "
            "correct them in a table of the log"
        )


def end_warnings(log_stats: LogStats, clock: Clock, names: tuple[str, ...]) -> Iterator[str]:
    """Warn of parts of the log that are not used, or only predicted, as a channel is missing.

    Parameters
    ----------
    log_stats
        Statistics of the log's channels.
    clock
        The clock of the resampled log.
    names
        The channels that are needed.

    Yields
    ------
    str
        A warning, in a sentence.
    """
    clock_start, clock_end = clock.start_ns, clock.end_ns
    starts = {name: log_stats[name].valid_span_ns[0] for name in names}
    names = tuple(name for name in names if not log_stats[name].hold)  # the others have no end
    ends = {name: log_stats[name].valid_span_ns[1] for name in names}
    last_to_start = max(starts, key=lambda name: starts[name])
    delay = (clock_start - min(starts.values())) * 1e-9
    latest = log_stats[last_to_start]
    if delay > (GAP_SECS if latest.hold else latest.gap_threshold_secs):
        yield (
            f"{last_to_start}: starts {delay:.1f} s after the other channels; "
            "what precedes is not used"
        )
    remainder = (max(ends.values(), default=clock_end) - clock_end) * 1e-9
    if remainder > max((log_stats[name].gap_threshold_secs for name in names), default=0.0):
        first_to_end = min(names, key=lambda name: abs(ends[name] - clock_end))
        yield (
            f"{first_to_end}: ends {remainder:.1f} s before the other channels; "
            "what follows is not used"
        )
    for name in names:
        missing = (clock_end - ends[name]) * 1e-9
        if missing > log_stats[name].gap_threshold_secs:
            yield (f"{name}: no samples in the last {missing:.1f} s; there it is only predicted")
