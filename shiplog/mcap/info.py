"""Content of a log as `shiplog info` shows it: spans, rates, ranges and foreign topics."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.types import Channel, TrialLog
from shiplog.units import CATALOGUE, conversion_factor

from .clock_repair import MAX_DISTANCE_NS
from .decode import McapContents, schema_of
from .reader import open_mcap
from .scan import scan
from .summary import McapSummary, read_summary
from .trial_log import build_trial_log

MAX_MESSAGES_TO_READ = 4_000_000  # of a finished file; a longer one is described by its summary


@dataclass(frozen=True)
class ChannelInfo:
    """One topic of shiplog in a file.

    Attributes
    ----------
    topic
        The topic, such as ``/yaw_rate/gyro``.
    unit
        The unit of the values in shiplog.
    positive
        The sign convention in words.
    samples
        The number of samples.
    rate_hz
        The sampling rate, from the median interval; None if unknown.
    display_unit
        The unit of `lowest` and `highest`: that in which people read the quantity.
    lowest, highest
        The range of the measured values, NaN excluded; None if unknown, and for a
        channel of several components.
    """

    topic: str
    unit: str
    positive: str
    samples: int
    rate_hz: float | None = None
    display_unit: str = ""
    lowest: float | None = None
    highest: float | None = None


@dataclass(frozen=True)
class ForeignTopic:
    """One topic of another program, whose messages shiplog does not read.

    Attributes
    ----------
    topic
        The topic.
    schema
        The name of its message schema; empty if it has none.
    messages
        The number of messages.
    first_ns, last_ns
        Its first and last time of reception, ns since 1970-01-01 UTC; None if unknown.
    """

    topic: str
    schema: str
    messages: int
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass(frozen=True)
class LogInfo:
    """The content of a file.

    Attributes
    ----------
    name
        The name of the file.
    start_ns, end_ns
        Its first and last time, ns since 1970-01-01 UTC: of measurement if the file was read; of
        reception if it has foreign topics only, or if taken from the summary.
    channels
        Its topics of shiplog.
    foreign
        Its topics of other programs.
    metadata
        Text about the trial, by key.
    has_vessel
        Whether a vessel file is attached.
    finished
        Whether the recorder has closed the file.
    warnings
        Problems met in reading the file.
    data_lost
        Whether a part of the file could not be read.
    """

    name: str
    start_ns: int
    end_ns: int
    channels: tuple[ChannelInfo, ...]
    foreign: tuple[ForeignTopic, ...]
    metadata: Mapping[str, str]
    has_vessel: bool
    finished: bool = True
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    @property
    def start_utc(self) -> str:
        """The start in UTC to the second, in ISO 8601."""
        return f"{np.datetime64(self.start_ns, 'ns').astype('M8[s]')}Z"

    def to_dict(self) -> dict[str, Any]:
        """Return the content as plain values for JSON, with ``duration_secs`` in s."""
        duration_secs = (self.end_ns - self.start_ns) * 1e-9
        return asdict(self) | {"start_utc": self.start_utc, "duration_secs": duration_secs}


def read_log_info(path: str | os.PathLike[str]) -> LogInfo:
    """Return the content of a log.

    Of a finished file with more than `MAX_MESSAGES_TO_READ` messages only the summary is read;
    then rates and ranges are unknown, and a warning reports this. Such a file is read too if the
    first and last time in its summary are impossible or more than a year apart.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.

    Examples
    --------
    >>> info = read_log_info("sample_data/zigzag_20_20.mcap")
    >>> info.channels[0].topic, info.channels[0].samples, round(info.channels[0].rate_hz)
    ('/yaw_rate/simulated', 6001, 10)
    """
    path = Path(path)
    contents = McapContents()
    with open_mcap(path) as stream:
        summary = read_summary(stream)
        if summary and _is_described_by(summary):
            return _info_of_summary(path.name, summary)
        for _ in scan(stream, contents):
            pass
    return _info_of_log(build_trial_log(path, contents), contents)


def _is_described_by(summary: McapSummary) -> bool:
    """Whether a file is too long to be read, and the times in its summary are possible."""
    start, end = summary.statistics.message_start_time, summary.statistics.message_end_time
    is_possible = start <= end < 2**63 and end - start < MAX_DISTANCE_NS
    return is_possible and summary.statistics.message_count > MAX_MESSAGES_TO_READ


def _info_of_summary(name: str, summary: McapSummary) -> LogInfo:
    statistics = summary.statistics
    channels, foreign = [], []
    for channel_id, channel in sorted(summary.channels.items()):
        samples = statistics.channel_message_counts.get(channel_id, 0)
        if schema_of(channel, summary.schemas) is None:
            schema = summary.schemas.get(channel.schema_id)
            foreign.append(ForeignTopic(channel.topic, schema.name if schema else "", samples))
        else:
            unit, positive = (channel.metadata.get(key, "") for key in ("unit", "positive"))
            channels.append(ChannelInfo(channel.topic, unit, positive, samples))
    return LogInfo(
        name,
        statistics.message_start_time,
        statistics.message_end_time,
        tuple(channels),
        tuple(foreign),
        summary.metadata,
        summary.vessel_toml is not None,
        warnings=(
            (
                f"{name}: only the summary of {statistics.message_count} messages was read; rates "
                f"and ranges are shown for logs of at most {MAX_MESSAGES_TO_READ}"
            ),
        ),
    )


def _info_of_log(log: TrialLog, contents: McapContents) -> LogInfo:
    foreign = []
    for channel_id, record in sorted(contents.channels.items()):
        if schema_of(record, contents.schemas) is None:
            schema, found = contents.schemas.get(record.schema_id), contents.foreign.get(channel_id)
            times = (found.count, found.first_ns, found.last_ns) if found else (0,)
            foreign.append(ForeignTopic(record.topic, schema.name if schema else "", *times))
    start_ns, end_ns = log.span_ns
    if contents.foreign and not any(len(channel) for channel in log):
        start_ns = min(one.first_ns for one in contents.foreign.values())
        end_ns = max(one.last_ns for one in contents.foreign.values())
    return LogInfo(
        log.name,
        start_ns,
        end_ns,
        tuple(map(_info_of_channel, log)),
        tuple(foreign),
        dict(log.metadata),
        log.vessel_toml is not None,
        contents.finished,
        log.warnings,
        log.data_lost,
    )


def _info_of_channel(channel: Channel) -> ChannelInfo:
    """Return the content of a channel; infinite and missing values have no part in its range."""
    kind = CATALOGUE.get(channel.name)
    unit = kind.display_unit if kind and channel.unit == kind.unit else channel.unit
    scale = 1.0 if unit == channel.unit else conversion_factor(channel.unit, unit)
    finite = np.isfinite(channel.values)
    values = channel.values[finite] * scale if not channel.fields else np.empty(0)
    step_ns = np.median(np.diff(np.sort(channel.measured_ns))) if len(channel) > 1 else 0.0
    return ChannelInfo(
        channel.topic,
        channel.unit,
        kind.positive if kind else channel.metadata.get("positive", ""),
        len(channel),
        1e9 / float(step_ns) if step_ns > 0 else None,
        unit,
        float(values.min()) if values.size else None,
        float(values.max()) if values.size else None,
    )
