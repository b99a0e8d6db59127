"""Check of all checksums of an MCAP file, before its records are read.

A wrong bit of the data section is corrected where the checksum of the section locates it and every
other checksum confirms it.
"""

import io
import os
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import IO, TYPE_CHECKING

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import ChunkIndex

from .damage import Damage
from .decompress import is_mcap_chunk_intact
from .inverted_bit import with_inverted_bit
from .metadata_record import metadata_is_intact
from .record_structure import attachment_is_intact
from .record_walk import RecordWalk
from .records import FOOTER_BYTES, MAGIC, MCAP_CHUNK_HEAD, RECORD_HEAD, crc32_of_range
from .single_bit import wrong_bit
from .summary import McapSummary, read_summary

if TYPE_CHECKING:
    from .part_set import LogParts

_DATA_END_HEAD = RECORD_HEAD.pack(Opcode.DATA_END, 4)
_DATA_END_BYTES = len(_DATA_END_HEAD) + 4
_FOOTER_HEAD = RECORD_HEAD.pack(Opcode.FOOTER, 20)
_CHECKS: dict[int, Callable[[bytes], bool]] = {
    Opcode.CHUNK: is_mcap_chunk_intact,
    Opcode.ATTACHMENT: attachment_is_intact,
    Opcode.METADATA: metadata_is_intact,
}


@dataclass(frozen=True)
class FileCheck:
    """What the checksums of a file show.

    Attributes
    ----------
    is_finished
        Whether the file ends as a complete one.
    is_intact
        Whether the checksum of the data section is right; None where there is none, and no other
        one is wrong.
    data_end
        The offset at which the data section ends; None if unknown.
    summary
        The summary; None if there is none, if it is damaged, or if the file has other records than
        it states.
    wrong_bit
        The byte and the bit in it that are inverted in reading; None for none.
    damage
        What is damaged, unless it was left to the walk over the records.
    parts
        The files of a log that has several, of which then nothing else is known here.
    """

    is_finished: bool
    is_intact: bool | None = None
    data_end: int | None = None
    summary: McapSummary | None = None
    wrong_bit: tuple[int, int] | None = None
    damage: tuple[Damage, ...] = ()
    parts: "LogParts | None" = None


def check_file(stream: IO[bytes]) -> FileCheck:
    """Verify the checksums of a file, for which it is read once.

    Parameters
    ----------
    stream
        The file, opened in binary mode.
    """
    size = stream.seek(0, os.SEEK_END)
    summary = read_summary(stream)
    ends = _find_ends(stream, size, summary)
    damage = (*_damaged_magic(stream), *ends.damage)
    check = FileCheck(ends.is_finished, None, ends.data_end, summary, damage=damage)
    if ends.data_end is not None and ends.crc:
        crc = crc32_of_range(stream, 0, ends.data_end - ends.data_end_bytes)
        check = replace(check, is_intact=crc == ends.crc)
        if crc != ends.crc:
            return _corrected(stream, check, crc ^ ends.crc)
    return _with_verified_summary(stream, check)


@dataclass(frozen=True)
class _Ends:
    """Where the data section and the file end.

    Attributes
    ----------
    is_finished
        Whether the file has a footer.
    data_end, data_end_bytes, crc
        The offset after the last record of the data section, the size of that record, and the
        checksum in it; the offset is None if it is not known.
    damage
        What is damaged after the data section.
    """

    is_finished: bool
    data_end: int | None = None
    data_end_bytes: int = _DATA_END_BYTES
    crc: int = 0
    damage: tuple[Damage, ...] = ()


def _find_ends(stream: IO[bytes], size: int, summary: McapSummary | None) -> _Ends:
    """Find the end of the data section by the footer, or else by the records."""
    footer_start = size - len(MAGIC) - FOOTER_BYTES
    tail = _read(stream, max(footer_start, 0), FOOTER_BYTES + len(MAGIC))
    has_footer = tail.startswith(_FOOTER_HEAD)
    if footer_start <= 0 or not (has_footer or tail.endswith(MAGIC)):
        return _Ends(is_finished=False)
    damage = tuple(_damage_after_data(stream, size, tail)) if has_footer else ()
    if has_footer:
        summary_start = int.from_bytes(tail[RECORD_HEAD.size :][:8], "little")
        end = summary_start or footer_start
        last = _read(stream, min(max(end - _DATA_END_BYTES, 0), size), _DATA_END_BYTES)
        if last.startswith(_DATA_END_HEAD) or (summary is not None and summary.is_verified):
            return _Ends(True, end, _DATA_END_BYTES, int.from_bytes(last[-4:], "little"), damage)
    return _find_ends_by_records(stream, size, damage)


def _find_ends_by_records(stream: IO[bytes], size: int, damage: tuple[Damage, ...]) -> _Ends:
    """Find the end of the data section of a file whose footer is longer, or damaged."""
    data_end, record_bytes, crc, last = None, 0, 0, None
    for opcode, start, end in _record_heads(stream, size):
        if opcode == Opcode.DATA_END and data_end is None:
            data_end, record_bytes = end, end - start
            content = _read(stream, start + RECORD_HEAD.size, 4)
            crc = int.from_bytes(content, "little")
        last = opcode, end
    if last != (Opcode.FOOTER, size - len(MAGIC)) and not damage:
        text = "the end of the summary cannot be read; it was not used"
        damage = (Damage(data_end or size - len(MAGIC), size, text, is_lost=False),)
    return _Ends(True, data_end, record_bytes, crc, damage)


def _damage_after_data(stream: IO[bytes], size: int, tail: bytes) -> Iterator[Damage]:
    """Yield what is damaged in the summary, the footer and the last bytes of a file."""
    summary_start, _, crc = struct.unpack_from("<QQI", tail, RECORD_HEAD.size)
    end = size - len(MAGIC)
    start = summary_start or end - FOOTER_BYTES
    if crc and not (start < end and crc32_of_range(stream, start, end - 4) == crc):
        text = "the checksum of the summary is wrong; it was not used"
        yield Damage(min(start, end), size, text, is_lost=False)
    if not tail.endswith(MAGIC):
        yield Damage(end, size, "the file does not end as an MCAP file does", is_lost=False)


def _corrected(stream: IO[bytes], check: FileCheck, difference: int) -> FileCheck:
    """Return the check of a file whose data section has a wrong checksum.

    A single bit that explains the checksum is corrected if the file is whole with it.
    """
    data_end = check.data_end or 0
    is_of_checksum = difference & (difference - 1) == 0
    if is_of_checksum and _is_whole(stream, data_end):
        text = "the checksum of the data section is wrong by one bit, the data are right"
        remark = Damage(data_end - 4, data_end, text, is_lost=False)
        return replace(check, is_intact=True, damage=(*check.damage, remark))
    bit = wrong_bit(difference, data_end - _DATA_END_BYTES)
    if bit is None or not _is_whole(with_inverted_bit(stream, bit), data_end):
        return check
    text = "one bit was wrong; it was corrected by the checksum of the data section"
    remark = Damage(bit[0], bit[0] + 1, text, is_lost=False)
    corrected = replace(check, is_intact=True, wrong_bit=bit, damage=(*check.damage, remark))
    view = with_inverted_bit(stream, bit)
    return _with_verified_summary(view, replace(corrected, summary=read_summary(view)))


def _is_whole(stream: IO[bytes], data_end: int) -> bool:
    """Whether all records of the data section are sound."""
    walk = RecordWalk(stream, data_end=data_end)
    for record in walk:
        is_sound = _CHECKS.get(record.opcode)
        if is_sound is not None and not is_sound(record.content):
            return False
    return walk.is_complete and not walk.remarks and not walk.gaps


def _with_verified_summary(stream: IO[bytes], check: FileCheck) -> FileCheck:
    """Return the check without a summary that does not describe the records of the file."""
    summary = check.summary
    if summary is None or check.data_end is None:
        return replace(check, summary=None)
    if summary.has_damaged_records:
        return replace(check, is_intact=False)
    if not _has_indexed_mcap_chunks(stream, summary):
        text = "the summary contradicts the data; it was not used"
        size = stream.seek(0, os.SEEK_END)
        damage = Damage(check.data_end, size, text, is_lost=False)
        return replace(check, summary=None, damage=(*check.damage, damage))
    return check if _is_complete(stream, summary, check.data_end) else replace(check, summary=None)


def _has_indexed_mcap_chunks(stream: IO[bytes], summary: McapSummary) -> bool:
    """Whether the heads of all indexed MCAP chunks are those that the indexes state."""
    for content in summary.mcap_chunk_indexes:
        index = ChunkIndex.read(ReadDataStream(io.BytesIO(content)))
        name = index.compression.encode()
        head_bytes = RECORD_HEAD.size + MCAP_CHUNK_HEAD.size
        head = _read(stream, index.chunk_start_offset, head_bytes + len(name))
        if len(head) < head_bytes:
            return False
        expected = (Opcode.CHUNK, index.chunk_length - RECORD_HEAD.size)
        first, last, size, _, _ = MCAP_CHUNK_HEAD.unpack_from(head, RECORD_HEAD.size)
        stated = (index.message_start_time, index.message_end_time, index.uncompressed_size)
        if RECORD_HEAD.unpack_from(head) != expected or (first, last, size) != stated:
            return False
        if head[head_bytes:] != name:
            return False
    return True


def _is_complete(stream: IO[bytes], summary: McapSummary, data_end: int) -> bool:
    """Whether the summary has an index of each MCAP chunk, attachment and metadata record.

    Of a file with messages outside of MCAP chunks this is not needed.
    """
    if summary.mcap_chunk_locations() is None:
        return True
    counts = dict.fromkeys((Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA), 0)
    for opcode, _, _ in _record_heads(stream, data_end):
        if opcode in counts:
            counts[Opcode(opcode)] += 1
        elif opcode == Opcode.MESSAGE:
            return False
    indexed = tuple(
        map(len, (summary.mcap_chunk_indexes, summary.attachment_offsets, summary.metadata_offsets))
    )
    return tuple(counts.values()) == indexed


def _record_heads(stream: IO[bytes], size: int) -> Iterator[tuple[int, int, int]]:
    """Yield the opcode, the start and the end of each record, as far as they follow each other."""
    at = len(MAGIC)
    while at + RECORD_HEAD.size <= size:
        opcode, length = RECORD_HEAD.unpack(_read(stream, at, RECORD_HEAD.size))
        end = at + RECORD_HEAD.size + length
        if opcode == 0 or end > size:
            return
        yield opcode, at, end
        at = end


def _damaged_magic(stream: IO[bytes]) -> Iterator[Damage]:
    if _read(stream, 0, len(MAGIC)) != MAGIC:
        text = "these are not the first bytes of an MCAP file, but those of one follow"
        yield Damage(0, len(MAGIC), text, is_lost=False)


def _read(stream: IO[bytes], at: int, length: int) -> bytes:
    stream.seek(at)
    return stream.read(length)
