"""Walk over the records of a file that may be damaged, from front to back.

Where a record's opcode or length is wrong, the other one and the fields of its content show what it
is. Where that fails, the walk goes on at the next place at which a record has a sound structure.
"""

import os
import re
from collections.abc import Collection, Iterator
from typing import IO, NamedTuple

from mcap.opcode import Opcode

from .damage import Damage
from .decompress import is_mcap_chunk_intact, is_mcap_chunk_start
from .limits import MAX_RECORD_BYTES
from .record_structure import attachment_is_intact, content_size, opcode_of
from .records import MAGIC, RECORD_HEAD

_MAX_SEARCH_BYTES = 1 << 28  # read in searches, so that a hostile file does not take minutes
_BLOCK_BYTES = 1 << 20
_LAST_KNOWN = max(Opcode)
_FIRST_PRIVATE = 0x80
_SUMMARY = frozenset(
    (Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.METADATA_INDEX,
     Opcode.SUMMARY_OFFSET, Opcode.FOOTER)
)  # fmt: skip
# what a search finds: in a file with MCAP chunks no messages, since those found may be within a
# damaged MCAP chunk, where no checksum covers them
_FOUND = frozenset((Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA, Opcode.MESSAGE_INDEX,
                    Opcode.DATA_END, *_SUMMARY))  # fmt: skip
_LOOSE = frozenset((Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE))
# an opcode and a length of less than 4 GiB, at any byte
_HEAD_PATTERN = re.compile(rb"(?=[\x01-\x0f][\s\S]{4}\0{4})")


class Record(NamedTuple):
    """A record: its opcode, the offsets of its first byte and of the byte after it, its content.

    An attachment that is too long to be read at once has no content.
    """

    opcode: int
    start: int
    end: int
    content: bytes


class RecordWalk:
    """An iterator over the records before the summary.

    Parameters
    ----------
    stream
        The file, opened in binary mode.
    skip
        The offsets of MCAP chunks not to read, with their message indexes.
    data_end
        The offset at which the data section ends, where it is known.

    Attributes
    ----------
    end
        The offset after the last record.
    size
        The size of the file.
    is_complete
        Whether the end of the data section was reached.
    remarks
        The records that were read although their opcode or length is wrong.
    gaps
        The offsets, start and end, between which no record can be read.
    """

    def __init__(
        self,
        stream: IO[bytes],
        skip: Collection[int] = (),
        data_end: int | None = None,
    ) -> None:
        self.end = len(MAGIC)
        self.size = stream.seek(0, os.SEEK_END)
        self.is_complete = False
        self.remarks: list[Damage] = []
        self.gaps: list[tuple[int, int]] = []
        self._stream, self._skip, self._data_end = stream, skip, data_end
        self._has_mcap_chunks = False
        self._searched = 0

    def __iter__(self) -> Iterator[Record]:
        """Yield each record; those of MCAP chunks to skip are omitted."""
        while (record := self._next()) is not None:
            self.end = record.end
            yield record
            if record.opcode == Opcode.DATA_END or record.opcode in _SUMMARY:
                self.is_complete = True
                return

    def _next(self) -> Record | None:
        self._skip_mcap_chunks()
        record = self._record_at(self.end)
        if record is None and self.end < self.size:
            start = self.end
            record = self._search(start + 1)
            if record is not None:
                self.gaps.append((start, record.start))
        if record is not None:
            self._has_mcap_chunks |= record.opcode == Opcode.CHUNK
        return record

    def _skip_mcap_chunks(self) -> None:
        skipping = False
        while len(head := self._read(self.end, RECORD_HEAD.size)) == RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack(head)
            skipping = self.end in self._skip or (skipping and opcode == Opcode.MESSAGE_INDEX)
            if not skipping:
                return
            self.end += RECORD_HEAD.size + length

    def _record_at(self, at: int) -> Record | None:
        """Return the record at an offset, with its opcode or its length corrected if need be."""
        head = self._read(at, RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size:
            return None
        opcode, length = RECORD_HEAD.unpack(head)
        start = at + RECORD_HEAD.size
        if opcode == 0:
            return None
        if start + length <= self.size:
            if length > MAX_RECORD_BYTES:
                return self._too_long(opcode, at, start + length)
            content = self._read(start, length)
            kind = self._kind(opcode, content, start + length)
            if kind is not None:
                if kind != opcode:
                    self._remark(at, start + length, "the opcode of a record is wrong")
                return Record(kind, at, start + length, content)
        return self._with_corrected_length(opcode, at)

    def _kind(self, opcode: int, content: bytes, end: int) -> int | None:
        """Return what a record is that ends at an offset; None if its length must be wrong."""
        if opcode == Opcode.DATA_END and self._data_end not in {None, end}:
            return None
        size = content_size(opcode, content)
        is_index = self._has_mcap_chunks and opcode == Opcode.MESSAGE
        if size == len(content) and opcode != Opcode.MESSAGE:
            return opcode
        actual = opcode_of(content) if opcode != Opcode.MESSAGE or is_index else None
        if opcode >= _FIRST_PRIVATE and actual != Opcode.CHUNK:
            actual = None
        if actual is not None and self._is_sound(actual, content):
            return actual
        is_whole = size is not None or not 0 < opcode <= _LAST_KNOWN
        if opcode in _SUMMARY and self._data_end is not None and end < self._data_end:
            is_whole = False
        return opcode if is_whole and self._is_head(end) else None

    def _with_corrected_length(self, opcode: int, at: int) -> Record | None:
        """Return a record that is as long as its fields, if another record follows it."""
        if opcode == Opcode.MESSAGE or not 0 < opcode <= _LAST_KNOWN:
            return None
        start = at + RECORD_HEAD.size
        content = self._read(start, MAX_RECORD_BYTES)
        size = content_size(opcode, content)
        if size is None or start + size >= self.size or not self._is_head(start + size):
            return None
        if not self._is_sound(opcode, content[:size]):
            return None
        self._remark(at, start + size, "the length of a record is wrong")
        return Record(opcode, at, start + size, content[:size])

    def _too_long(self, opcode: int, at: int, end: int) -> Record | None:
        if not self._is_head(end):
            return None
        if opcode == Opcode.ATTACHMENT:
            return Record(opcode, at, end, b"")
        text = f"a record of {end - at} bytes is longer than any of a log and was not read"
        self.remarks.append(Damage(at, end, text))
        return Record(opcode if opcode == Opcode.MESSAGE_INDEX else _FIRST_PRIVATE, at, end, b"")

    def _is_head(self, at: int) -> bool:
        """Whether a record, one that is cut off, or the end of the file may be at an offset."""
        head = self._read(at, RECORD_HEAD.size)
        if len(head) < RECORD_HEAD.size or (at == self.size - len(MAGIC) and MAGIC in head):
            return True
        opcode, length = RECORD_HEAD.unpack(head)
        if not any(head):
            return True  # not yet written when the machine crashed
        fits = at + RECORD_HEAD.size + length <= self.size
        is_cut = opcode <= _LAST_KNOWN and length < 1 << 32
        return bool(opcode != 0 and (fits or is_cut))

    def _search(self, start: int) -> Record | None:
        """Return the first sound record from an offset on."""
        wanted = _FOUND if self._has_mcap_chunks else _FOUND | _LOOSE
        for at in self._candidates(start):
            opcode, length = RECORD_HEAD.unpack(self._read(at, RECORD_HEAD.size))
            if opcode not in wanted or length > MAX_RECORD_BYTES:
                continue
            end = at + RECORD_HEAD.size + length
            content = self._read(at + RECORD_HEAD.size, length)
            self._searched += len(content)
            if end > self.size:
                if opcode == Opcode.CHUNK and is_mcap_chunk_start(content):
                    self.end = at
                    self.gaps.append((start - 1, at))
                    return None
                continue
            is_whole = content_size(opcode, content) == length and self._is_head(end)
            if is_whole and self._is_sound(opcode, content):
                return Record(opcode, at, end, content)
        return None

    def _candidates(self, start: int) -> Iterator[int]:
        overlap = RECORD_HEAD.size - 1
        while start + RECORD_HEAD.size <= self.size and self._searched < _MAX_SEARCH_BYTES:
            block = self._read(start, _BLOCK_BYTES)
            self._searched += len(block)
            for match in _HEAD_PATTERN.finditer(block):
                if self._searched >= _MAX_SEARCH_BYTES:
                    return
                yield start + match.start()
            start += max(len(block) - overlap, 1)

    def _is_sound(self, opcode: int, content: bytes) -> bool:
        """Whether the checksums of a record, where it has any, show that it is one."""
        if opcode == Opcode.CHUNK:
            return is_mcap_chunk_intact(content)
        return opcode != Opcode.ATTACHMENT or attachment_is_intact(content)

    def _remark(self, start: int, end: int, text: str) -> None:
        self.remarks.append(Damage(start, end, f"{text}; it was read", is_lost=False))

    def _read(self, at: int, length: int) -> bytes:
        self._stream.seek(at)
        return self._stream.read(length)
