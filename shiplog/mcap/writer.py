"""Writing of logs: whole trials, and samples, raw packets and events as they are recorded."""

import os
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from types import TracebackType
from typing import Self

import numpy as np
from mcap import records

from shiplog.errors import UsageError
from shiplog.files import atomic_write
from shiplog.types import Channel, Event, RawPackets, TrialLog, concatenate_channels
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor
from shiplog.version import __version__

from .encode import MAX_MCAP_CHUNK_BYTES, McapChunk, MessageBatch, encode_mcap_chunks
from .kept_records import ForeignMessages, KeptGroup
from .metadata_record import with_checksum
from .record_writer import McapRecordWriter
from .schema import (
    ENCODING,
    EVENT,
    EVENTS_TOPIC,
    FORMAT_VERSION,
    METADATA_NAME,
    RAW,
    RAW_NAME,
    VESSEL_ATTACHMENT,
    Schema,
    schema_for,
)
from .serialised import (
    SerialisedMessages,
    concatenate_messages,
    serialise_events,
    serialise_packets,
)

_SAMPLE_BYTES = 40  # of a scalar in an MCAP chunk, with its head


class LogWriter:
    """An open log to which what is received is appended; `close` makes it a complete file.

    If the process is killed, the file can be read up to the last `flush`; what was written since,
    at most about 1 MiB, is lost. A `LogWriter` is a context manager that closes the log.

    Parameters
    ----------
    path
        The MCAP file; it is overwritten.
    metadata
        Text about the trial, by key.
    vessel_toml
        The text of a vessel file to attach.

    Raises
    ------
    ShiplogError
        The file cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> from tempfile import TemporaryDirectory
    >>> from shiplog import read
    >>> times = np.array([0, 100_000_000])
    >>> with TemporaryDirectory() as folder:
    ...     with LogWriter(f"{folder}/trial.mcap", metadata={"place": "Neva"}) as writer:
    ...         writer.write(Channel("rudder", "feedback", "rad", times, times, np.zeros(2)))
    ...     read(f"{folder}/trial.mcap")["rudder"]
    Channel(/rudder/feedback [rad], 2 samples)
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        metadata: Mapping[str, str] | None = None,
        vessel_toml: str | None = None,
    ) -> None:
        self._file = McapRecordWriter(path)
        self._schema_ids: dict[tuple[str, str, bytes], int] = {}  # by name, encoding and data
        self._channel_ids: dict[Hashable, int] = {}  # by topic; of others by all of the record
        self._counts: dict[int, int] = {}  # of messages, by channel id
        self._samples = 0
        self._pending: list[MessageBatch] = []
        self._pending_bytes = 0
        self._latest_ns = 0  # time of reception of the messages in the file so far
        self._metadata: dict[str, str] = {}
        self.update_metadata(dict(metadata or {}) | _versions())
        if vessel_toml is not None:
            self._file.write_attachment(
                records.Attachment(  # without times: the same log gives the same bytes
                    create_time=0,
                    log_time=0,
                    name=VESSEL_ATTACHMENT,
                    media_type="application/toml",
                    data=vessel_toml.encode(),
                )
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def samples(self) -> int:
        """The number of samples written so far; raw packets and events are none."""
        return self._samples

    def write(self, *items: Channel | RawPackets | ForeignMessages | Event) -> None:
        """Append samples, packets, messages and events, interleaved in the order of reception.

        Parameters
        ----------
        items
            The next samples of each channel, the next packets of each source, messages of other
            programs, and events. The first of a topic fixes its unit, fields and metadata, or its
            format.

        Raises
        ------
        UsageError
            The unit of a known channel does not measure its quantity, or a channel is named
            ``raw``.
        """
        events = [item for item in items if isinstance(item, Event)]
        for item in items:
            if isinstance(item, Channel):
                self._append(self._register(item), item, _SAMPLE_BYTES * len(item))
                self._samples += len(item)
            elif isinstance(item, RawPackets):
                size = _SAMPLE_BYTES * len(item) + sum(map(len, item.data))
                self._append(self._register_packets(item), serialise_packets(item), size)
            elif isinstance(item, ForeignMessages):
                messages = item.messages
                size = _SAMPLE_BYTES * len(item) + sum(map(len, messages.messages))
                self._append(self._register_foreign(item), messages, size)
        if events:
            messages = serialise_events(events, self._latest_ns)
            self._append(self._register_events(), messages, _SAMPLE_BYTES * len(events))
        if self._pending_bytes >= MAX_MCAP_CHUNK_BYTES:
            for mcap_chunk in self._encode_pending():
                self._file.write_mcap_chunk(mcap_chunk)

    def update_metadata(self, metadata: Mapping[str, str]) -> None:
        """Append the entries of the trial's metadata that are new or have changed.

        Readers use the last value of each key.
        """
        changed = {key: text for key, text in metadata.items() if self._metadata.get(key) != text}
        if changed:
            self._metadata |= changed
            self._file.write_metadata(METADATA_NAME, with_checksum(changed))

    def write_records(
        self, attachments: Iterable[records.Attachment], metadata: Iterable[records.Metadata]
    ) -> None:
        """Append attachments and metadata records of other programs."""
        for attachment in attachments:
            self._file.write_attachment(attachment)
        for record in metadata:
            self._file.write_metadata(record.name, record.metadata)

    def flush(self) -> None:
        """Hand all to the operating system, so that a killed process does not lose it."""
        for mcap_chunk in self._encode_pending():
            self._file.extend_mcap_chunk(mcap_chunk)
        self._file.flush()

    def close(self) -> None:
        """Write the summary and close the file; a second call has no effect."""
        if not self._file.closed:
            with closing(self._file):
                for mcap_chunk in self._encode_pending():
                    self._file.write_mcap_chunk(mcap_chunk)
                self._file.finish(self._counts)

    def _append(self, channel_id: int, messages: Channel | SerialisedMessages, size: int) -> None:
        """Add messages to those that are still to be encoded, given about their size in bytes."""
        self._pending.append(MessageBatch(channel_id, self._counts[channel_id], messages))
        self._counts[channel_id] += len(messages)
        self._pending_bytes += size

    def _register(self, channel: Channel) -> int:
        """Return the id of a channel, and describe the channel when it is new."""
        if channel.topic in self._channel_ids:
            return self._channel_ids[channel.topic]
        if channel.name == RAW_NAME:
            raise UsageError(f"{channel.topic!r} is a topic of raw packets; name the channel anew")
        if channel.name in CATALOGUE and channel.fields != GEOGRAPHIC:
            conversion_factor(channel.unit, CATALOGUE[channel.name].unit)  # reject bad units
        return self._describe(channel.topic, schema_for(channel.fields), channel_metadata(channel))

    def _register_packets(self, packets: RawPackets) -> int:
        if packets.topic in self._channel_ids:
            return self._channel_ids[packets.topic]
        metadata = {"source": packets.source, "format": packets.format}
        return self._describe(packets.topic, RAW, metadata)

    def _register_events(self) -> int:
        if EVENTS_TOPIC in self._channel_ids:
            return self._channel_ids[EVENTS_TOPIC]
        return self._describe(EVENTS_TOPIC, EVENT, {})

    def _register_foreign(self, foreign: ForeignMessages) -> int:
        channel, schema = foreign.channel, foreign.schema
        schema_id = self._add_schema(schema.name, schema.encoding, schema.data) if schema else 0
        metadata = tuple(sorted(channel.metadata.items()))
        key = channel.topic, schema_id, channel.message_encoding, metadata
        return self._add_channel(key, channel, schema_id)

    def _describe(self, topic: str, schema: Schema, metadata: dict[str, str]) -> int:
        """Describe a channel of the file, and return its id."""
        from .messages import descriptor_set  # noqa: PLC0415 - protobuf takes long to import

        schema_id = self._add_schema(schema.name, ENCODING, descriptor_set(schema))
        record = records.Channel(
            id=0, topic=topic, message_encoding=ENCODING, metadata=metadata, schema_id=schema_id
        )
        return self._add_channel(topic, record, schema_id)

    def _add_channel(self, key: Hashable, channel: records.Channel, schema_id: int) -> int:
        """Return the id of a channel record, which is described when its key is new."""
        if key not in self._channel_ids:
            channel_id = len(self._channel_ids) + 1
            self._file.add_channel(replace(channel, id=channel_id, schema_id=schema_id))
            self._channel_ids[key] = channel_id
            self._counts[channel_id] = 0
        return self._channel_ids[key]

    def _add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Return the id of a schema, which is described when it is new."""
        key = name, encoding, data
        if key not in self._schema_ids:
            schema_id = len(self._schema_ids) + 1
            record = records.Schema(id=schema_id, name=name, encoding=encoding, data=data)
            self._file.add_schema(record)
            self._schema_ids[key] = schema_id
        return self._schema_ids[key]

    def _encode_pending(self) -> Iterator[McapChunk]:
        """Yield the messages that are not yet in the file."""
        batches, self._pending = _one_batch_per_channel(self._pending), []
        self._pending_bytes = 0
        if batches:
            for mcap_chunk in encode_mcap_chunks(batches, MAX_MCAP_CHUNK_BYTES):
                yield mcap_chunk
                self._latest_ns = max(self._latest_ns, mcap_chunk.last_ns)


def write(log: TrialLog, path: str | os.PathLike[str], kept: Iterable[KeptGroup] = ()) -> None:
    """Write a whole trial to an MCAP file.

    Parameters
    ----------
    log
        The trial.
    path
        The file. It appears only when it is complete; until then an existing one is kept.
    kept
        What to keep beside it as it is, in groups in the order of reception.

    Raises
    ------
    ShiplogError
        The file cannot be written.
    UsageError
        The unit of a known channel does not measure its quantity.
    """
    with (
        atomic_write(path) as part,
        LogWriter(part, metadata=log.metadata, vessel_toml=log.vessel_toml) as writer,
    ):
        rest: tuple[Channel | Event, ...] = (*log.channels, *log.events)
        for group in kept:
            writer.write_records(group.attachments, group.metadata)
            if group.messages:
                latest = max(int(messages.received_ns.max()) for messages in group.messages)
                now, rest = _split_at(rest, latest)
                writer.write(*now, *group.messages)
        writer.write(*rest)


def _split_at(
    items: Sequence[Channel | Event], received_ns: int
) -> tuple[tuple[Channel | Event, ...], tuple[Channel | Event, ...]]:
    """Return what was received up to a time, and the rest."""
    now: list[Channel | Event] = []
    rest: list[Channel | Event] = []
    for item in items:
        if isinstance(item, Event):
            (now if item.time_ns <= received_ns else rest).append(item)
            continue
        row = int(np.searchsorted(item.received_ns, received_ns, "right"))
        now.append(item.part(0, row))
        rest.append(item.part(row, len(item)))
    return tuple(now), tuple(rest)


def channel_metadata(channel: Channel) -> dict[str, str]:
    """Return the metadata of a channel in the file: its name, source, unit and sign convention."""
    metadata = {"channel": channel.name, "source": channel.source, "unit": channel.unit}
    if channel.name in CATALOGUE:
        metadata["positive"] = CATALOGUE[channel.name].positive
    return dict(channel.metadata) | metadata


def _versions() -> dict[str, str]:
    return {"format_version": FORMAT_VERSION, "written_by": f"shiplog {__version__}"}


def _one_batch_per_channel(batches: Sequence[MessageBatch]) -> list[MessageBatch]:
    """Join the consecutive batches of each channel of the file."""
    by_channel: dict[int, list[MessageBatch]] = {}
    for batch in batches:
        if len(batch.messages):
            by_channel.setdefault(batch.channel_id, []).append(batch)
    return [
        replace(group[0], messages=_concatenated([batch.messages for batch in group]))
        for group in by_channel.values()
    ]


def _concatenated(
    parts: Sequence[Channel | SerialisedMessages],
) -> Channel | SerialisedMessages:
    samples = [part for part in parts if isinstance(part, Channel)]
    if samples:
        return concatenate_channels(samples)
    return concatenate_messages([p for p in parts if isinstance(p, SerialisedMessages)])
