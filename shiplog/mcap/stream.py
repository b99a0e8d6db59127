"""Logs longer than memory: a file whose samples come chunk by chunk."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mcap import records

from shiplog.types import Channel, Event, TrialLog
from shiplog.types.inputs_in_force import inputs_in_force, with_inputs_in_force
from shiplog.types.time_cut import TimeCut, empty_cut_error, resolve_cut

from .clock_repair import MixedTimes, refuse_mixed_times
from .contents import McapContents
from .file_check import FileCheck
from .mcap_file import LogPaths, McapFile, checked_files, open_mcap
from .reader import contents_described_by, read_unchecked, sample_count
from .scan import scan
from .summary import are_in_order
from .times_check import TimesCheck
from .trial_log import build_trial_log

MAX_SAMPLES_IN_MEMORY = 16_000_000  # 400 MB of samples; a filter of them needs more
FILE_CHUNK_SAMPLES = 1 << 20  # of all channels together, about


@dataclass(eq=False, repr=False)
class LogFile:
    """A log in its file; each call of `chunks` is one pass over it in bounded memory.

    It is made by `open_log`. After the first pass, `metadata`, `warnings` and `data_lost` are those
    of `read`; before, they are what the summary of the file shows.

    Attributes
    ----------
    path
        The MCAP file.
    outline
        The log without its samples: its channels in their order, and what is known of the file.
    schemas, channel_records
        The schema and channel records, by id.
    check
        What the checksums of the file show.
    cuts
        The cuts of `between`, one after the other.
    """

    path: Path
    outline: TrialLog
    schemas: Mapping[int, records.Schema]
    channel_records: Mapping[int, records.Channel]
    check: FileCheck
    cuts: tuple[TimeCut, ...] = ()

    def __repr__(self) -> str:
        return f"LogFile({self.path}), read by its chunks"

    @property
    def name(self) -> str:
        """The name of the file, with the bounds where a part was cut from it."""
        name = self.outline.name
        for cut in self.cuts:
            name = cut.name_of_part(name)
        return name

    @property
    def metadata(self) -> Mapping[str, str]:
        """Text about the trial, by key."""
        name, metadata = self.outline.name, dict(self.outline.metadata)
        for cut in self.cuts:
            metadata["cut"] = cut.text(name)
            name = cut.name_of_part(name)
        return metadata

    @property
    def vessel_toml(self) -> str | None:
        """The attached vessel file."""
        return self.outline.vessel_toml

    @property
    def warnings(self) -> tuple[str, ...]:
        """Problems met in reading the file so far."""
        return self.outline.warnings

    @property
    def data_lost(self) -> bool:
        """Whether a part of the file could not be read so far."""
        return self.outline.data_lost

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened during the trial, in the order of time."""
        events = self.outline.events
        for cut in self.cuts:
            events = cut.events_within(events)
        return events

    def select_sources(self, sources: Mapping[str, str]) -> "LogFile":
        """Return the log with a single source for each of the names given; see `Log`."""
        return replace(self, outline=self.outline.select_sources(sources))

    def between(
        self, start: float | str | None = None, end: float | str | None = None
    ) -> "LogFile":
        """Return the part of the log between two times; see `TrialLog.between`.

        One pass over the file computes its span, another one the inputs in force at the start.
        """
        if start is None and end is None:
            return self
        spans = [
            (int(channel.measured_ns.min()), int(channel.measured_ns.max()))
            for chunk in self.chunks()
            for channel in chunk
            if len(channel)
        ] or [(0, 0)]
        span_ns = min(first for first, _ in spans), max(last for _, last in spans)
        cut = resolve_cut(start, end, span_ns, self.name)
        part = replace(self, cuts=(*self.cuts, cut))
        if not any(len(channel) for chunk in part.chunks() for channel in chunk):
            raise empty_cut_error(start, end, span_ns, self.name)
        if cut.start_ns == span_ns[0]:
            return part
        samples = inputs_in_force(self.chunks(), cut.start_ns)
        return replace(self, cuts=(*self.cuts, replace(cut, in_force=samples)))

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in the order of the file, about a million at a time.

        Yields
        ------
        channels
            All channels of the log; some may be empty in a chunk. The parts of a channel, one after
            the other, are the channel that `read` returns.

        Raises
        ------
        LogError
            Reading fails, as in `read`.
        """
        contents = McapContents(
            dict(self.schemas), dict(self.channel_records), keep_undescribed=False
        )
        is_first = True
        with open_mcap(self.path, self.check) as file:
            for _ in scan(file, contents):
                if contents.pending_samples >= FILE_CHUNK_SAMPLES:
                    chunk = build_trial_log(self.path, contents)
                    yield self._selected(chunk, is_first=is_first)
                    is_first = False
        rest = build_trial_log(self.path, contents)
        yield self._selected(rest, is_first=is_first)
        self.outline = replace(rest, channels=self.outline.channels)

    def _selected(self, chunk: TrialLog, *, is_first: bool) -> tuple[Channel, ...]:
        """Return the channels of a chunk in the order of the log, within its cuts."""
        by_key = {channel.key: channel for channel in chunk}
        channels = tuple(by_key.get(channel.key, channel) for channel in self.outline)
        for cut in self.cuts:
            channels = tuple(map(cut.apply, channels))
            if is_first:
                channels = with_inputs_in_force(channels, cut.in_force)
        return channels


def open_log(
    path: LogPaths,
    start: float | str | None = None,
    end: float | str | None = None,
) -> TrialLog | LogFile:
    """Open a log: in memory if it has at most 16 million samples, else in its file.

    A file without a valid summary is scanned once to learn its content. A file in which some times
    may need a repair, since they run back, step, were not set or are impossible, is read into
    memory whatever its size: what is repaired depends on all of them. One pass over a longer file
    checks this.

    Parameters
    ----------
    path
        The MCAP file, what names the parts of a log, or their paths, as in `read`.
    start, end
        The part to open, as `TrialLog.between` takes them; by default all.

    Returns
    -------
    log
        A `TrialLog`, or a `LogFile` that has only `chunks`; both are a `shiplog.Log`.

    Raises
    ------
    LogError
        Reading fails, as in `read`.
    UsageError
        A bound cannot be read, or no sample is between them.

    Examples
    --------
    >>> log = open_log("sample_data/zigzag_20_20.mcap")
    >>> sum(len(channel) for chunk in log.chunks() for channel in chunk) > 20_000
    True
    """
    log, mixed = _open_unchecked(*checked_files(path))
    part = log.between(start, end)
    if isinstance(part, TrialLog):
        refuse_mixed_times(mixed, part.span_ns)
    return part


def _open_unchecked(
    path: Path, check: FileCheck | None
) -> tuple[TrialLog | LogFile, list[MixedTimes]]:
    """Open a log whose parts may have mixed times, of which a `LogFile` learns by its chunks."""
    with open_mcap(path, check) as file:
        check, summary = file.check, file.check.summary
        mcap_chunks = None if summary is None else summary.mcap_chunk_locations()
        if summary is None or check.is_intact is False:
            return _open_by_scan(file)
        if sample_count(summary) <= MAX_SAMPLES_IN_MEMORY:
            return read_unchecked(path, check)
        if mcap_chunks is None:
            return _open_by_scan(file)
    if not are_in_order(mcap_chunks):
        return read_unchecked(path, check)
    contents = contents_described_by(summary)
    contents.finished = True
    contents.metadata, contents.vessel_toml = dict(summary.metadata), summary.vessel_toml
    return _log_file(path, check, contents)


def _log_file(
    path: Path, check: FileCheck, contents: McapContents
) -> tuple[TrialLog | LogFile, list[MixedTimes]]:
    """Return a log in its file, or in memory where some times may need a repair."""
    contents.event_messages = []  # of an earlier pass
    if _need_repair(path, check, contents):
        return read_unchecked(path, check)
    outline = build_trial_log(path, contents)
    return LogFile(path, outline, contents.schemas, contents.channels, check), []


def _need_repair(path: Path, check: FileCheck, described: McapContents) -> bool:
    """Whether some times of a file may have to be changed or dropped, by one pass over it.

    Where none has, the contents that describe the file receive its events and its last time.
    """
    contents = McapContents(
        dict(described.schemas), dict(described.channels), keep_undescribed=False
    )
    times = TimesCheck()
    with open_mcap(path, check) as file:
        for _ in scan(file, contents):
            times.add(contents.drain(), contents)
            if times.need_repair():
                return True
    if times.any_stood_still():
        return True
    described.event_messages = contents.event_messages
    described.last_sample_ns = times.last_received_ns
    return False


def _open_by_scan(file: McapFile) -> tuple[TrialLog | LogFile, list[MixedTimes]]:
    """Open a log by a scan of its file that keeps the samples only while they are few."""
    contents = McapContents()
    for _ in scan(file, contents):
        samples = contents.total_samples + sum(contents.undescribed_counts.values())
        if samples > MAX_SAMPLES_IN_MEMORY:
            contents.drain()
            contents.undescribed.clear()
            contents.undescribed_bytes, contents.keep_undescribed = 0, False
    if contents.keep_undescribed:
        return build_trial_log(file.path, contents), contents.mixed_times
    if contents.in_order:
        return _log_file(file.path, file.check, contents)
    return read_unchecked(file.path, file.check)
