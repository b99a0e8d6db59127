"""A file in which one bit is read inverted: one that is known to be wrong."""

import io
import os
from typing import IO, Any


class _InvertedBit(io.RawIOBase):
    """A view of a file in which one bit is inverted."""

    def __init__(self, stream: IO[bytes], offset: int, mask: int) -> None:
        self._stream, self._offset, self._mask = stream, offset, mask

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self._stream.seek(offset, whence)

    def tell(self) -> int:
        return self._stream.tell()

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401 - whatever has the buffer protocol
        at = self._stream.tell()
        data = self._stream.read(len(buffer))
        buffer[: len(data)] = data
        if at <= self._offset < at + len(data):
            buffer[self._offset - at] ^= self._mask
        return len(data)


def with_inverted_bit(stream: IO[bytes], bit: tuple[int, int] | None) -> IO[bytes]:
    """Return a view of a file in which one bit is inverted.

    Parameters
    ----------
    stream
        The file, opened in binary mode.
    bit
        The offset of a byte and the bit in it; for None the file itself is returned.

    Examples
    --------
    >>> with_inverted_bit(io.BytesIO(b"abc"), (1, 0x20)).read()
    b'aBc'
    """
    return stream if bit is None else io.BufferedReader(_InvertedBit(stream, *bit))
