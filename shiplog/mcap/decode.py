"""Decoding of the data of an MCAP chunk to columns of samples by channel.

All messages of a channel are taken at once if they have the fixed layout of shiplog's schemas.
Others are kept as bytes, to be decoded one by one.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from typing import NamedTuple

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from numpy.typing import NDArray

from shiplog.types import Event, FloatArray, TimeArray

from .clock_repair import MixedTimes
from .locate import (
    Offsets,
    complete_records,
    gather,
    locate_by_index,
    locate_by_size,
    record_sizes,
)
from .pauses import Pauses
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


@dataclass(frozen=True, eq=False)
class SampleBlock:
    """The samples of one channel in one MCAP chunk.

    Attributes
    ----------
    received, measured
        (n,) times, ns.
    values
        (n, k), or n messages that are still to be decoded since their layout is not fixed.
    number
        The number of the MCAP chunk, or run of messages outside of MCAP chunks, in the file.
    offsets
        (n,) offsets of the messages in its data.
    """

    received: TimeArray
    measured: TimeArray
    values: FloatArray | list[bytes]
    number: int
    offsets: Offsets


@dataclass
class MessageCount:
    """The messages of one topic that are counted but not decoded.

    Attributes
    ----------
    count
        The number of messages.
    size
        Their size in bytes.
    first_ns, last_ns
        The earliest and the latest time of reception, ns; of no messages, in the wrong order.
    """

    count: int = 0
    size: int = 0
    first_ns: int = 2**63 - 1
    last_ns: int = -(2**63)

    def add(self, heads: NDArray[np.void]) -> None:
        """Count further messages, given their heads (n,)."""
        received_ns = heads["received"].astype(np.int64)
        self.count += len(heads)
        self.size += int(record_sizes(heads).sum()) - MESSAGE_HEAD.itemsize * len(heads)
        self.first_ns = min(self.first_ns, int(received_ns.min()))
        self.last_ns = max(self.last_ns, int(received_ns.max()))


@dataclass(frozen=True)
class EventMessage:
    """A message of the topic of events, as it is in the file.

    Attributes
    ----------
    position
        Its place in the file, common to all channels, as in `MessageColumns`.
    time_ns
        When it happened, ns since 1970-01-01 UTC.
    data
        The serialised message.
    """

    position: int
    time_ns: int
    data: bytes


class RawBlock(NamedTuple):
    """Raw packets of one channel in one MCAP chunk: its id, (n,) times of reception, n messages."""

    channel_id: int
    received_ns: TimeArray
    messages: list[bytes]


@dataclass
class McapContents:
    """What the scan of a file has collected so far.

    Attributes
    ----------
    schemas, channels
        The schema and channel records, by id.
    selected
        The ids of the channels whose messages are kept; None for all.
    blocks
        The samples not yet taken by `drain`, by channel id, in the order of the file.
    pending_samples
        The number of samples in `blocks`.
    total_samples
        The number of samples read so far.
    undescribed
        Messages whose channel is not described yet: the data, the channel id, the offsets, and the
        number of their MCAP chunk.
    undescribed_counts
        The number of such messages, by channel id.
    keep_undescribed
        Whether to keep them, because a later record may describe their channel.
    not_decoded
        The numbers of raw packets, and of messages of other programs, by channel id.
    keep_raw
        Whether to keep the raw packets in `raw_blocks` too.
    raw_blocks
        The raw packets not yet taken, in the order of the file.
    event_messages
        The events not yet decoded.
    events
        The events decoded so far.
    foreign_records
        The attachments and metadata records of other programs, in words; a dict for their order.
    metadata
        Text about the trial, by key.
    vessel_toml
        The attached vessel file, or None.
    in_order
        Whether each MCAP chunk was received after the one before, by its own times.
    latest_ns
        The last time of reception in the MCAP chunks so far, ns.
    finished
        Whether the file has its footer.
    truncated
        Whether an unfinished file ends within a record.
    damage
        One warning for each damaged part.
    data_blocks
        The number of MCAP chunks, and runs of messages outside of them, read so far.
    clock_warnings
        Warnings about times of messages in the samples drained so far.
    mixed_times
        Steps of clocks that were not repaired in the samples drained so far.
    pauses
        Gaps in all channels in the samples drained so far.
    """

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    selected: frozenset[int] | None = None
    blocks: dict[int, list[SampleBlock]] = field(default_factory=dict)
    pending_samples: int = 0
    total_samples: int = 0
    undescribed: list[tuple[bytes, int, Offsets, int]] = field(default_factory=list)
    undescribed_counts: dict[int, int] = field(default_factory=dict)
    keep_undescribed: bool = True
    not_decoded: dict[int, MessageCount] = field(default_factory=dict)
    keep_raw: bool = False
    raw_blocks: list[RawBlock] = field(default_factory=list)
    event_messages: list[EventMessage] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    foreign_records: dict[str, None] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    in_order: bool = True
    latest_ns: int = 0
    finished: bool = False
    truncated: bool = False
    damage: list[str] = field(default_factory=list)
    data_blocks: int = 0
    clock_warnings: list[str] = field(default_factory=list)
    mixed_times: list[MixedTimes] = field(default_factory=list)
    pauses: Pauses = field(default_factory=Pauses)

    def drain(self) -> dict[int, list[SampleBlock]]:
        """Return the blocks collected so far, by channel id, and release them."""
        blocks, self.blocks, self.pending_samples = self.blocks, {}, 0
        return blocks


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
    start = _read_descriptions(data, contents)
    located = (
        locate_by_size(data, start)
        or locate_by_index(data, start, indexes)
        or _locate_by_walk(data, start, contents)
    )
    for channel_id, offsets in located.items():
        _collect_channel(data, channel_id, offsets, contents.data_blocks, contents)
    contents.data_blocks += 1
    return bool(located)


def collect_undescribed(contents: McapContents) -> None:
    """Add the messages whose channel was described only later, and report those never described.

    A channel is described after its messages when the MCAP chunk that describes it first is
    damaged. The messages come before those that were added already.
    """
    undescribed, contents.undescribed = contents.undescribed, []
    counts, contents.undescribed_counts = contents.undescribed_counts, {}
    later, contents.blocks = contents.blocks, {}
    for messages in undescribed:
        _collect_channel(*messages, contents)
    for channel_id, blocks in later.items():
        contents.blocks.setdefault(channel_id, []).extend(blocks)
    contents.undescribed = []
    lost = sum(
        count for channel_id, count in counts.items() if not _is_described(channel_id, contents)
    )
    if lost:
        contents.damage.append(f"lost {lost} samples: the description of their channel is damaged")


def read_record(opcode: int, content: bytes, contents: McapContents) -> None:
    """Add a record other than a message to the contents; report it if it is damaged."""
    try:
        _read_record(opcode, ReadDataStream(BytesIO(content)), contents)
    except MALFORMED as error:
        contents.damage.append(f"skipped a damaged record: {error}")


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


def _read_record(opcode: int, stream: ReadDataStream, contents: McapContents) -> None:
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
        else:
            contents.foreign_records[f"metadata {metadata.name!r}"] = None
    elif opcode == Opcode.ATTACHMENT:
        attachment = records.Attachment.read(stream)
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
            contents.undescribed.append((data, channel_id, offsets, number))
        return
    channel = contents.channels[channel_id]
    schema = schema_of(channel, contents.schemas)
    if is_events(channel, contents.schemas):
        contents.event_messages += _event_messages(data, offsets, number)
        return
    if schema is None:
        count = contents.not_decoded.setdefault(channel_id, MessageCount())
        count.add(gather(data, offsets, MESSAGE_HEAD))
        if contents.keep_raw and is_raw(channel, contents.schemas):
            heads, messages = _undecoded(data, offsets)
            received = heads["received"].astype(np.int64)
            contents.raw_blocks.append(RawBlock(channel_id, received, messages))
        return
    if contents.selected is not None and channel_id not in contents.selected:
        return
    block = _fixed_width_block(data, offsets, schema, number)
    block = block or _undecoded_block(data, offsets, number)
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
    return SampleBlock(received, measured, values, number, offsets)


def _event_messages(data: bytes, offsets: Offsets, number: int) -> Iterator[EventMessage]:
    heads, messages = _undecoded(data, offsets)
    positions = ((number << 32) + offsets).tolist()
    return map(EventMessage, positions, heads["measured"].astype(np.int64).tolist(), messages)


def _undecoded_block(data: bytes, offsets: Offsets, number: int) -> SampleBlock:
    heads, messages = _undecoded(data, offsets)
    received, measured = heads["received"].astype(np.int64), heads["measured"].astype(np.int64)
    return SampleBlock(received, measured, messages, number, offsets)


def _undecoded(data: bytes, offsets: Offsets) -> tuple[NDArray[np.void], list[bytes]]:
    """Return the heads (n,) of messages, and n serialised messages."""
    heads = gather(data, offsets, MESSAGE_HEAD)
    starts = (offsets + MESSAGE_HEAD.itemsize).tolist()
    ends = (offsets + record_sizes(heads)).tolist()
    return heads, [data[start:end] for start, end in zip(starts, ends, strict=True)]
