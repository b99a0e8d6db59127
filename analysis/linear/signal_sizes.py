"""Sizes of a system's signals on the clock: rms values, noise, first values, sampling intervals."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from analysis.replay.passes import resampled_chunks
from analysis.signals.moments import Moments
from shiplog.errors import LogError, UsageError
from shiplog.progress import ProgressCallback
from shiplog.resampling import Clock
from shiplog.screening import ScreenedLog
from shiplog.types import FloatArray, Signals

from .system_signals import BoundSignal, OutputStats, is_interpolated

MIN_MEASUREMENTS = 4  # the noise is estimated from third differences
MIN_STRIDE = 1.5  # steps between samples from which an interpolated output is decimated
# angles from one north, which a system may subtract from each other
HEADINGS = ("heading", "heading_order", "magnetic_heading", "course_over_ground")


@dataclass(frozen=True, eq=False)
class SignalSizes:
    """Sizes of the signals of a system.

    Attributes
    ----------
    outputs
        Statistics of each output.
    rms
        Rms values of the other signals.
    """

    outputs: tuple[OutputStats, ...]
    rms: FloatArray


def with_stride(signal: BoundSignal, clock: Clock) -> BoundSignal:
    """Return an output with its stride on the clock."""
    channel = clock.channels[signal.binding.channel]
    ratio = channel.interval_secs / clock.dt_secs
    is_decimated = is_interpolated(channel) and not channel.hold and ratio > MIN_STRIDE
    return replace(signal, stride=round(ratio)) if is_decimated else signal


def measurement_interval(output: BoundSignal, clock: Clock) -> float:
    """Return the time from one measurement of an output to the next, s."""
    channel = clock.channels[output.binding.channel]
    return max(0.0 if channel.hold else channel.interval_secs, clock.dt_secs)


def signal_sizes(
    log: ScreenedLog,
    clock: Clock,
    outputs: tuple[BoundSignal, ...],
    others: tuple[BoundSignal, ...],
    on_progress: ProgressCallback,
) -> SignalSizes:
    """Compute the sizes of the signals in a pass over the log.

    Raises
    ------
    LogError
        An output has too few measurements.
    UsageError
        Two headings start more than half a turn apart.
    """
    collected, headings = tuple(OutputStats() for _ in outputs), _FirstHeadings((*outputs, *others))
    moments = tuple(Moments() for _ in others)
    for signals in resampled_chunks(log, clock, on_progress, "resample"):
        headings.add(signals)
        for output, stats in zip(outputs, collected, strict=True):
            stats.add(output.measured(signals))
        for signal, each in zip(others, moments, strict=True):
            each.add(signal.values(signals))
    headings.require_one_turn()
    for output, stats in zip(outputs, collected, strict=True):
        if stats.moments.count < MIN_MEASUREMENTS:
            raise LogError(
                f"channel {output.binding.channel!r} has {stats.moments.count} samples where the"
                f" other channels have some, too, but {MIN_MEASUREMENTS} are needed; check the"
                f" recorder or choose another log: {log.name}"
            )
    return SignalSizes(collected, np.sqrt([each.mean_square for each in moments]))


def measurement_noise(
    outputs: tuple[BoundSignal, ...], collected: tuple[OutputStats, ...], clock: Clock
) -> tuple[FloatArray, tuple[bool, ...]]:
    """Return the noise (m,) of one measurement on the clock, stated or estimated from the log.

    The mean of the samples within a step of the clock has less noise than one sample. Raises
    `LogError` where a noise is not stated and the output never changes.
    """
    stds, measured = np.zeros(len(outputs)), []
    for k, (output, stats) in enumerate(zip(outputs, collected, strict=True)):
        channel = clock.channels[output.binding.channel]
        stated = output.binding.std
        if stated is None and stats.moments.std == 0:
            raise LogError(
                f"channel {output.binding.channel!r} never changes, so that its noise cannot be"
                f" estimated; state outputs.{output.binding.name}.std, or check the sensor"
            )
        if stated is None:
            stds[k] = stats.noise_std
        else:
            averaged = 1.0 if is_interpolated(channel) else channel.interval_secs / clock.dt_secs
            stds[k] = abs(output.binding.scale) * stated * np.sqrt(min(averaged, 1.0))
        measured.append(stated is None)
    return stds, tuple(measured)


class _FirstHeadings:
    """The first values of headings: each is unwrapped by itself, so that turns may lie between."""

    def __init__(self, signals: tuple[BoundSignal, ...]) -> None:
        self._signals = [each for each in signals if each.binding.channel in HEADINGS]
        self._first: dict[str, float] = {}

    def add(self, signals: Signals) -> None:
        """Add the next chunk."""
        for each in self._signals:
            if each.binding.name not in self._first:
                values = signals[each.binding.channel]
                known = values[np.isfinite(values)] - each.binding.offset / each.factor
                if len(known):
                    self._first[each.binding.name] = float(known[0])

    def require_one_turn(self) -> None:
        """Refuse headings more than half a turn apart; raise `UsageError` with the remedy."""
        if len(self._signals) < 2:
            return
        base, *others = self._signals
        for each in others:
            name, reference = each.binding.name, base.binding.name
            apart = self._first.get(name, np.nan) - self._first.get(reference, np.nan)
            if abs(apart) > pi:
                offset = each.binding.offset + 2 * pi * round(apart / (2 * pi)) * each.factor
                raise UsageError(
                    f"{name!r} starts {apart:+.3g} rad from {reference!r}, more than half a turn:"
                    f" its equations would see a turn that the ship does not make; set the offset"
                    f" of {name!r} to {offset:.9g}"
                )
