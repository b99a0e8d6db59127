"""The bytes of a chunk to columns of messages.

A chunk whose messages are all of one length needs neither loop nor index, one of several lengths
needs the message index to do without a loop. Where the index does not account for every byte the
chunk is walked. Either way one gather takes all messages of a channel; those that are not laid
out as ours are kept one by one, to be decoded.
"""

import struct
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
from numpy.typing import NDArray

from shiplog.types import FloatArray, TimeArray

from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .schema import METADATA_NAME, VESSEL_ATTACHMENT, Schema, schema_named

MALFORMED = (  # what decoders raise on damaged bytes: no one family
    McapError, zstandard.ZstdError, struct.error,
    ValueError, OverflowError, RuntimeError, MemoryError,
)  # fmt: skip

Offsets = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Piece:
    """Samples of one channel as they stood in one chunk: (n,) times and (n, k) values."""

    received: TimeArray
    measured: TimeArray
    values: FloatArray | list[bytes]  # messages still to be decoded, where not laid out as ours


@dataclass
class Contents:
    """What the scan of a file gathers."""

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    wanted: frozenset[int] | None = None  # the channels whose messages are kept; None: all
    pieces: dict[int, list[Piece]] = field(default_factory=dict)  # by channel, as in the file
    held: int = 0  # samples in the pieces
    taken: int = 0  # samples that ever were
    orphans: list[tuple[bytes, int, Offsets]] = field(default_factory=list)
    orphaned: dict[int, int] = field(default_factory=dict)  # how many, by channel
    keeps_orphans: bool = True  # messages whose channel is not described yet, but may be later
    metadata: dict[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    in_order: bool = True  # each chunk says that it was received after the one before
    latest_ns: int = 0  # when the last of those was
    finished: bool = False
    cut: bool = False  # unfinished, and what it ends with is no whole record
    damage: list[str] = field(default_factory=list)

    def drain(self) -> dict[int, list[Piece]]:
        """Hand out the pieces gathered so far and hold them no more."""
        pieces, self.pieces, self.held = self.pieces, {}, 0
        return pieces


def take(raw: bytes, index: list[bytes], contents: Contents) -> bool:
    """Sort messages that follow one another into the channels' pieces; whether there were any."""
    start = _described(raw, contents)
    located = _even(raw, start) or _indexed(raw, start, index) or _walked(raw, start, contents)
    for channel_id, offsets in located.items():
        _take_channel(raw, channel_id, offsets, contents)
    return bool(located)


def take_orphans(contents: Contents) -> None:
    """Messages that came before what describes them, the chunk with that being damaged."""
    orphans, contents.orphans = contents.orphans, []
    counts, contents.orphaned = contents.orphaned, {}
    later, contents.pieces = contents.pieces, {}
    for orphan in orphans:
        _take_channel(*orphan, contents)
    for channel_id, pieces in later.items():
        contents.pieces.setdefault(channel_id, []).extend(pieces)
    contents.orphans = []
    lost = sum(count for channel_id, count in counts.items() if _unknown(channel_id, contents))
    if lost:
        contents.damage.append(f"lost {lost} samples: nothing describes their channel any more")


def keep_record(opcode: int, content: bytes, contents: Contents) -> None:
    """Keep what a record other than a message says, if it concerns us."""
    try:
        _keep(opcode, ReadDataStream(BytesIO(content)), contents)
    except MALFORMED as error:
        contents.damage.append(f"left out a damaged record: {error}")


def schema_of(channel: records.Channel, schemas: dict[int, records.Schema]) -> Schema | None:
    """Ours, by which a channel's messages are read; None for what others wrote."""
    if channel.message_encoding != "protobuf":
        return None
    schema = schemas.get(channel.schema_id)
    return schema_named(schema.name) if schema else None


def _keep(opcode: int, stream: ReadDataStream, contents: Contents) -> None:
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


def _records(raw: bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """The records from `at` on that are whole: opcode, where the record starts, where it ends."""
    while at + RECORD_HEAD.size <= len(raw):
        opcode, length = RECORD_HEAD.unpack_from(raw, at)
        end = at + RECORD_HEAD.size + length
        if opcode == 0 or end > len(raw):
            return
        yield opcode, at, end
        at = end


def _described(raw: bytes, contents: Contents) -> int:
    """Keep the schemas and channels that stand before the first message; where that stands."""
    end = 0
    for opcode, start, end in _records(raw, 0):
        if opcode == Opcode.MESSAGE:
            return start
        keep_record(opcode, raw[start + RECORD_HEAD.size : end], contents)
    return end


def _even(raw: bytes, start: int) -> dict[int, Offsets]:
    """Where each channel's messages stand, if from `start` on there are but messages of one size.

    The lengths are those a walk would go by, so nothing has to be believed.
    """
    if len(raw) - start < MESSAGE_HEAD.itemsize:
        return {}
    size = RECORD_HEAD.size + RECORD_HEAD.unpack_from(raw, start)[1]
    count, rest = divmod(len(raw) - start, size)
    if rest or size < MESSAGE_HEAD.itemsize:
        return {}
    heads = np.ndarray((count,), MESSAGE_HEAD, raw, start, (size,))
    if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(
        heads["length"] != size - RECORD_HEAD.size
    ):
        return {}
    channels = heads["channel"]
    offsets = start + size * np.argsort(channels, kind="stable")
    counts = np.bincount(channels)
    here = np.flatnonzero(counts)
    parts = np.split(offsets, np.cumsum(counts[here])[:-1])
    return dict(zip(here.tolist(), parts, strict=True))


def _indexed(raw: bytes, start: int, index: list[bytes]) -> dict[int, Offsets]:
    """Where each channel's messages stand by the index, which no checksum protects.

    Nothing where it does not account for every byte from the first message on: it is damaged, or
    schemas and channels stand among the messages.
    """
    located: dict[int, Offsets] = {}
    covered = start
    for entry in index:
        if len(entry) == 6:  # the channel's id, the length of the array; the rest is entries
            continue
        if len(entry) % INDEX_ENTRY.itemsize != 6:
            return {}
        channel_id = int.from_bytes(entry[:2], "little")
        offsets = np.frombuffer(entry, INDEX_ENTRY, offset=6)["offset"].astype(np.intp)
        ascending = offsets[0] >= start and bool(np.all(offsets[1:] > offsets[:-1]))
        too_far = offsets[-1] > len(raw) - MESSAGE_HEAD.itemsize
        if channel_id in located or not ascending or too_far:
            return {}
        heads = _gather(raw, offsets, MESSAGE_HEAD)
        if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(heads["channel"] != channel_id):
            return {}
        located[channel_id] = offsets
        covered += int(_sizes(heads).sum())
    return located if covered == len(raw) else {}


def _walked(raw: bytes, start: int, contents: Contents) -> dict[int, Offsets]:
    """Go through a chunk record by record: where each channel's messages stand."""
    found: dict[int, list[int]] = {}
    for opcode, at, end in _records(raw, start):
        if opcode != Opcode.MESSAGE:
            keep_record(opcode, raw[at + RECORD_HEAD.size : end], contents)
        elif end - at >= MESSAGE_HEAD.itemsize:
            (channel_id,) = struct.unpack_from("<H", raw, at + RECORD_HEAD.size)
            found.setdefault(channel_id, []).append(at)
    return {channel_id: np.array(offsets, np.intp) for channel_id, offsets in found.items()}


def _unknown(channel_id: int, contents: Contents) -> bool:
    """Whether nothing read so far says what a channel's messages are."""
    channel = contents.channels.get(channel_id)
    return channel is None or bool(channel.schema_id and channel.schema_id not in contents.schemas)


def _take_channel(raw: bytes, channel_id: int, offsets: Offsets, contents: Contents) -> None:
    if _unknown(channel_id, contents):
        contents.orphaned[channel_id] = contents.orphaned.get(channel_id, 0) + len(offsets)
        if contents.keeps_orphans:
            contents.orphans.append((raw, channel_id, offsets))
        return
    schema = schema_of(contents.channels[channel_id], contents.schemas)
    if schema is None or (contents.wanted is not None and channel_id not in contents.wanted):
        return
    piece = _fixed(raw, offsets, schema) or _ragged(raw, offsets)
    contents.pieces.setdefault(channel_id, []).append(piece)
    contents.held += len(offsets)
    contents.taken += len(offsets)


def _fixed(raw: bytes, offsets: Offsets, schema: Schema) -> Piece | None:
    """Messages laid out as ours, all by one gather; None where one of them is not."""
    if schema.dtype is None:
        return None
    dtype = np.dtype(MESSAGE_HEAD.descr + schema.dtype.descr)
    if offsets[-1] + dtype.itemsize > len(raw):
        return None
    rows = _gather(raw, offsets, dtype)
    expected = {"length": dtype.itemsize - RECORD_HEAD.size} | schema.tags
    if any(np.any(rows[name] != value) for name, value in expected.items()):
        return None
    values = np.stack([rows[name] for name in schema.fields], axis=1)
    return Piece(rows["received"].astype(np.int64), rows["measured"].astype(np.int64), values)


def _ragged(raw: bytes, offsets: Offsets) -> Piece:
    heads = _gather(raw, offsets, MESSAGE_HEAD)
    ends = offsets + _sizes(heads)
    starts = offsets + MESSAGE_HEAD.itemsize
    messages = [raw[a:z] for a, z in zip(starts.tolist(), ends.tolist(), strict=True)]
    return Piece(heads["received"].astype(np.int64), heads["measured"].astype(np.int64), messages)


def _gather(raw: bytes, offsets: Offsets, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """The structures that stand at these offsets, wherever that is."""
    blank = np.dtype((np.void, dtype.itemsize))  # copied as one thing each, whatever the fields
    anywhere: NDArray[Any] = np.ndarray((len(raw) - dtype.itemsize + 1,), blank, raw, 0, (1,))
    rows: NDArray[np.void] = anywhere[offsets].view(dtype)
    return rows


def _sizes(heads: NDArray[np.void]) -> TimeArray:
    """The size of each message record, its head included."""
    return heads["length"].astype(np.int64) + RECORD_HEAD.size
