"""Binary structures of MCAP records, for reading and writing them by columns.

References
----------
MCAP format specification, https://mcap.dev/spec
"""

import struct
import zlib
from typing import IO

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"
FOOTER_BYTES = 29
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of the content
# of the content of an MCAP chunk: start, end, uncompressed size, CRC, length of compression name
MCAP_CHUNK_HEAD = struct.Struct("<QQQII")
MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
     ("received", "<u8"), ("measured", "<u8")]
)  # fmt: skip
INDEX_HEAD = struct.Struct("<HI")  # of the content of a message index: channel id, bytes of entries
INDEX_ENTRY = np.dtype([("received", "<u8"), ("offset", "<u8")])  # offset in the MCAP chunk's data
_BLOCK_BYTES = 1 << 20


def index_entries(content: bytes) -> tuple[int, NDArray[np.void]]:
    """Return the channel id and the entries (n,) in the content of a message index.

    Examples
    --------
    >>> channel_id, entries = index_entries(INDEX_HEAD.pack(3, 16) + bytes(16))
    >>> channel_id, len(entries)
    (3, 1)
    """
    channel_id, size = INDEX_HEAD.unpack_from(content)
    count = min(size, len(content) - INDEX_HEAD.size) // INDEX_ENTRY.itemsize
    return channel_id, np.frombuffer(content, INDEX_ENTRY, count, INDEX_HEAD.size)


def crc32_of_range(stream: IO[bytes], start: int, end: int, crc: int = 0) -> int:
    """Return the CRC-32 of the bytes from `start` to before `end` of a file.

    Parameters
    ----------
    stream
        The file; it is read in blocks, and is then at `end`.
    start, end
        Offsets in the file. The checksum of an empty range is `crc`.
    crc
        The checksum of what precedes the range.

    Examples
    --------
    >>> from io import BytesIO
    >>> crc32_of_range(BytesIO(b"-abc-"), 1, 4) == zlib.crc32(b"abc")
    True
    """
    stream.seek(min(start, end))
    for at in range(start, end, _BLOCK_BYTES):
        crc = zlib.crc32(stream.read(min(_BLOCK_BYTES, end - at)), crc)
    return crc
