"""What a copy of a log keeps as it is: raw packets, topics of other programs, their records."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from mcap import records
from mcap.opcode import Opcode

from shiplog.types import TimeArray
from shiplog.types.time_cut import TimeCut

from .contents import KeptMessages, McapContents
from .decode import is_foreign, is_raw
from .mcap_file import open_mcap
from .metadata_record import read_metadata
from .record_structure import read_attachment
from .record_walk import Record
from .scan import scan
from .schema import METADATA_NAME, VESSEL_ATTACHMENT
from .serialised import SerialisedMessages


@dataclass(frozen=True, eq=False)
class ForeignMessages:
    """Messages of one topic that are written as they are.

    Attributes
    ----------
    channel, schema
        The records that describe them.
    messages
        The messages, with their times.
    """

    channel: records.Channel
    schema: records.Schema | None
    messages: SerialisedMessages

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.messages)

    @property
    def received_ns(self) -> TimeArray:
        """(n,) times of reception, ns since 1970-01-01 UTC."""
        return self.messages.received_ns


@dataclass(frozen=True, eq=False)
class KeptGroup:
    """What is kept of one part of a file.

    Attributes
    ----------
    messages
        The messages of each topic in it, none of them empty.
    attachments, metadata
        The attachments and metadata records of other programs.
    """

    messages: tuple[ForeignMessages, ...] = ()
    attachments: tuple[records.Attachment, ...] = ()
    metadata: tuple[records.Metadata, ...] = ()


def kept_groups(
    path: Path, cut: TimeCut | None = None, *, with_topics: bool = True
) -> Iterator[KeptGroup]:
    """Read what a copy of a log keeps as it is, in the order of the file.

    Parameters
    ----------
    path
        The MCAP file.
    cut
        The part whose messages are kept, by their times of reception; None for all.
    with_topics
        Whether to keep the topics of other programs, and not only the raw packets.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.
    """
    contents = McapContents(
        selected=frozenset(), keeps=_is_kept if with_topics else is_raw, keep_records=True
    )
    with open_mcap(path) as file:
        for _ in scan(file, contents):
            contents.event_messages.clear()
            kept, found = contents.take_kept(), contents.records
            contents.records = []
            messages = (
                _foreign_messages(contents, channel_id, block, cut)
                for channel_id, blocks in kept.items()
                for block in blocks
            )
            group = KeptGroup(
                tuple(each for each in messages if len(each)),
                tuple(_attachments(found)),
                tuple(_metadata(found)),
            )
            if group.messages or group.attachments or group.metadata:
                yield group


def _attachments(found: Iterable[Record]) -> Iterator[records.Attachment]:
    """Yield the attachments of other programs."""
    for record in found:
        if record.opcode == Opcode.ATTACHMENT:
            attachment = read_attachment(record.content)
            if attachment.name != VESSEL_ATTACHMENT:
                yield attachment


def _metadata(found: Iterable[Record]) -> Iterator[records.Metadata]:
    """Yield the metadata records of other programs."""
    for record in found:
        if record.opcode == Opcode.METADATA:
            metadata = read_metadata(record.content)
            if metadata.name != METADATA_NAME:
                yield metadata


def _foreign_messages(
    contents: McapContents, channel_id: int, block: KeptMessages, cut: TimeCut | None
) -> ForeignMessages:
    channel = contents.channels[channel_id]
    received, measured, messages = block.received, block.measured, block.messages
    if cut is not None:
        rows = cut.rows_within(received)
        received, measured = received[rows], measured[rows]
        messages = [messages[row] for row in rows]
    schema = contents.schemas.get(channel.schema_id)
    return ForeignMessages(channel, schema, SerialisedMessages(received, measured, messages))


def _is_kept(channel: records.Channel, schemas: Mapping[int, records.Schema]) -> bool:
    return is_raw(channel, schemas) or is_foreign(channel, schemas)
