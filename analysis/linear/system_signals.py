"""The signals of a system, read from the channels of a log in the units of the system."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.signals.moments import Moments
from analysis.signals.signal_stats import NoiseLevel
from shiplog.checks.channel_stats import ChannelStats, LogStats, gap_threshold_secs
from shiplog.errors import UsageError
from shiplog.resampling import Clock
from shiplog.types import FloatArray, Signals
from shiplog.units import CATALOGUE, UNITS, conversion_factor

from .system import ChannelBinding, LinearSystem


@dataclass(frozen=True)
class BoundSignal:
    """A signal of the system on a clock: scale · (factor · channel - offset).

    Attributes
    ----------
    binding
        Its channel.
    factor
        From the unit of the log to that of the binding.
    channel_unit
        Unit in which the system takes the channel.
    stride
        Of an output: every how many instants of the clock there is a measurement. Between the
        samples of a channel that is interpolated the clock has no information of its own.
    """

    binding: ChannelBinding
    factor: float
    channel_unit: str
    stride: int = 1

    @property
    def unit(self) -> str:
        """Unit of the signal; the number 1 where it is scaled to a unit of the system's own."""
        return self.channel_unit if self.binding.scale == 1.0 else "1"

    def values(self, signals: Signals) -> FloatArray:
        """Return the signal at the instants of a chunk, (n,)."""
        raw = signals[self.binding.channel] * self.factor
        return np.asarray(self.binding.scale * (raw - self.binding.offset))

    def measured(self, signals: Signals) -> FloatArray:
        """Return an output at the instants of a chunk, (n,); NaN where there is no measurement."""
        values = self.values(signals)
        if self.stride > 1:
            numbers = signals.first + np.arange(len(signals))
            values = np.where(numbers % self.stride == 0, values, np.nan)
        return values


def bind_signals(bindings: Sequence[ChannelBinding], stats: LogStats) -> tuple[BoundSignal, ...]:
    """Bind signals to the channels of a log.

    Raises
    ------
    UsageError
        A unit does not fit the channel.
    """
    bound = []
    for binding in bindings:
        unit = stats[binding.channel].unit
        factor = 1.0
        if binding.unit is not None and binding.unit != unit:
            try:
                factor = conversion_factor(unit, binding.unit)
            except UsageError as error:
                raise UsageError(f"{binding.name}, channel {binding.channel!r}: {error}") from None
        bound.append(BoundSignal(binding, factor, binding.unit or unit))
    return tuple(bound)


def require_same_units(system: LinearSystem, outputs: Sequence[BoundSignal]) -> None:
    """Refuse an output that is a state by itself and is taken in another unit than the state.

    An output with a scale has the unit that its scale gives; a state of unit 1 has none to compare.

    Raises
    ------
    UsageError
        The units differ; the message names the keys to change.
    """
    for output, row, direct in zip(outputs, system.plant.C, system.D, strict=True):
        is_state = np.count_nonzero(row) == 1 and row.sum() == 1.0 and not direct.any()
        if not is_state or output.binding.scale != 1.0:
            continue
        k = int(np.argmax(row))
        name, unit = system.plant.states[k], system.units[k]
        if unit != "1" and _plain_unit(unit) != _plain_unit(output.channel_unit):
            raise UsageError(
                f"the output {output.binding.name!r} is in {output.channel_unit}, its state"
                f" {name!r} in {unit}; state one unit for both, or the scale of the output"
            )


def _plain_unit(unit: str) -> tuple[str, float]:
    """Return the SI unit and the factor to it; of a unit that shiplog does not know, itself."""
    plain = unit.replace("²", "2").replace("^", "")
    return UNITS.get(plain, (plain, 1.0))


def is_interpolated(channel: ChannelStats) -> bool:
    """Whether a channel has values between its samples on a clock: interpolated, or held."""
    kind = CATALOGUE.get(channel.name)
    between = kind is not None and (kind.commanded or kind.circular)
    return between or bool(channel.hold) or channel.interpolation == "linear"


class OutputStats:
    """Size, noise and first value of an output that comes in chunks."""

    def __init__(self) -> None:
        self.moments, self._noise, self.first = Moments(), NoiseLevel(), np.nan

    def add(self, values: FloatArray) -> None:
        """Add the next values, (n,); NaN where not measured."""
        known = values[np.isfinite(values)]
        self.moments.add(known)
        self._noise.add(known)
        if len(known) and not np.isfinite(self.first):
            self.first = float(known[0])

    @property
    def noise_std(self) -> float:
        """Standard deviation of the white noise, by third differences; NaN below four values."""
        return self._noise.result()


class HeldSignals:
    """Inputs and scheduling signals held at their last value where not measured.

    Attributes
    ----------
    held_secs
        Time in which each signal was held for longer than a gap, s.
    """

    def __init__(self, signals: Sequence[BoundSignal], clock: Clock) -> None:
        self._signals, self._dt = signals, clock.dt_secs
        channels: Mapping[str, ChannelStats] = clock.channels
        self._gaps = [
            gap_threshold_secs(max(channels[s.binding.channel].interval_secs, clock.dt_secs))
            / clock.dt_secs
            for s in signals
        ]
        self._last, self._age = np.full(len(signals), np.nan), np.zeros(len(signals))
        self.held_secs = np.zeros(len(signals))

    def step(self, signals: Signals) -> FloatArray:
        """Return the signals at the instants of a chunk, (n, k); NaN before their first sample."""
        columns = [self._hold(k, s.values(signals)) for k, s in enumerate(self._signals)]
        return np.column_stack(columns) if columns else np.zeros((len(signals), 0))

    def warnings(self) -> tuple[str, ...]:
        """Return a warning for each signal that was held over gaps."""
        return tuple(
            f"{signal.binding.name}: not measured for {secs:.1f} s in all; held at its last value"
            " there, which makes the estimates there less reliable"
            for signal, secs in zip(self._signals, self.held_secs, strict=True)
            if secs
        )

    def _hold(self, k: int, values: FloatArray) -> FloatArray:
        known = np.isfinite(values)
        last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
        ages = np.where(
            last >= 0, np.arange(len(values)) - last, self._age[k] + 1 + np.arange(len(values))
        )
        held = np.where(last >= 0, values[np.maximum(last, 0)], self._last[k])
        if len(values):
            self.held_secs[k] += self._dt * int(
                np.count_nonzero((ages > self._gaps[k]) & np.isfinite(held))
            )
            self._last[k], self._age[k] = held[-1], ages[-1]
        return held
