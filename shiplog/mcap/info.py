"""Content of a log as `shiplog info` shows it, without reading all of it."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from shiplog.types import TrialLog
from shiplog.units import CATALOGUE

from .reader import open_mcap, read
from .summary import McapSummary, read_summary


@dataclass(frozen=True)
class ChannelInfo:
    """One topic of a file.

    Attributes
    ----------
    topic
        The topic, such as ``/yaw_rate/gyro``.
    unit
        The unit that the file states; empty if it states none.
    positive
        The sign convention in words.
    schema
        The name of the message schema; empty if the file has no summary.
    samples
        The number of samples.
    """

    topic: str
    unit: str
    positive: str
    schema: str
    samples: int


@dataclass(frozen=True)
class LogInfo:
    """The content of a file.

    Attributes
    ----------
    name
        The name of the file.
    start_ns, end_ns
        Its first and last time, ns since 1970-01-01 UTC: of reception if taken from the summary, of
        measurement if the file had to be read.
    channels
        Its topics.
    metadata
        Text about the trial, by key.
    has_vessel
        Whether a vessel file is attached.
    warnings
        Problems met in reading the file.
    data_lost
        Whether a part of the file could not be read.
    """

    name: str
    start_ns: int
    end_ns: int
    channels: tuple[ChannelInfo, ...]
    metadata: Mapping[str, str]
    has_vessel: bool
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the content as plain values for JSON, with ``duration_secs`` in s."""
        return asdict(self) | {"duration_secs": (self.end_ns - self.start_ns) * 1e-9}


def read_log_info(path: str | os.PathLike[str]) -> LogInfo:
    """Return the content of a log.

    Only the summary of the file is read; the whole file if it has no valid summary.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.

    Examples
    --------
    >>> info = read_log_info("sample_data/zigzag_20_20.mcap")
    >>> info.channels[0].topic, info.channels[0].samples
    ('/yaw_rate/simulated', 6001)
    """
    path = Path(path)
    with open_mcap(path) as stream:
        summary = read_summary(stream)
    return _info_of_log(read(path)) if summary is None else _info_of_summary(path.name, summary)


def _info_of_summary(name: str, summary: McapSummary) -> LogInfo:
    counts = summary.statistics.channel_message_counts
    channels = []
    for channel_id, channel in sorted(summary.channels.items()):
        schema = summary.schemas.get(channel.schema_id)
        channels.append(
            ChannelInfo(
                channel.topic,
                channel.metadata.get("unit", ""),
                channel.metadata.get("positive", ""),
                schema.name if schema else "",
                counts.get(channel_id, 0),
            )
        )
    return LogInfo(
        name,
        summary.statistics.message_start_time,
        summary.statistics.message_end_time,
        tuple(channels),
        summary.metadata,
        summary.vessel_toml is not None,
    )


def _info_of_log(log: TrialLog) -> LogInfo:
    channels = tuple(
        ChannelInfo(
            channel.topic,
            channel.unit,
            CATALOGUE[channel.name].positive if channel.name in CATALOGUE else "",
            "",
            len(channel),
        )
        for channel in log
    )
    return LogInfo(
        log.name,
        *log.span_ns,
        channels,
        dict(log.metadata),
        log.vessel_toml is not None,
        log.warnings,
        log.data_lost,
    )
