"""What is in a log, without reading it all: `shiplog info`."""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from shiplog.units import CATALOGUE

from .reader import open_mcap, read
from .summary import read_summary


@dataclass(frozen=True)
class ChannelInfo:
    """One topic of a file."""

    topic: str
    unit: str
    positive: str
    schema: str
    samples: int


@dataclass(frozen=True)
class LogInfo:
    """What a file says of itself."""

    name: str
    start_ns: int
    end_ns: int
    channels: tuple[ChannelInfo, ...]
    metadata: Mapping[str, str]
    has_vessel: bool
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    def to_dict(self) -> dict[str, Any]:
        """The same as plain values."""
        return asdict(self) | {"duration_secs": (self.end_ns - self.start_ns) * 1e-9}


def read_log_info(path: str | os.PathLike[str]) -> LogInfo:
    """What is in a log; only its summary is read, if it has one that its checksum vouches for.

    Raises `LogError` where the file is missing or is not MCAP.
    """
    path = Path(path)
    with open_mcap(path) as stream:
        summary = read_summary(stream)
    if summary is None:
        return _by_reading(path)
    counts = summary.statistics.channel_message_counts
    channels = []
    for channel_id, channel in sorted(summary.channels.items()):
        schema = summary.schemas.get(channel.schema_id)
        said = channel.metadata
        channels.append(
            ChannelInfo(
                channel.topic,
                said.get("unit", ""),
                said.get("positive", ""),
                schema.name if schema else "",
                counts.get(channel_id, 0),
            )
        )
    return LogInfo(
        path.name,
        summary.statistics.message_start_time,
        summary.statistics.message_end_time,
        tuple(channels),
        summary.metadata,
        summary.vessel_toml is not None,
    )


def _by_reading(path: Path) -> LogInfo:
    """Of a file without a summary: one that was not finished."""
    log = read(path)
    start, end = log.span_ns
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
    has_vessel = log.vessel_toml is not None
    said = dict(log.metadata)
    return LogInfo(path.name, start, end, channels, said, has_vessel, log.warnings, log.data_lost)
