"""Samples to the chunks of an MCAP file, by columns: the counterpart of `messages`.

The bytes of several chunks are laid out at once in numpy: the messages of all channels, each a
head and its payload, interleaved in the order in which they were received. No loop runs over
messages of fixed size.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from shiplog.types import Channel, TimeArray, is_sorted

from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .schema import encode_messages, fill_rows, schema_for

Bytes = NDArray[np.uint8]

LAID_OUT_AT_ONCE = 1 << 16  # messages, about: some chunks full, which the processor's cache holds


@dataclass(frozen=True, eq=False)
class Part:
    """Samples of one channel on their way into chunks."""

    channel_id: int
    first_sequence: int
    chunk: Channel


@dataclass(frozen=True, eq=False)
class McapChunk:
    """The messages of a chunk, and where each channel's stand in it."""

    body: Bytes
    first_ns: int
    last_ns: int
    index: dict[int, NDArray[np.void]]  # of INDEX_ENTRY


def mcap_chunks(parts: Sequence[Part], largest: int) -> Iterator[McapChunk]:
    """Lay parts out in even chunks of at most about `largest` bytes, in the order of reception.

    A channel has one part. Parts as they were received are laid out little by little; where one
    is in another order, all at once.
    """
    for few in _portions(parts):
        yield from _laid_out([part for part in few if len(part.chunk)], largest)


def _portions(parts: Sequence[Part]) -> Iterator[list[Part]]:
    """The parts cut at the same times of reception, so that each portion is moderately large."""
    total = sum(len(part.chunk) for part in parts)
    leader = max(parts, key=lambda part: len(part.chunk)).chunk.received_ns
    step = max(1, LAID_OUT_AT_ONCE * len(leader) // max(total, 1))
    times = leader[step::step]
    if not all(is_sorted(part.chunk.received_ns) for part in parts):
        times = times[:0]
    cuts = [[0, *np.searchsorted(p.chunk.received_ns, times).tolist(), len(p.chunk)] for p in parts]
    for number in range(len(times) + 1):
        yield [
            Part(part.channel_id, part.first_sequence + at[number],
                 part.chunk.part(at[number], at[number + 1]))
            for part, at in zip(parts, cuts, strict=True)
        ]  # fmt: skip


def _laid_out(parts: Sequence[Part], largest: int) -> Iterator[McapChunk]:
    if not parts:
        return
    messages = [_messages(part) for part in parts]
    received = np.concatenate([part.chunk.received_ns for part in parts])
    order = np.argsort(received, kind="stable")
    ends = np.cumsum(np.concatenate([m.sizes for m in messages])[order])
    starts = np.concatenate(([0], ends[:-1]))
    places = np.empty(len(order), np.int64)  # of each message, in the order of the parts
    places[order] = starts
    body = np.empty(int(ends[-1]), np.uint8)
    index = {}
    for part, its_messages in zip(parts, messages, strict=True):
        its_places, places = np.split(places, [len(part.chunk)])
        _place(body, its_places, its_messages)
        index[part.channel_id] = _index(part, its_places)
    even = ceil(ends[-1] / ceil(ends[-1] / largest))
    firsts = np.flatnonzero(np.diff(starts // even, prepend=-1)).tolist()
    for first, stop in zip(firsts, [*firsts[1:], len(order)], strict=True):
        start, end = int(starts[first]), int(ends[stop - 1])
        first_ns, last_ns = received[order[[first, stop - 1]]].tolist()
        within = {channel_id: _between(index[channel_id], start, end) for channel_id in index}
        present = {channel_id: entries for channel_id, entries in within.items() if len(entries)}
        yield McapChunk(body[start:end], first_ns, last_ns, present)


def _index(part: Part, places: TimeArray) -> NDArray[np.void]:
    """Where the messages of a part stand, in the order in which they do."""
    entries = np.empty(len(places), INDEX_ENTRY)
    entries["received"], entries["offset"] = part.chunk.received_ns, places
    return entries if np.all(places[1:] > places[:-1]) else np.sort(entries, order="offset")


def _between(entries: NDArray[np.void], start: int, end: int) -> NDArray[np.void]:
    """The entries from `start` to before `end`, counted from there."""
    first, last = np.searchsorted(entries["offset"], np.array([start, end], np.uint64))
    within = entries[first:last].copy()
    within["offset"] -= np.uint64(start)
    return within


@dataclass(frozen=True, eq=False)
class _Messages:
    """Message records of one channel, one after the other."""

    data: Bytes
    sizes: TimeArray  # (n,)


def _messages(part: Part) -> _Messages:
    chunk, n = part.chunk, len(part.chunk)
    fixed = schema_for(chunk.fields).dtype
    rows = np.empty(n, MESSAGE_HEAD if fixed is None else MESSAGE_HEAD.descr + fixed.descr)
    rows["opcode"], rows["channel"] = Opcode.MESSAGE, part.channel_id
    rows["sequence"] = np.arange(part.first_sequence, part.first_sequence + n)
    rows["received"], rows["measured"] = chunk.received_ns, chunk.measured_ns
    if fixed is None:
        return _ragged(rows, encode_messages(chunk))
    rows["length"] = rows.dtype.itemsize - RECORD_HEAD.size
    fill_rows(rows, chunk)
    return _Messages(rows.view(np.uint8), np.full(n, rows.dtype.itemsize))


def _ragged(heads: NDArray[np.void], messages: Sequence[bytes]) -> _Messages:
    sizes = np.array([MESSAGE_HEAD.itemsize + len(data) for data in messages], np.int64)
    heads["length"] = sizes - RECORD_HEAD.size
    data = b"".join(head.tobytes() + data for head, data in zip(heads, messages, strict=True))
    return _Messages(np.frombuffer(data, np.uint8), sizes)


def _place(body: Bytes, places: TimeArray, messages: _Messages) -> None:
    """Copy messages to where they belong; those of one size all at once."""
    data, sizes = messages.data, messages.sizes
    if np.all(sizes == sizes[0]):
        size = int(sizes[0])
        _anywhere(body, size)[places] = data.view(f"V{size}")
        return
    starts = np.cumsum(sizes) - sizes
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        _anywhere(body, size)[places[alike]] = _anywhere(data, size)[starts[alike]]


def _anywhere(data: Bytes, size: int) -> NDArray[np.void]:
    """The pieces of that size in some bytes, from every byte on: to be gathered or scattered."""
    return np.ndarray((len(data) - size + 1,), f"V{size}", data, 0, (1,))
