"""Samples to MCAP: streaming, and safe against a crash up to the last flush."""

import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import mcap
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from shiplog.files import atomic_write, write_error
from shiplog.types import Channel, TrialLog, concatenate_channels
from shiplog.units import CATALOGUE, GEOGRAPHIC, conversion_factor
from shiplog.version import __version__

from .encode import McapChunk, Part, mcap_chunks
from .records import CHUNK_HEAD, MAGIC, RECORD_HEAD
from .schema import (
    ENCODING,
    FORMAT_VERSION,
    METADATA_NAME,
    VESSEL_ATTACHMENT,
    schema_for,
)

CHUNK_BYTES = 1 << 20  # what a crash between two flushes can lose
_ZSTD = b"zstd"
_PENDING_SAMPLES = CHUNK_BYTES // 40  # about a chunk: a scalar message takes 40 bytes


class LogWriter:
    """An open log, to which samples are added as they come; `close` makes it a finished file.

    A process killed in between leaves a file that still reads up to the last `flush`.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        metadata: Mapping[str, str] | None = None,
        vessel_toml: str | None = None,
    ) -> None:
        try:
            self._stream = Path(path).open("wb")  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise write_error(Path(path), error) from error
        self._at, self._crc = 0, 0
        self._schemas: dict[str, records.Schema] = {}
        self._channels: dict[str, records.Channel] = {}
        self._counts: dict[int, int] = {}
        self._chunk_indexes: list[records.ChunkIndex] = []
        self._metadata: list[records.MetadataIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._undescribed: list[records.McapRecord] = []  # schemas and channels for the next chunk
        self._pending: list[Part] = []
        self._compressor = zstandard.ZstdCompressor()
        self._put(MAGIC)
        library = f"shiplog {__version__} mcap {mcap.__version__}"
        self._put(_bytes(records.Header(profile="", library=library)))
        said = {"format_version": FORMAT_VERSION, "written_by": f"shiplog {__version__}"}
        self._add_metadata(dict(metadata or {}) | said)
        if vessel_toml is not None:
            self._add_vessel(vessel_toml.encode())

    def __enter__(self) -> Self:
        """The open log."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the log."""
        self.close()

    @property
    def samples(self) -> int:
        """How many were added so far."""
        return sum(self._counts.values())

    def write(self, *chunks: Channel) -> None:
        """Add the chunks' samples, interleaved in the order in which they were received.

        Raises `UsageError` where a chunk's unit does not measure what its name says.
        """
        for chunk in chunks:
            channel_id = self._register(chunk)
            self._pending.append(Part(channel_id, self._counts[channel_id], chunk))
            self._counts[channel_id] += len(chunk)
        if sum(len(part.chunk) for part in self._pending) >= _PENDING_SAMPLES:
            self._put_pending()

    def flush(self) -> None:
        """Hand what was written to the operating system: a killed process loses it no more."""
        self._put_pending()
        self._stream.flush()

    def close(self) -> None:
        """Write the index and close the file."""
        if not self._stream.closed:
            with self._stream:
                self._put_pending()
                self._put(b"".join(map(_bytes, self._undescribed)))  # channels that never spoke
                self._put(_bytes(records.DataEnd(data_section_crc=self._crc)))
                self._put_summary()

    def _register(self, chunk: Channel) -> int:
        if chunk.topic not in self._channels:
            if chunk.name in CATALOGUE and chunk.fields != GEOGRAPHIC:
                conversion_factor(
                    chunk.unit, CATALOGUE[chunk.name].unit
                )  # refused now, not when it is read
            schema = schema_for(chunk.fields)
            if schema.name not in self._schemas:
                number = len(self._schemas) + 1
                self._schemas[schema.name] = records.Schema(
                    id=number, name=schema.name, encoding=ENCODING, data=schema.descriptor_set
                )
                self._undescribed.append(self._schemas[schema.name])
            self._channels[chunk.topic] = records.Channel(
                id=len(self._channels) + 1,
                topic=chunk.topic,
                message_encoding=ENCODING,
                metadata=channel_metadata(chunk),
                schema_id=self._schemas[schema.name].id,
            )
            self._undescribed.append(self._channels[chunk.topic])
            self._counts[self._channels[chunk.topic].id] = 0
        return self._channels[chunk.topic].id

    def _add_metadata(self, said: Mapping[str, str]) -> None:
        data = _bytes(records.Metadata(name=METADATA_NAME, metadata=dict(said)))
        self._metadata.append(
            records.MetadataIndex(offset=self._at, length=len(data), name=METADATA_NAME)
        )
        self._put(data)

    def _add_vessel(self, text: bytes) -> None:
        name, kind = VESSEL_ATTACHMENT, "application/toml"
        data = _bytes(
            records.Attachment(create_time=0, log_time=0, name=name, media_type=kind, data=text)
        )
        self._attachments.append(
            records.AttachmentIndex(
                offset=self._at,
                length=len(data),
                log_time=0,
                create_time=0,
                data_size=len(text),
                name=name,
                media_type=kind,
            )
        )
        self._put(data)

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._at += len(data)
        self._crc = zlib.crc32(data, self._crc)

    def _put_pending(self) -> None:
        parts, self._pending = _one_a_channel(self._pending), []
        for chunk in mcap_chunks(parts, CHUNK_BYTES) if parts else ():
            self._put_chunk(chunk)

    def _put_chunk(self, chunk: McapChunk) -> None:
        described = b"".join(map(_bytes, self._undescribed))
        self._undescribed = []
        raw = described + chunk.body.tobytes() if described else chunk.body.data
        body = self._compressor.compress(raw)
        start, size = self._at, len(described) + len(chunk.body)
        head = CHUNK_HEAD.pack(chunk.first_ns, chunk.last_ns, size, zlib.crc32(raw), len(_ZSTD))
        head += _ZSTD + struct.pack("<Q", len(body))
        self._put(RECORD_HEAD.pack(Opcode.CHUNK, len(head) + len(body)) + head)
        self._put(body)
        length, offsets = self._at - start, {}
        for channel_id, entries in chunk.index.items():
            entries["offset"] += len(described)
            offsets[channel_id] = self._at
            self._put(RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + entries.nbytes))
            self._put(struct.pack("<HI", channel_id, entries.nbytes) + entries.tobytes())
        self._chunk_indexes.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=_ZSTD.decode(),
                compressed_size=len(body),
                message_end_time=chunk.last_ns,
                message_index_length=self._at - start - length,
                message_index_offsets=offsets,
                message_start_time=chunk.first_ns,
                uncompressed_size=size,
            )
        )

    def _put_summary(self) -> None:
        start, data, offsets = self._at, b"", []
        for opcode, group in (
            (Opcode.SCHEMA, list(self._schemas.values())),
            (Opcode.CHANNEL, list(self._channels.values())),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunk_indexes),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ):
            written = b"".join(map(_bytes, group))
            if written:
                offsets.append(
                    records.SummaryOffset(
                        group_opcode=opcode,
                        group_start=start + len(data),
                        group_length=len(written),
                    )
                )
            data += written
        offsets_start = start + len(data)
        data += b"".join(map(_bytes, offsets))
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 8 + 8 + 4, start, offsets_start)
        self._put(data)
        self._put(
            _bytes(
                records.Footer(
                    summary_start=start,
                    summary_offset_start=offsets_start,
                    summary_crc=zlib.crc32(data + footer_head),
                )
            )
        )
        self._put(MAGIC)

    def _statistics(self) -> records.Statistics:
        return records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts={id_: count for id_, count in self._counts.items() if count},
            chunk_count=len(self._chunk_indexes),
            message_count=self.samples,
            message_end_time=max((c.message_end_time for c in self._chunk_indexes), default=0),
            message_start_time=min((c.message_start_time for c in self._chunk_indexes), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _one_a_channel(parts: Sequence[Part]) -> list[Part]:
    """Chunks of one channel that follow one another, as one."""
    by_channel: dict[int, list[Part]] = {}
    for part in parts:
        if len(part.chunk):
            by_channel.setdefault(part.channel_id, []).append(part)
    return [few[0] if len(few) == 1 else _joined(few) for few in by_channel.values()]


def _joined(parts: Sequence[Part]) -> Part:
    return replace(parts[0], chunk=concatenate_channels([part.chunk for part in parts]))


def _bytes(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def write(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a whole trial to `path`; nothing half-written is left there if it fails."""
    with (
        atomic_write(path) as part,
        LogWriter(part, metadata=log.metadata, vessel_toml=log.vessel_toml) as writer,
    ):
        writer.write(*log.channels)


def channel_metadata(channel: Channel) -> dict[str, str]:
    """What the file says of a channel: its unit, its sign, its name and its source."""
    said = {"channel": channel.name, "source": channel.source, "unit": channel.unit}
    if channel.name in CATALOGUE:
        said["positive"] = CATALOGUE[channel.name].positive
    return dict(channel.metadata) | said
