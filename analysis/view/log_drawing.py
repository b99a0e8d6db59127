"""A log as recorded, drawn without a replay: the series of its channels, its gaps and its track."""

from dataclasses import dataclass

import numpy as np

from analysis.replay.track import RecordedTrack
from analysis.trial.log_manoeuvres import LogManoeuvres
from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.data_quality import defect_warnings, unusable_causes
from shiplog.checks.log_stats import compute_log_stats
from shiplog.geodesy import LocalFrame
from shiplog.mcap.trial_log import no_samples_error
from shiplog.types import Channel, Event, EventLevel, FloatArray, Log

from .channel_series import ChannelSeries, DrawnQuantity, channel_label, channels_by_quantity
from .decimation import Decimator, bucket_size
from .panels import REVIEW_UNITS
from .quantity_panel import has_any_value
from .series import GREY, Line, Series

MAX_GAPS = 200  # of a channel that are marked: the longest ones


@dataclass(frozen=True)
class FirstExecute:
    """The execute of a log's first manoeuvre, from which its drawing may count.

    Attributes
    ----------
    manoeuvre
        Its title, such as ``zig-zag 20°/20°, first to starboard``.
    at_ns
        The instant, ns since 1970-01-01 UTC.
    approach_heading
        The mean heading before it, rad; NaN where not known.
    """

    manoeuvre: str
    at_ns: int
    approach_heading: float


@dataclass(frozen=True, eq=False)
class LogDrawing:
    """What is drawn of one log.

    Attributes
    ----------
    name
        The name of the log.
    stats
        The statistics of its channels.
    series
        The series of each quantity that has a value, a series for each source.
    gaps
        The start and the end of the gaps of each quantity, (g, 2) s.
    track
        North and east, m, over time; None where the log has no positions.
    frame
        The local frame of the track.
    events
        The events of the log, and the longest gap of each channel as a warning.
    warnings
        Problems of the file and of its channels, each in a sentence.
    execute
        From which the times of the series count; None where they count from the log's start.
    manoeuvres
        Those that are shown, and the signals that show them; None where none are looked for.
    """

    name: str
    stats: LogStats
    series: dict[DrawnQuantity, list[Series]]
    gaps: dict[DrawnQuantity, FloatArray]
    track: Series | None
    frame: LocalFrame | None
    events: tuple[Event, ...]
    warnings: tuple[str, ...]
    execute: FirstExecute | None = None
    manoeuvres: LogManoeuvres | None = None

    @property
    def zero_ns(self) -> int:
        """The instant from which the times of the series count, ns since 1970-01-01 UTC."""
        return self.stats.span_ns[0] if self.execute is None else self.execute.at_ns


def draw_log(log: Log, *, full: bool = False) -> LogDrawing:
    """Draw all channels of a log at their own times.

    The log may be longer than memory; it is read twice, and once more for sentinels or spikes.
    Values that cannot be used (impossible ones, sentinels, spikes) are not drawn, and reported.

    Parameters
    ----------
    log
        The log as recorded.
    full
        Whether to keep every sample, in memory; by default what a screen can show.

    Raises
    ------
    LogError
        The log has no sample.

    Examples
    --------
    >>> import shiplog
    >>> drawing = draw_log(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> [quantity.name for quantity in drawing.series]
    ['yaw_rate', 'speed', 'rudder', 'rpm', 'heading']
    """
    stats = compute_log_stats(log, strict=True)
    if not any(channel.samples for channel in stats):
        raise no_samples_error("view", log.warnings, log.name)
    span = stats.span_ns[0], stats.duration_secs
    groups = channels_by_quantity(stats, REVIEW_UNITS)
    drawn = {
        quantity: [
            ChannelSeries(each, span, quantity, channel_label(each, quantity), full=full)
            for each in channels
        ]
        for quantity, channels in groups.items()
    }
    track = _TrackSeries(stats, full=full)
    for chunk in log.chunks():
        track.add(chunk)
        for group in drawn.values():
            for series in group:
                series.add(chunk)
    results = {quantity: [each.result() for each in group] for quantity, group in drawn.items()}
    return LogDrawing(
        log.name,
        stats,
        {quantity: kept for quantity, group in results.items() if (kept := _with_values(group))},
        {quantity: _gaps(channels, span[0]) for quantity, channels in groups.items()},
        track.result(),
        track.frame,
        _events(log, stats),
        tuple(_warnings(log, stats)),
    )


class _TrackSeries:
    """The track from the recorded positions of the source that has most of them."""

    def __init__(self, stats: LogStats, *, full: bool) -> None:
        sources = [channel for channel in stats if channel.name == "position"]
        best = max(sources, key=lambda channel: channel.valid, default=None)
        self._positions, self._decimator = None, Decimator(0.0)
        if best is not None and best.valid > 1:
            self._positions = RecordedTrack(stats.span_ns[0], best)
            size = 0 if full else bucket_size(best.samples, 2)
            self._decimator = Decimator(size * best.interval_secs)

    @property
    def frame(self) -> LocalFrame | None:
        """The local frame of the track."""
        return self._positions.frame if self._positions else None

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the positions in the next chunk of the log."""
        if self._positions:
            track = self._positions.step(chunk)
            lines = Line("north", track.north, GREY), Line("east", track.east, GREY)
            self._decimator.add(Series("track", track.time_secs, lines))

    def result(self) -> Series | None:
        """Return the track, once all chunks were added."""
        return self._decimator.result() if self._positions else None


def _with_values(group: list[Series]) -> list[Series]:
    return [series for series in group if has_any_value(series)]


def _gaps(channels: list[ChannelStats], start_ns: int) -> FloatArray:
    """Return the longest gaps of some channels in the order of time, (g, 2) s."""
    rows = []
    for channel in channels:
        offset = (channel.span_ns[0] - start_ns) * 1e-9
        longest = sorted(channel.gaps, key=lambda gap: -gap[1])[:MAX_GAPS]
        rows += [(offset + start, offset + start + length) for start, length in longest]
    return np.array(sorted(rows)).reshape(-1, 2)


def _events(log: Log, stats: LogStats) -> tuple[Event, ...]:
    """Return the events of the log, and the longest gap of each channel as a warning among them."""
    gaps = []
    for channel in stats:
        if channel.gaps:
            start, length = max(channel.gaps, key=lambda gap: gap[1])
            number = len(channel.gaps)
            text = "a gap" if number == 1 else f"the longest of {number} gaps"
            at = channel.span_ns[0] + round(start * 1e9)
            gaps.append(
                Event(at, f"{text}, {length:.1f} s", channel.topic.strip("/"), EventLevel.WARNING)
            )
    return tuple(sorted((*log.events, *gaps), key=lambda event: event.time_ns))


def _warnings(log: Log, stats: LogStats) -> list[str]:
    unusable = [f"{channel.topic} {text}" for channel in stats for text in unusable_causes(channel)]
    return [*log.warnings, *unusable, *defect_warnings(stats, stats.span_ns[1])]
