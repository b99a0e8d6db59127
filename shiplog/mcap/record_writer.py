"""Writer of the records of an MCAP file: MCAP chunks, indexes, attachments and summary."""

import os
import struct
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import mcap
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from shiplog.files import write_error
from shiplog.version import __version__

from .encode import McapChunk
from .records import INDEX_HEAD, MAGIC, MCAP_CHUNK_HEAD, RECORD_HEAD

_COMPRESSION = b"zstd"


class McapRecordWriter:
    """An open MCAP file to which records are appended; `finish` makes it a complete file.

    Parameters
    ----------
    path
        The file; it is overwritten.

    Raises
    ------
    ShiplogError
        The file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        try:
            self._stream = Path(path).open("wb")  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise write_error(Path(path), error) from error
        self._size, self._crc = 0, 0
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._undescribed: list[records.McapRecord] = []  # schemas and channels not yet written
        self._mcap_chunk_indexes: list[records.ChunkIndex] = []
        self._metadata_indexes: list[records.MetadataIndex] = []
        self._attachment_indexes: list[records.AttachmentIndex] = []
        self._compressor = zstandard.ZstdCompressor()
        self._append(MAGIC)
        library = f"shiplog {__version__} mcap {mcap.__version__}"
        self._append(_record_bytes(records.Header(profile="", library=library)))

    @property
    def closed(self) -> bool:
        """Whether the file is closed."""
        return self._stream.closed

    def flush(self) -> None:
        """Hand what was written to the operating system, so that a killed process keeps it."""
        self._stream.flush()

    def write_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Append a metadata record."""
        data = _record_bytes(records.Metadata(name=name, metadata=dict(metadata)))
        index = records.MetadataIndex(offset=self._size, length=len(data), name=name)
        self._metadata_indexes.append(index)
        self._append(data)

    def write_attachment(self, name: str, media_type: str, content: bytes) -> None:
        """Append an attachment, without times, so that the same log gives the same bytes."""
        data = _record_bytes(
            records.Attachment(
                create_time=0, log_time=0, name=name, media_type=media_type, data=content
            )
        )
        self._attachment_indexes.append(
            records.AttachmentIndex(
                offset=self._size,
                length=len(data),
                log_time=0,
                create_time=0,
                data_size=len(content),
                name=name,
                media_type=media_type,
            )
        )
        self._append(data)

    def add_schema(self, schema: records.Schema) -> None:
        """Describe a schema at the beginning of the next MCAP chunk."""
        self._schemas.append(schema)
        self._undescribed.append(schema)

    def add_channel(self, channel: records.Channel) -> None:
        """Describe a channel at the beginning of the next MCAP chunk."""
        self._channels.append(channel)
        self._undescribed.append(channel)

    def write_mcap_chunk(self, mcap_chunk: McapChunk) -> None:
        """Append an MCAP chunk and its message indexes."""
        descriptions = self._take_descriptions()
        size = len(descriptions) + len(mcap_chunk.data)
        data = descriptions + mcap_chunk.data.tobytes() if descriptions else mcap_chunk.data.data
        compressed = self._compressor.compress(data)
        start = self._size
        head = MCAP_CHUNK_HEAD.pack(
            mcap_chunk.first_ns, mcap_chunk.last_ns, size, zlib.crc32(data), len(_COMPRESSION)
        )
        head += _COMPRESSION + struct.pack("<Q", len(compressed))
        self._append(RECORD_HEAD.pack(Opcode.CHUNK, len(head) + len(compressed)) + head)
        self._append(compressed)
        length, index_offsets = self._size - start, {}
        for channel_id, entries in mcap_chunk.index.items():
            entries["offset"] += len(descriptions)
            index_offsets[channel_id] = self._size
            self._append(RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, INDEX_HEAD.size + entries.nbytes))
            self._append(INDEX_HEAD.pack(channel_id, entries.nbytes) + entries.tobytes())
        self._mcap_chunk_indexes.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=_COMPRESSION.decode(),
                compressed_size=len(compressed),
                message_end_time=mcap_chunk.last_ns,
                message_index_length=self._size - start - length,
                message_index_offsets=index_offsets,
                message_start_time=mcap_chunk.first_ns,
                uncompressed_size=size,
            )
        )

    def finish(self, message_counts: Mapping[int, int]) -> None:
        """Append the summary, which completes the file; it stays open.

        Parameters
        ----------
        message_counts
            The number of messages written, by channel id.
        """
        self._append(self._take_descriptions())  # of channels without samples
        self._append(_record_bytes(records.DataEnd(data_section_crc=self._crc)))
        self._write_summary(message_counts)

    def close(self) -> None:
        """Close the file, finished or not."""
        self._stream.close()

    def _append(self, data: bytes) -> None:
        self._stream.write(data)
        self._size += len(data)
        self._crc = zlib.crc32(data, self._crc)

    def _take_descriptions(self) -> bytes:
        undescribed, self._undescribed = self._undescribed, []
        return _records_bytes(undescribed)

    def _write_summary(self, message_counts: Mapping[int, int]) -> None:
        start, data, summary_offsets = self._size, b"", []
        for opcode, group in (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics(message_counts)]),
            (Opcode.CHUNK_INDEX, self._mcap_chunk_indexes),
            (Opcode.ATTACHMENT_INDEX, self._attachment_indexes),
            (Opcode.METADATA_INDEX, self._metadata_indexes),
        ):
            group_data = _records_bytes(group)
            if group_data:
                offset = records.SummaryOffset(
                    group_opcode=opcode, group_start=start + len(data), group_length=len(group_data)
                )
                summary_offsets.append(offset)
            data += group_data
        offsets_start = start + len(data)
        data += _records_bytes(summary_offsets)
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 8 + 8 + 4, start, offsets_start)
        footer = records.Footer(
            summary_start=start,
            summary_offset_start=offsets_start,
            summary_crc=zlib.crc32(data + footer_head),
        )
        self._append(data)
        self._append(_record_bytes(footer))
        self._append(MAGIC)

    def _statistics(self, message_counts: Mapping[int, int]) -> records.Statistics:
        indexes = self._mcap_chunk_indexes
        return records.Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts={id_: count for id_, count in message_counts.items() if count},
            chunk_count=len(indexes),
            message_count=sum(message_counts.values()),
            message_end_time=max((index.message_end_time for index in indexes), default=0),
            message_start_time=min((index.message_start_time for index in indexes), default=0),
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )


def _records_bytes(group: Iterable[records.McapRecord]) -> bytes:
    return b"".join(map(_record_bytes, group))


def _record_bytes(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
