"""Times of reception in the message indexes of a file, read without decompressing its data."""

from collections.abc import Iterator
from io import BytesIO
from typing import IO

import numpy as np
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from shiplog.types import is_sorted

from .decode import MALFORMED, schema_of
from .records import INDEX_ENTRY, INDEX_HEAD, RECORD_HEAD
from .summary import McapSummary


def received_in_order(stream: IO[bytes], summary: McapSummary) -> bool:
    """Whether the times of reception of each topic increase in the order of the file.

    Parameters
    ----------
    stream
        The file, opened in binary mode.
    summary
        Its summary; topics of other programs are not checked.

    Returns
    -------
    in_order
        False also where a message index is damaged or a time is before 1970.
    """
    topics = {
        id_: channel.topic
        for id_, channel in summary.channels.items()
        if schema_of(channel, summary.schemas) is not None
    }
    latest: dict[str, int] = {}
    try:
        for entries in _index_entries(stream, summary):
            by_topic: dict[str, list[np.ndarray]] = {}
            for id_, rows in entries.items():
                if id_ in topics and len(rows):
                    by_topic.setdefault(topics[id_], []).append(rows)
            for topic, parts in by_topic.items():
                rows = np.concatenate(parts)
                if not is_sorted(rows["offset"]):
                    rows = rows[np.argsort(rows["offset"], kind="stable")]
                times = rows["received"].astype(np.int64)
                if not latest.get(topic, 0) <= times[0] or not is_sorted(times):
                    return False
                latest[topic] = int(times[-1])
    except MALFORMED:
        return False
    return True


def _index_entries(stream: IO[bytes], summary: McapSummary) -> Iterator[dict[int, np.ndarray]]:
    """Yield the entries of each MCAP chunk's message indexes by channel id, in the file's order."""
    indexes = [
        records.ChunkIndex.read(ReadDataStream(BytesIO(content)))
        for content in summary.mcap_chunk_indexes
    ]
    for index in sorted(indexes, key=lambda index: index.chunk_start_offset):
        stream.seek(index.chunk_start_offset + index.chunk_length)
        data = stream.read(index.message_index_length)
        if len(data) < index.message_index_length:
            raise ValueError("the file ends within a message index")
        yield dict(_entries(data))


def _entries(data: bytes) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the channel id and the entries of each message index record."""
    at = 0
    while at < len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        id_, size = INDEX_HEAD.unpack_from(data, at + RECORD_HEAD.size)
        if opcode != Opcode.MESSAGE_INDEX or size != length - INDEX_HEAD.size:
            raise ValueError("not a message index")
        start = at + RECORD_HEAD.size + INDEX_HEAD.size
        yield id_, np.frombuffer(data, INDEX_ENTRY, size // INDEX_ENTRY.itemsize, start)
        at += RECORD_HEAD.size + length
