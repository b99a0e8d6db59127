"""Samples to the chunks of an MCAP file, by columns: the counterpart of `scan`.

A chunk's bytes are laid out in numpy: the messages of all channels, interleaved in the order in
which they were received, each a head and its payload. No loop runs over messages of fixed size.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from .mcap_layout import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .schema import encode, rows_of, schema_for
from .types import Channel, TimeArray

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Part:
    """Samples of one channel on their way into chunks."""

    channel_id: int
    first_sequence: int
    slab: Channel


@dataclass(frozen=True, eq=False)
class Chunk:
    """The messages of a chunk, and where each channel's stand in it."""

    body: Bytes
    first_ns: int
    last_ns: int
    index: dict[int, NDArray[np.void]]  # of INDEX_ENTRY


def chunks(parts: Sequence[Part], largest: int) -> Iterator[Chunk]:
    """Lay parts out in even chunks of at most about `largest` bytes, in the order of reception."""
    records = [_records(part) for part in parts]
    of_part = np.repeat(np.arange(len(parts)), [len(r) for r in records])
    of_row = np.concatenate([np.arange(len(r)) for r in records])
    received = np.concatenate([part.slab.received_ns for part in parts])
    sizes = np.concatenate([r.sizes for r in records])
    order = np.argsort(received, kind="stable")
    ends = np.cumsum(sizes[order])
    even = ceil(ends[-1] / ceil(ends[-1] / largest))
    cuts = np.flatnonzero(np.diff((ends - 1) // even)) + 1
    for chosen in np.split(order, cuts):
        if len(chosen):
            yield _chunk(parts, records, of_part[chosen], of_row[chosen], received[chosen])


@dataclass(frozen=True, eq=False)
class _Records:
    """Message records of one channel, one after the other."""

    data: Bytes
    starts: TimeArray  # (n,) of each in `data`
    sizes: TimeArray  # (n,)

    def __len__(self) -> int:
        return len(self.sizes)


def _records(part: Part) -> _Records:
    slab, n = part.slab, len(part.slab)
    heads = np.empty(n, MESSAGE_HEAD)
    heads["opcode"], heads["channel"] = Opcode.MESSAGE, part.channel_id
    heads["sequence"] = part.first_sequence + np.arange(n)
    heads["received"], heads["measured"] = slab.received_ns, slab.measured_ns
    fixed = schema_for(slab.fields).dtype
    if fixed is None:
        return _ragged(heads, encode(slab))
    size = MESSAGE_HEAD.itemsize + fixed.itemsize
    heads["length"] = size - RECORD_HEAD.size
    data = np.hstack((_as_bytes(heads), _as_bytes(rows_of(slab)))).ravel()
    return _Records(data, np.arange(n) * size, np.full(n, size))


def _ragged(heads: NDArray[np.void], messages: Sequence[bytes]) -> _Records:
    sizes = np.array([MESSAGE_HEAD.itemsize + len(data) for data in messages], np.int64)
    heads["length"] = sizes - RECORD_HEAD.size
    data = b"".join(head.tobytes() + data for head, data in zip(heads, messages, strict=True))
    return _Records(np.frombuffer(data, np.uint8), np.cumsum(sizes) - sizes, sizes)


def _as_bytes(rows: NDArray[np.void]) -> Bytes:
    return rows.view(np.uint8).reshape(len(rows), rows.dtype.itemsize)


def _chunk(
    parts: Sequence[Part],
    records: Sequence[_Records],
    of_part: NDArray[np.intp],
    of_row: NDArray[np.intp],
    received: TimeArray,
) -> Chunk:
    sizes = np.empty(len(of_part), np.int64)
    here = {number: np.flatnonzero(of_part == number) for number in np.unique(of_part).tolist()}
    for number, at in here.items():
        sizes[at] = records[number].sizes[of_row[at]]
    offsets = np.cumsum(sizes) - sizes
    body = np.empty(int(sizes.sum()), np.uint8)
    index: dict[int, NDArray[np.void]] = {}
    for number, at in here.items():
        _place(body, offsets[at], records[number], of_row[at])
        entries = np.empty(len(at), INDEX_ENTRY)
        entries["received"], entries["offset"] = received[at], offsets[at]
        channel_id = parts[number].channel_id
        both = [index[channel_id], entries] if channel_id in index else [entries]
        index[channel_id] = np.sort(np.concatenate(both), order="offset")
    return Chunk(body, int(received[0]), int(received[-1]), index)


def _place(body: Bytes, offsets: TimeArray, records: _Records, rows: NDArray[np.intp]) -> None:
    """Copy records to where they belong; those of one size all at once."""
    sizes, starts = records.sizes[rows], records.starts[rows]
    for size in np.unique(sizes).tolist():
        alike = sizes == size
        within = np.arange(size)
        body[offsets[alike][:, None] + within] = records.data[starts[alike][:, None] + within]
