"""Writer of the records of an MCAP file: MCAP chunks, indexes, attachments and summary."""

import os
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO

import mcap
import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from numpy.typing import NDArray

from shiplog.files import write_error
from shiplog.version import __version__

from .encode import McapChunk
from .open_chunk import COMPRESSION, OpenMcapChunk, mcap_chunk_head
from .records import INDEX_HEAD, MAGIC, RECORD_HEAD

_COPY_BYTES = 1 << 20


class McapRecordWriter:
    """An open MCAP file to which records are appended; `finish` makes it a complete file.

    Parameters
    ----------
    path
        The file; it is overwritten.
    profile
        The profile of the file's header, such as ``ros2``.

    Raises
    ------
    ShiplogError
        The file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], profile: str = "") -> None:
        try:
            self._stream = Path(path).open("wb")  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise write_error(Path(path), error) from error
        self._size, self._crc = 0, 0
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._undescribed: list[records.McapRecord] = []  # schemas and channels not yet written
        self._descriptions = b""  # the records of all schemas and channels so far
        self._mcap_chunk_indexes: list[records.ChunkIndex] = []
        self._metadata_indexes: list[records.MetadataIndex] = []
        self._attachment_indexes: list[records.AttachmentIndex] = []
        self._open: OpenMcapChunk | None = None
        self._compressor = zstandard.ZstdCompressor()
        self._append(MAGIC)
        library = f"shiplog {__version__} mcap {mcap.__version__}"
        self._append(_record_bytes(records.Header(profile=profile, library=library)))

    @property
    def closed(self) -> bool:
        """Whether the file is closed."""
        return self._stream.closed

    def flush(self) -> None:
        """Hand what was written to the operating system, so that a killed process keeps it."""
        self._stream.flush()

    def write_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Append a metadata record."""
        self.close_mcap_chunk()
        data = _record_bytes(records.Metadata(name=name, metadata=dict(metadata)))
        index = records.MetadataIndex(offset=self._size, length=len(data), name=name)
        self._metadata_indexes.append(index)
        self._append(data)

    def write_attachment(self, attachment: records.Attachment) -> None:
        """Append an attachment."""
        self.close_mcap_chunk()
        data = _record_bytes(attachment)
        self._attachment_indexes.append(
            records.AttachmentIndex(
                offset=self._size,
                length=len(data),
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )
        self._append(data)

    def copy_attachment(self, source: IO[bytes], index: records.AttachmentIndex) -> None:
        """Append an attachment of another file, in bounded memory.

        Parameters
        ----------
        source
            The other file.
        index
            The index entry of the attachment there.
        """
        self.close_mcap_chunk()
        self._attachment_indexes.append(replace(index, offset=self._size))
        source.seek(index.offset)
        for at in range(0, index.length, _COPY_BYTES):
            self._append(source.read(min(_COPY_BYTES, index.length - at)))

    def add_schema(self, schema: records.Schema) -> None:
        """Describe a schema at the beginning of each further MCAP chunk."""
        self._schemas.append(schema)
        self._undescribed.append(schema)

    def add_channel(self, channel: records.Channel) -> None:
        """Describe a channel at the beginning of each further MCAP chunk."""
        self._channels.append(channel)
        self._undescribed.append(channel)

    def write_mcap_chunk(self, mcap_chunk: McapChunk) -> None:
        """Append a complete MCAP chunk and its message indexes."""
        self.close_mcap_chunk()
        descriptions = self._all_descriptions()
        data = descriptions + mcap_chunk.data.tobytes() if descriptions else mcap_chunk.data.data
        compressed = self._compressor.compress(data)
        head = mcap_chunk_head(
            mcap_chunk.first_ns, mcap_chunk.last_ns, len(data), zlib.crc32(data), len(compressed)
        )
        start = self._size
        self._append(RECORD_HEAD.pack(Opcode.CHUNK, len(head) + len(compressed)) + head)
        self._append(compressed)
        for entries in mcap_chunk.index.values():
            entries["offset"] += len(descriptions)
        span = mcap_chunk.first_ns, mcap_chunk.last_ns
        self._write_indexes(start, span, (len(data), len(compressed)), mcap_chunk.index)

    def extend_mcap_chunk(self, messages: McapChunk) -> None:
        """Append messages to an MCAP chunk that stays open for more, until it is large enough.

        After a `flush` they can be read, as those of complete MCAP chunks. A pipe is given complete
        ones.
        """
        if not self._stream.seekable():
            self.write_mcap_chunk(messages)
            return
        if self._undescribed:  # descriptions precede the messages of an MCAP chunk
            self.close_mcap_chunk()
        if self._open is None:
            self._open = OpenMcapChunk(self._size, self._all_descriptions(), messages.first_ns)
            self._write(self._open.first_bytes())
        self._write(self._open.append(messages))
        if self._open.is_full:
            self.close_mcap_chunk()

    def close_mcap_chunk(self) -> None:
        """Complete the open MCAP chunk, where there is one, and append its message indexes."""
        if self._open is None:
            return
        mcap_chunk, self._open = self._open, None
        self._write(mcap_chunk.last_bytes())
        head, compressed = mcap_chunk.record_parts()
        self._stream.seek(mcap_chunk.offset)  # after it has handed all data to the system
        self._stream.write(head)
        self._stream.seek(0, os.SEEK_END)
        self._crc = zlib.crc32(compressed, zlib.crc32(head, self._crc))
        span, sizes = (mcap_chunk.first_ns, mcap_chunk.last_ns), (mcap_chunk.size, len(compressed))
        self._write_indexes(mcap_chunk.offset, span, sizes, mcap_chunk.index())

    def finish(self, message_counts: Mapping[int, int]) -> None:
        """Append the summary, which completes the file; it stays open.

        Parameters
        ----------
        message_counts
            The number of messages written, by channel id.
        """
        self.close_mcap_chunk()
        self._append(_records_bytes(self._undescribed))  # of channels without samples
        self._append(_record_bytes(records.DataEnd(data_section_crc=self._crc)))
        self._write_summary(message_counts)

    def close(self) -> None:
        """Close the file, finished or not."""
        self._stream.close()

    def _append(self, data: bytes) -> None:
        """Write bytes that do not change."""
        self._write(data)
        self._crc = zlib.crc32(data, self._crc)

    def _write(self, data: bytes) -> None:
        """Write bytes that are not yet part of the checksum."""
        self._stream.write(data)
        self._size += len(data)

    def _write_indexes(
        self,
        start: int,
        span_ns: tuple[int, int],
        sizes: tuple[int, int],
        index: Mapping[int, NDArray[np.void]],
    ) -> None:
        """Append the message indexes of the MCAP chunk that was written last.

        Parameters
        ----------
        start
            The offset of its record.
        span_ns
            Its first and its last time of reception, ns.
        sizes
            The sizes of its data before and after compression.
        index
            The index entries by channel id.
        """
        length, index_offsets = self._size - start, {}
        for channel_id, entries in index.items():
            index_offsets[channel_id] = self._size
            self._append(RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, INDEX_HEAD.size + entries.nbytes))
            self._append(INDEX_HEAD.pack(channel_id, entries.nbytes) + entries.tobytes())
        self._mcap_chunk_indexes.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=COMPRESSION.decode(),
                compressed_size=sizes[1],
                message_end_time=span_ns[1],
                message_index_length=self._size - start - length,
                message_index_offsets=index_offsets,
                message_start_time=span_ns[0],
                uncompressed_size=sizes[0],
            )
        )

    def _all_descriptions(self) -> bytes:
        """Return the schemas and channels so far, so that each MCAP chunk can be read alone."""
        self._descriptions += _records_bytes(self._undescribed)
        self._undescribed = []
        return self._descriptions

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
