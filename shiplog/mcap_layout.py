"""The parts of the MCAP format that are read and written by columns, byte by byte."""

import struct

import numpy as np

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, size, crc, length of the compression's name
MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
     ("received", "<u8"), ("measured", "<u8")]
)  # fmt: skip
INDEX_ENTRY = np.dtype([("received", "<u8"), ("offset", "<u8")])  # offset within the chunk
