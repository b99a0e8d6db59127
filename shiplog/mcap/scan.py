"""Sequential scan of an MCAP file, record by record.

The file is read from front to back in bounded memory, up to the contents that the caller does not
drain. All checksums are verified; damaged parts are skipped and reported.
"""

import os
import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import IO

import numpy as np
from mcap.opcode import Opcode

from .contents import McapContents
from .decode import MALFORMED, collect_messages, collect_undescribed, read_record
from .decompress import mcap_chunk_data, truncated_mcap_chunk_data
from .locate import complete_records
from .records import MAGIC, MCAP_CHUNK_HEAD, RECORD_HEAD, crc32_of_range

_MAX_LOOSE_BYTES = 1 << 20  # of messages outside of MCAP chunks that are collected at once
# Longer records other than MCAP chunks are skipped: no attachment of shiplog is as long. Of an
# MCAP chunk cut off by a crash no more is decompressed.
_MAX_RECORD_BYTES = 1 << 28


def scan(stream: IO[bytes], contents: McapContents, skip: Collection[int] = ()) -> Iterator[None]:
    """Go through a file once, and yield after each MCAP chunk that was added to `contents`.

    Parameters
    ----------
    stream
        The file, opened in binary mode.
    contents
        Receives what the file contains. The caller may drain it at each yield.
    skip
        The offsets of MCAP chunks not to read. With any, the checksum of the data section as a
        whole is not verified.
    """
    reader = _RecordReader(stream, stream.seek(0, os.SEEK_END), skip)
    for opcode, content, indexes in _grouped_records(reader):
        if opcode == Opcode.CHUNK:
            _read_mcap_chunk(content, indexes, contents)
            yield
        elif opcode == Opcode.MESSAGE:
            contents.in_order &= not collect_messages(content, [], contents)
            yield
        elif opcode == Opcode.DATA_END:
            if not skip:
                _verify_checksum(reader.crc_before, content, "data section", contents)
        elif opcode == Opcode.FOOTER and _is_at_end(reader):
            crc = _summary_crc(stream, reader.end, content)
            _verify_checksum(crc, content[-4:], "summary", contents)
            contents.finished = True
            break
        else:
            read_record(opcode, content, contents)
    if not contents.finished:
        _read_truncated_end(reader, contents)
    collect_undescribed(contents)
    yield


@dataclass
class _RecordReader:
    """An iterator over the complete records of a file, with a running checksum.

    Attributes
    ----------
    stream, size
        The file and its size in bytes.
    skip
        The offsets of MCAP chunks not to read.
    end
        The offset after the last complete record.
    crc, crc_before
        The checksums of the file up to `end`, and up to the start of that record.
    """

    stream: IO[bytes]
    size: int
    skip: Collection[int]
    end: int = len(MAGIC)
    crc: int = zlib.crc32(MAGIC)
    crc_before: int = 0

    def __iter__(self) -> Iterator[tuple[int, bytes, bytes]]:
        """Yield the opcode, the head and the content of each record."""
        self.stream.seek(self.end)
        skipping = False
        while len(head := self.stream.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack(head)
            end = self.end + RECORD_HEAD.size + length
            if opcode == 0 or end > self.size:
                return
            # the message indexes of a skipped MCAP chunk are skipped with it
            skipping = self.end in self.skip or (skipping and opcode == Opcode.MESSAGE_INDEX)
            if skipping:
                self.end = self.stream.seek(end)
                continue
            if opcode != Opcode.CHUNK and length > _MAX_RECORD_BYTES:
                self.crc = crc32_of_range(self.stream, self.end, end, self.crc)
                self.end = end
                continue
            content = self.stream.read(length)
            if len(content) < length:
                return
            self.end, self.crc_before = end, self.crc
            if not self.skip:
                self.crc = zlib.crc32(content, zlib.crc32(head, self.crc))
            yield opcode, head, content


def _grouped_records(reader: _RecordReader) -> Iterator[tuple[int, bytes, list[bytes]]]:
    """Yield MCAP chunks with their message indexes, runs of loose messages, and other records."""
    mcap_chunk: bytes | None = None
    indexes: list[bytes] = []
    loose = bytearray()
    for opcode, head, content in reader:
        if opcode == Opcode.MESSAGE_INDEX:
            indexes.append(content)
            continue
        if mcap_chunk is not None:
            yield Opcode.CHUNK, mcap_chunk, indexes
        mcap_chunk, indexes = (content if opcode == Opcode.CHUNK else None), []
        if loose and (opcode != Opcode.MESSAGE or len(loose) >= _MAX_LOOSE_BYTES):
            yield Opcode.MESSAGE, bytes(loose), []
            loose.clear()
        if opcode == Opcode.MESSAGE:
            loose += head + content
        elif mcap_chunk is None:
            yield opcode, content, []
    if mcap_chunk is not None:
        yield Opcode.CHUNK, mcap_chunk, indexes
    if loose:
        yield Opcode.MESSAGE, bytes(loose), []


def _summary_crc(stream: IO[bytes], end: int, footer: bytes) -> int:
    """Return the checksum of the summary to which the footer refers; the footer ends at `end`."""
    start = int.from_bytes(footer[:8], "little")
    return crc32_of_range(stream, start or end - len(footer) - RECORD_HEAD.size, end - 4)


def _is_at_end(reader: _RecordReader) -> bool:
    is_magic = reader.stream.read(len(MAGIC)) == MAGIC
    reader.stream.seek(reader.end)
    return is_magic


def _verify_checksum(crc: int, recorded: bytes, section: str, contents: McapContents) -> None:
    """Report a wrong checksum of a section, unless damage in it was reported already."""
    expected = int.from_bytes(recorded, "little")
    if expected and not contents.damage and expected != crc:
        contents.damage.append(
            f"damaged: the checksum of the {section} is wrong; samples may be missing"
        )


def _read_mcap_chunk(content: bytes, indexes: list[bytes], contents: McapContents) -> None:
    try:
        data = mcap_chunk_data(content)
    except MALFORMED as error:
        span = np.frombuffer(content[:16].ljust(16, b"\0"), "<M8[ns]").astype("M8[ms]")
        contents.damage.append(
            f"lost the samples received from {span[0]} to {span[1]}: damaged MCAP chunk, {error}"
        )
    else:
        _collect_mcap_chunk(data, content, indexes, contents)


def _collect_mcap_chunk(
    data: bytes, content: bytes, indexes: list[bytes], contents: McapContents
) -> None:
    if collect_messages(data, indexes, contents):
        first, last = struct.unpack_from("<qq", content)  # signed, as all times in shiplog
        contents.in_order &= contents.latest_ns <= first <= last
        contents.latest_ns = last


def _read_truncated_end(reader: _RecordReader, contents: McapContents) -> None:
    """Read what follows the last complete record of an unfinished file."""
    contents.truncated = reader.end < reader.size
    reader.stream.seek(reader.end)
    _read_truncated_mcap_chunk(reader.stream.read(_MAX_RECORD_BYTES), contents)
    reader.stream.seek(max(reader.end, reader.size - len(MAGIC)))
    if reader.stream.read(len(MAGIC)) == MAGIC:
        contents.damage.append(f"damaged at byte {reader.end}: the rest of the file was not read")


def _read_truncated_mcap_chunk(record: bytes, contents: McapContents) -> None:
    """Collect the complete messages of an MCAP chunk that is cut off by the end of the file.

    One that a recorder had left open is not cut off where it ends with a message.
    """
    head = RECORD_HEAD.size + MCAP_CHUNK_HEAD.size
    if len(record) <= head or record[0] != Opcode.CHUNK:
        return
    content = record[RECORD_HEAD.size :]
    data = truncated_mcap_chunk_data(content)
    _collect_mcap_chunk(data, content, [], contents)
    *_, size, _, _ = MCAP_CHUNK_HEAD.unpack_from(content)
    if size == 0:  # its head was not completed
        contents.truncated = max((end for *_, end in complete_records(data, 0)), default=0) < len(
            data
        )
