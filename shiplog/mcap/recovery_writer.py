"""Writer of a recovered file: the intact records of a damaged one, or of all parts of a log."""

from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import IO, TypeVar

import numpy as np
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from .contents import McapContents
from .encode import McapChunk
from .locate import complete_records, gather
from .metadata_record import read_metadata, with_checksum
from .record_structure import read_attachment
from .record_walk import Record
from .record_writer import McapRecordWriter
from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD
from .schema import METADATA_NAME, PART_KEY

_ID_END = RECORD_HEAD.size + 2  # of the channel id of a message
R = TypeVar("R", records.Schema, records.Channel)


class RecoveryWriter:
    """A file of intact records, of one source file after the other.

    The ids of schemas and channels are kept. Those of a further file that mean something else there
    are replaced by free ones; a channel that is described as one of the files before is that one.

    Parameters
    ----------
    path, profile
        The file to write, and the profile of its header.
    is_divided
        Whether the source files are the parts of a log: what makes them parts is not kept, and a
        record that each of them has, such as the vessel file, is kept once.

    Attributes
    ----------
    attachments, metadata_records
        The numbers of those written.
    """

    def __init__(self, path: Path, profile: str, *, is_divided: bool) -> None:
        self.attachments, self.metadata_records = 0, 0
        self._file = McapRecordWriter(path, profile)
        self._is_divided = is_divided
        self._written: set[bytes] = set()  # digests of the records that are kept once
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, records.Channel] = {}
        self._counts: dict[int, int] = {}

    def begin_file(self, contents: McapContents, source: IO[bytes]) -> None:
        """Go on with the records of a further file.

        Parameters
        ----------
        contents
            Has the schemas and channels of the file, wherever in it they are described, and its
            long attachments.
        source
            The file.
        """
        self._contents, self._source = contents, source
        self._long_attachments = contents.long_attachments or {}
        self._schema_ids: dict[int, int] = {0: 0}  # those written, by those in the file
        self._channel_ids: dict[int, int] = {}

    def add(self, record: Record) -> None:
        """Append an intact record of the file."""
        if record.opcode == Opcode.CHUNK:
            self._add_messages(record.content)
        elif record.opcode == Opcode.ATTACHMENT and not record.content:
            self._file.copy_attachment(self._source, self._long_attachments[record.start])
            self.attachments += 1
        elif record.opcode == Opcode.ATTACHMENT and self._is_new(record.content):
            self._file.write_attachment(read_attachment(record.content))
            self.attachments += 1
        elif record.opcode == Opcode.METADATA:
            self._add_metadata(record.content)

    def end_file(self) -> None:
        """Describe the channels of the file that have no messages too."""
        for channel_id in sorted(self._contents.channels):
            self._channel_id(channel_id)

    def finish(self) -> None:
        """Complete the file that is written."""
        with closing(self._file):
            self._file.finish(self._counts)

    def messages_by_topic(self) -> dict[str, int]:
        """Return the number of messages written, by topic."""
        return messages_by_topic(self._counts, self._channels)

    def _is_new(self, content: bytes) -> bool:
        """Whether a record of a part is not one that another part had."""
        digest = sha256(content).digest()
        is_new = not (self._is_divided and digest in self._written)
        self._written.add(digest)
        return is_new

    def _add_metadata(self, content: bytes) -> None:
        metadata = records.Metadata.read(ReadDataStream(BytesIO(content)))
        entries = metadata.metadata
        if self._is_divided and metadata.name == METADATA_NAME:
            own = read_metadata(content).metadata
            entries = {key: text for key, text in own.items() if not key.startswith(PART_KEY)}
            if not entries:
                return
            entries = with_checksum(entries)
        if self._is_new(repr((metadata.name, entries)).encode()):
            self._file.write_metadata(metadata.name, entries)
            self.metadata_records += 1

    def _add_messages(self, data: bytes) -> None:
        """Append the messages in the data of an MCAP chunk whose channels are described."""
        offsets: dict[int, list[int]] = {}
        parts, size = [], 0
        for opcode, start, end in complete_records(data, 0):
            if opcode != Opcode.MESSAGE or end - start < MESSAGE_HEAD.itemsize:
                continue
            head_end = start + RECORD_HEAD.size
            channel_id = self._channel_id(
                int.from_bytes(data[head_end : start + _ID_END], "little")
            )
            if channel_id is not None:
                offsets.setdefault(channel_id, []).append(size)
                parts += [data[start:head_end], channel_id.to_bytes(2, "little")]
                parts.append(data[start + _ID_END : end])
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

    def _channel_id(self, own_id: int) -> int | None:
        """Return the id of a channel of the file, described where new; None if nothing does."""
        if own_id in self._channel_ids:
            return self._channel_ids[own_id]
        channel = self._contents.channels.get(own_id)
        if channel is None or channel.schema_id not in {0, *self._contents.schemas}:
            return None
        joined = replace(channel, schema_id=self._schema_id(channel.schema_id))
        id_, is_new = _joined_id(joined, self._channels, self._channel_ids)
        if is_new:
            self._file.add_channel(self._channels[id_])
            self._counts[id_] = 0
        return id_

    def _schema_id(self, own_id: int) -> int:
        if own_id not in self._schema_ids:
            schema = self._contents.schemas[own_id]
            id_, is_new = _joined_id(schema, self._schemas, self._schema_ids)
            if is_new:
                self._file.add_schema(self._schemas[id_])
        return self._schema_ids[own_id]


def messages_by_topic(
    counts: Mapping[int, int], channels: Mapping[int, records.Channel]
) -> dict[str, int]:
    """Return numbers of messages by topic, given those by channel id."""
    by_topic: dict[str, int] = {}
    for channel_id, count in counts.items():
        topic = channels[channel_id].topic
        by_topic[topic] = by_topic.get(topic, 0) + count
    return by_topic


def _joined_id(record: R, written: dict[int, R], ids: dict[int, int]) -> tuple[int, bool]:
    """Return the id under which a description of a file is written, and whether it is new.

    Parameters
    ----------
    record
        The description, with its id in the file.
    written
        Those written, by their ids; receives a new one.
    ids
        The ids of the file's descriptions so far, by those in the file; receives this one.
    """
    taken = set(ids.values())
    known = (
        id_
        for id_, each in written.items()
        if id_ not in taken and replace(each, id=record.id) == record
    )
    id_ = next(known, None)
    is_new = id_ is None
    if id_ is None:
        id_ = record.id if record.id not in written else max(written) + 1
        written[id_] = replace(record, id=id_)
    ids[record.id] = id_
    return id_, is_new
