"""Location of each channel's messages in the data of an MCAP chunk, without a loop.

If all messages have one size, their positions follow from it. Otherwise the message indexes give
them, provided that they account for every byte. Where neither holds, the records have to be walked
one by one (`shiplog.mcap.decode`).
"""

from collections.abc import Iterator

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from shiplog.types import TimeArray

from .records import INDEX_ENTRY, INDEX_HEAD, MESSAGE_HEAD, RECORD_HEAD

Offsets = NDArray[np.intp]


def complete_records(data: bytes, at: int) -> Iterator[tuple[int, int, int]]:
    """Iterate over the complete records from an offset on.

    Yields
    ------
    opcode, start, end
        The opcode, the offset of the record and the offset after it.
    """
    while at + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        end = at + RECORD_HEAD.size + length
        if opcode == 0 or end > len(data):
            return
        yield opcode, at, end
        at = end


def locate_by_size(data: bytes, start: int) -> dict[int, Offsets]:
    """Locate messages that all have the same size.

    Their record lengths are verified, so that the result is that of a walk.

    Parameters
    ----------
    data
        The data of an MCAP chunk.
    start
        The offset of the first message.

    Returns
    -------
    offsets
        The offsets of each channel's messages (n,), by channel id. Empty if the sizes differ, or if
        there are other records among the messages.
    """
    if len(data) - start < MESSAGE_HEAD.itemsize:
        return {}
    size = RECORD_HEAD.size + RECORD_HEAD.unpack_from(data, start)[1]
    count, rest = divmod(len(data) - start, size)
    if rest or size < MESSAGE_HEAD.itemsize:
        return {}
    heads = np.ndarray((count,), MESSAGE_HEAD, data, start, (size,))
    if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(
        heads["length"] != size - RECORD_HEAD.size
    ):
        return {}
    channels = heads["channel"]
    offsets = start + size * np.argsort(channels, kind="stable")
    counts = np.bincount(channels)
    present = np.flatnonzero(counts)
    parts = np.split(offsets, np.cumsum(counts[present])[:-1])
    return dict(zip(present.tolist(), parts, strict=True))


def locate_by_index(data: bytes, start: int, indexes: list[bytes]) -> dict[int, Offsets]:
    """Locate messages by the message indexes of an MCAP chunk.

    No checksum protects the indexes, so they are verified against the data.

    Parameters
    ----------
    data
        The data of the MCAP chunk.
    start
        The offset of the first message.
    indexes
        The content of the message index records that follow the MCAP chunk.

    Returns
    -------
    offsets
        The offsets of each channel's messages (n,), by channel id. Empty if the indexes do not
        account for every byte from `start` on: they are damaged, or there are other records among
        the messages.
    """
    located: dict[int, Offsets] = {}
    covered = start
    for index in indexes:
        if len(index) == INDEX_HEAD.size:
            continue  # a channel without messages
        if len(index) % INDEX_ENTRY.itemsize != INDEX_HEAD.size:
            return {}
        channel_id = int.from_bytes(index[:2], "little")
        offsets = np.frombuffer(index, INDEX_ENTRY, offset=INDEX_HEAD.size)["offset"]
        offsets = offsets.astype(np.intp)
        in_order = offsets[0] >= start and bool(np.all(offsets[1:] > offsets[:-1]))
        too_far = offsets[-1] > len(data) - MESSAGE_HEAD.itemsize
        if channel_id in located or not in_order or too_far:
            return {}
        heads = gather(data, offsets, MESSAGE_HEAD)
        if np.any(heads["opcode"] != Opcode.MESSAGE) or np.any(heads["channel"] != channel_id):
            return {}
        located[channel_id] = offsets
        covered += int(record_sizes(heads).sum())
    return located if covered == len(data) else {}


def gather(data: bytes, offsets: Offsets, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return the structures (n,) at offsets (n,) in some bytes, whatever their alignment.

    Examples
    --------
    >>> gather(b"-ab-cd", np.array([1, 4]), np.dtype([("text", "S2")]))["text"].tolist()
    [b'ab', b'cd']
    """
    opaque = np.dtype((np.void, dtype.itemsize))  # each copied in one piece, not field by field
    everywhere = np.ndarray((len(data) - dtype.itemsize + 1,), opaque, data, 0, (1,))
    rows: NDArray[np.void] = everywhere[offsets].view(dtype)
    return rows


def record_sizes(heads: NDArray[np.void]) -> TimeArray:
    """Return the size in bytes of each message record, its head included, (n,)."""
    return heads["length"].astype(np.int64) + RECORD_HEAD.size
