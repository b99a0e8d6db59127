"""Parts of a log: which belong together, their order, and which of them are missing."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode

from shiplog.errors import LogError

from .damage import span_text
from .decode import MALFORMED
from .file_check import FileCheck, check_file
from .metadata_record import read_metadata
from .record_walk import RecordWalk
from .records import MCAP_CHUNK_HEAD
from .schema import METADATA_NAME, PART_INDEX, PART_KEY, PART_NEXT, PART_NUMBER, PART_SET

MAX_GAP_NS = 10 * 10**9  # between the parts of a recorder that does not number them


@dataclass(frozen=True)
class LogPart:
    """One file of a log.

    Attributes
    ----------
    path
        The file.
    check
        What its checksums show.
    metadata
        The entries of its metadata that describe it as a part.
    span_ns
        Its first and last time of reception, ns; None where it has no messages, the last one is
        the first one where it is not known.
    topics
        Its topics; None where they are not known.
    """

    path: Path
    check: FileCheck
    metadata: dict[str, str] = field(default_factory=dict)
    span_ns: tuple[int, int] | None = None
    topics: frozenset[str] | None = None

    @property
    def number(self) -> int:
        """The number of the part in its recording."""
        text = self.metadata.get(PART_NUMBER, "")
        return int(text) if text.isdecimal() else 0


@dataclass(frozen=True)
class LogParts:
    """The files of a log in their order.

    Attributes
    ----------
    parts
        The files.
    warnings
        What is missing between them, or differs.
    is_missing
        Whether a part is missing.
    """

    parts: tuple[LogPart, ...]
    warnings: tuple[str, ...] = ()
    is_missing: bool = False


def read_part(path: Path, stream: IO[bytes]) -> LogPart:
    """Read what shows to which log a file belongs, and where.

    Parameters
    ----------
    path
        The file.
    stream
        The file, opened in binary mode.
    """
    check = check_file(stream)
    if check.summary is None:
        return _read_beginning(path, stream, check)
    statistics = check.summary.statistics
    span = statistics.message_start_time, statistics.message_end_time
    return LogPart(
        path,
        check,
        _of_part(check.summary.metadata),
        span if statistics.message_count else None,
        frozenset(channel.topic for channel in check.summary.channels.values()),
    )


def join_parts(parts: Sequence[LogPart], path: Path) -> LogParts:
    """Return the files of a log in their order.

    Parameters
    ----------
    parts
        The files, at least two.
    path
        What names them together, for messages.

    Raises
    ------
    LogError
        They are parts of different recordings, or one is there twice.
    """
    sets = {part.metadata.get(PART_SET, ""): part for part in parts}
    if len(sets) > 1:
        names = " and ".join(part.path.name for part in list(sets.values())[:2])
        raise LogError(f"{names} are of different recordings; name the parts of one: {path}")
    return _unnumbered(parts, path) if "" in sets else _numbered(parts, path)


def _numbered(parts: Sequence[LogPart], path: Path) -> LogParts:
    """Join the parts of a divided recording, whose metadata have an index of them."""
    by_number: dict[int, LogPart] = {}
    for part in parts:
        other = by_number.setdefault(part.number, part)
        if other is not part:
            names = f"{other.path.name} and {part.path.name}"
            raise LogError(f"{names} are both part {part.number}; remove one of them: {path}")
    ordered = [by_number[number] for number in sorted(by_number)]
    index = {
        key.removeprefix(PART_INDEX): text
        for part in ordered
        for key, text in part.metadata.items()
        if key.startswith(PART_INDEX)
    }
    warnings = []
    for number in range(1, ordered[-1].number):
        if number not in by_number:
            content = index.get(str(number), "content unknown")
            warnings.append(f"part {number} of the recording is missing ({content}): {path}")
    if name := ordered[-1].metadata.get(PART_NEXT):
        warnings.append(f"the recording goes on in {name}, which is missing: {path}")
    return LogParts(tuple(ordered), tuple(warnings), is_missing=bool(warnings))


def _unnumbered(parts: Sequence[LogPart], path: Path) -> LogParts:
    """Join the files of a recorder that begins a new one from time to time, by their times."""
    timed = [(part.span_ns, part) for part in parts if part.span_ns is not None]
    timed.sort(key=lambda each: (each[0], each[1].path.name))
    warnings = []
    for (before_ns, before), (after_ns, after) in pairwise(timed):
        names = f"{before.path.name} and {after.path.name}"
        gap_ns = after_ns[0] - before_ns[1]
        if gap_ns < 0:
            raise LogError(
                f"{names} are not the parts of one recording: both have messages received "
                f"{span_text((after_ns[0], min(before_ns[1], after_ns[1])))}; name one file: {path}"
            )
        if gap_ns > MAX_GAP_NS and before.check.is_finished:
            warnings.append(f"{gap_ns * 1e-9:.0f} s are missing between {names}; add their file")
        warnings += _different_topics(before, after)
    return LogParts(tuple(part for _, part in timed) or tuple(parts), tuple(warnings))


def _different_topics(before: LogPart, after: LogPart) -> list[str]:
    if before.topics is None or after.topics is None or before.topics == after.topics:
        return []
    names = f"{before.path.name} and {after.path.name}"
    if not before.topics & after.topics:
        raise LogError(f"not the parts of one recording, they have no common topic: {names}")
    some = sorted(before.topics ^ after.topics)
    return [f"{names} do not have the same topics; only one has {', '.join(some[:4])}"]


def _read_beginning(path: Path, stream: IO[bytes], check: FileCheck) -> LogPart:
    """Read the metadata and the first time of a file without a summary, as of a crash."""
    metadata: dict[str, str] = {}
    for record in RecordWalk(stream):
        if record.opcode == Opcode.METADATA:
            try:
                entries = read_metadata(record.content)
            except MALFORMED:
                continue
            metadata |= entries.metadata if entries.name == METADATA_NAME else {}
        elif record.opcode == Opcode.CHUNK:
            return LogPart(path, check, _of_part(metadata), _first_time(record.content))
    return LogPart(path, check, _of_part(metadata))


def _first_time(mcap_chunk: bytes) -> tuple[int, int]:
    first, *_ = MCAP_CHUNK_HEAD.unpack_from(mcap_chunk)
    return first, first


def _of_part(metadata: dict[str, str]) -> dict[str, str]:
    return {key: text for key, text in metadata.items() if key.startswith(PART_KEY)}
