"""The bytes of an MCAP file, front to back, to columns of messages.

The file is read record by record, so that no more of it is held than was asked for. Every
checksum is verified, and what is damaged is left out and said.
"""

import os
import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import IO

import numpy as np
import zstandard
from mcap.opcode import Opcode

from .decode import MALFORMED, Contents, keep_record, take, take_orphans
from .records import CHUNK_HEAD, MAGIC, RECORD_HEAD, crc_of

_BLOCK = 1 << 20  # bytes that are read, and messages outside chunks that are taken, at a time
_LONGEST = 1 << 28  # bytes: no attachment of ours is longer, and no chunk that a crash cut


def scan(stream: IO[bytes], contents: Contents, skip: Collection[int] = ()) -> Iterator[None]:
    """Go through a file once; control comes back after each chunk, taken into `contents`.

    Chunks that start at an offset in `skip` are passed over unread; the checksum of the data as
    a whole is then not verified.
    """
    tape = _Tape(stream, stream.seek(0, os.SEEK_END), skip)
    for opcode, content, index in _gathered(tape):
        if opcode == Opcode.CHUNK:
            _read_chunk(content, index, contents)
            yield
        elif opcode == Opcode.MESSAGE:
            contents.in_order &= not take(content, [], contents)
            yield
        elif opcode == Opcode.DATA_END:
            if not skip:
                _check(tape.crc_before, content, "data", contents)
        elif opcode == Opcode.FOOTER and _ends_here(tape):
            crc = _summary_crc(stream, tape.end, content)
            _check(crc, content[-4:], "summary", contents)
            contents.finished = True
            break
        else:
            keep_record(opcode, content, contents)
    if not contents.finished:
        _read_tail(tape, contents)
    take_orphans(contents)
    yield


@dataclass
class _Tape:
    """A file's records, one after the other."""

    stream: IO[bytes]
    size: int
    skip: Collection[int]
    end: int = len(MAGIC)  # of the last record that was whole
    crc: int = zlib.crc32(MAGIC)  # of all up to there
    crc_before: int = 0  # of all before that record

    def __iter__(self) -> Iterator[tuple[int, bytes, bytes]]:
        """The records that are whole: opcode, head, content."""
        self.stream.seek(self.end)
        skipping = False
        while len(head := self.stream.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack(head)
            end = self.end + RECORD_HEAD.size + length
            if opcode == 0 or end > self.size:
                return
            # a chunk's indexes go with it
            skipping = self.end in self.skip or (skipping and opcode == Opcode.MESSAGE_INDEX)
            if skipping:
                self.end = self.stream.seek(end)
                continue
            if opcode != Opcode.CHUNK and length > _LONGEST:
                self.crc = crc_of(self.stream, self.end, end, self.crc)
                self.end = end
                continue
            content = self.stream.read(length)
            if len(content) < length:
                return
            self.end, self.crc_before = end, self.crc
            if not self.skip:
                self.crc = zlib.crc32(content, zlib.crc32(head, self.crc))
            yield opcode, head, content


def _gathered(tape: _Tape) -> Iterator[tuple[int, bytes, list[bytes]]]:
    """Chunks with the message indexes that follow them, messages outside chunks in runs, others."""
    chunk: bytes | None = None
    index: list[bytes] = []
    loose = bytearray()
    for opcode, head, content in tape:
        if opcode == Opcode.MESSAGE_INDEX:
            index.append(content)
            continue
        if chunk is not None:
            yield Opcode.CHUNK, chunk, index
        chunk, index = (content if opcode == Opcode.CHUNK else None), []
        if loose and (opcode != Opcode.MESSAGE or len(loose) >= _BLOCK):
            yield Opcode.MESSAGE, bytes(loose), []
            loose.clear()
        if opcode == Opcode.MESSAGE:
            loose += head + content
        elif chunk is None:
            yield opcode, content, []
    if chunk is not None:
        yield Opcode.CHUNK, chunk, index
    if loose:
        yield Opcode.MESSAGE, bytes(loose), []


def _summary_crc(stream: IO[bytes], end: int, footer: bytes) -> int:
    """The checksum of the summary that a footer, which ends at `end`, speaks of."""
    start = int.from_bytes(footer[:8], "little")
    return crc_of(stream, start or end - len(footer) - RECORD_HEAD.size, end - 4)


def _ends_here(tape: _Tape) -> bool:
    ends = tape.stream.read(len(MAGIC)) == MAGIC
    tape.stream.seek(tape.end)
    return ends


def _check(crc: int, checksum: bytes, name: str, contents: Contents) -> None:
    """Whether a section of the file holds the bytes once written, where nothing yet says no."""
    said = int.from_bytes(checksum, "little")
    if said and not contents.damage and said != crc:
        contents.damage.append(f"damaged: the checksum of its {name} is wrong, some may be missing")


def _read_chunk(content: bytes, index: list[bytes], contents: Contents) -> None:
    try:
        *_, size, crc, name_length = CHUNK_HEAD.unpack_from(content, 0)
        raw = _inflate(*_compression_and_body(content, name_length), size)
        if len(raw) != size or (crc and zlib.crc32(raw) != crc):
            raise ValueError("its checksum is wrong")
    except MALFORMED as error:
        span = np.frombuffer(content[:16].ljust(16, b"\0"), "<M8[ns]").astype("M8[ms]")
        contents.damage.append(
            f"lost what was received {span[0]} to {span[1]}: damaged chunk, {error}"
        )
    else:
        _take_chunk(raw, content, index, contents)


def _take_chunk(raw: bytes, head: bytes, index: list[bytes], contents: Contents) -> None:
    if take(raw, index, contents):
        first, last = struct.unpack_from("<qq", head)  # signed, as we read all times
        contents.in_order &= contents.latest_ns <= first <= last
        contents.latest_ns = last


def _read_tail(tape: _Tape, contents: Contents) -> None:
    """What an unfinished file ends with after its last whole record."""
    contents.cut = tape.end < tape.size
    tape.stream.seek(tape.end)
    _read_cut_chunk(tape.stream.read(_LONGEST), contents)
    tape.stream.seek(max(tape.end, tape.size - len(MAGIC)))
    if tape.stream.read(len(MAGIC)) == MAGIC:
        contents.damage.append(f"damaged at byte {tape.end}: what follows was not read")


def _read_cut_chunk(content: bytes, contents: Contents) -> None:
    """The whole messages of a chunk that the file ends in the middle of, if it does."""
    head = RECORD_HEAD.size + CHUNK_HEAD.size
    if len(content) <= head or content[0] != Opcode.CHUNK:
        return
    content = content[RECORD_HEAD.size :]
    *_, name_length = CHUNK_HEAD.unpack_from(content, 0)
    raw = _inflate_cut(*_compression_and_body(content, name_length))
    _take_chunk(raw, content, [], contents)


def _compression_and_body(content: bytes, name_length: int) -> tuple[str, memoryview]:
    at = CHUNK_HEAD.size
    compression = content[at : at + name_length].decode(errors="replace")
    return compression, memoryview(content)[at + name_length + 8 :]


def _inflate(compression: str, body: memoryview, size: int) -> bytes:
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompress(body, max_output_size=size)
    if compression == "lz4":
        import lz4.frame  # noqa: PLC0415 - mcap brings it; only files of others need it

        return bytes(lz4.frame.decompress(bytes(body)))
    if compression == "":
        return bytes(body)
    raise ValueError(f"compression {compression!r} is not known")


def _inflate_cut(compression: str, body: memoryview) -> bytes:
    """As much as the beginning of a compressed text tells."""
    written = bytes(body).rstrip(b"\0")  # a crash of the machine leaves zeros for what was not
    if compression == "":
        return written
    if compression != "zstd":
        return b""
    inflater, raw = zstandard.ZstdDecompressor().decompressobj(), bytearray()
    try:
        for at in range(0, len(written), 1 << 10):
            raw += inflater.decompress(written[at : at + (1 << 10)])
    except zstandard.ZstdError:
        pass  # what came before is whole
    return bytes(raw)
