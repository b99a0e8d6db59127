"""Decompression of MCAP chunks, complete or cut off by a crash, in bounded memory."""

import struct
import zlib
from collections.abc import Callable

import zstandard

from .limits import MAX_MCAP_CHUNK_BYTES, MAX_WINDOW_BYTES
from .records import MCAP_CHUNK_HEAD

_INPUT_BYTES = 1 << 10  # decompressed at a time, to keep all that precedes a cut


def mcap_chunk_data(content: bytes) -> bytes:
    """Return the decompressed data of an MCAP chunk, after verifying its size and checksum.

    Parameters
    ----------
    content
        The content of the MCAP chunk record.

    Raises
    ------
    ValueError
        The size or the checksum is wrong, the size is beyond `MAX_MCAP_CHUNK_BYTES`, or the
        compression is unknown. Damaged bytes also raise the other exceptions of
        `shiplog.mcap.decode.MALFORMED`.
    """
    *_, size, crc, name_length = MCAP_CHUNK_HEAD.unpack_from(content, 0)
    if size > MAX_MCAP_CHUNK_BYTES:
        raise ValueError(f"it claims {size} bytes, more than an MCAP chunk of any log")
    compression, body = _compression_and_body(content, name_length)
    data = _decompress(compression, body[: _body_size(content, name_length)], size)
    if len(data) != size:
        raise ValueError(f"it does not have the {size} bytes that its head states")
    if crc and zlib.crc32(data) != crc:
        raise ValueError("its checksum is wrong")
    return data


def is_mcap_chunk_intact(content: bytes) -> bool:
    """Whether the content of a record is an MCAP chunk whose checksum, if it has one, is right."""
    try:
        mcap_chunk_data(content)
    except (ValueError, struct.error, RuntimeError, zstandard.ZstdError, MemoryError):
        return False
    return True


def is_mcap_chunk_start(content: bytes) -> bool:
    """Whether some bytes can be the beginning of the content of an MCAP chunk."""
    if len(content) < MCAP_CHUNK_HEAD.size:
        return False
    first, last, size, _, name_length = MCAP_CHUNK_HEAD.unpack_from(content, 0)
    name = content[MCAP_CHUNK_HEAD.size :][:name_length]
    return first <= last and size <= MAX_MCAP_CHUNK_BYTES and name in {b"", b"zstd", b"lz4"}


def truncated_mcap_chunk_data(content: bytes) -> bytes:
    """Return what can be decompressed of the beginning of an MCAP chunk.

    Parameters
    ----------
    content
        The beginning of the content of the MCAP chunk record.

    Raises
    ------
    struct.error
        Not even the head of the MCAP chunk is complete.
    """
    *_, name_length = MCAP_CHUNK_HEAD.unpack_from(content, 0)
    compression, body = _compression_and_body(content, name_length)
    written = bytes(body).rstrip(b"\0")  # a crash of the machine leaves zeros for unwritten bytes
    if compression == "":
        return written
    decompress, data = _incremental(compression), bytearray()
    try:
        for at in range(0, len(written), _INPUT_BYTES):
            if len(data) > MAX_MCAP_CHUNK_BYTES:
                break
            data += decompress(written[at : at + _INPUT_BYTES])
    except (zstandard.ZstdError, RuntimeError):
        pass  # what was decompressed before is intact
    return bytes(data)


def _compression_and_body(content: bytes, name_length: int) -> tuple[str, memoryview]:
    at = MCAP_CHUNK_HEAD.size
    compression = content[at : at + name_length].decode(errors="replace")
    return compression, memoryview(content)[at + name_length + 8 :]


def _body_size(content: bytes, name_length: int) -> int:
    (size,) = struct.unpack_from("<Q", content, MCAP_CHUNK_HEAD.size + name_length)
    return int(size)


def _decompress(compression: str, body: memoryview, size: int) -> bytes:
    """Return the decompressed data, of which no more than `size` bytes are made."""
    if compression == "zstd":
        claimed = zstandard.get_frame_parameters(body).content_size
        if claimed not in {size, zstandard.CONTENTSIZE_UNKNOWN}:
            raise ValueError(f"its data claim {claimed} bytes in place of {size}")
        decompressor = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES)
        return decompressor.decompress(body, max_output_size=size)
    if compression == "lz4":
        import lz4.frame  # noqa: PLC0415 - a dependency of mcap; shiplog itself writes zstd

        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(bytes(body), max_length=size + 1))
    if compression == "":
        return bytes(body[: size + 1])
    raise ValueError(f"compression {compression!r} is unknown")


def _incremental(compression: str) -> Callable[[bytes], bytes]:
    """Return a function that decompresses the next bytes."""
    if compression == "zstd":
        decompressor = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES)
        return decompressor.decompressobj().decompress
    if compression == "lz4":
        import lz4.frame  # noqa: PLC0415 - as above

        decompress: Callable[[bytes], bytes] = lz4.frame.LZ4FrameDecompressor().decompress
        return decompress
    return lambda _: b""
