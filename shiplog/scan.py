"""The bytes of an MCAP file to columns of messages.

A chunk of fixed-size messages needs no loop: the message index says where each message stands,
and one gather in numpy takes them all. Chunks without an index, or with one that does not account
for every byte, are walked; messages of uneven length are kept one by one. Every checksum is
verified, and what is damaged is left out and said.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from .mcap_layout import CHUNK_HEAD, INDEX_ENTRY, MAGIC, MESSAGE_HEAD, RECORD_HEAD
from .schema import METADATA_NAME, VESSEL_ATTACHMENT, Schema, schema_named

_SHORTEST_MESSAGE = MESSAGE_HEAD.itemsize
_MALFORMED = (  # what decoders raise on damaged bytes: no one family
    McapError, zstandard.ZstdError, struct.error,
    ValueError, OverflowError, RuntimeError, MemoryError,
)  # fmt: skip

Bytes = memoryview
_Located = tuple[np.ndarray[Any, Any], int, np.ndarray[Any, Any]]  # bytes, channel, offsets in them


@dataclass
class Contents:
    """What the scan of a file gathers."""

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    columns: dict[int, list[np.ndarray[Any, Any]]] = field(default_factory=dict)
    ragged: dict[int, list[tuple[int, int, bytes]]] = field(default_factory=dict)
    orphans: list[_Located] = field(default_factory=list)  # their channel is not yet described
    metadata: dict[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    finished: bool = False
    cut: bool = False  # unfinished, and what it ends with is no whole record
    damage: list[str] = field(default_factory=list)


def scan(data: Bytes) -> Contents:
    """Go through the file's top-level records once, chunk by chunk."""
    contents = Contents()
    loose: dict[int, list[int]] = {}  # messages outside any chunk
    end = len(MAGIC)
    for opcode, start, end in _records(data, len(MAGIC)):
        if opcode == Opcode.CHUNK:
            _read_chunk(data[start:end], _index_after(data, end), contents)
        elif opcode == Opcode.MESSAGE:
            _locate(data, start, end, loose)
        elif opcode == Opcode.DATA_END:
            _check(data[: start - RECORD_HEAD.size], data[start:end], "data", contents)
        elif opcode == Opcode.FOOTER and data[end : end + len(MAGIC)] == MAGIC:
            summary_start = int.from_bytes(data[start : start + 8], "little")
            summary_start = summary_start or start - RECORD_HEAD.size
            _check(data[summary_start : end - 4], data[end - 4 : end], "summary", contents)
            contents.finished = True
            break
        elif opcode != Opcode.MESSAGE_INDEX:
            _read_record(opcode, data[start:end], contents)
    if not contents.finished:
        contents.cut = end < len(data)
        _read_cut_chunk(data[end:], contents)
        if data[end:][-len(MAGIC) :] == MAGIC:
            contents.damage.append(f"damaged at byte {end}: what follows was not read")
    for channel_id, offsets in loose.items():
        _take_channel(np.frombuffer(data, np.uint8), channel_id, np.array(offsets), contents)
    _take_orphans(contents)
    return contents


def _records(data: Bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """The records from `at` on that are whole: opcode, where the content starts, where it ends."""
    while at + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        start = at + RECORD_HEAD.size
        if opcode == 0 or start + length > len(data):
            return
        yield opcode, start, start + length
        at = start + length


def _index_after(data: Bytes, at: int) -> list[Bytes]:
    """The message indexes that follow a chunk."""
    index = []
    for opcode, start, end in _records(data, at):
        if opcode != Opcode.MESSAGE_INDEX:
            break
        index.append(data[start:end])
    return index


def _check(section: Bytes, checksum: Bytes, name: str, contents: Contents) -> None:
    """Whether a section of the file holds the bytes once written, where nothing yet says no."""
    crc = int.from_bytes(checksum, "little")
    if crc and not contents.damage and zlib.crc32(section) != crc:
        contents.damage.append(f"damaged: the checksum of its {name} is wrong, some may be missing")


def _read_record(opcode: int, content: Bytes, contents: Contents) -> None:
    try:
        _keep_record(opcode, ReadDataStream(BytesIO(content)), contents)
    except _MALFORMED as error:
        contents.damage.append(f"left out a damaged record: {error}")


def _keep_record(opcode: int, stream: ReadDataStream, contents: Contents) -> None:
    if opcode == Opcode.SCHEMA:
        schema = records.Schema.read(stream)
        contents.schemas.setdefault(schema.id, schema)
    elif opcode == Opcode.CHANNEL:
        channel = records.Channel.read(stream)
        contents.channels.setdefault(channel.id, channel)
    elif opcode == Opcode.METADATA:
        metadata = records.Metadata.read(stream)
        if metadata.name == METADATA_NAME:
            contents.metadata.update(metadata.metadata)
    elif opcode == Opcode.ATTACHMENT:
        attachment = records.Attachment.read(stream)
        if attachment.name == VESSEL_ATTACHMENT:
            contents.vessel_toml = attachment.data.decode()


def _read_chunk(content: Bytes, index: list[Bytes], contents: Contents) -> None:
    try:
        *_, size, crc, name_length = CHUNK_HEAD.unpack_from(content, 0)
        raw = _inflate(*_compression_and_body(content, name_length), size)
        if len(raw) != size or (crc and zlib.crc32(raw) != crc):
            raise ValueError("its checksum is wrong")
    except _MALFORMED as error:
        span = np.frombuffer(bytes(content[:16]).ljust(16, b"\0"), "<M8[ns]").astype("M8[ms]")
        contents.damage.append(
            f"lost what was received {span[0]} to {span[1]}: damaged chunk, {error}"
        )
    else:
        _take(np.frombuffer(raw, np.uint8), index, contents)


def _read_cut_chunk(content: Bytes, contents: Contents) -> None:
    """The whole messages of a chunk that the file ends in the middle of, if it does."""
    head = RECORD_HEAD.size + CHUNK_HEAD.size
    if len(content) <= head or content[0] != Opcode.CHUNK:
        return
    content = content[RECORD_HEAD.size :]
    *_, name_length = CHUNK_HEAD.unpack_from(content, 0)
    raw = _inflate_cut(*_compression_and_body(content, name_length))
    _take(np.frombuffer(raw, np.uint8), [], contents)


def _compression_and_body(content: Bytes, name_length: int) -> tuple[str, Bytes]:
    at = CHUNK_HEAD.size
    compression = bytes(content[at : at + name_length]).decode(errors="replace")
    return compression, content[at + name_length + 8 :]


def _inflate(compression: str, body: Bytes, size: int) -> bytes:
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompress(body, max_output_size=size)
    if compression == "lz4":
        import lz4.frame  # noqa: PLC0415 - mcap brings it; only files of others need it

        return bytes(lz4.frame.decompress(bytes(body)))
    if compression == "":
        return bytes(body)
    raise ValueError(f"compression {compression!r} is not known")


def _inflate_cut(compression: str, body: Bytes) -> bytes:
    """As much as the beginning of a compressed text tells."""
    written = bytes(body).rstrip(b"\0")  # a crash of the machine leaves zeros for what was not
    if compression == "":
        return written
    if compression != "zstd":
        return b""
    inflater, raw = zstandard.ZstdDecompressor().decompressobj(), bytearray()
    try:
        for at in range(0, len(written), 1 << 10):
            raw += inflater.decompress(written[at : at + (1 << 10)])
    except zstandard.ZstdError:
        pass  # what came before is whole
    return bytes(raw)


def _take(raw: np.ndarray[Any, Any], index: list[Bytes], contents: Contents) -> None:
    """Sort a chunk's messages into the channels' columns."""
    indexed = _indexed(raw, index)
    start = min((int(offsets[0]) for offsets in indexed.values()), default=len(raw))
    for located in (_walk(raw[:start], contents), indexed):
        for channel_id, offsets in located.items():
            _take_channel(raw, channel_id, offsets, contents)


def _indexed(raw: np.ndarray[Any, Any], index: list[Bytes]) -> dict[int, np.ndarray[Any, Any]]:
    """Where each channel's messages stand by the index, which no checksum protects.

    Nothing where it does not account for every byte from the first message on: it is damaged, or
    schemas and channels stand among the messages.
    """
    located: dict[int, np.ndarray[Any, Any]] = {}
    covered = 0
    for entry in index:
        if len(entry) == 6:  # the channel's id, the length of the array; the rest is entries
            continue
        if len(entry) % INDEX_ENTRY.itemsize != 6:
            return {}
        channel_id = int.from_bytes(entry[:2], "little")
        offsets = np.frombuffer(entry, INDEX_ENTRY, offset=6)["offset"].astype(np.intp)
        ascending = offsets[0] >= 0 and bool(np.all(offsets[1:] > offsets[:-1]))
        if channel_id in located or not ascending or offsets[-1] > len(raw) - _SHORTEST_MESSAGE:
            return {}
        heads = _heads(raw, offsets)
        if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(heads["channel"] != channel_id):
            return {}
        located[channel_id] = offsets
        covered += int(_lengths(heads).sum())
    start = min((int(offsets[0]) for offsets in located.values()), default=0)
    return located if start + covered == len(raw) else {}


def _walk(raw: np.ndarray[Any, Any], contents: Contents) -> dict[int, np.ndarray[Any, Any]]:
    """Go through a chunk record by record: where each channel's messages stand."""
    data = raw.data
    found: dict[int, list[int]] = {}
    for opcode, start, end in _records(data, 0):
        if opcode == Opcode.MESSAGE:
            _locate(data, start, end, found)
        else:
            _read_record(opcode, data[start:end], contents)
    return {channel_id: np.array(offsets, np.intp) for channel_id, offsets in found.items()}


def _locate(data: Bytes, start: int, end: int, found: dict[int, list[int]]) -> None:
    """Add where a message stands, if it is one, to what was found of its channel."""
    start -= RECORD_HEAD.size
    if end - start >= _SHORTEST_MESSAGE:
        (channel_id,) = struct.unpack_from("<H", data, start + RECORD_HEAD.size)
        found.setdefault(channel_id, []).append(start)


def _take_orphans(contents: Contents) -> None:
    """Messages that came before what describes them, the chunk with that being damaged."""
    orphans, contents.orphans = contents.orphans, []
    for raw, channel_id, offsets in orphans:
        _take_channel(raw, channel_id, offsets, contents)
    if contents.orphans:
        lost = sum(len(offsets) for *_, offsets in contents.orphans)
        contents.damage.append(f"lost {lost} samples: nothing describes their channel any more")


def _take_channel(
    raw: np.ndarray[Any, Any],
    channel_id: int,
    offsets: np.ndarray[Any, Any],
    contents: Contents,
) -> None:
    channel = contents.channels.get(channel_id)
    if channel is None or channel.schema_id not in {0, *contents.schemas}:
        contents.orphans.append((raw, channel_id, offsets))
        return
    schema = schema_of(channel, contents)
    if schema is None:
        return
    heads = _heads(raw, offsets)
    lengths = _lengths(heads)
    dtype = schema.dtype
    if dtype is not None and np.all(lengths == MESSAGE_HEAD.itemsize + dtype.itemsize):
        rows = _gather(raw, offsets, np.dtype(MESSAGE_HEAD.descr + dtype.descr))
        if all(np.all(rows[tag] == value) for tag, value in schema.tags.items()):
            contents.columns.setdefault(channel_id, []).append(rows)
            return
    ragged = contents.ragged.setdefault(channel_id, [])
    for at, length, head in zip(offsets.tolist(), lengths.tolist(), heads, strict=True):
        data = raw[at + MESSAGE_HEAD.itemsize : at + length].tobytes()
        ragged.append((int(head["received"]), int(head["measured"]), data))


def schema_of(channel: records.Channel, contents: Contents) -> Schema | None:
    """Ours, by which a channel's messages are read; None for what others wrote."""
    if channel.message_encoding != "protobuf":
        return None
    schema = contents.schemas.get(channel.schema_id)
    return schema_named(schema.name) if schema else None


def _gather(
    raw: np.ndarray[Any, Any], offsets: np.ndarray[Any, Any], dtype: np.dtype[np.void]
) -> np.ndarray[Any, Any]:
    windows = np.lib.stride_tricks.sliding_window_view(raw, dtype.itemsize)
    rows: np.ndarray[Any, Any] = windows[offsets].view(dtype)[:, 0]
    return rows


def _heads(raw: np.ndarray[Any, Any], offsets: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return _gather(raw, offsets, MESSAGE_HEAD)


def _lengths(heads: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The size of each message record, its head included."""
    return heads["length"].astype(np.int64) + RECORD_HEAD.size
