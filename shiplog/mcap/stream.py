"""A log too long to be held whole, which is gone through chunk by chunk."""

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO

from mcap import records

from shiplog.types import Channel, TrialLog

from .decode import Contents
from .reader import described, open_mcap, read, trial_log
from .scan import scan
from .summary import ChunkPlace, read_summary

HELD_SAMPLES = 16_000_000  # a log of more is not held: they would take 400 MB, their filter more
CHUNK_SAMPLES = 1 << 20


@dataclass(eq=False, repr=False)
class LogFile:
    """A log in its file. Each call of `chunks` is one pass over it, in bounded memory.

    What it says of itself is complete, and what `read` would say, after the first pass.
    """

    path: Path
    known: TrialLog  # its channels in their order, without samples, and what is known of the file
    schemas: Mapping[int, records.Schema]
    channel_records: Mapping[int, records.Channel]

    def __repr__(self) -> str:
        """What it is, not all that it holds."""
        return f"LogFile({self.path}), to be gone through by its chunks"

    @property
    def name(self) -> str:
        """The file's name."""
        return self.known.name

    @property
    def metadata(self) -> Mapping[str, str]:
        """What the file says of the trial."""
        return self.known.metadata

    @property
    def vessel_toml(self) -> str | None:
        """The vessel attached to it."""
        return self.known.vessel_toml

    @property
    def warnings(self) -> tuple[str, ...]:
        """What reading it met, as far as it was read."""
        return self.known.warnings

    @property
    def data_lost(self) -> bool:
        """Whether a part of the file could not be read, as far as it was."""
        return self.known.data_lost

    def select_sources(self, sources: Mapping[str, str]) -> "LogFile":
        """The same log with one source only for each name given, the one given.

        Raises `LogError` where there is no such channel.
        """
        return replace(self, known=self.known.select_sources(sources))

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """The samples in the order of the file, about `CHUNK_SAMPLES` at a time.

        Each chunk has every channel, though some may have no samples in it; those of a channel,
        one chunk after the other, are what `read` gives.

        Raises `LogError` as `read` does.
        """
        contents = Contents(dict(self.schemas), dict(self.channel_records), keeps_orphans=False)
        with open_mcap(self.path) as stream:
            for _ in scan(stream, contents):
                if contents.held >= CHUNK_SAMPLES:
                    yield self._chosen(trial_log(self.path, contents))
        rest = trial_log(self.path, contents)
        yield self._chosen(rest)
        self.known = replace(rest, channels=self.known.channels)

    def _chosen(self, chunk: TrialLog) -> tuple[Channel, ...]:
        """A chunk's channels, in the order of those asked for."""
        found = {channel.key: channel for channel in chunk}
        return tuple(found.get(channel.key, channel) for channel in self.known)


def open_log(path: str | os.PathLike[str]) -> TrialLog | LogFile:
    """A log, whole if memory holds it easily, else in its file, to be gone through in chunks.

    A file that has no trustworthy summary is gone through once to learn what is in it. One whose
    messages are not in the order of reception from chunk to chunk is read whole.

    Raises `LogError` as `read` does.
    """
    path = Path(path)
    with open_mcap(path) as stream:
        summary = read_summary(stream)
        if summary is None:
            return _learned(path, stream)
        if summary.statistics.message_count <= HELD_SAMPLES:
            return read(path)
        chunks = summary.chunk_places()
        if chunks is None:
            return _learned(path, stream)
    if not _are_in_order(chunks):
        return read(path)
    contents = described(summary)
    contents.finished = True
    contents.metadata, contents.vessel_toml = dict(summary.metadata), summary.vessel_toml
    return _log_file(path, contents)


def _log_file(path: Path, contents: Contents) -> LogFile:
    return LogFile(path, trial_log(path, contents), contents.schemas, contents.channels)


def _are_in_order(chunks: Iterable[ChunkPlace]) -> bool:
    latest = 0
    for chunk in chunks:
        if chunk.channel_ids and not latest <= chunk.first_ns <= chunk.last_ns:
            return False
        latest = max(latest, chunk.last_ns)
    return True


def _learned(path: Path, stream: IO[bytes]) -> TrialLog | LogFile:
    """The log by going through its file, holding its samples only while they are few."""
    contents = Contents()
    for _ in scan(stream, contents):
        if contents.taken + sum(contents.orphaned.values()) > HELD_SAMPLES:
            contents.drain()
            contents.orphans.clear()
            contents.keeps_orphans = False
    if contents.keeps_orphans:
        return trial_log(path, contents)
    return _log_file(path, contents) if contents.in_order else read(path)
