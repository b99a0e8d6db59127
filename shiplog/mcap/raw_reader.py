"""Raw packets of a log, read from its file chunk by chunk."""

import os
from collections.abc import Iterator
from pathlib import Path

from mcap import records

from shiplog.errors import LogError
from shiplog.types import RawPackets

from .contents import KeptMessages, McapContents
from .decode import is_raw
from .mcap_file import open_mcap
from .scan import scan
from .schema import RAW, RAW_NAME
from .serialised import packet_of


def read_raw(path: str | os.PathLike[str]) -> Iterator[RawPackets]:
    """Read the raw packets that a recorder kept beside the samples, in the order of the file.

    An unfinished file is read up to its last complete packet; damaged parts are skipped, as
    `shiplog.read` reports.

    Parameters
    ----------
    path
        The MCAP file.

    Yields
    ------
    packets
        The packets of one source in one part of the file, each with its time of reception as it was
        recorded. A file without raw packets yields nothing.

    Raises
    ------
    LogError
        The file is missing, is not MCAP, or has a message that is no raw packet.
    """
    for group in raw_groups(path):
        yield from group


def raw_groups(path: str | os.PathLike[str]) -> Iterator[list[RawPackets]]:
    """Read raw packets as `read_raw` does, those of all sources in one MCAP chunk together."""
    path = Path(path)
    contents = McapContents(selected=frozenset(), keeps=is_raw)
    with open_mcap(path) as file:
        for _ in scan(file, contents):
            contents.event_messages.clear()
            kept = contents.take_kept()
            if kept:
                yield [
                    _packets(path, contents.channels[channel_id], block)
                    for channel_id, blocks in kept.items()
                    for block in blocks
                ]


def raw_source(record: records.Channel) -> str:
    """Return the source of a topic of raw packets."""
    return record.metadata.get("source", record.topic.removeprefix(f"/{RAW_NAME}/"))


def _packets(path: Path, record: records.Channel, block: KeptMessages) -> RawPackets:
    try:
        data = tuple(map(packet_of, block.messages))
    except ValueError as error:
        raise LogError(
            f"{record.topic} has messages that are not {RAW.name}; "
            f"correct the program that wrote them: {path}"
        ) from error
    return RawPackets(raw_source(record), record.metadata.get("format", ""), block.received, data)
