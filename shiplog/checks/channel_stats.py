"""What a log holds, channel by channel, from one pass over it, whatever its length."""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shiplog.types import Channel, ChannelsByName, FloatArray, Log, TimeArray
from shiplog.units import CATALOGUE, GEOGRAPHIC

from .quantiles import Quantiles
from .stuck import StuckCheck, StuckStats

Mask = NDArray[np.bool_]

GAP_PERIODS = 5.0  # a silence of so many usual periods is a gap
GAP_SECS = 1.0  # but nothing shorter than this
FEWEST_INTERVALS = 10  # to tell whether a channel is regular
_NEVER = np.iinfo(np.int64).max
_GLOBE = {"latitude": 90.0, "longitude": 180.0}


@dataclass(frozen=True)
class Occurrences:
    """How often something was met in a channel, and what tells of one case."""

    count: int = 0
    first_secs: float = 0.0  # of the first, since the channel's start
    extent: float = 0.0  # of the first or of the worst


@dataclass(frozen=True, eq=False)
class ChannelStats:
    """What a channel holds. Known are values that are finite, and possible too if `strict`."""

    name: str
    source: str
    unit: str
    fields: tuple[str, ...]
    samples: int
    span_ns: tuple[int, int]  # the first and the last instant; (0, 0) of none
    interval_secs: float  # the median interval between samples; 0 where there is none
    gaps: tuple[tuple[float, float], ...]  # start, since the channel's, and length, s
    irregular_share: float  # share of the other intervals that are more than half off the usual one
    interval_range_secs: tuple[float, float]  # s: their percentiles 1 and 99
    duplicate_times: int  # samples with the time of the one before
    backward_steps: Occurrences  # by how many seconds the measured times first ran back
    received_early: Occurrences  # received before measured, by seconds at the most
    max_delay_ns: int  # from measurement to reception, at the most
    missing: int  # NaN
    infinite: Occurrences
    impossible: Occurrences  # and the worst value
    stuck: StuckStats | None
    valid: int
    valid_span_ns: tuple[int, int]
    valid_interval_secs: float
    value_range: tuple[float, float]  # of the known values; NaN where there are none
    median: float
    negative_share: float
    strict: bool = False

    @property
    def topic(self) -> str:
        """`/yaw_rate/gyro`, as the channel's."""
        return f"/{self.name}/{self.source}"

    @property
    def gap_threshold_secs(self) -> float:
        """The silence beyond which the channel was not measured, not between two samples."""
        return gap_threshold_secs(self.interval_secs)

    def select(self, chunk: tuple[Channel, ...]) -> Channel | None:
        """The part of a chunk that is this channel's, what is not known as NaN."""
        for channel in chunk:
            if channel.topic == self.topic and channel.fields == self.fields:
                return without_impossible(channel) if self.strict else channel
        return None


@dataclass(frozen=True, eq=False)
class LogStats(ChannelsByName[ChannelStats]):
    """What a log holds."""

    name: str
    channels: tuple[ChannelStats, ...]

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first and the last instant at which anything was measured; (0, 0) if nothing was."""
        spans = [channel.span_ns for channel in self.channels if channel.samples]
        if not spans:
            return (0, 0)
        return min(start for start, _ in spans), max(end for _, end in spans)

    @property
    def duration_secs(self) -> float:
        """From the first measurement to the last."""
        start, end = self.span_ns
        return (end - start) * 1e-9


def compute_log_stats(log: Log, *, strict: bool = False) -> LogStats:
    """Go through a log once and say what each of its channels holds.

    `strict` takes what no ship does as not measured.
    """
    collectors: dict[tuple[str, tuple[str, ...]], _ChannelStatsCollector] = {}
    for chunk in log.chunks():
        for channel in chunk:
            if channel.key not in collectors:
                collectors[channel.key] = _ChannelStatsCollector(channel, strict=strict)
            collectors[channel.key].add(channel)
    return LogStats(log.name, tuple(collector.result() for collector in collectors.values()))


def gap_threshold_secs(interval_secs: float) -> float:
    """How far apart two samples of a sensor of that usual period may stand without a gap."""
    return max(GAP_PERIODS * interval_secs, GAP_SECS)


def without_impossible(channel: Channel) -> Channel:
    """The channel with what no ship does as not measured."""
    kind = CATALOGUE.get(channel.name)
    if kind is None or channel.fields:
        return channel
    values = channel.values
    credible = (values >= kind.lowest) & (values <= kind.highest)
    return (
        channel if credible.all() else replace(channel, values=np.where(credible, values, np.nan))
    )


class _ChannelStatsCollector:
    """Counts one channel's samples as they come."""

    def __init__(self, channel: Channel, *, strict: bool) -> None:
        self._channel, self._strict = channel, strict  # the former for what it is called
        kind = CATALOGUE.get(channel.name)
        self._stuck = None if kind is not None and kind.commanded else StuckCheck()
        self._samples = self._repeated = self._missing = self._known = self._negative = 0
        self._start = self._last = self._last_known = 0
        self._span, self._known_span = (_NEVER, -_NEVER), (_NEVER, -_NEVER)
        self._extremes = (np.inf, -np.inf)
        self._backwards, self._early, self._infinite, self._impossible = (Occurrences(),) * 4
        self._delay = 0
        self._worst_beyond = 0.0  # by which a value is impossible
        self._long = [np.zeros((0, 2), np.int64)]  # rows of the start and length of a long step
        self._intervals, self._values = Quantiles(), Quantiles()
        self._known_intervals = self._intervals  # until a sample is not known

    def add(self, channel: Channel) -> None:
        """Take the next samples."""
        if not len(channel):
            return
        if not self._samples:
            self._start = self._last = self._last_known = int(channel.measured_ns[0])
        rows = channel.values.reshape(len(channel), -1)
        known = _known(channel, rows, strict=self._strict)
        if not known.all() and self._known_intervals is self._intervals:
            self._known_intervals = deepcopy(self._intervals)
        self._add_times(channel, known)
        self._add_values(channel, rows, known)
        if self._stuck:
            self._stuck.add((channel.measured_ns - self._start) * 1e-9, rows)
        self._samples += len(channel)

    def _add_times(self, channel: Channel, known: Mask) -> None:
        times = channel.measured_ns
        joined = np.concatenate(([self._last], times)) if self._samples else times
        steps = np.diff(joined)
        back = np.flatnonzero(steps < 0)
        if len(back):
            by = -float(steps[back[0]]) * 1e-9
            self._backwards = self._met(self._backwards, len(back), joined[back[0]], by)
            joined = np.sort(joined)
            steps = np.diff(joined)
        self._repeated += int(np.count_nonzero(steps == 0))
        self._intervals.add(steps[steps > 0].astype(float))
        long = np.flatnonzero(steps > GAP_SECS * 1e9)
        self._long.append(np.column_stack((joined[long], steps[long])))
        early = times - channel.received_ns
        self._delay = max(self._delay, -int(early.min()))
        ahead = float(early.max()) * 1e-9
        if ahead > 0:
            worst = max(self._early.extent, ahead)
            count, first = int(np.count_nonzero(early > 0)), int(times[np.argmax(early > 0)])
            met = self._met(self._early, count, first, 0.0)
            self._early = replace(met, extent=worst)
        if self._known_intervals is not self._intervals:
            joined = np.concatenate(([self._last_known] * (self._known > 0), times[known]))
            steps = np.diff(np.sort(joined))
            self._known_intervals.add(steps[steps > 0].astype(float))
        self._span = _spanned(self._span, times)
        self._known_span = _spanned(self._known_span, times[known])
        self._last = int(times[-1])
        if known.any():
            self._last_known = int(times[known][-1])

    def _add_values(self, channel: Channel, rows: FloatArray, known: Mask) -> None:
        if not known.all() or channel.fields or not self._strict:
            times = channel.measured_ns
            self._missing += int(np.count_nonzero(np.isnan(rows).all(axis=1)))
            infinite = np.flatnonzero(np.isinf(rows).any(axis=1))
            if len(infinite):
                self._infinite = self._met(self._infinite, len(infinite), times[infinite[0]], 0.0)
            self._add_impossible(channel, rows)
        values = rows[known]
        self._known += len(values)
        if len(values) and not channel.fields:
            low, high = self._extremes
            # + 0.0: a negative zero is a zero
            low, high = min(low, float(values.min())), max(high, float(values.max()))
            self._extremes = low + 0.0, high + 0.0
            self._negative += int(np.count_nonzero(values < 0))
            self._values.add(values[:, 0])

    def _add_impossible(self, channel: Channel, rows: FloatArray) -> None:
        beyond = _beyond(channel, rows)
        bad = np.flatnonzero(beyond > 0)
        if len(bad):
            worst = int(np.nanargmax(beyond))
            extent = self._impossible.extent
            if beyond[worst] > self._worst_beyond:
                self._worst_beyond, extent = float(beyond[worst]), float(rows[worst, 0])
            met = self._met(self._impossible, len(bad), channel.measured_ns[bad[0]], 0.0)
            self._impossible = replace(met, extent=extent)

    def _met(self, cases: Occurrences, count: int, at_ns: int, extent: float) -> Occurrences:
        """Some more cases; the first of all is told."""
        if cases.count:
            return replace(cases, count=cases.count + count)
        return Occurrences(count, float(at_ns - self._start) * 1e-9, extent)

    def result(self) -> ChannelStats:
        """What all that was added comes to."""
        channel, usual = self._channel, _median_secs(self._intervals)
        known = self._known_intervals
        long = np.concatenate(self._long)
        long = long[long[:, 1] * 1e-9 > gap_threshold_secs(usual)]
        gaps = zip((long[:, 0] - self._span[0]) * 1e-9, long[:, 1] * 1e-9, strict=True)
        irregular_share, interval_range_secs = _beat(self._intervals.values * 1e-9, usual)
        return ChannelStats(
            name=channel.name,
            source=channel.source,
            unit=channel.unit,
            fields=channel.fields,
            samples=self._samples,
            span_ns=self._span if self._samples else (0, 0),
            interval_secs=usual,
            gaps=tuple((float(start), float(length)) for start, length in gaps),
            irregular_share=irregular_share,
            interval_range_secs=interval_range_secs,
            duplicate_times=self._repeated,
            backward_steps=self._backwards,
            received_early=self._early,
            max_delay_ns=self._delay,
            missing=self._missing,
            infinite=self._infinite,
            impossible=self._impossible,
            stuck=self._stuck.result(usual) if self._stuck else None,
            valid=self._known,
            valid_span_ns=self._known_span if self._known else (0, 0),
            valid_interval_secs=usual if known is self._intervals else _median_secs(known),
            value_range=self._extremes,
            median=self._values.median(),
            negative_share=self._negative / self._known if self._known else 0.0,
            strict=self._strict,
        )


def _known(channel: Channel, rows: FloatArray, *, strict: bool) -> Mask:
    """Which samples are finite, and possible if need be."""
    kind = CATALOGUE.get(channel.name)
    if channel.fields or kind is None or not strict:
        return np.asarray(np.isfinite(rows).all(axis=1))
    return np.asarray((rows[:, 0] >= kind.lowest) & (rows[:, 0] <= kind.highest))


def _beyond(channel: Channel, rows: FloatArray) -> FloatArray:
    """By how much each sample lies beyond what is possible, (n,); none where not positive."""
    kind = CATALOGUE.get(channel.name)
    if channel.fields == GEOGRAPHIC:
        limits = np.array([_GLOBE.get(field, np.inf) for field in channel.fields])
        with np.errstate(invalid="ignore"):  # an infinite altitude
            beyond = np.abs(rows) - limits
        return np.asarray(np.nan_to_num(beyond, nan=-np.inf).max(axis=1))
    if channel.fields or kind is None:
        return np.full(len(rows), -np.inf)
    return np.asarray(np.maximum(kind.lowest - rows[:, 0], rows[:, 0] - kind.highest))


def _spanned(span: tuple[int, int], times: TimeArray) -> tuple[int, int]:
    if not len(times):
        return span
    return min(span[0], int(times.min())), max(span[1], int(times.max()))


def _median_secs(intervals: Quantiles) -> float:
    return intervals.median() * 1e-9 if len(intervals.values) else 0.0


def _beat(intervals: FloatArray, usual: float) -> tuple[float, tuple[float, float]]:
    """The share of intervals, but for gaps, that are more than half off, and their range."""
    steps = intervals[intervals <= gap_threshold_secs(usual)]
    if len(steps) < FEWEST_INTERVALS:
        return 0.0, (usual, usual)
    low, high = np.percentile(steps, [1, 99])
    return float(np.mean(np.abs(steps - usual) > 0.5 * usual)), (float(low), float(high))
