"""Sequential scan of an MCAP file, record by record.

The file is read from front to back in bounded memory, up to the contents that the caller does not
drain. All checksums are verified; damaged parts are skipped and reported.
"""

import struct
from collections.abc import Collection, Iterator

import numpy as np
from mcap.opcode import Opcode

from .chunk_order import restore_order
from .contents import LostMcapChunk, McapContents
from .damage import Damage, gap_damage, lost_messages_text
from .decode import MALFORMED, collect_messages, collect_undescribed, read_record
from .decompress import (
    is_mcap_chunk_start,
    mcap_chunk_data,
    truncated_mcap_chunk_data,
)
from .excess import refuse_excess
from .limits import MAX_RECORD_BYTES
from .locate import complete_records, gather, locate_by_index
from .long_attachment import long_attachment
from .mcap_file import McapFile, open_mcap
from .part_contents import PartContents
from .part_set import LogParts
from .record_walk import Record, RecordWalk
from .records import MCAP_CHUNK_HEAD, MESSAGE_HEAD, RECORD_HEAD, index_entries
from .summary import McapSummary

_MAX_LOOSE_BYTES = 1 << 20  # of messages outside of MCAP chunks that are collected at once


def scan(file: McapFile, contents: McapContents, skip: Collection[int] = ()) -> Iterator[None]:
    """Go through a file once, and yield after each MCAP chunk that was added to `contents`.

    Parameters
    ----------
    file
        The file.
    contents
        Receives what the file contains. The caller may drain it at each yield.
    skip
        The offsets of MCAP chunks not to read.

    Raises
    ------
    LogError
        The file holds more than a log of its size can.
    """
    if file.check.parts is not None:
        yield from _scan_parts(file.check.parts, contents)
        return
    contents.damage += file.check.damage
    contents.finished = file.check.is_finished
    walk = RecordWalk(file.stream, skip, file.check.data_end)
    for record, indexes in _with_indexes(walk):
        contents.reading = record.start, record.end
        if record.opcode == Opcode.CHUNK:
            data = _read_mcap_chunk(record, indexes, contents)
            if file.check.is_intact is False and data is not None:
                _check_indexes(data, record, indexes, contents)
            refuse_excess(file.path, walk.size, contents)
            yield
        elif record.opcode == Opcode.MESSAGE:
            contents.in_order &= not collect_messages(record.content, [], contents)
            refuse_excess(file.path, walk.size, contents)
            yield
        elif record.opcode == Opcode.ATTACHMENT and not record.content:
            _read_long_attachment(file, contents)
        else:
            read_record(record.opcode, record.content, contents)
            refuse_excess(file.path, walk.size, contents)
    if not walk.is_complete:
        _read_truncated_end(file, walk, contents)
    _use_summary(file.check.summary, contents)
    refuse_excess(file.path, walk.size, contents)
    collect_undescribed(contents)
    if contents.is_whole:
        restore_order(contents)
    _report_damage(file, walk, contents)
    yield


def _scan_parts(parts: LogParts, contents: McapContents) -> Iterator[None]:
    """Go through the parts of a log, one after the other."""
    contents.part_warnings = parts.warnings
    contents.is_part_missing = parts.is_missing
    contents.finished = all(part.check.is_finished for part in parts.parts)
    for part in parts.parts:
        joined = PartContents(part.path, contents)
        with open_mcap(part.path, part.check) as file:
            for _ in scan(file, joined.own):
                joined.move()
                yield
                joined.own.keep_undescribed &= contents.keep_undescribed
        joined.finish()
    yield


def _with_indexes(walk: RecordWalk) -> Iterator[tuple[Record, list[bytes]]]:
    """Yield MCAP chunks with their message indexes, runs of loose messages, and other records."""
    mcap_chunk: Record | None = None
    indexes: list[bytes] = []
    size = 0  # of the indexes
    loose, loose_start = bytearray(), 0
    end = 0  # of the record before
    for record in walk:
        follows, end = record.start == end, record.end
        if record.opcode == Opcode.MESSAGE_INDEX:
            size += len(record.content)
            if follows and size <= MAX_RECORD_BYTES:
                indexes.append(record.content)
            continue
        if mcap_chunk is not None:
            yield mcap_chunk, indexes
        mcap_chunk, indexes, size = (record if record.opcode == Opcode.CHUNK else None), [], 0
        if loose and (record.opcode != Opcode.MESSAGE or len(loose) >= _MAX_LOOSE_BYTES):
            yield Record(Opcode.MESSAGE, loose_start, record.start, bytes(loose)), []
            loose.clear()
        if record.opcode == Opcode.MESSAGE:
            loose_start = loose_start if loose else record.start
            loose += RECORD_HEAD.pack(record.opcode, len(record.content)) + record.content
        elif mcap_chunk is None:
            yield record, []
    if mcap_chunk is not None:
        yield mcap_chunk, indexes
    if loose:
        yield Record(Opcode.MESSAGE, loose_start, walk.end, bytes(loose)), []


def _read_mcap_chunk(record: Record, indexes: list[bytes], contents: McapContents) -> bytes | None:
    """Collect the messages of an MCAP chunk, and return its data; None where it is damaged."""
    key = record.content[: MCAP_CHUNK_HEAD.size]
    try:
        data = mcap_chunk_data(record.content)
    except MALFORMED as error:
        contents.lost_mcap_chunks.append(_lost_mcap_chunk(record, indexes, str(error)))
        return None
    size, crc = struct.unpack_from("<QI", key, 16)
    if size and crc and key in contents.mcap_chunks_read:
        text = f"the MCAP chunk at byte {contents.mcap_chunks_read[key]} is there again; once read"
        contents.damage.append(Damage(record.start, record.end, text, is_lost=False))
        return data
    contents.mcap_chunks_read[key] = record.start
    _collect_mcap_chunk(data, record.content, indexes, contents)
    return data


def _check_indexes(
    data: bytes, record: Record, indexes: list[bytes], contents: McapContents
) -> None:
    """Report message indexes that do not describe the data of an MCAP chunk; they were not used."""
    if not indexes:
        return
    first = (at for opcode, at, _ in complete_records(data, 0) if opcode == Opcode.MESSAGE)
    located = locate_by_index(data, next(first, len(data)), indexes)
    entries = [index_entries(index)[1] for index in indexes]
    times = [
        np.array_equal(gather(data, offsets, MESSAGE_HEAD)["received"], rows["received"])
        for offsets, rows in zip(located.values(), filter(len, entries), strict=False)
    ]
    if not located or not all(times):
        end = record.end + sum(len(index) + RECORD_HEAD.size for index in indexes)
        text = "a message index is wrong; it is not needed"
        contents.damage.append(Damage(record.end, end, text, is_lost=False))


def _read_long_attachment(file: McapFile, contents: McapContents) -> None:
    """Locate the attachment that is being read, where such attachments are wanted."""
    start, end = contents.reading
    index = long_attachment(file.stream, start, end)
    if index is None:
        contents.report(f"an attachment of {end - start} bytes is damaged")
    elif contents.long_attachments is None:
        text = f"an attachment of {end - start} bytes is longer than any of a log and was not read"
        contents.report(f"{text}; `shiplog recover` keeps it")
    else:
        contents.long_attachments[start] = index
        contents.keep(Opcode.ATTACHMENT, b"")


def _lost_mcap_chunk(record: Record, indexes: list[bytes], cause: str) -> LostMcapChunk:
    """Return what is lost by an MCAP chunk, according to its message indexes or else its head."""
    ids, times = [], []
    for index in indexes:
        channel_id, entries = index_entries(index)
        if len(entries):
            ids.append(channel_id)
            times.append(entries["received"].astype(np.int64))
    messages = sum(map(len, times))
    head = np.frombuffer(record.content[:16].ljust(16, b"\0"), np.int64)
    received = np.concatenate(times) if times else head
    span = int(received.min()), int(received.max())
    return LostMcapChunk(record.start, record.end, messages, tuple(ids), span, cause)


def _damage_of(lost: LostMcapChunk, contents: McapContents) -> Damage:
    """Return the damage by a lost MCAP chunk; its topics may be described anywhere in the file."""
    topics = tuple(
        contents.channels[id_].topic for id_ in lost.channel_ids if id_ in contents.channels
    )
    text = f"{lost_messages_text(lost.messages, topics, lost.span_ns)}: MCAP chunk, {lost.cause}"
    return Damage(lost.start, lost.end, text, topics=topics, span_ns=lost.span_ns)


def _collect_mcap_chunk(
    data: bytes, content: bytes, indexes: list[bytes], contents: McapContents
) -> None:
    if collect_messages(data, indexes, contents):
        first, last = struct.unpack_from("<qq", content)  # signed, as all times in shiplog
        contents.in_order &= contents.latest_ns <= first <= last
        contents.latest_ns = last


def _read_truncated_end(file: McapFile, walk: RecordWalk, contents: McapContents) -> None:
    """Read what follows the last complete record of a file whose data section does not end."""
    if contents.finished:
        end = file.check.data_end or walk.size
        walk.gaps.append((walk.end, end))
        return
    contents.truncated = walk.end < walk.size
    file.stream.seek(walk.end)
    record = file.stream.read(MAX_RECORD_BYTES)
    content = record[RECORD_HEAD.size :]
    if record[:1] != bytes([Opcode.CHUNK]) or not is_mcap_chunk_start(content):
        return
    data = truncated_mcap_chunk_data(content)
    contents.reading = walk.end, walk.size
    _collect_mcap_chunk(data, content, [], contents)
    *_, size, _, _ = MCAP_CHUNK_HEAD.unpack_from(content)
    if size == 0:  # left open by a recorder; it is not cut off where it ends with a message
        contents.truncated = max((end for *_, end in complete_records(data, 0)), default=0) < len(
            data
        )


def _report_damage(file: McapFile, walk: RecordWalk, contents: McapContents) -> None:
    """Report what the walk found, and a wrong checksum of the data that no damage explains."""
    summary, data_end = file.check.summary, file.check.data_end
    contents.damage += [_damage_of(lost, contents) for lost in contents.lost_mcap_chunks]
    contents.lost_mcap_chunks.clear()
    contents.damage += walk.remarks
    contents.damage += [gap_damage(start, end, summary) for start, end in walk.gaps]
    contents.damage.sort(key=lambda damage: damage.start)
    is_explained = any(damage.start < (data_end or 0) for damage in contents.damage)
    if file.check.is_intact is False and not is_explained:
        text = (
            "the checksum of the data section is wrong, those of its parts are right or absent; "
            "metadata may be wrong, samples may be missing"
        )
        contents.damage.append(Damage(0, data_end or 0, text))


def _use_summary(summary: McapSummary | None, contents: McapContents) -> None:
    """Take the descriptions from the summary that are missing in the data."""
    if summary is not None:
        contents.schemas = dict(summary.schemas) | contents.schemas
        contents.channels = dict(summary.channels) | contents.channels
