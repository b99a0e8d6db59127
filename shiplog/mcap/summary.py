"""Summary section of an MCAP file: its content as recorded at its end."""

import os
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from .limits import MAX_RECORD_BYTES, MAX_SUMMARY_BYTES
from .metadata_record import metadata_is_intact, read_metadata
from .record_structure import attachment_is_intact, content_size, read_attachment
from .records import FOOTER_BYTES, INDEX_ENTRY, INDEX_HEAD, MAGIC, RECORD_HEAD, crc32_of_range
from .schema import METADATA_NAME, VESSEL_ATTACHMENT


@dataclass(frozen=True)
class McapChunkLocation:
    """Where an MCAP chunk is in the file, and what it contains.

    Attributes
    ----------
    offset
        The offset of the MCAP chunk record in the file.
    first_ns, last_ns
        The first and the last time of reception, ns. In a corrupt index the first may be later.
    channel_ids
        The channels with messages in the MCAP chunk.
    """

    offset: int
    first_ns: int
    last_ns: int
    channel_ids: frozenset[int]


@dataclass(frozen=True)
class McapSummary:
    """The summary of a finished file, whose checksum is correct.

    Attributes
    ----------
    schemas, channels
        The schema and channel records, by id.
    statistics
        The statistics record: the number of messages of each channel, first and last time.
    metadata
        Text about the trial, by key.
    vessel_toml
        The attached vessel file, or None.
    mcap_chunk_indexes
        The content of the chunk index records, not parsed: a long file has thousands.
    attachment_offsets, metadata_offsets
        The offsets of the indexed attachments and metadata records.
    is_verified
        Whether a checksum covers the summary.
    has_damaged_records
        Whether an attachment or a metadata record of shiplog is damaged, and thus not in it.
    """

    schemas: dict[int, records.Schema]
    channels: dict[int, records.Channel]
    statistics: records.Statistics
    metadata: dict[str, str]
    vessel_toml: str | None
    mcap_chunk_indexes: tuple[bytes, ...]
    attachment_offsets: tuple[int, ...]
    metadata_offsets: tuple[int, ...]
    is_verified: bool
    has_damaged_records: bool

    def mcap_chunk_locations(self) -> tuple[McapChunkLocation, ...] | None:
        """Return the locations of the MCAP chunks in the order of the file.

        None if some messages are in no indexed MCAP chunk: then the index does not show in which
        parts of the file a channel has no messages.
        """
        locations, messages = [], 0
        for content in self.mcap_chunk_indexes:
            index = records.ChunkIndex.read(ReadDataStream(BytesIO(content)))
            ids = index.message_index_offsets
            head = RECORD_HEAD.size + INDEX_HEAD.size
            messages += (index.message_index_length - head * len(ids)) // INDEX_ENTRY.itemsize
            first, last = struct.unpack_from("<qq", content)  # signed, as all times in shiplog
            location = McapChunkLocation(index.chunk_start_offset, first, last, frozenset(ids))
            locations.append(location)
        if messages != self.statistics.message_count:
            return None
        return tuple(sorted(locations, key=lambda location: location.offset))


def are_in_order(mcap_chunks: Iterable[McapChunkLocation]) -> bool:
    """Whether each MCAP chunk with messages was received after the ones before it."""
    latest = 0
    for mcap_chunk in mcap_chunks:
        if mcap_chunk.channel_ids and not latest <= mcap_chunk.first_ns <= mcap_chunk.last_ns:
            return False
        latest = max(latest, mcap_chunk.last_ns)
    return True


def read_summary(stream: IO[bytes]) -> McapSummary | None:
    """Read the summary at the end of a file.

    Returns
    -------
    summary
        None if the file has no summary, if it is damaged, or if it does not describe every channel
        that has messages. In these cases the whole file has to be read.
    """
    try:
        return _read_summary(stream)
    except (McapError, struct.error, ValueError, KeyError, OverflowError, OSError, MemoryError):
        return None


def _read_summary(stream: IO[bytes]) -> McapSummary | None:
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - len(MAGIC) - FOOTER_BYTES))
    footer = stream.read()
    start, _, crc = struct.unpack_from("<QQI", footer, RECORD_HEAD.size)
    if footer[0] != Opcode.FOOTER or not footer.endswith(MAGIC) or not 0 < start < size:
        return None
    end = size - len(MAGIC) - 4
    if end - start > MAX_SUMMARY_BYTES:
        return None
    if crc and crc32_of_range(stream, start, end) != crc:
        return None
    by_opcode: dict[int, list[bytes]] = {}
    for opcode, content in _section_records(stream, start, size - len(MAGIC) - FOOTER_BYTES):
        by_opcode.setdefault(opcode, []).append(content)
    schemas = [records.Schema.read(s) for s in _streams(by_opcode, Opcode.SCHEMA)]
    channels = [records.Channel.read(s) for s in _streams(by_opcode, Opcode.CHANNEL)]
    statistics = [records.Statistics.read(s) for s in _streams(by_opcode, Opcode.STATISTICS)]
    by_id = {channel.id: channel for channel in channels}
    schema_ids = {0, *(schema.id for schema in schemas)}
    described = {id_ for id_, channel in by_id.items() if channel.schema_id in schema_ids}
    if len(statistics) != 1 or not described.issuperset(statistics[0].channel_message_counts):
        return None
    metadata, vessel_toml, is_damaged = _own_records(stream, by_opcode)
    return McapSummary(
        {schema.id: schema for schema in schemas},
        by_id,
        statistics[0],
        metadata,
        vessel_toml,
        tuple(by_opcode.get(Opcode.CHUNK_INDEX, [])),
        _offsets(by_opcode.get(Opcode.ATTACHMENT_INDEX, [])),
        _offsets(by_opcode.get(Opcode.METADATA_INDEX, [])),
        bool(crc),
        is_damaged,
    )


def _section_records(stream: IO[bytes], start: int, end: int) -> Iterator[tuple[int, bytes]]:
    """Yield the opcode and the content of each record from `start` to before `end`."""
    stream.seek(start)
    data, at = stream.read(end - start), 0
    while at < len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size + length
        content = data[at - length : at]
        if at > len(data) or (opcode <= max(Opcode) and content_size(opcode, content) is None):
            raise ValueError("a record that is longer than its section, or than its fields")
        yield opcode, content


def _streams(by_opcode: dict[int, list[bytes]], opcode: Opcode) -> Iterator[ReadDataStream]:
    return (ReadDataStream(BytesIO(content)) for content in by_opcode.get(opcode, []))


def _offsets(indexes: list[bytes]) -> tuple[int, ...]:
    """Return the offsets of the records to which indexes of attachments or metadata point."""
    return tuple(int.from_bytes(content[:8], "little") for content in indexes)


def _own_records(
    stream: IO[bytes], by_opcode: dict[int, list[bytes]]
) -> tuple[dict[str, str], str | None, bool]:
    """Return the metadata, the vessel file, and whether one of their records is damaged."""
    metadata: dict[str, str] = {}
    vessel_toml, is_damaged, size = None, False, 0
    for entry in _streams(by_opcode, Opcode.METADATA_INDEX):
        index = records.MetadataIndex.read(entry)
        if index.name == METADATA_NAME:
            size = _with_length(size, index.length)
            content = _indexed_record(stream, index.offset, index.length, Opcode.METADATA)
            is_damaged |= not metadata_is_intact(content)
            metadata |= {} if is_damaged else read_metadata(content).metadata
    for entry in _streams(by_opcode, Opcode.ATTACHMENT_INDEX):
        index = records.AttachmentIndex.read(entry)
        if index.name == VESSEL_ATTACHMENT:
            size = _with_length(size, index.length)
            content = _indexed_record(stream, index.offset, index.length, Opcode.ATTACHMENT)
            if attachment_is_intact(content):
                vessel_toml = read_attachment(content).data.decode()
            else:
                is_damaged = True
    return metadata, vessel_toml, is_damaged


def _with_length(size: int, length: int) -> int:
    """Add the length of a record to that of others; many indexes may point to a long one."""
    if size + length > MAX_RECORD_BYTES:
        raise ValueError("indexes of records that are longer than those of any log")
    return size + length


def _indexed_record(stream: IO[bytes], offset: int, length: int, opcode: Opcode) -> bytes:
    """Return the content of the record that an index points to."""
    stream.seek(offset)
    data = stream.read(length)
    if RECORD_HEAD.unpack_from(data) != (opcode, length - RECORD_HEAD.size):
        raise ValueError("an index that points to another record")
    return data[RECORD_HEAD.size :]
