"""Structure of the content of MCAP records: how many bytes their fields take.

A record whose length is that of its fields is taken for intact in its structure; damage in an
opcode or a length shows by it.

References
----------
MCAP format specification, https://mcap.dev/spec
"""

import struct
import zlib
from io import BytesIO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from .limits import MAX_MAP_ENTRIES
from .records import INDEX_ENTRY

_TEXT, _LONG, _MAP, _ENTRIES, _COUNTS, _REST = "text", "long", "map", "entries", "counts", "rest"
_FIELDS: dict[int, tuple[int | str, ...]] = {  # a number is that of the bytes of a field
    Opcode.HEADER: (_TEXT, _TEXT),
    Opcode.FOOTER: (20,),
    Opcode.SCHEMA: (2, _TEXT, _TEXT, _TEXT),
    Opcode.CHANNEL: (4, _TEXT, _TEXT, _MAP),
    Opcode.MESSAGE: (22, _REST),
    Opcode.CHUNK: (28, _TEXT, _LONG),
    Opcode.MESSAGE_INDEX: (2, _ENTRIES),
    Opcode.CHUNK_INDEX: (32, _COUNTS, 8, _TEXT, 16),
    Opcode.ATTACHMENT: (16, _TEXT, _TEXT, _LONG, 4),
    Opcode.ATTACHMENT_INDEX: (40, _TEXT, _TEXT),
    Opcode.STATISTICS: (42, _COUNTS),
    Opcode.METADATA: (_TEXT, _MAP),
    Opcode.METADATA_INDEX: (16, _TEXT),
    Opcode.SUMMARY_OFFSET: (17,),
    Opcode.DATA_END: (4,),
}
_ROW_BYTES = {_ENTRIES: INDEX_ENTRY.itemsize, _COUNTS: 10, _TEXT: 1, _MAP: 1}


def content_size(opcode: int, content: bytes) -> int | None:
    r"""Return the number of bytes that the fields of a record's content take.

    Parameters
    ----------
    opcode
        The opcode of the record.
    content
        Its content; it may go on after the record.

    Returns
    -------
    size
        None if the opcode is none of MCAP, or if the fields are longer than `content` or contradict
        each other.

    Examples
    --------
    >>> content_size(Opcode.HEADER, bytes(4) + b"\x03\0\0\0abc, and more")
    11
    """
    fields = _FIELDS.get(opcode)
    if fields is None:
        return None
    at = 0
    for field in fields:
        if field == _REST:
            at = max(at, len(content))
            continue
        size = field if isinstance(field, int) else _field_size(field, content, at)
        if size is None or at + size > len(content):
            return None
        at += size
    return at


def opcode_of(content: bytes) -> int | None:
    """Return the opcode whose fields take exactly this content; None if there is no such kind.

    Kinds without structure, and those of which an error here could give wrong values, are omitted.
    """
    kinds = (Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA)
    for opcode in kinds:
        if content and content_size(opcode, content) == len(content):
            return opcode
    return None


def attachment_is_intact(content: bytes) -> bool:
    """Whether the checksum of an attachment is right, or absent."""
    size = content_size(Opcode.ATTACHMENT, content)
    if size is None:
        return False
    (crc,) = struct.unpack_from("<I", content, size - 4)
    return not crc or zlib.crc32(memoryview(content)[: size - 4]) == crc


def read_attachment(content: bytes) -> records.Attachment:
    """Read an attachment, and verify its checksum if it has one.

    Raises
    ------
    ValueError
        The record is damaged.
    """
    if not attachment_is_intact(content):
        raise ValueError("an attachment whose checksum is wrong")
    attachment: records.Attachment = records.Attachment.read(ReadDataStream(BytesIO(content)))
    return attachment


def _field_size(field: str, content: bytes, at: int) -> int | None:
    """Return the size of a field with a length before it; None if its parts contradict that."""
    head = struct.Struct("<Q" if field == _LONG else "<I")
    if at + head.size > len(content):
        return None
    (length,) = head.unpack_from(content, at)
    if field == _LONG:
        return head.size + int(length)
    if length % _ROW_BYTES[field]:
        return None
    end = at + head.size + int(length)
    if field == _MAP and (end > len(content) or not _is_map(content, at + head.size, end)):
        return None
    return end - at


def _is_map(content: bytes, at: int, end: int) -> bool:
    """Whether pairs of texts take exactly the bytes from `at` to before `end`."""
    for _ in range(2 * MAX_MAP_ENTRIES):
        if at >= end:
            break
        if at + 4 > end:
            return False
        at += 4 + int.from_bytes(content[at : at + 4], "little")
    return at == end
