"""Statistics of a log's raw channels: intervals, gaps, duplicates, impossible and stuck values.

`shiplog.checks.log_stats` computes them.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from shiplog.types import Channel, ChannelsByName
from shiplog.units import CATALOGUE

from .fixes import FixScreening
from .on_change import HoldStats, is_order
from .spikes import SpikeStats
from .stuck import StuckStats

GAP_PERIODS = 5.0  # an interval longer than this many typical ones is a gap,
GAP_SECS = 1.0  # if it is longer than this, too
MIN_ORDER_STEP = 0.06  # rad, about 3.5 deg: no steering gear moves a rudder by as much at once


@dataclass(frozen=True)
class Occurrences:
    """Count of a defect in a channel, with the first occurrence and its size.

    Attributes
    ----------
    count
        Number of samples with the defect.
    first_secs
        Time of the first one, in s since the channel's first sample.
    extent
        Size of the first one, or of the worst; see the field that holds it, also for the unit.
    """

    count: int = 0
    first_secs: float = 0.0
    extent: float = 0.0

    def plus(self, count: int, secs: float, extent: float = 0.0) -> "Occurrences":
        """Return these and `count` later ones; time and extent stay those of the first one."""
        if self.count:
            return replace(self, count=self.count + count)
        return Occurrences(count, secs, extent)


@dataclass(frozen=True, eq=False)
class ChannelStats:
    """Statistics of all samples of one channel.

    A sample is valid where all its components are finite and, with `strict`, where its value is
    physically possible, too.

    Attributes
    ----------
    name, source, unit, fields
        As those of the `Channel`.
    samples
        Number of samples.
    span_ns
        First and last instant of measurement; (0, 0) without samples.
    interval_secs
        Median interval between valid samples, in s; 0 where there is none.
    row_interval_secs
        Median interval between samples, valid or not, in s: shorter where a table has empty cells.
    gaps
        Start, in s since the channel's start, and length, in s, of each gap between valid samples.
    irregular_share
        Share of the intervals, gaps excluded, that differ by more than half of `interval_secs`
        from it.
    interval_range_secs
        Percentiles 1 and 99 of the intervals, gaps excluded, in s.
    duplicate_times
        Number of valid samples with the same time as the one before.
    backward_steps
        Samples whose measured time lies before that of the previous sample; `extent` is the
        first such step in s.
    received_early
        Samples received before they were measured; `extent` is the largest lead in s.
    max_delay_ns
        Largest delay from measurement to reception.
    missing
        Number of samples that are NaN in all components.
    infinite
        Samples with an infinite value.
    impossible
        Samples beyond what is possible on a ship; `extent` is the worst value.
    impossible_value
        The impossible value that occurs most often, and how often.
    sentinels
        Values that stand for "not available", each with its number of samples; with `strict`, these
        are not valid.
    spikes
        Single samples that leave the course of the channel, which with `strict` are not valid;
        None where there is none, and without `strict`.
    limits
        The physically possible range of the channel; values outside it are impossible.
    stuck
        Runs of one repeated value; None where there is none, and for commanded channels.
    valid
        Number of valid samples.
    valid_span_ns
        First and last instant of a valid sample; (0, 0) without any.
    value_range
        Smallest and largest valid value; (inf, -inf) without any, and for channels with `fields`.
    median
        Median of the valid values; NaN without any, and for channels with `fields`.
    negative_share
        Share of the valid values below zero.
    strict
        Whether impossible values count as not measured.
    interpolation
        What the channel's metadata states: `hold`, `linear`, or empty for nothing.
    hold
        Figures of a channel that is held between its samples; None for one that is not.
    fixes
        Of positions, which fixes are used, whether `strict` or not; None for other channels.
    """

    name: str
    source: str
    unit: str
    fields: tuple[str, ...]
    samples: int
    span_ns: tuple[int, int]
    interval_secs: float
    row_interval_secs: float
    gaps: tuple[tuple[float, float], ...]
    irregular_share: float
    interval_range_secs: tuple[float, float]
    duplicate_times: int
    backward_steps: Occurrences
    received_early: Occurrences
    max_delay_ns: int
    missing: int
    infinite: Occurrences
    impossible: Occurrences
    impossible_value: tuple[float, int]
    sentinels: tuple[tuple[float, int], ...]
    spikes: SpikeStats | None
    limits: tuple[float, float]
    stuck: StuckStats | None
    valid: int
    valid_span_ns: tuple[int, int]
    value_range: tuple[float, float]
    median: float
    negative_share: float
    strict: bool = False
    interpolation: str = ""
    hold: HoldStats | None = None
    fixes: FixScreening | None = None

    @property
    def topic(self) -> str:
        """Topic of the channel, such as `/yaw_rate/gyro`."""
        return f"/{self.name}/{self.source}"

    @property
    def gap_threshold_secs(self) -> float:
        """Longest interval between two valid samples, in s, that is not a gap of this channel."""
        return np.inf if self.hold else gap_threshold_secs(self.interval_secs)

    def select(self, chunk: tuple[Channel, ...]) -> Channel | None:
        """Return this channel's samples in a chunk of the log; None where it has none.

        With `strict`, unusable values are NaN; position fixes that are not used always are.
        """
        for channel in chunk:
            if channel.topic == self.topic and channel.fields == self.fields:
                return self.screened(channel)
        return None

    def screened(self, channel: Channel) -> Channel:
        """Return a part of this channel with NaN in place of values that are not used."""
        if self.fixes:
            return self.fixes.apply(channel)
        if not self.strict:
            return channel
        sentinels = tuple(value for value, _ in self.sentinels)
        return without_unusable(channel, self.limits, sentinels, self.spikes)


@dataclass(frozen=True, eq=False)
class LogStats(ChannelsByName[ChannelStats]):
    """Statistics of all channels of a log, by name as in the log.

    Attributes
    ----------
    name
        Name of the log.
    channels
        Statistics of each channel, in the order of the log.
    """

    name: str
    channels: tuple[ChannelStats, ...]

    def select_sources(self, sources: Mapping[str, str]) -> "LogStats":
        """Return the statistics with a single source for each of the names given."""
        selected = tuple(
            channel
            for channel in self.channels
            if sources.get(channel.name, channel.source) == channel.source
        )
        return replace(self, channels=selected)

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last instant at which anything was measured; (0, 0) if nothing was."""
        spans = [channel.span_ns for channel in self.channels if channel.samples]
        if not spans:
            return (0, 0)
        return min(start for start, _ in spans), max(end for _, end in spans)

    @property
    def duration_secs(self) -> float:
        """Time from the first measurement to the last, in s."""
        start, end = self.span_ns
        return (end - start) * 1e-9


def is_rudder_order(channel: ChannelStats) -> bool:
    """Return whether a rudder channel is the order, by its source or by its steps.

    A held rudder is the order if it changes by more than `MIN_ORDER_STEP` at once.
    """
    steps = channel.hold is not None and channel.hold.largest_step > MIN_ORDER_STEP
    return channel.name == "rudder" and (steps or is_order(channel.source))


def gap_threshold_secs(interval_secs: float) -> float:
    """Return the longest interval that is not a gap, in s.

    Parameters
    ----------
    interval_secs
        Typical interval between the samples of the sensor.

    Examples
    --------
    >>> gap_threshold_secs(0.1), gap_threshold_secs(2.0)
    (1.0, 10.0)
    """
    return max(GAP_PERIODS * interval_secs, GAP_SECS)


def possible_range(name: str) -> tuple[float, float]:
    """Return the physically possible range of a quantity; unlimited if it is not catalogued."""
    kind = CATALOGUE.get(name)
    return (kind.lowest, kind.highest) if kind else (-np.inf, np.inf)


def without_unusable(
    channel: Channel,
    limits: tuple[float, float],
    sentinels: Collection[float] = (),
    spikes: SpikeStats | None = None,
) -> Channel:
    """Return the channel with NaN in place of impossible values, of sentinels and of spikes.

    A channel with `fields` is returned unchanged.

    Parameters
    ----------
    channel
        A channel, or a part of one.
    limits
        The lowest and the highest possible value.
    sentinels
        Values that stand for "not available", from `shiplog.checks.sentinels`.
    spikes
        The spikes, from `shiplog.checks.spikes`.
    """
    if channel.fields or (limits == (-np.inf, np.inf) and not (sentinels or spikes)):
        return channel
    values = channel.values
    usable = (values >= limits[0]) & (values <= limits[1])
    if sentinels:
        usable &= ~np.isin(values, list(sentinels))
    if spikes:
        usable &= ~spikes.among(channel)
    return channel if usable.all() else replace(channel, values=np.where(usable, values, np.nan))
