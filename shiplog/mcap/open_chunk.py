"""An MCAP chunk that stays open: a recording is flushed often, and yet has few MCAP chunks.

Its compressed data grow in the file at each flush. Its head is completed when it is closed; until
then the head states a length beyond the end of the file, as in a file that was cut off there, and a
reader decompresses what the file has.
"""

import struct
import zlib
from collections.abc import Mapping

import numpy as np
import zstandard
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .encode import MAX_MCAP_CHUNK_BYTES, McapChunk
from .records import MCAP_CHUNK_HEAD, RECORD_HEAD

MAX_SPAN_NS = 60 * 10**9  # programs that cannot read an open MCAP chunk lose no more after a crash
COMPRESSION = b"zstd"
_UNKNOWN_LENGTH = 1 << 30  # of the record while it grows: beyond any MCAP chunk


class OpenMcapChunk:
    """The MCAP chunk at the end of a file to which messages are appended.

    Parameters
    ----------
    offset
        Where the record begins in the file.
    descriptions
        Records of schemas and channels that precede its messages.
    first_ns
        The time of reception of its first message, ns.
    """

    def __init__(self, offset: int, descriptions: bytes, first_ns: int) -> None:
        self.offset = offset
        self.first_ns, self.last_ns = first_ns, first_ns
        self.size, self._crc = 0, 0
        self._compressor = zstandard.ZstdCompressor().compressobj()
        self._compressed = bytearray(self._compress(descriptions))
        self._entries: dict[int, list[NDArray[np.void]]] = {}

    @property
    def is_full(self) -> bool:
        """Whether it is so large, or lasts so long, that it should be closed."""
        return self.size >= MAX_MCAP_CHUNK_BYTES or self.last_ns - self.first_ns >= MAX_SPAN_NS

    def first_bytes(self) -> bytes:
        """Return the beginning of the record for the file, with the head of an open MCAP chunk."""
        head = mcap_chunk_head(self.first_ns, self.first_ns, 0, 0, 0)
        return RECORD_HEAD.pack(Opcode.CHUNK, _UNKNOWN_LENGTH) + head + self._compressed

    def append(self, messages: McapChunk) -> bytes:
        """Append messages, and return the bytes with which a reader of the file can have them."""
        for channel_id, entries in messages.index.items():
            entries["offset"] += self.size
            self._entries.setdefault(channel_id, []).append(entries)
        self.first_ns = min(self.first_ns, messages.first_ns)
        self.last_ns = max(self.last_ns, messages.last_ns)
        data = self._compress(messages.data.data)
        data += self._compressor.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK)
        self._compressed += data
        return data

    def last_bytes(self) -> bytes:
        """End the compressed data, and return the bytes that complete them; call it once."""
        data = self._compressor.flush(zstandard.COMPRESSOBJ_FLUSH_FINISH)
        self._compressed += data
        return data

    def record_parts(self) -> tuple[bytes, bytes]:
        """Return the completed head of the record, and the compressed data that follow it."""
        compressed = bytes(self._compressed)
        head = mcap_chunk_head(self.first_ns, self.last_ns, self.size, self._crc, len(compressed))
        length = len(head) + len(compressed)
        return RECORD_HEAD.pack(Opcode.CHUNK, length) + head, compressed

    def index(self) -> Mapping[int, NDArray[np.void]]:
        """Return the index entries of its messages, by channel id."""
        return {channel_id: np.concatenate(parts) for channel_id, parts in self._entries.items()}

    def _compress(self, data: bytes | memoryview) -> bytes:
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)
        return self._compressor.compress(data)


def mcap_chunk_head(
    first_ns: int, last_ns: int, size: int, crc: int, compressed_size: int
) -> bytes:
    """Return what precedes the compressed data in the content of an MCAP chunk record.

    Parameters
    ----------
    first_ns, last_ns
        The first and the last time of reception, ns.
    size, crc
        The size and the CRC-32 of the data before compression.
    compressed_size
        The size of the compressed data.
    """
    head = MCAP_CHUNK_HEAD.pack(first_ns, last_ns, size, crc, len(COMPRESSION))
    return head + COMPRESSION + struct.pack("<Q", compressed_size)
