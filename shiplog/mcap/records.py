"""The parts of the MCAP format that are read and written by columns, byte by byte."""

import struct
import zlib
from typing import IO

import numpy as np

MAGIC = b"\x89MCAP0\r\n"
FOOTER_BYTES = 29
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, size, crc, length of the compression's name
MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
     ("received", "<u8"), ("measured", "<u8")]
)  # fmt: skip
INDEX_ENTRY = np.dtype([("received", "<u8"), ("offset", "<u8")])  # offset within the chunk
_BLOCK = 1 << 20


def crc_of(stream: IO[bytes], start: int, end: int, crc: int = 0) -> int:
    """The checksum of a part of a file, which may be long, going on from `crc`."""
    stream.seek(min(start, end))
    for at in range(start, end, _BLOCK):
        crc = zlib.crc32(stream.read(min(_BLOCK, end - at)), crc)
    return crc
