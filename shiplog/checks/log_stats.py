"""One pass over a log that computes the statistics of all its channels."""

from collections import Counter
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.geodesy import positions_of
from shiplog.types import Channel, ChunkedLog, FloatArray, TimeArray
from shiplog.units import CATALOGUE

from .channel_stats import (
    GAP_SECS,
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
from .stuck import StuckCheck

Mask = NDArray[np.bool_]
ChannelKey = tuple[str, tuple[str, ...]]  # topic and fields

MIN_INTERVALS = 10  # fewer do not show whether a channel is irregular
LAST_INSTANT_NS = np.iinfo(np.int64).max


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
        Treat impossible values and sentinels as not measured: they are then not valid. Where there
        are sentinels, the log is read a second time.
    sources
        The source in use, by the name of a quantity: fixes are not judged by another speed.

    Examples
    --------
    >>> import shiplog
    >>> stats = compute_log_stats(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> stats["yaw_rate"].samples, round(stats["yaw_rate"].interval_secs, 3)
    (6001, 0.1)
    """
    collectors = _collect(log, {}, strict=strict)
    if strict:
        cleanings = {key: found for key, each in collectors.items() if (found := each.cleaning())}
        collectors = _collect(log, cleanings, strict=True) if cleanings else collectors
    used = (sources or {}).get("speed")
    speeds = [c for c in collectors.values() if c.name == "speed" and used in (None, c.source)]
    max_speed = max((c.max_value for c in speeds), default=0.0)
    return LogStats(log.name, tuple(c.result(max_speed) for c in collectors.values()))


class _Cleaning(NamedTuple):
    """Which values of a channel cannot be used: those outside the limits, and its sentinels."""

    limits: tuple[float, float]
    sentinels: tuple[float, ...] = ()


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
        self._limits = cleaning.limits
        self._sentinels = dict.fromkeys(cleaning.sentinels, 0)  # with the number of samples of each
        kind = CATALOGUE.get(channel.name)
        circular = kind is not None and kind.circular
        commanded = kind is not None and kind.commanded
        self._stuck = None if commanded else StuckCheck(circular=circular)
        self._fixes = (
            FixScreen() if channel.name == "position" and len(channel.fields) > 1 else None
        )
        self._samples = self._duplicates = self._missing = self._valid = self._negative = 0
        self._start = self._last = self._last_valid = 0
        self._span = self._valid_span = (LAST_INSTANT_NS, -LAST_INSTANT_NS)
        self._value_range = (np.inf, -np.inf)
        self._backward_steps, self._received_early = Occurrences(), Occurrences()
        self._infinite, self._impossible = Occurrences(), Occurrences()
        self._max_delay_ns = 0
        self._impossible_values: Counter[float] = Counter()
        self._worst_excess = 0.0  # of an impossible value over its limit
        self._long_intervals = [np.zeros((0, 2), np.int64)]  # rows of start and length, ns
        self._intervals, self._values = Quantiles(), Quantiles()
        self._row_intervals = self._intervals  # one object until the first invalid sample
        self._changes = Quantiles() if kind is not None and kind.commanded else None
        self._last_value = np.nan

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
        if not self._samples:
            self._start = self._last = self._last_valid = int(channel.measured_ns[0])
        if self._sentinels:
            for value in self._sentinels:
                self._sentinels[value] += int(np.count_nonzero(channel.values == value))
            channel = without_unusable(channel, (-np.inf, np.inf), self._sentinels)
        rows = channel.values.reshape(len(channel), -1)
        if self._fixes:
            self._fixes.add(channel)
            rows = _without_altitude(channel)
        valid = self._usable(channel, rows)
        if not valid.all() and self._row_intervals is self._intervals:
            self._row_intervals = deepcopy(self._intervals)
        self._add_times(channel, valid)
        self._add_values(channel, rows, valid)
        if self._stuck and valid.any():
            secs = (channel.measured_ns - self._start) * 1e-9
            self._stuck.add(*((secs, rows) if valid.all() else (secs[valid], rows[valid])))
        self._samples += len(channel)

    def _usable(self, channel: Channel, rows: FloatArray) -> Mask:
        """Which samples are finite and, with `strict`, possible, (n,)."""
        if channel.fields or not self._strict or self._limits == (-np.inf, np.inf):
            return np.asarray(np.isfinite(rows).all(axis=1))
        return np.asarray((rows[:, 0] >= self._limits[0]) & (rows[:, 0] <= self._limits[1]))

    def _add_times(self, channel: Channel, valid: Mask) -> None:
        times = channel.measured_ns
        with_last = np.concatenate(([self._last], times)) if self._samples else times
        steps = np.diff(with_last)
        backward = np.flatnonzero(steps < 0)
        if len(backward):
            first_step = -float(steps[backward[0]]) * 1e-9
            self._backward_steps = self._with_more(
                self._backward_steps, len(backward), with_last[backward[0]], first_step
            )
        if self._row_intervals is not self._intervals:
            steps = np.diff(np.sort(with_last))
            self._row_intervals.add(steps[steps > 0].astype(float))
        self._add_intervals(channel, valid)
        self._add_delays(channel)
        self._span = _extended_span(self._span, times)
        self._valid_span = _extended_span(self._valid_span, times[valid])
        self._last = int(times[-1])
        if valid.any():
            self._last_valid = int(times[valid][-1])

    def _add_intervals(self, channel: Channel, valid: Mask) -> None:
        """Add the intervals between valid samples, and the changes of an input over them."""
        times, values = channel.measured_ns[valid], channel.values[valid]
        if self._valid:
            times = np.concatenate(([self._last_valid], times))
        steps = np.diff(times)
        order: slice | NDArray[np.intp] = slice(None)
        if (steps < 0).any():
            order = np.argsort(times, kind="stable")
            times = times[order]
            steps = np.diff(times)
        positive = steps > 0
        self._duplicates += len(steps) - int(np.count_nonzero(positive))
        self._intervals.add(steps[positive].astype(float))
        long = np.flatnonzero(steps > GAP_SECS * 1e9)
        self._long_intervals.append(np.column_stack((times[long], steps[long])))
        if self._changes is not None and len(values):
            if self._valid:
                values = np.concatenate(([self._last_value], values))
            self._changes.add(np.abs(np.diff(values[order]))[positive])
            self._last_value = float(values[-1])

    def _add_delays(self, channel: Channel) -> None:
        lead = channel.measured_ns - channel.received_ns
        self._max_delay_ns = max(self._max_delay_ns, -int(lead.min()))
        largest_lead = float(lead.max()) * 1e-9
        if largest_lead > 0:
            extent = max(self._received_early.extent, largest_lead)
            early = lead > 0
            count, first_ns = int(np.count_nonzero(early)), int(channel.measured_ns[early.argmax()])
            more = self._with_more(self._received_early, count, first_ns, 0.0)
            self._received_early = replace(more, extent=extent)

    def _add_values(self, channel: Channel, rows: FloatArray, valid: Mask) -> None:
        if not valid.all() or channel.fields or not self._strict:
            times = channel.measured_ns
            self._missing += _missing(channel)
            infinite = np.flatnonzero(np.isinf(rows).any(axis=1))
            if len(infinite):
                self._infinite = self._with_more(
                    self._infinite, len(infinite), times[infinite[0]], 0.0
                )
            self._add_impossible(channel, rows)
        values = rows[valid]
        self._valid += len(values)
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
            first_ns = channel.measured_ns[impossible[0]]
            more = self._with_more(self._impossible, len(impossible), first_ns, 0.0)
            self._impossible = replace(more, extent=extent)
            self._count_impossible(rows[impossible, 0])

    def _count_impossible(self, values: FloatArray) -> None:
        """Count impossible values by value, as long as these are few."""
        if len(self._impossible_values) < MAX_IMPOSSIBLE_VALUES:
            self._impossible_values.update(values.tolist())

    def _with_more(
        self, occurrences: Occurrences, count: int, at_ns: int, extent: float
    ) -> Occurrences:
        """Add occurrences to those before; time and extent stay those of the first one."""
        if occurrences.count:
            return replace(occurrences, count=occurrences.count + count)
        return Occurrences(count, float(at_ns - self._start) * 1e-9, extent)

    def _regularity(self) -> tuple[float, tuple[float, float]]:
        """Return the irregularity of the intervals, and their range.

        A value that was removed was sent in time: where no row is empty, the rows are judged.
        """
        sentinels = sum(self._sentinels.values())
        removed = self._impossible.count + sentinels
        rows = removed and self._missing == sentinels
        intervals = self._row_intervals if rows else self._intervals
        return _regularity(intervals.values * 1e-9, _median_secs(intervals))

    def cleaning(self) -> _Cleaning | None:
        """Return what the samples show to be unusable; None where a second pass is needless."""
        if self._channel.fields or not self._valid:
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

    def result(self, max_speed: float) -> ChannelStats:
        """Return the statistics of all samples added; `max_speed` of the log, m/s."""
        fixes = self._fixes.result(max_speed) if self._fixes else None
        channel, interval = self._channel, _median_secs(self._intervals)
        irregular_share, interval_range = self._regularity()
        hold = self._hold(interval)
        return ChannelStats(
            name=channel.name,
            source=channel.source,
            unit=channel.unit,
            fields=channel.fields,
            samples=self._samples,
            span_ns=self._span if self._samples else (0, 0),
            interval_secs=interval,
            row_interval_secs=_median_secs(self._row_intervals),
            gaps=() if hold else self._gaps(interval),
            irregular_share=irregular_share,
            interval_range_secs=interval_range,
            duplicate_times=self._duplicates,
            backward_steps=self._backward_steps,
            received_early=self._received_early,
            max_delay_ns=self._max_delay_ns,
            missing=self._missing - sum(self._sentinels.values()),
            infinite=self._infinite,
            impossible=self._impossible,
            impossible_value=next(iter(self._impossible_values.most_common(1)), (np.nan, 0)),
            sentinels=tuple(self._sentinels.items()),
            limits=self._limits,
            stuck=self._stuck.result(interval) if self._stuck else None,
            valid=fixes.usable if fixes else self._valid,
            valid_span_ns=(
                fixes.usable_span_ns if fixes else self._valid_span if self._valid else (0, 0)
            ),
            value_range=self._value_range,
            median=self._values.median(),
            negative_share=self._negative / self._valid if self._valid else 0.0,
            strict=self._strict,
            interpolation=stated_interpolation(channel),
            hold=hold,
            fixes=fixes,
        )

    def _hold(self, interval: float) -> HoldStats | None:
        """Return the figures of a channel to be held; None where it is to be interpolated."""
        stated = stated_interpolation(self._channel)
        if stated == "linear" or self._channel.fields or not self._valid:
            return None
        intervals = self._intervals.values * 1e-9
        if not (stated or len(intervals)) and self.name.startswith("rudder"):
            return None  # one sample of a rudder shows nothing; revolutions may be written once
        changes = np.zeros(0) if self._changes is None else self._changes.values
        if stated != "hold":
            order, gap_secs = is_order(self._channel.source), gap_threshold_secs(interval)
            if self._changes is None or not is_written_on_change(
                intervals, changes, gap_secs, order=order
            ):
                return None
        longest, largest = (float(each.max(initial=0.0)) for each in (intervals, changes))
        return HoldStats(stated == "hold", longest, largest)

    def _gaps(self, interval: float) -> tuple[tuple[float, float], ...]:
        """Start and length of each gap, s."""
        long = np.concatenate(self._long_intervals)
        long = long[long[:, 1] * 1e-9 > gap_threshold_secs(interval)]
        gaps = zip((long[:, 0] - self._span[0]) * 1e-9, long[:, 1] * 1e-9, strict=True)
        return tuple((float(start), float(length)) for start, length in gaps)


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


def _extended_span(span: tuple[int, int], times: TimeArray) -> tuple[int, int]:
    if not len(times):
        return span
    return min(span[0], int(times.min())), max(span[1], int(times.max()))


def _median_secs(intervals: Quantiles) -> float:
    """Median of intervals in ns, as s; 0 without any."""
    return intervals.median() * 1e-9 if len(intervals.values) else 0.0


def _regularity(intervals: FloatArray, typical: float) -> tuple[float, tuple[float, float]]:
    """Share of intervals that differ by more than half from the typical one, and their range.

    Gaps are not counted.
    """
    steps = intervals[intervals <= gap_threshold_secs(typical)]
    if len(steps) < MIN_INTERVALS:
        return 0.0, (typical, typical)
    low, high = np.percentile(steps, [1, 99])
    return float(np.mean(np.abs(steps - typical) > 0.5 * typical)), (float(low), float(high))
