"""Reading of an MCAP file, or a part of it, into memory."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from shiplog.errors import UsageError
from shiplog.types import TimeArray, TrialLog

from .clock_repair import MixedTimes, refuse_mixed_times
from .contents import McapContents
from .damage import Damage
from .decode import is_events, schema_of
from .file_check import FileCheck
from .index_times import received_in_order
from .mcap_file import LogPaths, McapFile, checked_files, open_mcap
from .scan import scan
from .schema import EVENTS_TOPIC
from .summary import McapChunkLocation, McapSummary, are_in_order
from .times_check import TimesCheck
from .trial_log import build_trial_log, channels_by_id, merge_by_topic


@dataclass(frozen=True)
class ReceptionSpan:
    """A span of times of reception.

    Attributes
    ----------
    start_ns, end_ns
        From `start_ns` on and before `end_ns`; None is no bound.
    """

    start_ns: int | None = None
    end_ns: int | None = None

    def rows(self, received_ns: TimeArray) -> tuple[int, int]:
        """Return the first row and the row after the last within the span.

        Parameters
        ----------
        received_ns
            (n,) times of reception, in order.

        Examples
        --------
        >>> ReceptionSpan(2, 4).rows(np.array([1, 2, 3, 4]))
        (1, 3)
        """
        start = 0 if self.start_ns is None else np.searchsorted(received_ns, self.start_ns)
        end = len(received_ns) if self.end_ns is None else np.searchsorted(received_ns, self.end_ns)
        return int(start), max(int(start), int(end))

    def excludes(self, first_ns: int, last_ns: int) -> bool:
        """Whether no time from `first_ns` to `last_ns` is within the span.

        False if these are in the wrong order: a damaged index proves nothing.
        """
        return first_ns <= last_ns and (
            (self.start_ns is not None and last_ns < self.start_ns)
            or (self.end_ns is not None and first_ns >= self.end_ns)
        )


def read(
    path: LogPaths,
    *,
    channels: Iterable[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> TrialLog:
    """Read a recorded trial, or a part of it, into memory.

    An unfinished file is read as far as it goes, damaged MCAP chunks and topics of other programs
    are skipped; the `warnings` of the log report this.

    Parameters
    ----------
    path
        The MCAP file; what names the parts of a log (the name of a divided recording, a folder, or
        a pattern such as ``day/*.mcap``); or the paths of the parts.
    channels
        The channels to read, each named as in ``log[name]``. By default all. The log has them
        in the order of the file, and all events.
    start_ns, end_ns
        Read the samples received from `start_ns` on and before `end_ns`, ns since 1970-01-01 UTC.

    Returns
    -------
    log
        The trial. Where a part was requested, MCAP chunks that contain nothing of it according to
        the summary of the file are not decompressed. Their message indexes, and the MCAP chunks at
        the ends of the file, show whether times need a repair; such a file, one whose data section
        has a wrong checksum, and one without a summary, is read whole, so that the part is the one
        that the whole log has.

    Raises
    ------
    LogError
        The file is missing, is not MCAP, has an unknown unit, lacks a requested channel, or a clock
        was set in the part so that its times are not known.
    UsageError
        `end_ns` is before `start_ns`.

    Examples
    --------
    >>> log = read("sample_data/zigzag_20_20.mcap", channels=["rudder", "yaw_rate"])
    >>> [channel.name for channel in log]
    ['yaw_rate', 'rudder']
    """
    name, check = checked_files(path)
    log, mixed = read_unchecked(name, check, channels=channels, start_ns=start_ns, end_ns=end_ns)
    refuse_mixed_times(mixed, log.span_ns)
    return log


def read_unchecked(
    path: Path,
    check: FileCheck | None = None,
    *,
    channels: Iterable[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> tuple[TrialLog, list[MixedTimes]]:
    """Read a trial as `read` does, for a caller that uses a part of it.

    Parameters
    ----------
    path
        The file, or what names the parts of a log.
    check
        What its checksums showed before, so that they are not computed again.
    channels, start_ns, end_ns
        What to read.

    Returns
    -------
    log, mixed
        The trial, and the spans for which the caller has to call `refuse_mixed_times`.
    """
    if isinstance(channels, str):
        channels = (channels,)
    keys = None if channels is None else tuple(channels)
    if start_ns is not None and end_ns is not None and end_ns < start_ns:
        raise UsageError(
            f"end_ns {end_ns} is before start_ns {start_ns}; exchange them to read from: {path}"
        )
    span = ReceptionSpan(start_ns, end_ns)
    is_part = keys is not None or span != ReceptionSpan()
    with open_mcap(path, check) as file:
        contents = _contents_of_part(file, keys, span) if is_part else None
        if contents is None:
            contents = McapContents()
            for _ in scan(file, contents):
                pass
            contents.damage = [each for each in contents.damage if _concerns(each, keys, span)]
    log = build_trial_log(path, contents)
    return _selected_part(log, keys, span) if is_part else log, contents.mixed_times


def _contents_of_part(
    file: McapFile, keys: Collection[str] | None, span: ReceptionSpan
) -> McapContents | None:
    """Return the contents of the MCAP chunks that have something of a part.

    None where the file is damaged, where the summary does not describe them, or where some times
    may need a repair: what is repaired depends on the whole file.
    """
    summary = file.check.summary
    if summary is None or file.check.is_intact is False:
        return None
    contents = contents_described_by(summary)
    contents.selected = _selected_ids(file.path, contents, keys)
    mcap_chunks = summary.mcap_chunk_locations() or ()
    skip = _mcap_chunks_to_skip(mcap_chunks, contents.selected, span)
    if not skip or not received_in_order(file.stream, summary):
        return None
    check = TimesCheck()
    offsets = frozenset(mcap_chunk.offset for mcap_chunk in mcap_chunks)
    first, last = min(offsets), max(offsets)
    _check_skipped(file, summary, offsets - ({first} & skip), check)
    for _ in scan(file, contents, skip):
        pass
    check.add(contents.blocks, contents)
    _check_skipped(file, summary, offsets - ({last} & skip - {first}), check)
    return None if check.need_repair() or check.any_stood_still() else contents


def _check_skipped(
    file: McapFile, summary: McapSummary, skip: frozenset[int], check: TimesCheck
) -> None:
    """Check the times in the MCAP chunks at the ends of a file that are not in the part."""
    contents = contents_described_by(summary)
    for _ in scan(file, contents, skip):
        pass
    check.add(contents.blocks, contents)


def contents_described_by(summary: McapSummary) -> McapContents:
    """Return empty contents that have all schemas and channels of the file from the start."""
    return McapContents(dict(summary.schemas), dict(summary.channels), keep_undescribed=False)


def _selected_ids(
    path: Path, contents: McapContents, keys: Collection[str] | None
) -> frozenset[int]:
    """Return the ids of the described channels that are requested, and of the events."""
    by_id = channels_by_id(path, contents)
    if keys is None:
        return frozenset(by_id) | event_ids(contents)
    log = TrialLog(path.name, merge_by_topic(by_id.values()))
    selected = {log[key].key for key in keys}
    ids = {id_ for id_, channel in by_id.items() if channel.key in selected}
    return frozenset(ids | event_ids(contents))


def event_ids(contents: McapContents) -> frozenset[int]:
    """Return the ids of the described channels of events."""
    return frozenset(
        id_ for id_, channel in contents.channels.items() if is_events(channel, contents.schemas)
    )


def sample_count(summary: McapSummary) -> int:
    """Return the number of samples in a file according to its summary."""
    counts = summary.statistics.channel_message_counts
    return sum(
        counts.get(id_, 0)
        for id_, channel in summary.channels.items()
        if schema_of(channel, summary.schemas) is not None
    )


def _mcap_chunks_to_skip(
    mcap_chunks: Collection[McapChunkLocation], ids: frozenset[int], span: ReceptionSpan
) -> frozenset[int]:
    """Return the offsets of the MCAP chunks that have nothing of these channels and this span.

    None is skipped where they are not in the order of reception: a clock may have been set back.
    """
    if not are_in_order(mcap_chunks):
        return frozenset()
    return frozenset(
        mcap_chunk.offset
        for mcap_chunk in mcap_chunks
        if ids.isdisjoint(mcap_chunk.channel_ids)
        or span.excludes(mcap_chunk.first_ns, mcap_chunk.last_ns)
    )


def _concerns(damage: Damage, keys: Collection[str] | None, span: ReceptionSpan) -> bool:
    """Whether damage may have taken samples or events of a part."""
    if damage.span_ns is not None and span.excludes(*damage.span_ns):
        return False
    if keys is None or not damage.topics or EVENTS_TOPIC in damage.topics:
        return True
    lost = [f"{topic.strip('/')}/" for topic in damage.topics]
    return any(topic.startswith(f"{key.strip('/')}/") for topic in lost for key in keys)


def _selected_part(log: TrialLog, keys: Collection[str] | None, span: ReceptionSpan) -> TrialLog:
    """Return the requested channels and span of a log."""
    selected = log.channels if keys is None else [log[key] for key in keys]
    parts = [
        channel.part(*span.rows(channel.received_ns))
        for channel in log
        if any(channel is one for one in selected)
    ]
    events = tuple(event for event in log.events if not span.excludes(event.time_ns, event.time_ns))
    return replace(log, channels=tuple(parts), events=events)
