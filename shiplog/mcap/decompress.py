"""Decompression of MCAP chunks, complete or cut off by a crash."""

import zlib

import zstandard

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
        The size or the checksum is wrong, or the compression is unknown. Damaged bytes also raise
        the other exceptions of `shiplog.mcap.decode.MALFORMED`.
    """
    *_, size, crc, name_length = MCAP_CHUNK_HEAD.unpack_from(content, 0)
    data = _decompress(*_compression_and_body(content, name_length), size)
    if len(data) != size or (crc and zlib.crc32(data) != crc):
        raise ValueError("its checksum is wrong")
    return data


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
    if compression != "zstd":
        return b""
    decompressor, data = zstandard.ZstdDecompressor().decompressobj(), bytearray()
    try:
        for at in range(0, len(written), _INPUT_BYTES):
            data += decompressor.decompress(written[at : at + _INPUT_BYTES])
    except zstandard.ZstdError:
        pass  # what was decompressed before is intact
    return bytes(data)


def _compression_and_body(content: bytes, name_length: int) -> tuple[str, memoryview]:
    at = MCAP_CHUNK_HEAD.size
    compression = content[at : at + name_length].decode(errors="replace")
    return compression, memoryview(content)[at + name_length + 8 :]


def _decompress(compression: str, body: memoryview, size: int) -> bytes:
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompress(body, max_output_size=size)
    if compression == "lz4":
        import lz4.frame  # noqa: PLC0415 - a dependency of mcap; shiplog itself writes zstd

        return bytes(lz4.frame.decompress(bytes(body)))
    if compression == "":
        return bytes(body)
    raise ValueError(f"compression {compression!r} is unknown")
