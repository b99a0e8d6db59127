"""Series of single channels as recorded, drawn at their own times, chunk by chunk."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.on_change import is_order
from shiplog.types import Channel, FloatArray
from shiplog.units import CATALOGUE, conversion_factor, display_conversion

from .decimation import Decimator, bucket_size
from .panels import words
from .series import GREY, Line, Series

ORDER_SUFFIX = "_order"  # of the name of a quantity that is commanded
NOT_DRAWN = "position", "gnss_time"  # the track, and a clock


@dataclass(frozen=True)
class DrawnQuantity:
    """What the channels of a panel have in common.

    Attributes
    ----------
    name
        The name of the quantity.
    unit
        The unit of the values.
    fields
        The names of the components; empty for a scalar.
    display_unit
        The unit in which it is drawn; empty for the one in which people are shown the quantity.
    """

    name: str
    unit: str
    fields: tuple[str, ...]
    display_unit: str = ""

    @property
    def display(self) -> tuple[str, float]:
        """The unit in which it is drawn, and the factor to that unit."""
        if self.display_unit:
            return self.display_unit, conversion_factor(self.unit, self.display_unit)
        return display_conversion(self.name, self.unit)

    @property
    def turn(self) -> float:
        """A full turn in the unit in which it is drawn; 0 where it is no compass angle."""
        circular = self.name in CATALOGUE and CATALOGUE[self.name].circular and not self.fields
        return 2 * np.pi * self.display[1] if circular else 0.0


class ChannelSeries:
    """The series of one channel in the unit people use, built chunk by chunk.

    A gap becomes one NaN. Orders and channels that are held have no gaps: they are drawn in steps,
    from the value in force at the start of the span to its end. A sample with a time before that
    of an earlier one is not drawn.

    Parameters
    ----------
    channel
        The statistics of the channel.
    span
        The first instant, ns since 1970, and the time from there to the last one, s.
    quantity
        What the channels of its panel have in common.
    label
        The name of its lines.
    full
        Whether to keep every sample, in memory; by default what a screen can show.
    """

    def __init__(
        self,
        channel: ChannelStats,
        span: tuple[int, float],
        quantity: DrawnQuantity,
        label: str,
        *,
        full: bool,
    ) -> None:
        self._channel, self._label = channel, label
        self._start_ns, self._end_secs = span
        self._factor, self._steps = quantity.display[1], _is_drawn_in_steps(channel)
        self._width = max(len(channel.fields), 1)
        self._unwrap = _Unwrap(quantity.turn) if quantity.turn else None
        self._last_secs, self._last = -np.inf, np.full((1, self._width), np.nan)
        size = 0 if full else bucket_size(channel.samples, self._width)
        first, last = channel.span_ns
        self._decimator = Decimator(size * (last - first) * 1e-9 / max(channel.samples - 1, 1))
        self._keep(np.zeros(0), np.zeros((0, self._width)))

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the channel's samples in the next chunk of the log."""
        part = self._channel.select(chunk)
        if part is None:
            return
        values = part.values.reshape(-1, self._width) * self._factor
        times = (part.measured_ns - self._start_ns) * 1e-9
        usable = np.isfinite(values).any(axis=1) & (times <= self._end_secs)
        times, values = times[usable], values[usable]
        latest = np.maximum.accumulate(np.concatenate(([self._last_secs], times)))[:-1]
        times, values = times[times >= latest], values[times >= latest]
        if len(times):
            values = self._unwrap.step(values) if self._unwrap else values
            self._add_sorted(times, values)
            self._last_secs, self._last = float(times[-1]), values[-1:]

    def result(self) -> Series:
        """Return the series, once all chunks were added."""
        if self._steps and np.isfinite(self._last).any():
            ends = np.array([max(self._last_secs, 0.0), self._end_secs])
            self._keep(ends, np.repeat(self._last, 2, axis=0))
        return self._decimator.result()

    def _add_sorted(self, times: FloatArray, values: FloatArray) -> None:
        """Add samples (n,) in the order of time, with the value in force at the start or gaps."""
        before = np.concatenate(([self._last_secs], times[:-1]))
        if self._steps:
            held = np.concatenate((self._last, values[:-1]))
            at_start = np.flatnonzero((before < 0) & (times > 0) & np.isfinite(held).any(axis=1))
            times = np.insert(times, at_start, 0.0)
            values = np.insert(values, at_start, held[at_start], axis=0)
        else:
            threshold = self._channel.gap_threshold_secs
            gap_ends = np.flatnonzero((times - before > threshold) & np.isfinite(before))
            middles = np.maximum((before[gap_ends] + times[gap_ends]) / 2, 0.0)
            times = np.insert(times, gap_ends, middles)
            values = np.insert(values, gap_ends, np.nan, axis=0)
        in_span = times >= 0
        self._keep(times[in_span], values[in_span])

    def _keep(self, times: FloatArray, values: FloatArray) -> None:
        names = self._channel.fields or ("",)
        lines = (
            Line(f"{self._label} {name}".strip(), column, GREY, 1.5)
            for name, column in zip(names, values.T, strict=True)
        )
        series = Series(self._label, times, tuple(lines), spiky=True, steps=self._steps)
        self._decimator.add(series)


class _Unwrap:
    """Removes the jumps of an angle by a full turn, from chunks."""

    def __init__(self, turn: float) -> None:
        self._turn, self._turns = turn, 0.0
        self._last: FloatArray | None = None  # (1, 1) as recorded

    def step(self, values: FloatArray) -> FloatArray:
        """Return the next values (n, 1) without jumps; n is at least one."""
        before = values[:1] if self._last is None else self._last
        jumps = np.round(np.diff(values, axis=0, prepend=before) / self._turn)
        turns = self._turns + np.cumsum(jumps, axis=0)
        self._last, self._turns = values[-1:], float(turns[-1, 0])
        return values - self._turn * turns


def channels_by_quantity(
    stats: LogStats, display_units: Mapping[str, str] | None = None
) -> dict[DrawnQuantity, list[ChannelStats]]:
    """Return the channels of a log that have a value, by quantity, in the order of the catalogue.

    An order is among the channels of what it commands, if that is in the log. Positions are not
    drawn over time, nor are the times of a satellite receiver.

    Parameters
    ----------
    stats
        The statistics of the channels.
    display_units
        The unit in which a quantity is drawn, by its name, where it is not the usual one.
    """
    groups: dict[DrawnQuantity, list[ChannelStats]] = {}
    for channel in stats:
        if channel.valid and channel.name not in NOT_DRAWN:
            quantity = _quantity(channel, stats, display_units or {})
            groups.setdefault(quantity, []).append(channel)
    order = {name: number for number, name in enumerate(CATALOGUE)}
    return {
        quantity: groups[quantity]
        for quantity in sorted(groups, key=lambda each: order.get(each.name, len(order)))
    }


def _quantity(
    channel: ChannelStats, stats: LogStats, display_units: Mapping[str, str]
) -> DrawnQuantity:
    """Return the quantity of a channel; of an order, what it commands if that is in the log."""
    commanded = channel.name.removesuffix(ORDER_SUFFIX)
    other = stats.get(commanded)
    name = commanded if other is not None and other.unit == channel.unit else channel.name
    is_usual = name in CATALOGUE and channel.unit == CATALOGUE[name].unit
    shown = display_units.get(name, "") if is_usual else ""
    return DrawnQuantity(name, channel.unit, channel.fields, shown)


def channel_label(channel: ChannelStats, quantity: DrawnQuantity) -> str:
    """Return the source of a channel, with its name where that is not the one of its panel."""
    if channel.name == quantity.name:
        return channel.source
    return f"{words(channel.name)}, {channel.source}"


def _is_drawn_in_steps(channel: ChannelStats) -> bool:
    if channel.interpolation == "linear":
        return False
    order = channel.name.endswith(ORDER_SUFFIX) or is_order(channel.source)
    return order or channel.hold is not None
