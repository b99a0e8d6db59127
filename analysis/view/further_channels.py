"""Panels of the channels that a replay does not use, drawn at their own times.

Channels of one quantity share a panel, with a line for each source; an order is drawn in the panel
of what it commands.
"""

import re
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np

from analysis.replay.passes import REQUIRED_CHANNELS
from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.on_change import is_order
from shiplog.resampling import Clock
from shiplog.screening import Screening
from shiplog.types import Channel, FloatArray
from shiplog.units import CATALOGUE, display_conversion

from .decimation import Decimator, bucket_size
from .panels import Panel, limits, title_of, words
from .series import BLUE, CYAN, GREEN, GREY, ORANGE, RED, Line, Series

SOURCE_COLOURS = BLUE, ORANGE, GREEN, RED, CYAN, GREY
ORDER_SUFFIX = "_order"  # of the name of a quantity that is commanded
NOT_DRAWN = "position", "gnss_time"  # the track, and a clock
LEGEND_SHARE = 0.15  # of an axis, above the values, for each name in the legend


@dataclass(frozen=True)
class _Quantity:
    """What the channels of a panel have in common: the name, the unit, and the components."""

    name: str
    unit: str
    fields: tuple[str, ...]

    @property
    def display(self) -> tuple[str, float]:
        """The unit in which it is drawn, and the factor to that unit."""
        return display_conversion(self.name, self.unit)

    @property
    def turn(self) -> float:
        """A full turn in the unit in which it is drawn; 0 where it is no compass angle."""
        circular = self.name in CATALOGUE and CATALOGUE[self.name].circular and not self.fields
        return 2 * np.pi * self.display[1] if circular else 0.0


class FurtherChannels:
    """Draws the channels of a log that a replay does not use, chunk by chunk.

    Of a quantity with several sources all are drawn, the one that the replay uses included.
    Positions are not drawn, as they are the track, nor are the times of a satellite receiver. Where
    the chunks are cut changes no result.

    Parameters
    ----------
    screening
        What the replay uses of the log, with the statistics of all channels.
    clock
        The clock of the replay, from whose start to whose end channels are drawn.
    full
        Whether to keep every sample, in memory; by default what a screen can show.
    """

    def __init__(self, screening: Screening, clock: Clock, *, full: bool = False) -> None:
        self._groups = {
            quantity: [
                _FurtherSeries(
                    channel, clock, quantity, _label(channel, quantity, screening), full=full
                )
                for channel in channels
            ]
            for quantity, channels in _by_quantity(screening.all_stats).items()
        }

    def __bool__(self) -> bool:
        """Whether the log has any further channel."""
        return bool(self._groups)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next chunk of the log as recorded, with all sources."""
        for group in self._groups.values():
            for series in group:
                series.add(chunk)

    def panels(self) -> list[Panel]:
        """Return a panel of each quantity that has a value on the clock, after all chunks."""
        panels: list[Panel] = []
        for quantity, group in self._groups.items():
            drawn = [series for each in group if _has_values(series := each.result())]
            if drawn:
                panels.append(_panel(f"further/{len(panels)}", quantity, drawn))
        return panels


class _FurtherSeries:
    """The series of one channel in the unit people use, built chunk by chunk.

    A gap becomes one NaN. Orders and channels that are held have no gaps: they are drawn in steps,
    from the value in force at the start of the clock to its end. A sample with a time before that
    of an earlier one is not drawn.
    """

    def __init__(
        self, channel: ChannelStats, clock: Clock, quantity: _Quantity, label: str, *, full: bool
    ) -> None:
        self._channel, self._label = channel, label
        self._start_ns, self._end_secs = clock.start_ns, (clock.count - 1) * clock.dt_secs
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
        on_clock = times >= 0
        self._keep(times[on_clock], values[on_clock])

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


def _by_quantity(stats: LogStats) -> dict[_Quantity, list[ChannelStats]]:
    """Return the channels to draw by quantity, in the order of the catalogue."""
    groups: dict[_Quantity, list[ChannelStats]] = {}
    for channel in stats:
        if channel.valid and channel.name not in NOT_DRAWN:
            groups.setdefault(_quantity(channel, stats), []).append(channel)
    order = {name: number for number, name in enumerate(CATALOGUE)}
    return {
        quantity: groups[quantity]
        for quantity in sorted(groups, key=lambda each: order.get(each.name, len(order)))
        if quantity.name not in REQUIRED_CHANNELS or len(groups[quantity]) > 1
    }


def _quantity(channel: ChannelStats, stats: LogStats) -> _Quantity:
    """Return the quantity of a channel; of an order, what it commands if that is in the log."""
    commanded = channel.name.removesuffix(ORDER_SUFFIX)
    other = stats.get(commanded)
    same = other is not None and other.unit == channel.unit
    return _Quantity(commanded if same else channel.name, channel.unit, channel.fields)


def _label(channel: ChannelStats, quantity: _Quantity, screening: Screening) -> str:
    """Return the source of a channel, with what distinguishes it from the others of its panel."""
    label = channel.source
    if channel.name != quantity.name:
        label = f"{words(channel.name)}, {label}"
    return f"{label} (used)" if screening.sources.get(channel.name) == channel.source else label


def _is_drawn_in_steps(channel: ChannelStats) -> bool:
    if channel.interpolation == "linear":
        return False
    order = channel.name.endswith(ORDER_SUFFIX) or is_order(channel.source)
    return order or channel.hold is not None


def _has_values(series: Series) -> bool:
    return any(np.isfinite(line.values).any() for line in series.lines)


def _panel(name: str, quantity: _Quantity, drawn: list[Series]) -> Panel:
    """Return the panel of a quantity, with a colour for each of several lines, and a legend."""
    if quantity.turn:
        drawn = [_turned_to(drawn[0], each, quantity.turn) for each in drawn]
    lines = [line for each in drawn for line in each.lines]
    low, high = limits(*(line.values for line in lines))
    if len(lines) > 1:
        drawn = _coloured(drawn)
        high += LEGEND_SHARE * len(lines) * (high - low)
    named = (replace(each, name=f"{i}_{_entity(each.name)}") for i, each in enumerate(drawn))
    return Panel(
        f"{name}_{_entity(quantity.name)}",
        title_of(quantity.name, quantity.display[0]),
        tuple(named),
        (low, high),
        legend=len(lines) > 1,
    )


def _turned_to(reference: Series, series: Series, turn: float) -> Series:
    """Return an angle shifted by whole turns, so that it is nearest to a reference."""
    (line,), (other,) = series.lines, reference.lines
    known, other_known = np.isfinite(line.values), np.isfinite(other.values)
    at, other_at = series.time_secs[known], reference.time_secs[other_known]
    difference = line.values[known] - np.interp(at, other_at, other.values[other_known])
    turns = float(np.round(np.median(difference) / turn))
    return replace(series, lines=(replace(line, values=line.values - turn * turns),))


def _coloured(drawn: list[Series]) -> list[Series]:
    """Return the series with a colour of its own for each line, as far as there are colours."""
    colours = cycle(SOURCE_COLOURS)
    return [
        replace(each, lines=tuple(replace(line, colour=next(colours)) for line in each.lines))
        for each in drawn
    ]


def _entity(text: str) -> str:
    """Return a text as a part of an entity's path, in which Rerun takes few characters."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)
