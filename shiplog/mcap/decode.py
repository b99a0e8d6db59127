"""Decoding of the data of an MCAP chunk to columns of samples by channel.

All messages of a channel are taken at once if they have the fixed layout of shiplog's schemas.
Others are kept as bytes, to be decoded one by one.
"""

import struct
from collections.abc import Iterator, Mapping
from io import BytesIO

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .contents import EventMessage, KeptMessages, McapContents, MessageCount, SampleBlock
from .limits import MAP_ENTRY_BYTES, MAX_DESCRIPTION_BYTES
from .locate import (
    Offsets,
    complete_records,
    gather,
    locate_by_index,
    locate_by_size,
    record_sizes,
)
from .metadata_record import read_metadata
from .record_structure import content_size, read_attachment
from .records import MESSAGE_HEAD, RECORD_HEAD
from .schema import (
    ENCODING,
    EVENT,
    EVENTS_TOPIC,
    METADATA_NAME,
    RAW,
    VESSEL_ATTACHMENT,
    Schema,
    schema_named,
)

MALFORMED = (  # what the decoders raise on damaged bytes; the exceptions have no common base
    McapError, zstandard.ZstdError, struct.error,
    ValueError, OverflowError, RuntimeError, MemoryError,
)  # fmt: skip


def collect_messages(data: bytes, indexes: list[bytes], contents: McapContents) -> bool:
    """Add the messages in some data to the contents, by channel.

    Parameters
    ----------
    data
        Consecutive records: the data of an MCAP chunk, or messages outside of MCAP chunks.
    indexes
        The content of the message index records of the MCAP chunk.
    contents
        Receives the samples, and the schemas and channels that the data describe.

    Returns
    -------
    found
        Whether there were any messages.
    """
    contents.keep(Opcode.CHUNK, data)
    start = _read_descriptions(data, contents)
    located = (
        locate_by_size(data, start)
        or locate_by_index(data, start, indexes)
        or _locate_by_walk(data, start, contents)
    )
    for channel_id, offsets in located.items():
        contents.messages += len(offsets)
        _collect_channel(data, channel_id, offsets, contents.data_blocks, contents)
    contents.data_blocks += 1
    contents.block_starts.append(contents.reading[0])
    return bool(located)


def collect_undescribed(contents: McapContents) -> None:
    """Add the messages whose channel was described only later, and report those never described.

    A channel is described after its messages when the MCAP chunk that describes it first is
    damaged. The messages come before those that were added already.
    """
    undescribed, contents.undescribed, contents.undescribed_bytes = contents.undescribed, [], 0
    counts, contents.undescribed_counts = contents.undescribed_counts, {}
    later, contents.blocks = contents.blocks, {}
    for messages in undescribed:
        _collect_channel(*messages, contents)
    for channel_id, blocks in later.items():
        contents.blocks.setdefault(channel_id, []).extend(blocks)
    contents.undescribed, contents.undescribed_bytes = [], 0
    lost = sum(
        count for channel_id, count in counts.items() if not _is_described(channel_id, contents)
    )
    if lost:
        contents.report(f"lost {lost} samples: the description of their channel is damaged")


def read_record(opcode: int, content: bytes, contents: McapContents) -> None:
    """Add a record other than a message to the contents; report it if it is damaged."""
    try:
        _read_record(opcode, content, contents)
        contents.keep(opcode, content)
    except MALFORMED as error:
        contents.report(f"a record was not used: {str(error) or 'it cannot be read'}")


def schema_of(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> Schema | None:
    """Return the schema of a channel's samples; None where its messages are none."""
    return schema_named(_schema_name(channel, schemas))


def is_raw(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> bool:
    """Whether a channel's messages are raw packets."""
    return _schema_name(channel, schemas) == RAW.name


def is_events(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> bool:
    """Whether a channel's messages are the events of the log, not log messages of a program."""
    return channel.topic == EVENTS_TOPIC and _schema_name(channel, schemas) == EVENT.name


def is_foreign(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> bool:
    """Whether shiplog cannot read a channel's messages."""
    ours = is_raw(channel, schemas) or is_events(channel, schemas)
    return not ours and schema_of(channel, schemas) is None


def _schema_name(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> str:
    """Return the name of the protobuf schema of a channel; empty for other encodings."""
    schema = schemas.get(channel.schema_id)
    return schema.name if schema and channel.message_encoding == ENCODING else ""


def _read_record(opcode: int, content: bytes, contents: McapContents) -> None:
    if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
        if len(content) > MAX_DESCRIPTION_BYTES or content_size(opcode, content) is None:
            raise ValueError("the fields of a description are longer than it, or than any of a log")
        stream = ReadDataStream(BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = records.Schema.read(stream)
            is_new = contents.schemas.setdefault(schema.id, schema) is schema
            size = len(content)
        else:
            channel = records.Channel.read(stream)
            is_new = contents.channels.setdefault(channel.id, channel) is channel
            size = len(content) + MAP_ENTRY_BYTES * len(channel.metadata)
        contents.description_bytes += size if is_new else 0
    elif opcode == Opcode.METADATA:
        metadata = read_metadata(content)
        if metadata.name == METADATA_NAME:
            contents.metadata.update(metadata.metadata)
        else:
            contents.foreign_records[f"metadata {metadata.name!r}"] = None
    elif opcode == Opcode.ATTACHMENT:
        attachment = read_attachment(content)
        if attachment.name == VESSEL_ATTACHMENT:
            contents.vessel_toml = attachment.data.decode()
        else:
            contents.foreign_records[f"attachment {attachment.name!r}"] = None


def _read_descriptions(data: bytes, contents: McapContents) -> int:
    """Read the schemas and channels before the first message, and return its offset."""
    end = 0
    for opcode, start, end in complete_records(data, 0):
        if opcode == Opcode.MESSAGE:
            return start
        read_record(opcode, data[start + RECORD_HEAD.size : end], contents)
    return end


def _locate_by_walk(data: bytes, start: int, contents: McapContents) -> dict[int, Offsets]:
    """Locate each channel's messages record by record, and read the other records."""
    located: dict[int, list[int]] = {}
    for opcode, at, end in complete_records(data, start):
        if opcode != Opcode.MESSAGE:
            read_record(opcode, data[at + RECORD_HEAD.size : end], contents)
        elif end - at >= MESSAGE_HEAD.itemsize:
            (channel_id,) = struct.unpack_from("<H", data, at + RECORD_HEAD.size)
            located.setdefault(channel_id, []).append(at)
    return {channel_id: np.array(offsets, np.intp) for channel_id, offsets in located.items()}


def _is_described(channel_id: int, contents: McapContents) -> bool:
    """Whether the channel, and the schema it refers to, have been read."""
    channel = contents.channels.get(channel_id)
    if channel is None:
        return False
    return not channel.schema_id or channel.schema_id in contents.schemas


def _collect_channel(
    data: bytes, channel_id: int, offsets: Offsets, number: int, contents: McapContents
) -> None:
    if not _is_described(channel_id, contents):
        counts = contents.undescribed_counts
        counts[channel_id] = counts.get(channel_id, 0) + len(offsets)
        if contents.keep_undescribed:
            if not contents.undescribed or contents.undescribed[-1][0] is not data:
                contents.undescribed_bytes += len(data)
            contents.undescribed.append((data, channel_id, offsets, number))
        return
    channel = contents.channels[channel_id]
    schema = schema_of(channel, contents.schemas)
    is_kept = contents.keeps is not None and contents.keeps(channel, contents.schemas)
    if is_kept:
        kept = _kept_messages(data, offsets, number)
        contents.kept.setdefault(channel_id, []).append(kept)
        contents.held_bytes += sum(map(len, kept.messages))
    if is_events(channel, contents.schemas):
        events = list(_event_messages(data, offsets, number))
        contents.event_messages += events
        contents.held_bytes += sum(len(event.data) for event in events)
        return
    if schema is None:
        count = contents.not_decoded.setdefault(channel_id, MessageCount())
        count.add(gather(data, offsets, MESSAGE_HEAD))
        return
    if is_kept or (contents.selected is not None and channel_id not in contents.selected):
        return
    block = _fixed_width_block(data, offsets, schema, number)
    if block is None:
        block = _undecoded_block(data, offsets, number)
        contents.held_bytes += sum(map(len, block.values))
    contents.blocks.setdefault(channel_id, []).append(block)
    contents.pending_samples += len(offsets)
    contents.total_samples += len(offsets)


def _fixed_width_block(
    data: bytes, offsets: Offsets, schema: Schema, number: int
) -> SampleBlock | None:
    """Decode messages of the schema's fixed layout at once; None if one of them has another."""
    if schema.dtype is None:
        return None
    dtype = np.dtype(MESSAGE_HEAD.descr + schema.dtype.descr)
    if offsets[-1] + dtype.itemsize > len(data):
        return None
    rows = gather(data, offsets, dtype)
    expected = {"length": dtype.itemsize - RECORD_HEAD.size} | schema.tags
    if any(np.any(rows[name] != value) for name, value in expected.items()):
        return None
    values = np.stack([rows[name] for name in schema.fields], axis=1)
    received, measured = rows["received"].astype(np.int64), rows["measured"].astype(np.int64)
    return SampleBlock(received, measured, values, number, offsets, _sequences(rows))


def _event_messages(data: bytes, offsets: Offsets, number: int) -> Iterator[EventMessage]:
    heads, messages = _undecoded(data, offsets)
    positions = ((number << 32) + offsets).tolist()
    return map(EventMessage, positions, heads["measured"].astype(np.int64).tolist(), messages)


def _undecoded_block(data: bytes, offsets: Offsets, number: int) -> SampleBlock:
    kept = _kept_messages(data, offsets, number)
    sequences = _sequences(gather(data, offsets, MESSAGE_HEAD))
    return SampleBlock(kept.received, kept.measured, kept.messages, number, offsets, sequences)


def _kept_messages(data: bytes, offsets: Offsets, number: int) -> KeptMessages:
    heads, messages = _undecoded(data, offsets)
    received, measured = heads["received"].astype(np.int64), heads["measured"].astype(np.int64)
    return KeptMessages(received, measured, messages, number, offsets)


def _sequences(heads: NDArray[np.void]) -> tuple[int, int]:
    return int(heads["sequence"][0]), int(heads["sequence"][-1])


def _undecoded(data: bytes, offsets: Offsets) -> tuple[NDArray[np.void], list[bytes]]:
    """Return the heads (n,) of messages, and n serialised messages."""
    heads = gather(data, offsets, MESSAGE_HEAD)
    starts = (offsets + MESSAGE_HEAD.itemsize).tolist()
    ends = (offsets + record_sizes(heads)).tolist()
    return heads, [data[start:end] for start, end in zip(starts, ends, strict=True)]
