"""Attachments that are too long to be read at once: verified and located in bounded memory."""

import struct
from io import BytesIO
from typing import IO

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from .limits import MAX_DESCRIPTION_BYTES
from .records import RECORD_HEAD, crc32_of_range


def long_attachment(stream: IO[bytes], start: int, end: int) -> records.AttachmentIndex | None:
    """Return the index entry of an attachment, after its checksum was verified if it has one.

    Parameters
    ----------
    stream
        The file.
    start, end
        The offsets of the first byte of its record and of the byte after it.

    Returns
    -------
    index
        None where the attachment is damaged.
    """
    stream.seek(start + RECORD_HEAD.size)
    head = BytesIO(stream.read(MAX_DESCRIPTION_BYTES))
    fields = ReadDataStream(head)
    try:
        log_time, create_time = fields.read8(), fields.read8()
        name, media_type = fields.read_prefixed_string(), fields.read_prefixed_string()
        size = fields.read8()
    except (struct.error, ValueError, McapError):
        return None
    data_end = start + RECORD_HEAD.size + head.tell() + size
    if data_end + 4 > end:
        return None
    stream.seek(data_end)
    crc = int.from_bytes(stream.read(4), "little")
    if crc and crc32_of_range(stream, start + RECORD_HEAD.size, data_end) != crc:
        return None
    return records.AttachmentIndex(
        offset=start,
        length=end - start,
        log_time=log_time,
        create_time=create_time,
        data_size=size,
        name=name,
        media_type=media_type,
    )
