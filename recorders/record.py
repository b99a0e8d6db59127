"""The loop that writes a source of samples to a log, safe against crashes and Ctrl-C."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import chain
from pathlib import Path

from shiplog.errors import ShiplogError
from shiplog.files import is_device, write_error
from shiplog.mcap.writer import LogWriter
from shiplog.types import Channel

from .source import Recordable, Source


@dataclass(frozen=True)
class Recording:
    """What a recording holds.

    Attributes
    ----------
    samples
        The number of samples written, of all channels.
    channels
        The number of channels written.
    interrupted
        Whether Ctrl-C ended the recording.
    files
        The logs written, in the order of time.
    """

    samples: int
    channels: int
    interrupted: bool
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Rotation:
    """When a recording goes on in a new file.

    Attributes
    ----------
    minutes
        The longest time of a file, min; None for any.
    megabytes
        The size at which a file is ended, MB; None for any.
    """

    minutes: float | None = None
    megabytes: float | None = None

    def is_due(self, opened_secs: float, size_bytes: int) -> bool:
        """Whether a file that was opened some time ago and has some size is to be ended."""
        return (self.minutes is not None and opened_secs >= 60 * self.minutes) or (
            self.megabytes is not None and size_bytes >= 1e6 * self.megabytes
        )


def record(
    source: Source,
    path: str | os.PathLike[str],
    *,
    rotation: Rotation | None = None,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> Recording:
    """Write everything that a source yields to a log: samples, raw packets and events.

    While recording, the log grows beside its final name with ``.part`` appended, readable up to the
    last chunk even if the process is killed. Ctrl-C ends the recording and keeps the log. If the
    source fails, what was received until then stays in the ``.part`` file, complete, and the error
    names it; an older file at `path` is not changed. However the recording ends, the metadata of
    the source that have changed since its beginning are written then.

    Parameters
    ----------
    source
        Where the samples come from.
    path
        The log to write; ``.mcap`` by convention. A device such as ``/dev/stdout`` is written
        directly.
    rotation
        When to go on in a new file. The files are then named ``trial.001.mcap`` and so on.
    on_chunk
        Called after each chunk with the number of samples written so far.

    Raises
    ------
    ShiplogError
        The file cannot be written, an unfinished recording lies beside it, or the source failed.
    """
    chunks, topics, files, samples = source.chunks(), set[str](), list[Path](), 0
    while True:
        final = Path(path) if rotation is None else _numbered(Path(path), len(files) + 1)
        part = _RecordedPart(source, final, rotation)
        end = part.write(chunks, partial(_report, on_chunk, samples))
        topics |= part.topics
        samples += part.samples
        files.append(final)
        following = next(chunks, None) if end is _End.ROTATED else None
        if following is None:
            return Recording(samples, len(topics), end is _End.INTERRUPTED, tuple(files))
        chunks = chain([following], chunks)


def _report(on_chunk: Callable[[int], None], before: int, samples: int) -> None:
    """Report the samples of a file and of the files before it."""
    on_chunk(before + samples)


class _End(Enum):
    """What ended a file."""

    SOURCE = "source"
    INTERRUPTED = "interrupted"
    ROTATED = "rotated"


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}.{number:03}{path.suffix}")


class _RecordedPart:
    """One file of a recording."""

    def __init__(self, source: Source, final: Path, rotation: Rotation | None) -> None:
        self._source, self._final = source, final
        self._rotation = rotation or Rotation()
        self._part = final if is_device(final) else final.with_name(final.name + ".part")
        self.topics = set[str]()
        self.samples = 0

    def write(
        self, chunks: Iterator[tuple[Recordable, ...]], on_chunk: Callable[[int], None]
    ) -> _End:
        """Write chunks until something ends the file, and give it its final name."""
        final, part = self._final, self._part
        if final.is_dir():
            raise write_error(final, IsADirectoryError())
        if part != final and part.exists():
            raise ShiplogError(
                "an unfinished recording lies there; rescue it with `shiplog convert`, "
                f"or delete it: {part}"
            )
        writer = LogWriter(
            part, metadata=self._source.metadata, vessel_toml=self._source.vessel_toml
        )
        try:
            with writer, _metadata_at_end(self._source, writer):
                end = self._write_chunks(writer, chunks, on_chunk)
        except KeyboardInterrupt:
            end = _End.INTERRUPTED
        except ShiplogError as error:
            if writer.messages:
                message = f"{error}; the {writer.samples} samples until then are in {part}"
                raise ShiplogError(message) from error
            part.unlink(missing_ok=True)
            raise
        if part != final:
            part.replace(final)
        self.samples = writer.samples
        return end

    def _write_chunks(
        self,
        writer: LogWriter,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        opened = time.monotonic()
        for chunk in chunks:
            writer.write(*chunk)
            writer.flush()
            self.topics.update(item.topic for item in chunk if isinstance(item, Channel))
            on_chunk(writer.samples)
            if self._rotation.is_due(time.monotonic() - opened, self._part.stat().st_size):
                return _End.ROTATED
        return _End.SOURCE


@contextmanager
def _metadata_at_end(source: Source, writer: LogWriter) -> Iterator[None]:
    """Write the metadata that have changed, such as counts of rejected packets, at the end."""
    try:
        yield
    finally:
        writer.update_metadata(source.metadata)
