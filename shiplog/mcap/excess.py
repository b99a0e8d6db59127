"""Comparison of what the scan of a file has collected with the limits for a file of its size."""

from collections.abc import Iterator
from pathlib import Path

from shiplog.errors import LogError

from .contents import McapContents
from .limits import (
    MAX_CHANNELS,
    MAX_DESCRIPTIONS_BYTES,
    MAX_HELD_BYTES,
    MAX_HELD_PER_BYTE,
    MAX_MAP_ENTRIES,
    MAX_MESSAGES_PER_BYTE,
    MAX_OTHER_RECORDS,
)


def refuse_excess(path: Path, size: int, contents: McapContents) -> None:
    """Refuse a file of which more was collected than a log of its size has.

    Parameters
    ----------
    path
        The file.
    size
        Its size, bytes.
    contents
        What was collected so far.

    Raises
    ------
    LogError
        The file describes too much, or its MCAP chunks unpack to too much.
    """
    for cause in _excesses(size, contents):
        raise LogError(f"{cause}; if it is a log, divide it by another program: {path}")


def _excesses(size: int, contents: McapContents) -> Iterator[str]:
    for kind, number in (("channels", len(contents.channels)), ("schemas", len(contents.schemas))):
        if number > MAX_CHANNELS:
            yield f"it describes {number} {kind}, more than any log (at most {MAX_CHANNELS})"
    if contents.description_bytes > MAX_DESCRIPTIONS_BYTES:
        yield "its schemas and channels have longer descriptions than those of any log"
    if len(contents.metadata) > MAX_MAP_ENTRIES:
        yield f"it has more than {MAX_MAP_ENTRIES} keys of metadata, more than any log"
    if len(contents.foreign_records) > MAX_OTHER_RECORDS:
        yield f"it has more than {MAX_OTHER_RECORDS} attachments and metadata records"
    held = contents.held_bytes + contents.undescribed_bytes
    if (
        contents.messages > MAX_MESSAGES_PER_BYTE * size
        or held > MAX_HELD_BYTES + MAX_HELD_PER_BYTE * size
    ):
        yield "its MCAP chunks unpack to more than a log of its size has"
