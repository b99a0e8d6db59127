"""What an MCAP file says of itself at its end, without reading what it holds."""

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from .records import FOOTER_BYTES, MAGIC, RECORD_HEAD, crc_of
from .schema import METADATA_NAME, VESSEL_ATTACHMENT

_INDEX_HEAD = RECORD_HEAD.size + 6  # of a message index: the channel, the length of its entries
_ENTRY = 16  # bytes of one message in a message index


@dataclass(frozen=True)
class ChunkPlace:
    """Where a chunk stands in the file, and what it holds."""

    offset: int
    first_ns: int  # of reception; later than `last_ns` where the file says nonsense
    last_ns: int
    channel_ids: frozenset[int]


@dataclass(frozen=True)
class Summary:
    """A summary that its checksum vouches for."""

    schemas: dict[int, records.Schema]
    channels: dict[int, records.Channel]
    statistics: records.Statistics
    metadata: dict[str, str]
    vessel_toml: str | None
    chunk_indexes: tuple[bytes, ...]  # unread: there are thousands in a long file

    def chunk_places(self) -> tuple[ChunkPlace, ...] | None:
        """The chunks in the order of the file; None if some messages are in none of them.

        Only where every message is accounted for can one know where a channel's messages are not.
        """
        places, messages = [], 0
        for content in self.chunk_indexes:
            index = records.ChunkIndex.read(ReadDataStream(BytesIO(content)))
            ids = index.message_index_offsets
            messages += (index.message_index_length - _INDEX_HEAD * len(ids)) // _ENTRY
            first, last = struct.unpack_from("<qq", content)  # signed, as we read all times
            places.append(ChunkPlace(index.chunk_start_offset, first, last, frozenset(ids)))
        if messages != self.statistics.message_count:
            return None
        return tuple(sorted(places, key=lambda place: place.offset))


def read_summary(stream: IO[bytes]) -> Summary | None:
    """The summary of a finished file.

    None where there is none, where it is damaged, or where it does not describe every channel
    that has messages: then only reading the file tells.
    """
    try:
        return _summary(stream)
    except (McapError, struct.error, ValueError, KeyError, OverflowError, OSError, MemoryError):
        return None


def _summary(stream: IO[bytes]) -> Summary | None:
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - len(MAGIC) - FOOTER_BYTES))
    footer = stream.read()
    start, _, crc = struct.unpack_from("<QQI", footer, RECORD_HEAD.size)
    if footer[0] != Opcode.FOOTER or not footer.endswith(MAGIC) or not 0 < start < size:
        return None
    end = size - len(MAGIC) - 4
    if crc and crc_of(stream, start, end) != crc:
        return None
    found: dict[int, list[bytes]] = {}
    for opcode, content in _records(stream, start, size - len(MAGIC) - FOOTER_BYTES):
        found.setdefault(opcode, []).append(content)
    schemas = [records.Schema.read(s) for s in _streams(found, Opcode.SCHEMA)]
    channels = [records.Channel.read(s) for s in _streams(found, Opcode.CHANNEL)]
    statistics = [records.Statistics.read(s) for s in _streams(found, Opcode.STATISTICS)]
    by_id = {channel.id: channel for channel in channels}
    schema_ids = {0, *(schema.id for schema in schemas)}
    described = {id_ for id_, channel in by_id.items() if channel.schema_id in schema_ids}
    if len(statistics) != 1 or not described.issuperset(statistics[0].channel_message_counts):
        return None
    return Summary(
        {schema.id: schema for schema in schemas},
        by_id,
        statistics[0],
        _metadata(stream, found),
        _vessel(stream, found),
        tuple(found.get(Opcode.CHUNK_INDEX, [])),
    )


def _records(stream: IO[bytes], start: int, end: int) -> Iterator[tuple[int, bytes]]:
    stream.seek(start)
    data, at = stream.read(end - start), 0
    while at < len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size + length
        if at > len(data):
            raise ValueError("a record that is longer than its section")
        yield opcode, data[at - length : at]


def _streams(found: dict[int, list[bytes]], opcode: Opcode) -> Iterator[ReadDataStream]:
    return (ReadDataStream(BytesIO(content)) for content in found.get(opcode, []))


def _metadata(stream: IO[bytes], found: dict[int, list[bytes]]) -> dict[str, str]:
    said: dict[str, str] = {}
    for place in _streams(found, Opcode.METADATA_INDEX):
        index = records.MetadataIndex.read(place)
        if index.name == METADATA_NAME:
            content = _at(stream, index.offset, index.length, Opcode.METADATA)
            said |= records.Metadata.read(content).metadata
    return said


def _vessel(stream: IO[bytes], found: dict[int, list[bytes]]) -> str | None:
    text = None
    for place in _streams(found, Opcode.ATTACHMENT_INDEX):
        index = records.AttachmentIndex.read(place)
        if index.name == VESSEL_ATTACHMENT:
            content = _at(stream, index.offset, index.length, Opcode.ATTACHMENT)
            text = records.Attachment.read(content).data.decode()
    return text


def _at(stream: IO[bytes], offset: int, length: int, opcode: Opcode) -> ReadDataStream:
    """The content of the record that an index points to."""
    stream.seek(offset)
    data = stream.read(length)
    if RECORD_HEAD.unpack_from(data)[0] != opcode:
        raise ValueError("an index that points to something else")
    return ReadDataStream(BytesIO(data[RECORD_HEAD.size :]))
