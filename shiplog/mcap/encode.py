"""Encoding of messages to the data of MCAP chunks, by columns.

The counterpart of `shiplog.mcap.decode`. The messages of all channels, each a head and its payload,
are interleaved in the order of reception in numpy arrays; no loop runs over messages of fixed size.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from shiplog.types import Channel, TimeArray, is_sorted

from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .schema import fill_message_rows, schema_for
from .serialised import SerialisedMessages

Bytes = NDArray[np.uint8]

MAX_MCAP_CHUNK_BYTES = 1 << 20  # before compression
MESSAGES_AT_ONCE = 1 << 16  # about some MCAP chunks, so that the CPU cache holds them


@dataclass(frozen=True, eq=False)
class MessageBatch:
    """Messages of one channel of the file that are to be written.

    Attributes
    ----------
    channel_id
        The id of the channel in the file.
    first_sequence
        The sequence number of the first message within its channel.
    messages
        Samples, or messages that are already serialised.
    """

    channel_id: int
    first_sequence: int
    messages: Channel | SerialisedMessages

    def part(self, start: int, stop: int) -> "MessageBatch":
        """Return the messages with the numbers `start` to `stop` - 1 of the batch."""
        return MessageBatch(
            self.channel_id, self.first_sequence + start, self.messages.part(start, stop)
        )


@dataclass(frozen=True, eq=False)
class McapChunk:
    """The data of an MCAP chunk, not compressed, and the index of its messages.

    Attributes
    ----------
    data
        (b,) bytes: the message records one after the other.
    first_ns, last_ns
        The first and the last time of reception, ns.
    index
        The time and the offset of each message, by channel id: arrays (n,) of `INDEX_ENTRY`.
    """

    data: Bytes
    first_ns: int
    last_ns: int
    index: dict[int, NDArray[np.void]]


def encode_mcap_chunks(batches: Sequence[MessageBatch], max_bytes: int) -> Iterator[McapChunk]:
    """Encode batches as MCAP chunks of similar size, in the order of reception.

    Parameters
    ----------
    batches
        At least one batch, and no two of one channel. If the times of reception of each are
        ascending, memory is needed for some MCAP chunks only, else for all.
    max_bytes
        The size that the data of an MCAP chunk exceeds by at most about one message.
    """
    for portion in _portions(batches):
        yield from _encode_portion([batch for batch in portion if len(batch.messages)], max_bytes)


def _portions(batches: Sequence[MessageBatch]) -> Iterator[list[MessageBatch]]:
    """Cut all batches at the same times of reception, into about `MESSAGES_AT_ONCE` messages."""
    total = sum(len(batch.messages) for batch in batches)
    longest = max(batches, key=lambda batch: len(batch.messages)).messages.received_ns
    step = max(1, MESSAGES_AT_ONCE * len(longest) // max(total, 1))
    times = longest[step::step]
    if not all(is_sorted(batch.messages.received_ns) for batch in batches):
        times = times[:0]
    cuts = [
        [0, *np.searchsorted(b.messages.received_ns, times).tolist(), len(b.messages)]
        for b in batches
    ]
    for number in range(len(times) + 1):
        yield [
            batch.part(at[number], at[number + 1]) for batch, at in zip(batches, cuts, strict=True)
        ]


def _encode_portion(batches: Sequence[MessageBatch], max_bytes: int) -> Iterator[McapChunk]:
    if not batches:
        return
    messages = [_message_records(batch) for batch in batches]
    received = np.concatenate([batch.messages.received_ns for batch in batches])
    order = np.argsort(received, kind="stable")
    ends = np.cumsum(np.concatenate([m.sizes for m in messages])[order])
    starts = np.concatenate(([0], ends[:-1]))
    offsets = np.empty(len(order), np.int64)  # of each message, in the order of the batches
    offsets[order] = starts
    data = np.empty(int(ends[-1]), np.uint8)
    index = {}
    for batch, batch_messages in zip(batches, messages, strict=True):
        batch_offsets, offsets = np.split(offsets, [len(batch.messages)])
        _scatter(data, batch_offsets, batch_messages)
        index[batch.channel_id] = _index_entries(batch, batch_offsets)
    even_size = ceil(ends[-1] / ceil(ends[-1] / max_bytes))
    firsts = np.flatnonzero(np.diff(starts // even_size, prepend=-1)).tolist()
    for first, stop in zip(firsts, [*firsts[1:], len(order)], strict=True):
        start, end = int(starts[first]), int(ends[stop - 1])
        first_ns, last_ns = received[order[[first, stop - 1]]].tolist()
        within = {id_: _entries_between(entries, start, end) for id_, entries in index.items()}
        present = {id_: entries for id_, entries in within.items() if len(entries)}
        yield McapChunk(data[start:end], first_ns, last_ns, present)


def _index_entries(batch: MessageBatch, offsets: TimeArray) -> NDArray[np.void]:
    """Return the index entries of a batch, in the order of their offsets."""
    entries = np.empty(len(offsets), INDEX_ENTRY)
    entries["received"], entries["offset"] = batch.messages.received_ns, offsets
    return entries if np.all(offsets[1:] > offsets[:-1]) else np.sort(entries, order="offset")


def _entries_between(entries: NDArray[np.void], start: int, end: int) -> NDArray[np.void]:
    """Return the entries from `start` to before `end`, with offsets relative to `start`."""
    first, last = np.searchsorted(entries["offset"], np.array([start, end], np.uint64))
    within = entries[first:last].copy()
    within["offset"] -= np.uint64(start)
    return within


@dataclass(frozen=True, eq=False)
class _MessageRecords:
    """Message records of one channel one after the other, and the size of each, (n,)."""

    data: Bytes
    sizes: TimeArray


def _message_records(batch: MessageBatch) -> _MessageRecords:
    messages, n = batch.messages, len(batch.messages)
    fixed = schema_for(messages.fields).dtype if isinstance(messages, Channel) else None
    rows = np.empty(n, MESSAGE_HEAD if fixed is None else MESSAGE_HEAD.descr + fixed.descr)
    rows["opcode"], rows["channel"] = Opcode.MESSAGE, batch.channel_id
    rows["sequence"] = np.arange(batch.first_sequence, batch.first_sequence + n)
    rows["received"], rows["measured"] = messages.received_ns, messages.measured_ns
    if isinstance(messages, SerialisedMessages):
        return _variable_width_records(rows, messages.messages)
    if fixed is None:
        from .messages import encode_messages  # noqa: PLC0415 - protobuf takes long to import

        return _variable_width_records(rows, encode_messages(messages))
    rows["length"] = rows.dtype.itemsize - RECORD_HEAD.size
    fill_message_rows(rows, messages)
    return _MessageRecords(rows.view(np.uint8), np.full(n, rows.dtype.itemsize))


def _variable_width_records(heads: NDArray[np.void], messages: Sequence[bytes]) -> _MessageRecords:
    sizes = np.fromiter(map(len, messages), np.int64, len(messages)) + heads.itemsize
    heads["length"] = sizes - RECORD_HEAD.size
    head_bytes = heads.tobytes()
    starts = range(0, len(head_bytes), heads.itemsize)
    parts = [head_bytes[start : start + heads.itemsize] for start in starts]
    data = b"".join([part for pair in zip(parts, messages, strict=True) for part in pair])
    return _MessageRecords(np.frombuffer(data, np.uint8), sizes)


def _scatter(data: Bytes, offsets: TimeArray, messages: _MessageRecords) -> None:
    """Copy each message to its offset, all at once where they have one size."""
    sizes = messages.sizes
    if np.all(sizes == sizes[0]):
        size = int(sizes[0])
        _every_window(data, size)[offsets] = messages.data.view(f"V{size}")
        return
    target, source = data.data, messages.data.data
    start = 0
    for at, size in zip(offsets.tolist(), sizes.tolist(), strict=True):
        target[at : at + size] = source[start : start + size]
        start += size


def _every_window(data: Bytes, size: int) -> NDArray[np.void]:
    """Return a view of the `size` bytes that begin at each byte, to scatter them."""
    return np.ndarray((len(data) - size + 1,), f"V{size}", data, 0, (1,))
