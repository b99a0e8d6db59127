"""Recovery of a damaged or unfinished MCAP file, of shiplog or of another program."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from shiplog.errors import LogError
from shiplog.files import atomic_write

from .contents import McapContents
from .damage import Damage, is_any_lost
from .decode import MALFORMED
from .mcap_file import McapFile, open_mcap
from .record_walk import Record
from .recovery_writer import RecoveryWriter, messages_by_topic
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
    part_warnings, is_part_missing
        What is missing between the parts of a log that has several files, or differs, and whether
        a part is missing.
    """

    messages: dict[str, int]
    lost_messages: dict[str, int] | None
    attachments: int
    metadata_records: int
    damage: tuple[Damage, ...]
    is_finished: bool
    is_cut: bool
    part_warnings: tuple[str, ...] = ()
    is_part_missing: bool = False

    @property
    def is_lost(self) -> bool:
        """Whether something of the file is lost."""
        return self.is_cut or self.is_part_missing or is_any_lost(self.damage)


def recover(path: str | os.PathLike[str], output: str | os.PathLike[str]) -> Recovery:
    """Write all that is intact in a file to another one.

    Messages of all topics are kept as they are, in their order in the file, with the attachments
    and metadata records of all programs. The file is read twice, in bounded memory. The parts of a
    log become one file.

    Parameters
    ----------
    path
        The MCAP file, or what names the parts of a log. It may be cut off, damaged or whole.
    output
        The file to write, another one; it appears when it is complete.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.
    ShiplogError
        The output cannot be written.
    """
    damage: list[Damage] = []
    stated: dict[str, int] | None = {}
    is_cut = False
    with open_mcap(Path(path)) as file, atomic_write(output) as target:
        parts = file.check.parts
        is_missing = parts is not None and parts.is_missing
        writer: RecoveryWriter | None = None
        for each in _files(file):
            contents, profile = _described(each)
            writer = writer or RecoveryWriter(target, profile, is_divided=parts is not None)
            writer.begin_file(contents, each.stream)
            for record in _intact_records(each, McapContents(selected=frozenset())):
                writer.add(record)
            writer.end_file()
            name = each.path.name if parts else ""
            damage += [replace(damaged, file=name) for damaged in contents.damage]
            stated = _with_stated_messages(stated, each.check.summary)
            is_cut |= contents.truncated
        if writer is None:
            raise LogError(f"there is nothing in its parts; record it again: {path}")
        writer.finish()
    messages = writer.messages_by_topic()
    return Recovery(
        messages,
        None if is_missing else _lost_messages(stated, messages),
        writer.attachments,
        writer.metadata_records,
        tuple(damage),
        file.check.is_finished,
        is_cut,
        parts.warnings if parts else (),
        is_missing,
    )


def _files(file: McapFile) -> Iterator[McapFile]:
    """Yield a file, or the parts of a log one after the other."""
    if file.check.parts is None:
        yield file
        return
    for part in file.check.parts.parts:
        with open_mcap(part.path, part.check) as each:
            yield each


def _described(file: McapFile) -> tuple[McapContents, str]:
    """Return what a scan finds in a file, without its messages, and the profile of the file."""
    contents = McapContents(selected=frozenset())
    profile = ""
    for record in _intact_records(file, contents):
        if record.opcode == Opcode.HEADER and not profile:
            profile = _profile(record.content)
    return contents, profile


def _intact_records(file: McapFile, contents: McapContents) -> Iterator[Record]:
    """Yield the intact records of a file; messages in runs, with the opcode of an MCAP chunk."""
    contents.keep_records, contents.keep_undescribed = True, False
    contents.long_attachments = {}
    for _ in scan(file, contents):
        kept, contents.records = contents.records, []
        contents.event_messages.clear()
        yield from kept


def _with_stated_messages(
    stated: dict[str, int] | None, summary: McapSummary | None
) -> dict[str, int] | None:
    """Add the numbers of messages that a file states; None where one does not state them."""
    if stated is None or summary is None or not summary.is_verified:
        return None
    further = messages_by_topic(summary.statistics.channel_message_counts, summary.channels)
    return {topic: stated.get(topic, 0) + further.get(topic, 0) for topic in stated | further}


def _lost_messages(
    stated: dict[str, int] | None, messages: dict[str, int]
) -> dict[str, int] | None:
    """Return how many messages of each topic are missing, given the numbers stated."""
    if stated is None:
        return None
    lost = {topic: count - messages.get(topic, 0) for topic, count in stated.items()}
    return {topic: count for topic, count in lost.items() if count}


def _profile(header: bytes) -> str:
    """Return the profile of a file; empty where it cannot be read."""
    try:
        return str(records.Header.read(ReadDataStream(BytesIO(header))).profile)
    except MALFORMED:
        return ""
