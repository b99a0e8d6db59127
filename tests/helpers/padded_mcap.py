"""The padded variant of an MCAP file: bytes after the fields of each record that may have them.

A later version of MCAP may add fields at the end of a record, which a reader has to ignore. Footer,
data end, messages and MCAP chunks end with their last field.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode

MAGIC, HEAD = b"\x89MCAP0\r\n", struct.Struct("<BQ")
PADDING = b"\x01\xff\xff"
NEVER_PADDED = {Opcode.FOOTER, Opcode.DATA_END, Opcode.MESSAGE, Opcode.CHUNK}
RECORDS = {
    Opcode.CHUNK: records.Chunk,
    Opcode.MESSAGE_INDEX: records.MessageIndex,
    Opcode.CHUNK_INDEX: records.ChunkIndex,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex,
    Opcode.METADATA_INDEX: records.MetadataIndex,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset,
    Opcode.FOOTER: records.Footer,
    Opcode.DATA_END: records.DataEnd,
}


def padded(data: bytes) -> bytes:
    """Return the padded variant of a whole MCAP file, whose MCAP chunks are not compressed.

    All offsets, lengths and checksums are right.
    """
    places = _places(data)
    out = bytearray(MAGIC)
    in_chunk: dict[int, int] = {}  # places in the data of the last MCAP chunk
    for opcode, _, content in _records(data, len(MAGIC), len(data) - len(MAGIC)):
        if opcode not in RECORDS:
            out += _record(opcode, content)
        else:
            record: Any = RECORDS[opcode].read(ReadDataStream(BytesIO(content)))
            if opcode == Opcode.CHUNK:
                in_chunk = _data_places(record.data)
            if opcode == Opcode.MESSAGE_INDEX:
                record.records = [(time, in_chunk[offset]) for time, offset in record.records]
            record = _moved(record, places)
            if opcode == Opcode.DATA_END:
                record.data_section_crc = record.data_section_crc and zlib.crc32(out)
            if opcode == Opcode.FOOTER:
                begin = record.summary_start or len(out)
                covered = out[begin:] + HEAD.pack(opcode, 20) + _content(record)[:16]
                record.summary_crc = record.summary_crc and zlib.crc32(covered)
            out += _record(opcode, _content(record))
    return bytes(out) + MAGIC


def _records(data: bytes, at: int, end: int) -> Iterator[tuple[int, int, bytes]]:
    while at < end:
        opcode, length = HEAD.unpack_from(data, at)
        yield opcode, at, data[at + HEAD.size : at + HEAD.size + length]
        at += HEAD.size + length


def _record(opcode: int, content: bytes) -> bytes:
    padding = b"" if opcode in NEVER_PADDED else PADDING
    return HEAD.pack(opcode, len(content + padding)) + content + padding


def _content(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())[HEAD.size :]


def _places(data: bytes) -> dict[int, int]:
    """Return where the begin of each record, and the end of the last one, is in the padded file."""
    places, at = {}, len(MAGIC)
    for opcode, start, content in _records(data, len(MAGIC), len(data) - len(MAGIC)):
        places[start] = at
        if opcode == Opcode.CHUNK:
            chunk = records.Chunk.read(ReadDataStream(BytesIO(content)))
            at += len(_record(opcode, content)) + len(_padded_data(chunk.data)) - len(chunk.data)
        else:
            at += len(_record(opcode, content))
    return places | {len(data) - len(MAGIC): at}


def _padded_data(data: bytes) -> bytes:
    return b"".join(_record(opcode, content) for opcode, _, content in _records(data, 0, len(data)))


def _data_places(data: bytes) -> dict[int, int]:
    places, at = {}, 0
    for opcode, start, content in _records(data, 0, len(data)):
        places[start] = at
        at += len(_record(opcode, content))
    return places


def _moved(record: records.McapRecord, places: dict[int, int]) -> records.McapRecord:
    """Return a record with the offsets and lengths that it has in the padded file."""

    def length(begin: int, size: int) -> int:
        return places[begin + size] - places[begin]

    match record:
        case records.Chunk():
            data = _padded_data(record.data)
            crc = zlib.crc32(data) if record.uncompressed_crc else 0
            return replace(record, data=data, uncompressed_size=len(data), uncompressed_crc=crc)
        case records.ChunkIndex():
            at, size = record.chunk_start_offset, record.chunk_length
            grown = length(at, size) - size
            return replace(
                record,
                chunk_start_offset=places[at],
                chunk_length=size + grown,
                message_index_offsets={
                    id_: places[offset] for id_, offset in record.message_index_offsets.items()
                },
                message_index_length=length(at + size, record.message_index_length),
                compressed_size=record.compressed_size + grown,
                uncompressed_size=record.uncompressed_size + grown,
            )
        case records.AttachmentIndex() | records.MetadataIndex():
            new_length = length(record.offset, record.length)
            return replace(record, offset=places[record.offset], length=new_length)
        case records.SummaryOffset():
            new_length = length(record.group_start, record.group_length)
            return replace(record, group_start=places[record.group_start], group_length=new_length)
        case records.Footer():
            return replace(
                record,
                summary_start=record.summary_start and places[record.summary_start],
                summary_offset_start=record.summary_offset_start
                and places[record.summary_offset_start],
            )
    return record
