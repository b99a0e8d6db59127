"""Logs whose raw packets are decoded again, with today's decoders."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from shiplog import LogError, TrialLog, read
from shiplog.extensions import load_extension
from shiplog.mcap.raw_reader import read_raw
from shiplog.types import Channel, Event

from .source import Recordable
from .streams.format import GROUP, StreamFormat
from .streams.packets import Batches, Packet
from .streams.sample_buffer import STREAM_KEY
from .streams.stream_options import parse_options_text
from .streams.stream_source import StreamSource
from .trial.recorded_source import RecordedSource


@dataclass
class DecodedSource:
    """The raw packets of a log as a source of samples, with all else that the log holds.

    Channels that were decoded from packets are decoded again; channels of streams without raw
    packets, events, metadata and the vessel file are kept.

    Attributes
    ----------
    log
        The log.
    recorded
        Its raw packets, decoded again.
    """

    log: TrialLog
    recorded: RecordedSource

    @property
    def metadata(self) -> Mapping[str, str]:
        """The metadata of the log, with those of its streams as they are decoded now."""
        counts = tuple(f"{stream.name}." for stream in self.recorded.streams)
        kept = {k: v for k, v in self.log.metadata.items() if not k.startswith(counts)}
        return kept | dict(self.recorded.metadata) | {"decoded_from": self.log.name}

    @property
    def vessel_toml(self) -> str | None:
        """The vessel file of the log."""
        return self.log.vessel_toml

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield the samples decoded again, and the kept ones of the same times."""
        streams = {stream.name for stream in self.recorded.streams}
        kept = [c for c in self.log.channels if c.metadata.get(STREAM_KEY) not in streams]
        events, old_events, before = list(self.log.events), set(self.log.events), -inf
        for chunk in self.recorded.chunks():
            items = [item for item in chunk if item not in old_events]
            until = max((_last_ns(item) for item in items), default=before)
            due = [event for event in events if event.time_ns <= until]
            events = events[len(due) :]
            yield (*items, *(_between(channel, before, until) for channel in kept), *due)
            before = until
        yield (*(_between(channel, before, inf) for channel in kept), *events)


def open_raw(path: str | os.PathLike[str]) -> DecodedSource:
    """Open a log to decode its raw packets again.

    Parameters
    ----------
    path
        The log.

    Raises
    ------
    LogError
        The log cannot be read, or has no raw packets.
    UsageError
        The format of its packets is not installed.
    """
    log = read(path)
    formats = {packets.source: packets.format for packets in read_raw(path)}
    if not formats:
        raise LogError(f"no raw packets; record them with --raw: {path}")
    streams = [_stream(Path(path), log, name, format_) for name, format_ in formats.items()]
    return DecodedSource(log, RecordedSource(streams))


def _stream(path: Path, log: TrialLog, name: str, format_name: str) -> StreamSource:
    """Return one raw topic as a stream, decoded with the options it was recorded with."""
    stream_format = load_extension(GROUP, format_name, StreamFormat, "format")
    text = log.metadata.get(f"{name}.options", "")
    options = parse_options_text(stream_format, text, f"options of {name} in {path.name}")
    return StreamSource(
        name,
        format_name,
        _batches(path, name),
        stream_format.make_decoder(options),
        keep_raw=True,
        origin=log.metadata.get(f"{name}.origin", path.name),
        prefix=log.metadata.get(f"{name}.prefix", ""),
        options=text,
    )


def _batches(path: Path, name: str) -> Batches:
    for packets in read_raw(path):
        if packets.source == name:
            times = packets.received_ns.tolist()
            yield [Packet(data, t) for data, t in zip(packets.data, times, strict=True)]


def _last_ns(item: Recordable) -> int:
    if isinstance(item, Event):
        return item.time_ns
    return int(item.received_ns[-1]) if len(item) else 0


def _between(channel: Channel, after_ns: float, until_ns: float) -> Channel:
    """Return the samples received after one time and until another."""
    received = channel.received_ns
    chosen = np.flatnonzero((received > after_ns) & (received <= until_ns))
    return channel.take(chosen)
