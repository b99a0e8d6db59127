"""Content of a log as `shiplog info` shows it: times, rates, ranges, gaps and foreign topics."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from mcap import records

from shiplog.mcap.clock_repair import mixed_times_in
from shiplog.mcap.contents import McapContents, MessageCount
from shiplog.mcap.decode import is_events, is_foreign, is_raw, schema_of
from shiplog.mcap.mcap_file import open_mcap
from shiplog.mcap.raw_reader import raw_source
from shiplog.mcap.reader import read, sample_count
from shiplog.mcap.scan import scan
from shiplog.mcap.stream import open_log
from shiplog.mcap.summary import McapSummary
from shiplog.mcap.trial_log import build_trial_log
from shiplog.types import Channel, Event, Log, TrialLog
from shiplog.units import CATALOGUE, GEOGRAPHIC, display_conversion

from .channel_stats import ChannelStats, LogStats
from .data_quality import MAX_IRREGULAR_SHARE
from .log_content import ChannelInfo, ForeignTopic, LogInfo, RawTopic, ValueRange
from .log_stats import compute_log_stats

MAX_MESSAGES_TO_READ = 4_000_000  # of a finished file; of a longer one only the summary is read
_GEOGRAPHIC_UNITS = dict(zip(GEOGRAPHIC, ("deg", "deg", "m"), strict=True))


def read_log_info(
    path: str | os.PathLike[str],
    start: float | str | None = None,
    end: float | str | None = None,
) -> LogInfo:
    """Return the content of a log.

    A file is read whole, except a finished one with more than `MAX_MESSAGES_TO_READ` messages: of
    that only the summary is read, and a warning reports that rates and ranges are unknown. A part
    of it is read chunk by chunk.

    Parameters
    ----------
    path
        The MCAP file.
    start, end
        The part to describe, as `TrialLog.between` takes them; by default all.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.
    UsageError
        The part has no samples.

    Examples
    --------
    >>> info = read_log_info("sample_data/zigzag_20_20.mcap")
    >>> info.channels[0].topic, info.channels[0].samples, round(info.channels[0].rate_hz)
    ('/yaw_rate/simulated', 6001, 10)
    """
    path = Path(path)
    contents = McapContents()
    with open_mcap(path) as file:
        summary = None if file.check.is_intact is False else file.check.summary
        if summary and sample_count(summary) > MAX_MESSAGES_TO_READ:
            if start is None and end is None:
                return _info_of_summary(path, summary)
            log = open_log(path, start, end)
            others = _foreign_in_summary(summary), _raw_in_summary(summary)
            return _info_of_log(log, *others, finished=True)
        for _ in scan(file, contents):
            pass
    log = build_trial_log(path, contents).between(start, end)
    mixed = mixed_times_in(contents.mixed_times, log.span_ns)
    log = replace(log, warnings=(*log.warnings, *(span.message for span in mixed)))
    others = _foreign_in_contents(contents), _raw_in_contents(contents)
    return _info_of_log(log, *others, finished=contents.finished)


def _info_of_summary(path: Path, summary: McapSummary) -> LogInfo:
    statistics, name = summary.statistics, path.name
    channels = []
    for channel_id, channel in sorted(summary.channels.items()):
        if schema_of(channel, summary.schemas) is not None:
            source = channel.metadata.get("source", channel.topic.strip("/").partition("/")[2])
            unit, positive = (channel.metadata.get(key, "") for key in ("unit", "positive"))
            samples = statistics.channel_message_counts.get(channel_id, 0)
            channels.append(ChannelInfo(channel.topic, source, unit, positive, samples))
    warning = (
        f"{name}: only the summary of its {statistics.message_count:,} messages was read, so that "
        "rates, ranges and gaps are unknown; to read a part, use --from and --to"
    )
    return LogInfo(
        name,
        statistics.message_start_time,
        statistics.message_end_time,
        tuple(channels),
        _foreign_in_summary(summary),
        summary.metadata,
        summary.vessel_toml is not None,
        warnings=(warning,),
        raw=_raw_in_summary(summary),
        events=_events_of(path, summary),
    )


def _events_of(path: Path, summary: McapSummary) -> tuple[Event, ...]:
    """Read the events of a long file, from the few MCAP chunks that have any."""
    has_events = any(is_events(each, summary.schemas) for each in summary.channels.values())
    return read(path, channels=()).events if has_events else ()


def _foreign_in_summary(summary: McapSummary) -> tuple[ForeignTopic, ...]:
    counts = summary.statistics.channel_message_counts
    return tuple(
        _foreign_topic(channel, summary.schemas, counts.get(channel_id, 0))
        for channel_id, channel in sorted(summary.channels.items())
        if is_foreign(channel, summary.schemas)
    )


def _foreign_topic(
    channel: records.Channel, schemas: Mapping[int, records.Schema], messages: int
) -> ForeignTopic:
    """Return a topic of another program as its records describe it."""
    schema = schemas.get(channel.schema_id)
    name, encoding = (schema.name, schema.encoding) if schema else ("", "")
    return ForeignTopic(channel.topic, name, messages, channel.message_encoding, encoding)


def _raw_in_summary(summary: McapSummary) -> tuple[RawTopic, ...]:
    counts = summary.statistics.channel_message_counts
    return tuple(
        RawTopic(
            channel.topic,
            raw_source(channel),
            channel.metadata.get("format", ""),
            counts.get(channel_id, 0),
        )
        for channel_id, channel in sorted(summary.channels.items())
        if is_raw(channel, summary.schemas)
    )


def _raw_in_contents(contents: McapContents) -> tuple[RawTopic, ...]:
    """Return the topics of raw packets in a file, which may have no summary."""
    topics = []
    for channel_id, record in sorted(contents.channels.items()):
        if is_raw(record, contents.schemas):
            count = contents.not_decoded.get(channel_id, MessageCount())
            source, packet_format = raw_source(record), record.metadata.get("format", "")
            topics.append(
                RawTopic(
                    record.topic, source, packet_format, count.count, count.size, *_rate(count)
                )
            )
    return tuple(topics)


def _foreign_in_contents(contents: McapContents) -> tuple[ForeignTopic, ...]:
    """Return the topics of other programs in a file, which may have no summary."""
    topics = []
    for channel_id, record in sorted(contents.channels.items()):
        if is_foreign(record, contents.schemas):
            count = contents.not_decoded.get(channel_id, MessageCount())
            topic = _foreign_topic(record, contents.schemas, count.count)
            rate_hz, first_ns, last_ns = _rate(count)
            topics.append(replace(topic, rate_hz=rate_hz, first_ns=first_ns, last_ns=last_ns))
    return tuple(topics)


def _rate(count: MessageCount) -> tuple[float | None, int | None, int | None]:
    """Return the mean rate of counted messages, Hz, and their first and last time, ns."""
    if not count.count:
        return None, None, None
    secs = (count.last_ns - count.first_ns) * 1e-9
    rate = (count.count - 1) / secs if secs > 0 else None
    return rate, count.first_ns, count.last_ns


def _info_of_log(
    log: Log, foreign: tuple[ForeignTopic, ...], raw: tuple[RawTopic, ...], *, finished: bool
) -> LogInfo:
    return describe_log(log, compute_log_stats(log), foreign, raw, finished=finished)


def describe_log(
    log: Log,
    stats: LogStats,
    foreign: tuple[ForeignTopic, ...] = (),
    raw: tuple[RawTopic, ...] = (),
    *,
    finished: bool = True,
) -> LogInfo:
    """Return the content of a log whose statistics are known.

    Parameters
    ----------
    log
        The log; of one in its file, the ranges of components are unknown.
    stats
        Its statistics, from `compute_log_stats`.
    foreign, raw
        What else its file has.
    finished
        Whether the file was written to its end.
    """
    starts = [channel.span_ns[0] for channel in stats if channel.samples]
    ends = [channel.span_ns[1] for channel in stats if channel.samples]
    if not starts:
        others: tuple[RawTopic | ForeignTopic, ...] = (*raw, *foreign)
        starts = [topic.first_ns for topic in others if topic.first_ns is not None]
        ends = [topic.last_ns for topic in others if topic.last_ns is not None]
    in_memory = {channel.key: channel for channel in log} if isinstance(log, TrialLog) else {}
    channels = tuple(
        _info_of_channel(channel, in_memory.get((channel.topic, channel.fields)))
        for channel in stats
    )
    return LogInfo(
        log.name,
        min(starts, default=None),
        max(ends, default=None),
        channels,
        foreign,
        dict(log.metadata),
        log.vessel_toml is not None,
        finished,
        log.warnings,
        log.data_lost,
        raw,
        log.events,
    )


def _info_of_channel(stats: ChannelStats, channel: Channel | None) -> ChannelInfo:
    """Return the content of a channel from its statistics, and from its samples if in memory."""
    kind = CATALOGUE.get(stats.name)
    metadata = channel.metadata if channel else {}
    positive = kind.positive if kind else metadata.get("positive", "")
    if set(stats.fields) & set(GEOGRAPHIC):
        positive = "north and east"
    return ChannelInfo(
        stats.topic,
        stats.source,
        stats.unit,
        positive,
        stats.samples,
        1 / stats.interval_secs if stats.interval_secs > 0 else None,
        stats.irregular_share > MAX_IRREGULAR_SHARE,
        len(stats.gaps),
        max((length for _, length in stats.gaps), default=0.0),
        tuple(_ranges(stats, channel)),
    )


def _ranges(stats: ChannelStats, channel: Channel | None) -> Iterator[ValueRange]:
    """Yield the range of each component that has a finite value."""
    unit, scale = display_conversion(stats.name, stats.unit)
    if not stats.fields:
        low, high = stats.value_range
        if low <= high:
            yield ValueRange("", unit, low * scale, high * scale)
        return
    if channel is None:
        return
    for field, values in zip(channel.fields, channel.values.T, strict=True):
        finite = values[np.isfinite(values)]
        if len(finite):
            low, high = float(finite.min()) * scale, float(finite.max()) * scale
            yield ValueRange(field, _GEOGRAPHIC_UNITS.get(field, unit), low, high)
