"""Recovery of a damaged or unfinished MCAP file, of shiplog or of another program."""

import os
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from shiplog.files import atomic_write

from .contents import McapContents
from .damage import Damage, is_any_lost
from .decode import MALFORMED
from .encode import McapChunk
from .locate import complete_records, gather
from .mcap_file import McapFile, open_mcap
from .record_structure import read_attachment
from .record_walk import Record
from .record_writer import McapRecordWriter
from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .scan import scan
from .summary import McapSummary


@dataclass(frozen=True)
class Recovery:
    """What was recovered of a file, and what was not.

    Attributes
    ----------
    messages
        The number of messages recovered, by topic.
    lost_messages
        The number of messages lost, by topic; None if the file does not state how many it had.
    attachments, metadata_records
        The numbers of those recovered.
    damage
        The damaged parts of the file, in their order.
    is_finished
        Whether the file had its end.
    is_cut
        Whether it ends within a record.
    """

    messages: dict[str, int]
    lost_messages: dict[str, int] | None
    attachments: int
    metadata_records: int
    damage: tuple[Damage, ...]
    is_finished: bool
    is_cut: bool

    @property
    def is_lost(self) -> bool:
        """Whether something of the file is lost."""
        return self.is_cut or is_any_lost(self.damage)


def recover(path: str | os.PathLike[str], output: str | os.PathLike[str]) -> Recovery:
    """Write all that is intact in a file to another one.

    Messages of all topics are kept as they are, in their order in the file, with the attachments
    and metadata records of all programs. The file is read twice, in bounded memory.

    Parameters
    ----------
    path
        The MCAP file. It may be cut off, damaged or whole.
    output
        The file to write, another one; it appears when it is complete.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.
    ShiplogError
        The output cannot be written.
    """
    with open_mcap(Path(path)) as file:
        contents = McapContents(selected=frozenset())
        profile = ""
        for record in _intact_records(file, contents):
            if record.opcode == Opcode.HEADER and not profile:
                profile = _profile(record.content)
        with atomic_write(output) as part:
            writer = _RecoveryWriter(part, profile, contents, file.stream)
            for record in _intact_records(file, McapContents(selected=frozenset())):
                writer.add(record)
            writer.finish()
    messages = writer.messages_by_topic()
    return Recovery(
        messages,
        _lost_messages(file.check.summary, messages),
        writer.attachments,
        writer.metadata_records,
        tuple(contents.damage),
        contents.finished,
        contents.truncated,
    )


class _RecoveryWriter:
    """A file of intact records.

    Parameters
    ----------
    path, profile
        The file to write, and the profile of its header.
    contents
        Has the schemas and channels of the damaged file, wherever in it they were described, and
        its long attachments.
    source
        The damaged file.
    """

    def __init__(self, path: Path, profile: str, contents: McapContents, source: IO[bytes]) -> None:
        self.attachments, self.metadata_records = 0, 0
        self._file = McapRecordWriter(path, profile)
        self._contents, self._source = contents, source
        self._long_attachments = contents.long_attachments or {}
        self._schemas: set[int] = set()
        self._counts: dict[int, int] = {}

    def add(self, record: Record) -> None:
        """Append an intact record."""
        if record.opcode == Opcode.CHUNK:
            self._add_messages(record.content)
        elif record.opcode == Opcode.ATTACHMENT:
            if record.content:
                self._file.write_attachment(read_attachment(record.content))
            else:
                self._file.copy_attachment(self._source, self._long_attachments[record.start])
            self.attachments += 1
        elif record.opcode == Opcode.METADATA:
            metadata = records.Metadata.read(_stream(record.content))
            self._file.write_metadata(metadata.name, metadata.metadata)
            self.metadata_records += 1

    def finish(self) -> None:
        """Complete the file, with the channels that have no messages too."""
        with closing(self._file):
            for channel_id in sorted(self._contents.channels):
                self._describe(channel_id)
            self._file.finish(self._counts)

    def messages_by_topic(self) -> dict[str, int]:
        """Return the number of messages written, by topic."""
        return _by_topic(self._counts, self._contents.channels)

    def _add_messages(self, data: bytes) -> None:
        """Append the messages in the data of an MCAP chunk whose channels are described."""
        offsets: dict[int, list[int]] = {}
        parts, size = [], 0
        for opcode, start, end in complete_records(data, 0):
            if opcode != Opcode.MESSAGE or end - start < MESSAGE_HEAD.itemsize:
                continue
            channel_id = int.from_bytes(data[start + RECORD_HEAD.size :][:2], "little")
            if self._describe(channel_id):
                offsets.setdefault(channel_id, []).append(size)
                parts.append(data[start:end])
                size += end - start
        if not parts:
            return
        messages, index = b"".join(parts), {}
        for channel_id, places in offsets.items():
            entries = np.empty(len(places), INDEX_ENTRY)
            entries["offset"] = places
            entries["received"] = gather(messages, np.array(places), MESSAGE_HEAD)["received"]
            index[channel_id] = entries
            self._counts[channel_id] += len(places)
        first = min(int(entries["received"].min()) for entries in index.values())
        last = max(int(entries["received"].max()) for entries in index.values())
        chunk = McapChunk(np.frombuffer(messages, np.uint8), first, last, index)
        self._file.write_mcap_chunk(chunk)

    def _describe(self, channel_id: int) -> bool:
        """Describe a channel in the file when it is new there; False if nothing describes it."""
        if channel_id in self._counts:
            return True
        channel = self._contents.channels.get(channel_id)
        if channel is None or channel.schema_id not in {0, *self._contents.schemas}:
            return False
        if channel.schema_id and channel.schema_id not in self._schemas:
            self._file.add_schema(self._contents.schemas[channel.schema_id])
            self._schemas.add(channel.schema_id)
        self._file.add_channel(channel)
        self._counts[channel_id] = 0
        return True


def _intact_records(file: McapFile, contents: McapContents) -> Iterator[Record]:
    """Yield the intact records of a file; messages in runs, with the opcode of an MCAP chunk."""
    contents.keep_records, contents.keep_undescribed = True, False
    contents.long_attachments = {}
    for _ in scan(file, contents):
        kept, contents.records = contents.records, []
        contents.event_messages.clear()
        yield from kept


def _lost_messages(summary: McapSummary | None, messages: dict[str, int]) -> dict[str, int] | None:
    """Return how many messages of each topic are missing, by the statistics of the file."""
    if summary is None or not summary.is_verified:
        return None
    stated = _by_topic(summary.statistics.channel_message_counts, summary.channels)
    lost = {topic: count - messages.get(topic, 0) for topic, count in stated.items()}
    return {topic: count for topic, count in lost.items() if count}


def _by_topic(counts: Mapping[int, int], channels: Mapping[int, records.Channel]) -> dict[str, int]:
    by_topic: dict[str, int] = {}
    for channel_id, count in counts.items():
        topic = channels[channel_id].topic
        by_topic[topic] = by_topic.get(topic, 0) + count
    return by_topic


def _profile(header: bytes) -> str:
    """Return the profile of a file; empty where it cannot be read."""
    try:
        return str(records.Header.read(_stream(header)).profile)
    except MALFORMED:
        return ""


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))
