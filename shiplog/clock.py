"""Many clocks to one: a trial on a uniform grid, with nothing invented.

What the ship does (yaw rate, speed) is put on the nearest instant of the grid, several samples
averaged; where nothing was measured there is NaN. What is commanded (rudder, rpm) acts between
its samples too and is interpolated, but not across a gap.
"""

from math import inf

import numpy as np

from .errors import LogError, UsageError
from .types import Channel, FloatArray, Signals, TrialLog
from .units import CATALOGUE

GAP_PERIODS = 5.0  # a silence of so many usual periods is a gap
GAP_SECS = 1.0  # but nothing shorter than this
MAX_SAMPLES = 20_000_000  # of a grid: beyond it the times are wrong, not the trial long


def resample(
    log: TrialLog,
    dt_secs: float | None = None,
    channels: tuple[str, ...] | None = None,
    optional: tuple[str, ...] = (),
) -> Signals:
    """Put a log's channels on one clock.

    `dt_secs` defaults to the usual period of the first of the channels, on whose samples the
    clock falls. It starts where all of them are known, and ends with the commanded ones, or else
    with the last of the others. `optional` channels are placed on it where the log has them.

    Raises `LogError` where a channel is missing or has fewer than two samples, or where the
    channels have no time in common.
    """
    names = channels or tuple(c.name for c in log if not c.fields)
    if not names:
        raise LogError(f"no channel to resample; choose a log that has samples: {log.name}")
    used = {name: log[name] for name in names}
    for name, channel in used.items():
        _require_samples(log, name, channel)
    dt = usual_period_secs(used[names[0]]) if dt_secs is None else dt_secs
    if not 0 < dt < inf:
        raise UsageError(f"the time step must be positive, got {dt} s")
    start_ns, end_ns = _common_span(log, list(used.values()))
    steps = (end_ns - start_ns) * 1e-9 / dt + 1e-6
    if steps > MAX_SAMPLES:
        raise LogError(
            f"its times span {(end_ns - start_ns) / 8.64e13:.4g} days, too many steps of {dt:g} s; "
            f"correct the clock of one of {', '.join(names)}: {log.name}"
        )
    grid = np.arange(int(steps) + 1) * dt
    used |= {name: log[name] for name in optional if name in log and _measured(log[name]) > 1}
    values = {}
    for name, channel in used.items():
        at = (channel.measured_ns - start_ns) * 1e-9
        kind = CATALOGUE.get(channel.name)
        place = _interpolated if kind and (kind.commanded or kind.circular) else _binned
        values[name] = place(at, channel, grid, dt)
    return Signals(start_ns, dt, values)


def usual_period_secs(channel: Channel) -> float:
    """The median interval between a channel's samples."""
    steps = np.diff(np.sort(channel.measured_ns))
    steps = steps[steps > 0]
    return float(np.median(steps)) * 1e-9 if len(steps) else 0.0


def gap_threshold_secs(channel: Channel) -> float:
    """The silence beyond which a channel was not measured, rather than between two samples."""
    return longest_step_secs(usual_period_secs(channel))


def longest_step_secs(usual_secs: float) -> float:
    """How far apart two samples of a sensor of that usual period may stand without a gap."""
    return max(GAP_PERIODS * usual_secs, GAP_SECS)


def usual_interval_secs(values: FloatArray, dt_secs: float) -> float:
    """The median time between two measurements of a channel on a clock; NaN is none."""
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    return float(np.median(steps)) * dt_secs if len(steps) else dt_secs


def gaps(channel: Channel) -> list[tuple[float, float]]:
    """Where a channel fell silent: start and length in seconds from its first sample."""
    times = np.sort(channel.measured_ns)
    steps = np.diff(times) * 1e-9
    return [
        (float((times[i] - times[0]) * 1e-9), float(steps[i]))
        for i in np.flatnonzero(steps > gap_threshold_secs(channel))
    ]


def _require_samples(log: TrialLog, name: str, channel: Channel) -> None:
    if channel.fields:
        raise UsageError(
            f"channel {name!r} has components ({', '.join(channel.fields)}), "
            f"and a clock takes one value a sample; name others: {log.name}"
        )
    measured = _measured(channel)
    if measured < 2 or usual_period_secs(channel) == 0:
        has = {0: "no measured value", 1: "one sample"}.get(
            measured, "all its samples at one instant"
        )
        raise LogError(
            f"channel {name!r} has {has}, and a replay needs it over time; "
            f"check the recorder or choose another log: {log.name}"
        )


def _measured(channel: Channel) -> int:
    return int(np.isfinite(channel.values).sum())


def _common_span(log: TrialLog, channels: list[Channel]) -> tuple[int, int]:
    """From where all are known, on a sample of the first, to where the inputs cease."""
    begun = max(_known_span(channel)[0] for channel in channels)
    inputs: list[int] = []
    others: list[int] = []
    for channel in channels:
        commanded = channel.name in CATALOGUE and CATALOGUE[channel.name].commanded
        (inputs if commanded else others).append(_known_span(channel)[1])
    end = min([max(others or inputs), *inputs])
    leader = channels[0].measured_ns[np.isfinite(channels[0].values)]
    on_sample = leader[leader >= begun]
    start = int(on_sample.min()) if len(on_sample) else begun
    if end <= start:
        names = ", ".join(c.name for c in channels)
        raise LogError(f"{names} were never recorded at the same time: {log.name}")
    return start, end


def _known_span(channel: Channel) -> tuple[int, int]:
    """The first and the last instant at which something was measured."""
    times = channel.measured_ns[np.isfinite(channel.values)]
    return int(times.min()), int(times.max())


def _binned(at: FloatArray, channel: Channel, grid: FloatArray, dt: float) -> FloatArray:
    """The mean of the samples nearest each instant; NaN where there is none."""
    cell = np.floor(at / dt + 0.5).astype(np.int64)
    good = np.isfinite(channel.values) & (cell >= 0) & (cell < len(grid))
    count = np.bincount(cell[good], minlength=len(grid))
    total = np.bincount(cell[good], weights=channel.values[good], minlength=len(grid))
    with np.errstate(invalid="ignore"):
        mean: FloatArray = total / count
    return mean


def _interpolated(at: FloatArray, channel: Channel, grid: FloatArray, dt: float) -> FloatArray:
    """Linear between samples, NaN inside a gap and beyond the ends."""
    good = np.isfinite(channel.values)
    order = np.argsort(at[good], kind="stable")
    times, values = at[good][order], channel.values[good][order]
    if channel.name in CATALOGUE and CATALOGUE[channel.name].circular:
        values = np.unwrap(values)
    placed = np.interp(grid, times, values)
    after = np.searchsorted(times, grid - 1e-6 * dt)
    inside = (after > 0) & (after < len(times))
    left, right = times[np.clip(after - 1, 0, None)], times[np.clip(after, None, len(times) - 1)]
    on_sample = np.abs(right - grid) <= 1e-6 * dt
    known = on_sample | (inside & (right - left <= gap_threshold_secs(channel)))
    return np.where(known, placed, np.nan)
