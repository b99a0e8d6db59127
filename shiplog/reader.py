"""MCAP to `TrialLog`, by columns.

A chunk of fixed-size messages needs no loop: the message index says where each message stands,
and one gather in numpy takes them all. Chunks without an index are walked, messages of uneven
length are decoded one by one. Every chunk's checksum is verified.
"""

import mmap
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from .errors import LogError
from .schema import FORMAT_VERSION, METADATA_NAME, VESSEL_ATTACHMENT, Schema, decode, schema_named
from .types import Channel, TrialLog
from .units import CATALOGUE, UNITS, did_you_mean, factor

MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, size, crc, length of the compression's name
_MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
     ("received", "<u8"), ("measured", "<u8")]
)  # fmt: skip
_INDEX_ENTRY = np.dtype([("received", "<u8"), ("offset", "<u8")])

Bytes = memoryview


def read(path: str | os.PathLike[str]) -> TrialLog:
    """Read a recorded trial.

    A file that was not finished is read as far as it goes; a damaged chunk is left out; foreign
    topics are passed over. The log's `warnings` say so.

    Raises `LogError` where the file is missing, is not MCAP, or holds a unit nobody knows.
    """
    path = Path(path)
    contents = _Contents()
    with open_mcap(path) as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        view = memoryview(data)
        try:
            _scan(view, contents)
        finally:
            view.release()
    return _trial_log(path, contents)


def open_mcap(path: Path) -> IO[bytes]:
    """The file, opened, if it exists and begins as an MCAP file does; else `LogError`."""
    try:
        stream = path.open("rb")
    except OSError as error:
        raise LogError(_cannot_read(path, error)) from error
    try:
        magic = stream.read(len(MAGIC))
    except OSError as error:
        stream.close()
        raise LogError(_cannot_read(path, error)) from error
    if magic != MAGIC:
        stream.close()
        if not magic:
            raise LogError(f"the file is empty: record or convert it again: {path}")
        raise LogError(f"not an MCAP file; tables are read by `shiplog convert`: {path}")
    stream.seek(0)
    return stream


def _cannot_read(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return f"no such file: {path}"
    if isinstance(error, IsADirectoryError):
        return f"a folder, not a log; name one file in it: {path}"
    return f"cannot read: {(error.strerror or str(error)).lower()}: {path}"


@dataclass
class _Contents:
    """What the scan of a file gathers."""

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    columns: dict[int, list[np.ndarray[Any, Any]]] = field(default_factory=dict)
    ragged: dict[int, list[tuple[int, int, bytes]]] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    finished: bool = False
    damage: list[str] = field(default_factory=list)


def _scan(data: Bytes, contents: _Contents) -> None:
    """Go through the file's top-level records once, chunk by chunk."""
    loose: list[tuple[int, int]] = []  # messages outside any chunk
    end = len(MAGIC)
    for opcode, start, end in _records(data, len(MAGIC)):
        if opcode == Opcode.CHUNK:
            _read_chunk(data[start:end], _index_after(data, end), contents)
        elif opcode == Opcode.MESSAGE:
            loose.append((start - _RECORD_HEAD.size, end))
        elif opcode == Opcode.FOOTER:
            contents.finished = True
            break
        elif opcode != Opcode.MESSAGE_INDEX:
            _read_record(opcode, data[start:end], contents)
    if not contents.finished:
        _read_cut_chunk(data[end:], contents)
    for start, stop in loose:
        _take_loose(np.frombuffer(data[start:stop], np.uint8), contents)


def _records(data: Bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """The records from `at` on that are whole: opcode, where the content starts, where it ends."""
    while at + _RECORD_HEAD.size <= len(data):
        opcode, length = _RECORD_HEAD.unpack_from(data, at)
        start = at + _RECORD_HEAD.size
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


def _read_record(opcode: int, content: Bytes, contents: _Contents) -> None:
    stream = ReadDataStream(BytesIO(content))
    if opcode == Opcode.SCHEMA:
        schema = records.Schema.read(stream)
        contents.schemas[schema.id] = schema
    elif opcode == Opcode.CHANNEL:
        channel = records.Channel.read(stream)
        contents.channels[channel.id] = channel
    elif opcode == Opcode.METADATA:
        metadata = records.Metadata.read(stream)
        if metadata.name == METADATA_NAME:
            contents.metadata.update(metadata.metadata)
    elif opcode == Opcode.ATTACHMENT:
        attachment = records.Attachment.read(stream)
        if attachment.name == VESSEL_ATTACHMENT:
            contents.vessel_toml = attachment.data.decode()


def _read_chunk(content: Bytes, index: list[Bytes], contents: _Contents) -> None:
    first_ns, last_ns, size, crc, name_length = _CHUNK_HEAD.unpack_from(content, 0)
    try:
        raw = _inflate(*_compression_and_body(content, name_length), size)
        fault = "its checksum is wrong" if crc and zlib.crc32(raw) != crc else ""
    except (ValueError, zstandard.ZstdError, RuntimeError) as error:
        raw, fault = b"", str(error)
    if fault:
        first, last = (np.datetime64(ns, "ns").astype("M8[ms]") for ns in (first_ns, last_ns))
        contents.damage.append(f"lost what was received {first} to {last}: damaged chunk, {fault}")
    else:
        _take(np.frombuffer(raw, np.uint8), index, contents)


def _read_cut_chunk(content: Bytes, contents: _Contents) -> None:
    """The whole messages of a chunk that the file ends in the middle of, if it does."""
    head = _RECORD_HEAD.size + _CHUNK_HEAD.size
    if len(content) <= head or content[0] != Opcode.CHUNK:
        return
    content = content[_RECORD_HEAD.size :]
    *_, name_length = _CHUNK_HEAD.unpack_from(content, 0)
    compression, body = _compression_and_body(content, name_length)
    try:
        if compression == "zstd":
            raw = zstandard.ZstdDecompressor().decompressobj().decompress(body)
        else:
            raw = bytes(body) if compression == "" else b""
    except zstandard.ZstdError:
        return
    _take(np.frombuffer(raw, np.uint8), [], contents)


def _compression_and_body(content: Bytes, name_length: int) -> tuple[str, Bytes]:
    at = _CHUNK_HEAD.size
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


def _take(raw: np.ndarray[Any, Any], index: list[Bytes], contents: _Contents) -> None:
    """Sort a chunk's messages into the channels' columns."""
    offsets: dict[int, np.ndarray[Any, Any]] = {}
    for entry in index:
        (channel_id,) = struct.unpack_from("<H", entry, 0)
        if len(entry) > 6:  # the channel's id, the length of the array; the rest is entries
            found = np.frombuffer(entry, _INDEX_ENTRY, offset=6)["offset"].astype(np.intp)
            offsets[channel_id] = found
    covered = sum(int(_lengths(raw, found).sum()) for found in offsets.values())
    if covered != len(raw):  # schemas, channels or messages that the index does not name
        walked = _walk(raw, contents)
        offsets = walked if covered == 0 or not offsets else offsets | walked
    for channel_id, found in offsets.items():
        _take_channel(raw, channel_id, found, contents)


def _walk(raw: np.ndarray[Any, Any], contents: _Contents) -> dict[int, np.ndarray[Any, Any]]:
    """Go through a chunk record by record: where each channel's messages stand."""
    data = raw.data
    found: dict[int, list[int]] = {}
    for opcode, start, end in _records(data, 0):
        if opcode == Opcode.MESSAGE:
            (channel_id,) = struct.unpack_from("<H", data, start)
            found.setdefault(channel_id, []).append(start - _RECORD_HEAD.size)
        else:
            _read_record(opcode, data[start:end], contents)
    return {channel_id: np.array(offsets, np.intp) for channel_id, offsets in found.items()}


def _take_loose(raw: np.ndarray[Any, Any], contents: _Contents) -> None:
    """A message that stands outside any chunk."""
    at = np.zeros(1, np.intp)
    _take_channel(raw, int(_heads(raw, at)["channel"][0]), at, contents)


def _take_channel(
    raw: np.ndarray[Any, Any],
    channel_id: int,
    offsets: np.ndarray[Any, Any],
    contents: _Contents,
) -> None:
    channel = contents.channels.get(channel_id)
    schema = _schema_of(channel, contents)
    if schema is None or not len(offsets):
        contents.columns.setdefault(channel_id, [])
        return
    lengths = _lengths(raw, offsets)
    dtype = schema.dtype
    if dtype is not None and np.all(lengths == _MESSAGE_HEAD.itemsize + dtype.itemsize):
        row = np.dtype(_MESSAGE_HEAD.descr + dtype.descr)
        contents.columns.setdefault(channel_id, []).append(_gather(raw, offsets, row))
        return
    heads = _heads(raw, offsets)
    ragged = contents.ragged.setdefault(channel_id, [])
    for at, length, head in zip(offsets.tolist(), lengths.tolist(), heads, strict=True):
        data = raw[at + _MESSAGE_HEAD.itemsize : at + length].tobytes()
        ragged.append((int(head["received"]), int(head["measured"]), data))


def _schema_of(channel: records.Channel | None, contents: _Contents) -> Schema | None:
    if channel is None or channel.message_encoding != "protobuf":
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
    return _gather(raw, offsets, _MESSAGE_HEAD)


def _lengths(raw: np.ndarray[Any, Any], offsets: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The size of each message record, its head included."""
    if not len(offsets):
        return np.zeros(0, np.int64)
    return _heads(raw, offsets)["length"].astype(np.int64) + _RECORD_HEAD.size


def _trial_log(path: Path, contents: _Contents) -> TrialLog:
    version = contents.metadata.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION:
        raise LogError(
            f"written in format {version}, this shiplog reads format {FORMAT_VERSION}; "
            f"install a newer shiplog: {path}"
        )
    channels, foreign = [], []
    for channel_id, record in sorted(contents.channels.items()):
        schema = _schema_of(record, contents)
        if schema is None:
            foreign.append(record.topic)
        else:
            channels.append(_channel(path, record, schema, contents, channel_id))
    warnings = list(contents.damage)
    if not contents.finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed); "
            f"its {sum(map(len, channels))} whole samples were read"
        )
    if foreign:
        warnings.append(f"passed over {len(foreign)} topics not ours: {', '.join(foreign)}")
    return TrialLog(
        path.name, tuple(channels), contents.metadata, contents.vessel_toml, tuple(warnings)
    )


def _channel(
    path: Path,
    record: records.Channel,
    schema: Schema,
    contents: _Contents,
    channel_id: int,
) -> Channel:
    topic_name, _, topic_source = record.topic.strip("/").partition("/")
    name = record.metadata.get("channel", topic_name)
    received, measured, values = _columns(schema, contents, channel_id)
    if np.any(received[1:] < received[:-1]):
        order = np.argsort(received, kind="stable")
        received, measured, values = received[order], measured[order], values[order]
    unit = record.metadata.get("unit", "1")
    if schema.fields in (("value",), ("north", "east")):
        scale, unit = _to_si(path, name, unit)
        values = values * scale if scale != 1 else values
    scalar = schema.fields == ("value",)
    ours = {"channel", "source", "unit", "positive"}
    return Channel(
        name,
        record.metadata.get("source", topic_source),
        unit,
        measured,
        received,
        values[:, 0] if scalar else values,
        () if scalar else schema.fields,
        {key: value for key, value in record.metadata.items() if key not in ours},
    )


def _columns(
    schema: Schema, contents: _Contents, channel_id: int
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A channel's received times, measured times and values (n, k), in the order of the file."""
    slabs = [
        (
            slab["received"].astype(np.int64),
            slab["measured"].astype(np.int64),
            np.stack([slab[name] for name in schema.fields], axis=1),
        )
        for slab in contents.columns.get(channel_id, [])
    ]
    ragged = contents.ragged.get(channel_id, [])
    if ragged or not slabs:
        received, measured, data = zip(*ragged, strict=True) if ragged else ((), (), ())
        slabs.append(
            (
                np.array(received, np.int64),
                np.array(measured, np.int64),
                decode(schema, list(data)),
            )
        )
    return tuple(np.concatenate(column) for column in zip(*slabs, strict=True))  # type: ignore[return-value]


def _to_si(path: Path, name: str, unit: str) -> tuple[float, str]:
    kind = CATALOGUE.get(name)
    if kind is None:
        return 1.0, unit
    if unit not in UNITS:
        raise LogError(
            f"channel {name!r} is in an unknown unit {unit!r}{did_you_mean(unit, UNITS)}; "
            f"it should be in {kind.unit}: {path}"
        )
    return factor(unit, kind.unit), kind.unit
