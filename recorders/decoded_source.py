"""Logs whose raw packets are decoded again, with today's decoders."""

import os
import shlex
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from shiplog import LogError, TrialLog, open_log
from shiplog.errors import UsageError
from shiplog.extensions import load_extension
from shiplog.mcap.raw_reader import read_raw
from shiplog.mcap.stream import LogFile
from shiplog.types import Channel, Event

from .source import Recordable
from .streams.format import GROUP, StreamFormat
from .streams.packets import Batches, Packet
from .streams.sample_buffer import STREAM_KEY
from .streams.stream_options import options_text, parse_options_text
from .streams.stream_source import StreamSource
from .trial.recorded_source import RecordedSource


class _KeptSamples:
    """The samples of the channels that are kept, taken in the order of reception."""

    def __init__(self, log: TrialLog | LogFile, decoded: Collection[str]) -> None:
        self._chunks = log.chunks()
        self._decoded = decoded  # the streams whose channels are not kept
        self._waiting: list[Channel] = []
        self._last_ns = -inf

    def take(self, until_ns: float) -> list[Channel]:
        """Return the samples received until a time since the last call."""
        while self._last_ns <= until_ns and (chunk := next(self._chunks, None)) is not None:
            kept = [c for c in chunk if len(c) and c.metadata.get(STREAM_KEY) not in self._decoded]
            self._waiting += kept
            self._last_ns = max((_last_ns(c) for c in kept), default=self._last_ns)
        taken = [_between(channel, -inf, until_ns) for channel in self._waiting]
        rest = [_between(channel, until_ns, inf) for channel in self._waiting]
        self._waiting = [channel for channel in rest if len(channel)]
        return [channel for channel in taken if len(channel)]


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

    log: TrialLog | LogFile
    recorded: RecordedSource

    @property
    def old_channels(self) -> int:
        """The number of channels of the log."""
        outline = self.log.outline if isinstance(self.log, LogFile) else self.log
        return len(outline.channels)

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
        kept = _KeptSamples(self.log, {stream.name for stream in self.recorded.streams})
        events, old_events, until = list(self.log.events), set(self.log.events), -inf
        for chunk in self.recorded.chunks():
            items = [item for item in chunk if item not in old_events]
            until = max((_last_ns(item) for item in items), default=until)
            due = [event for event in events if event.time_ns <= until]
            events = events[len(due) :]
            yield (*items, *kept.take(until), *due)
        yield (*kept.take(inf), *events)


def open_raw(
    path: str | os.PathLike[str], changes: Mapping[str, str] | None = None
) -> DecodedSource:
    """Open a log to decode its raw packets again.

    Parameters
    ----------
    path
        The log.
    changes
        Options of the formats that differ from those of the recording, by stream and option, such
        as ``{"bridge.time": "gnss"}``; the value ``true`` is an option without a value. By default
        none.

    Raises
    ------
    LogError
        The log cannot be read, or has no raw packets.
    UsageError
        The format of its packets is not installed, or a change is of no stream or option.
    """
    log = open_log(path)
    formats = {packets.source: packets.format for packets in read_raw(path)}
    if not formats:
        raise LogError(f"no raw packets; record them with --raw: {path}")
    options = {name: log.metadata.get(f"{name}.options", "") for name in formats}
    for change, value in (changes or {}).items():
        name, _, key = change.partition(".")
        if name not in options or not key:
            known = ", ".join(options)
            raise UsageError(f"{change} is no STREAM.OPTION of the log's streams: {known}")
        options[name] += f" --{key}" if value == "true" else f" --{key}={shlex.quote(value)}"
    streams = [
        _stream(Path(path), log, name, format_, options[name]) for name, format_ in formats.items()
    ]
    return DecodedSource(log, RecordedSource(streams))


def _stream(
    path: Path, log: TrialLog | LogFile, name: str, format_name: str, text: str
) -> StreamSource:
    """Return one raw topic as a stream, decoded with the options of a text."""
    stream_format = load_extension(GROUP, format_name, StreamFormat, "format")
    options = parse_options_text(stream_format, text, f"options of {name} in {path.name}")
    return StreamSource(
        name,
        format_name,
        _batches(path, name),
        stream_format.make_decoder(options),
        keep_raw=True,
        origin=log.metadata.get(f"{name}.origin", path.name),
        prefix=log.metadata.get(f"{name}.prefix", ""),
        options=options_text(stream_format, options),
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
