"""One pass over a log that computes the statistics of all its channels."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shiplog.geodesy import positions_of
from shiplog.types import Channel, ChunkedLog, FloatArray
from shiplog.units import CATALOGUE

from .channel_stats import (
    ChannelStats,
    LogStats,
    Occurrences,
    gap_threshold_secs,
    possible_range,
    without_unusable,
)
from .fixes import MAX_IMPOSSIBLE_VALUES, FixScreen
from .on_change import HoldStats, is_order, is_written_on_change, stated_interpolation
from .quantiles import Quantiles
from .sentinels import MAX_WRAPPED, sentinel_values, unwrapped_limit
from .spikes import SMOOTH_QUANTITIES, SpikeSearch, SpikeStats
from .stuck import StuckCheck
from .time_stats import ChannelTimeStats, Mask

ChannelKey = tuple[str, tuple[str, ...]]  # topic and fields


def compute_log_stats(
    log: ChunkedLog, *, strict: bool = False, sources: Mapping[str, str] | None = None
) -> LogStats:
    """Compute the statistics of all channels in one pass over the log.

    The log may be longer than memory holds. Where its chunks are cut changes no result.

    Parameters
    ----------
    log
        The log; its chunks are read once.
    strict
        Treat impossible values, sentinels and spikes as not measured: they are then not valid.
        Where there are sentinels, the log is read once more, and where there are spikes, too.
    sources
        The source in use, by the name of a quantity: fixes are not judged by another speed.

    Examples
    --------
    >>> import shiplog
    >>> stats = compute_log_stats(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> stats["yaw_rate"].samples, round(stats["yaw_rate"].interval_secs, 3)
    (6001, 0.1)
    """
    cleanings: dict[ChannelKey, _Cleaning] = {}
    collectors = _collect(log, cleanings, strict=strict)
    # a sentinel is no spike: spikes are known once sentinels are omitted
    for find in (_ChannelStatsCollector.cleaning, _ChannelStatsCollector.despiking):
        found = {key: new for key, each in collectors.items() if strict and (new := find(each))}
        if found:
            cleanings |= found
            collectors = _collect(log, cleanings, strict=True)
    used = (sources or {}).get("speed")
    speeds = [c for c in collectors.values() if c.name == "speed" and used in (None, c.source)]
    max_speed = max((c.max_value for c in speeds), default=0.0)
    return LogStats(log.name, tuple(c.result(max_speed) for c in collectors.values()))


class _Cleaning(NamedTuple):
    """Values of a channel that cannot be used: those outside the limits, sentinels and spikes."""

    limits: tuple[float, float]
    sentinels: tuple[float, ...] = ()
    spikes: SpikeStats | None = None


def _collect(
    log: ChunkedLog, cleanings: Mapping[ChannelKey, _Cleaning], *, strict: bool
) -> "dict[ChannelKey, _ChannelStatsCollector]":
    """Collect the statistics of all channels in one pass."""
    collectors: dict[ChannelKey, _ChannelStatsCollector] = {}
    for chunk in log.chunks():
        for channel in chunk:
            key = channel.key
            if key not in collectors:
                cleaning = cleanings.get(key) or _Cleaning(possible_range(channel.name))
                collectors[key] = _ChannelStatsCollector(channel, cleaning, strict=strict)
            collectors[key].add(channel)
    return collectors


class _ChannelStatsCollector:
    """Accumulates the statistics of one channel chunk by chunk."""

    def __init__(self, channel: Channel, cleaning: _Cleaning, *, strict: bool) -> None:
        self._channel, self._strict = channel, strict  # the channel for its name, unit and fields
        self._cleaning, self._limits = cleaning, cleaning.limits
        self._sentinels = dict.fromkeys(cleaning.sentinels, 0)  # with the number of samples of each
        kind = CATALOGUE.get(channel.name)
        circular = kind is not None and kind.circular
        commanded = kind is not None and kind.commanded
        self._times = ChannelTimeStats(commanded=commanded)
        self._stuck = None if commanded else StuckCheck(circular=circular)
        smooth = channel.name in SMOOTH_QUANTITIES and not is_order(channel.source)
        search = strict and smooth and not (channel.fields or cleaning.spikes)
        self._spikes = SpikeSearch(circular=circular) if search else None
        self._removed = 0  # sentinels and spikes
        self._fixes = (
            FixScreen() if channel.name == "position" and len(channel.fields) > 1 else None
        )
        self._missing = self._negative = 0
        self._value_range = (np.inf, -np.inf)
        self._infinite, self._impossible = Occurrences(), Occurrences()
        self._impossible_values: Counter[float] = Counter()
        self._worst_excess = 0.0  # of an impossible value over its limit
        self._values = Quantiles()

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self._channel.name

    @property
    def source(self) -> str:
        """Source of the channel."""
        return self._channel.source

    @property
    def max_value(self) -> float:
        """Largest valid value that is possible; 0 without any."""
        return min(max(self._value_range[1], 0.0), CATALOGUE[self.name].highest)

    def add(self, channel: Channel) -> None:
        """Add the next samples of the channel."""
        if not len(channel):
            return
        if self._cleaning.sentinels or self._cleaning.spikes:
            for value in self._sentinels:
                self._sentinels[value] += int(np.count_nonzero(channel.values == value))
            missing = _missing(channel)
            channel = without_unusable(
                channel, (-np.inf, np.inf), self._sentinels, self._cleaning.spikes
            )
            self._removed += _missing(channel) - missing
        rows = channel.values.reshape(len(channel), -1)
        if self._fixes:
            self._fixes.add(channel)
            rows = _without_altitude(channel)
        valid = self._usable(channel, rows)
        self._times.add(channel, valid)
        self._add_values(channel, rows, valid)
        if self._stuck and valid.any():
            secs = (channel.measured_ns - self._times.start_ns) * 1e-9
            self._stuck.add(*((secs, rows) if valid.all() else (secs[valid], rows[valid])))
        if self._spikes:
            self._spikes.add(channel.measured_ns[valid], channel.values[valid])

    def _usable(self, channel: Channel, rows: FloatArray) -> Mask:
        """Which samples are finite and, with `strict`, possible, (n,)."""
        if channel.fields or not self._strict or self._limits == (-np.inf, np.inf):
            return np.asarray(np.isfinite(rows).all(axis=1))
        return np.asarray((rows[:, 0] >= self._limits[0]) & (rows[:, 0] <= self._limits[1]))

    def _add_values(self, channel: Channel, rows: FloatArray, valid: Mask) -> None:
        if not valid.all() or channel.fields or not self._strict:
            times = channel.measured_ns
            self._missing += _missing(channel)
            infinite = np.flatnonzero(np.isinf(rows).any(axis=1))
            if len(infinite):
                first_secs = self._times.secs(int(times[infinite[0]]))
                self._infinite = self._infinite.plus(len(infinite), first_secs)
            self._add_impossible(channel, rows)
        values = rows[valid]
        if len(values) and not channel.fields:
            low, high = self._value_range
            # + 0.0: a negative zero becomes a zero
            low, high = min(low, float(values.min())), max(high, float(values.max()))
            self._value_range = low + 0.0, high + 0.0
            self._negative += int(np.count_nonzero(values < 0))
            self._values.add(values[:, 0])

    def _add_impossible(self, channel: Channel, rows: FloatArray) -> None:
        excess = _excess(channel, rows, self._limits)
        impossible = np.flatnonzero(excess > 0)
        if len(impossible):
            worst = int(np.nanargmax(excess))
            extent = self._impossible.extent
            if excess[worst] > self._worst_excess:
                self._worst_excess, extent = float(excess[worst]), float(rows[worst, 0])
            first_secs = self._times.secs(int(channel.measured_ns[impossible[0]]))
            more = self._impossible.plus(len(impossible), first_secs)
            self._impossible = replace(more, extent=extent)
            self._count_impossible(rows[impossible, 0])

    def _count_impossible(self, values: FloatArray) -> None:
        """Count impossible values by value, as long as these are few."""
        if len(self._impossible_values) < MAX_IMPOSSIBLE_VALUES:
            self._impossible_values.update(values.tolist())

    def _regularity(self) -> tuple[float, tuple[float, float]]:
        """Return the irregularity of the intervals, and their range.

        A value that was removed was sent in time: where no row is empty, the rows are judged.
        """
        removed = self._impossible.count + self._removed
        return self._times.regularity(rows=bool(removed) and self._missing == self._removed)

    def cleaning(self) -> _Cleaning | None:
        """Return what the samples show to be unusable; None where a second pass is needless."""
        if self._channel.fields or not self._times.valid:
            return None
        (low, high), values = self._limits, self._values.values
        kind = CATALOGUE.get(self._channel.name)
        if kind is not None and kind.circular and max(map(abs, self._value_range)) > MAX_WRAPPED:
            limit = unwrapped_limit(values)
            low, high = max(low, -limit), min(high, limit)
            values = values[(values >= low) & (values <= high)]
        sentinels = sentinel_values(values, self._channel.unit)
        needless = (low, high) == self._limits and not sentinels
        return None if needless else _Cleaning((low, high), sentinels)

    def despiking(self) -> _Cleaning | None:
        """Return the cleaning with the spikes of the samples; None where there are none."""
        interval = self._times.median_interval_secs()
        if self._spikes is None or self._hold(interval):
            return None
        spikes = self._spikes.result(interval, rudder=self.name == "rudder")
        return self._cleaning._replace(spikes=spikes) if spikes else None

    def result(self, max_speed: float) -> ChannelStats:
        """Return the statistics of all samples added; `max_speed` of the log, m/s."""
        fixes = self._fixes.result(max_speed) if self._fixes else None
        channel, times = self._channel, self._times
        interval = times.median_interval_secs()
        irregular_share, interval_range = self._regularity()
        hold = self._hold(interval)
        return ChannelStats(
            name=channel.name,
            source=channel.source,
            unit=channel.unit,
            fields=channel.fields,
            samples=times.samples,
            span_ns=times.span_ns if times.samples else (0, 0),
            interval_secs=interval,
            row_interval_secs=times.median_row_interval_secs(),
            gaps=() if hold else times.gaps(),
            irregular_share=irregular_share,
            interval_range_secs=interval_range,
            duplicate_times=times.duplicates,
            backward_steps=times.backward_steps,
            received_early=times.received_early,
            max_delay_ns=times.max_delay_ns,
            missing=self._missing - self._removed,
            infinite=self._infinite,
            impossible=self._impossible,
            impossible_value=next(iter(self._impossible_values.most_common(1)), (np.nan, 0)),
            sentinels=tuple(self._sentinels.items()),
            spikes=self._cleaning.spikes,
            limits=self._limits,
            stuck=self._stuck.result(interval) if self._stuck else None,
            valid=fixes.usable if fixes else times.valid,
            valid_span_ns=(
                fixes.usable_span_ns if fixes else times.valid_span_ns if times.valid else (0, 0)
            ),
            value_range=self._value_range,
            median=self._values.median(),
            negative_share=self._negative / times.valid if times.valid else 0.0,
            strict=self._strict,
            interpolation=stated_interpolation(channel),
            hold=hold,
            fixes=fixes,
        )

    def _hold(self, interval: float) -> HoldStats | None:
        """Return the figures of a channel to be held; None where it is to be interpolated."""
        stated = stated_interpolation(self._channel)
        if stated == "linear" or self._channel.fields or not self._times.valid:
            return None
        intervals, changes = self._times.intervals.values * 1e-9, self._times.changes
        if not (stated or len(intervals)) and self.name.startswith("rudder"):
            return None  # one sample of a rudder shows nothing; revolutions may be written once
        steps = np.zeros(0) if changes is None else changes.values
        if stated != "hold":
            order, gap_secs = is_order(self._channel.source), gap_threshold_secs(interval)
            if changes is None or not is_written_on_change(intervals, steps, gap_secs, order=order):
                return None
        longest, largest = (float(each.max(initial=0.0)) for each in (intervals, steps))
        return HoldStats(stated == "hold", longest, largest)


def _missing(channel: Channel) -> int:
    """Count the samples that were not measured: all components NaN, or one of a position."""
    missing = np.isnan(channel.values.reshape(len(channel), -1))
    if channel.name == "position":
        return int(np.count_nonzero(missing[:, :2].any(axis=1)))
    return int(np.count_nonzero(missing.all(axis=1)))


def _without_altitude(channel: Channel) -> FloatArray:
    """Return the components of the positions that are needed, (n, 2); NaN where there is none.

    The altitude is optional. Latitude 0, longitude 0 is no position for the statistics.
    """
    positions = positions_of(channel.fields, channel.values)
    measured = positions.measured & ~positions.at_zero
    return np.where(measured[:, None], channel.values[:, :2], np.nan)


def _excess(channel: Channel, rows: FloatArray, limits: tuple[float, float]) -> FloatArray:
    """By how much each sample exceeds the limits of what is possible, (n,); <= 0 within them."""
    if channel.fields:
        return np.full(len(rows), -np.inf)
    return np.asarray(np.maximum(limits[0] - rows[:, 0], rows[:, 0] - limits[1]))
