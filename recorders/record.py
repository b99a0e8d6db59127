"""The loop that writes a source of samples to a log, safe against crashes and Ctrl-C."""

import os
import re
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import chain
from pathlib import Path

from shiplog.errors import ShiplogError
from shiplog.files import is_device, write_error
from shiplog.mcap.writer import LogWriter
from shiplog.types import Channel, Event

from .source import Recordable, Source

_PART = ".part"  # appended to the name of a file that grows


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
    dropped
        The number of packets of live streams that came faster than they could be recorded.
    """

    samples: int
    channels: int
    interrupted: bool
    files: tuple[Path, ...]
    dropped: int = 0


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
    overwrites: bool = True,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> Recording:
    """Write everything that a source yields to a log: samples, raw packets and events.

    While recording, the log grows beside its final name with ``.part`` appended, readable up to the
    last chunk even if the process is killed. Ctrl-C ends the recording and keeps the log. If the
    source fails or the disk is full, what was received until then stays in the ``.part`` file, and
    the error names it; an older file at `path` is not changed. However the recording ends, the
    metadata of the source that have changed since its beginning are written then.

    Parameters
    ----------
    source
        Where the samples come from.
    path
        The log to write; ``.mcap`` by convention. A device such as ``/dev/stdout`` is written
        directly.
    rotation
        When to go on in a new file. The files are then named ``trial.001.mcap`` and so on.
    overwrites
        Whether the complete recording replaces an older log of its name.
    on_chunk
        Called after each chunk with the number of samples written so far.

    Raises
    ------
    ShiplogError
        The file cannot be written, an unfinished recording or a log that is not to be replaced lies
        there, or the source failed.
    """
    _require_free(Path(path), rotation, overwrites=overwrites)
    chunks = source.chunks()
    try:
        return _record_files(source, chunks, Path(path), rotation, overwrites, on_chunk)
    finally:
        if isinstance(chunks, Generator):
            chunks.close()  # stops the readers of live streams


def growing_file(path: Path, rotation: Rotation | None) -> Path:
    """Return the file to which a running recording of a log is written at the moment."""
    if is_device(path):
        return path
    parts = [file for file in _files_of(path, rotation) if file.name.endswith(_PART)]
    return parts[-1] if parts else path


def _require_free(path: Path, rotation: Rotation | None, *, overwrites: bool) -> None:
    """Refuse an output in whose way older files lie, now and not when the recording gets there."""
    if is_device(path):
        return
    if path.is_dir() or not path.parent.is_dir():
        raise write_error(path, FileNotFoundError())
    for file in _files_of(path, rotation):
        if file.name.endswith(_PART):
            raise _unfinished(file)
        if not overwrites:
            raise ShiplogError(
                f"a log of this name exists, and a live recording replaces none; name another with "
                f"-o, or move it: {file}"
            )


def _files_of(path: Path, rotation: Rotation | None) -> list[Path]:
    """Return the files that a recording of a log has, or an older one has, by name."""
    number = "" if rotation is None else r"\.\d{3,}"
    name = re.compile(
        rf"{re.escape(path.stem)}{number}{re.escape(path.suffix)}({re.escape(_PART)})?"
    )
    return sorted(file for file in path.parent.iterdir() if name.fullmatch(file.name))


def _unfinished(part: Path) -> ShiplogError:
    return ShiplogError(
        "an unfinished recording lies there, or another recorder is writing it; rescue it with "
        f"`shiplog convert`, or delete it: {part}"
    )


def _record_files(
    source: Source,
    chunks: Iterator[tuple[Recordable, ...]],
    path: Path,
    rotation: Rotation | None,
    overwrites: bool,
    on_chunk: Callable[[int], None],
) -> Recording:
    """Write one file after the other until the source ends."""
    topics, files, samples = set[str](), list[Path](), 0
    while True:
        final = path if rotation is None else _numbered(path, len(files) + 1)
        part = _RecordedPart(source, final, rotation, overwrites=overwrites)
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

    def __init__(
        self, source: Source, final: Path, rotation: Rotation | None, *, overwrites: bool
    ) -> None:
        self._source, self._final = source, final
        self._rotation = rotation or Rotation()
        self._overwrites = overwrites
        self._part = final if is_device(final) else final.with_name(final.name + _PART)
        self._has_data = False  # samples or raw packets: a log of events alone is worth nothing
        self.topics = set[str]()
        self.samples = 0

    def write(
        self, chunks: Iterator[tuple[Recordable, ...]], on_chunk: Callable[[int], None]
    ) -> _End:
        """Write chunks until something ends the file, and give it its final name."""
        self._claim()
        writer = LogWriter(
            self._part, metadata=self._source.metadata, vessel_toml=self._source.vessel_toml
        )
        try:
            end = self._write_all(writer, chunks, on_chunk)
        except KeyboardInterrupt:  # the file is complete
            end = _End.INTERRUPTED
        except ShiplogError as error:
            if self._has_data:
                message = f"{error}; the {writer.samples} samples until then are in {self._part}"
                raise ShiplogError(message) from error
            if self._part != self._final:
                self._part.unlink(missing_ok=True)
            raise
        if self._part != self._final:
            self._rename()
        self.samples = writer.samples
        return end

    def _claim(self) -> None:
        """Create the file that grows, which no other recorder may be writing."""
        if self._part == self._final:
            return
        try:
            self._part.touch(exist_ok=False)
        except FileExistsError:
            raise _unfinished(self._part) from None
        except OSError as error:
            raise write_error(self._final, error) from error

    def _write_all(
        self,
        writer: LogWriter,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        """Write chunks, and whatever ends them, the metadata of the end."""
        try:
            return self._write_chunks(writer, chunks, on_chunk)
        finally:
            with _write_errors(), _uninterrupted(), writer:
                # those that have changed, such as counts of rejected packets
                writer.update_metadata(self._source.metadata)

    def _write_chunks(
        self,
        writer: LogWriter,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        opened = time.monotonic()
        for chunk in chunks:
            self._has_data |= any(len(item) for item in chunk if not isinstance(item, Event))
            with _write_errors(), _uninterrupted():
                writer.write(*chunk)
                writer.flush()
                size = self._part.stat().st_size  # fails, too, where the file was deleted
            self.topics.update(item.topic for item in chunk if isinstance(item, Channel))
            on_chunk(writer.samples)
            if self._rotation.is_due(time.monotonic() - opened, size):
                return _End.ROTATED
        return _End.SOURCE

    def _rename(self) -> None:
        """Give the complete file its final name."""
        if self._final.exists() and not self._overwrites:
            raise ShiplogError(
                f"a file of the log's name has appeared; the recording is complete in {self._part}"
            )
        try:
            self._part.replace(self._final)
        except OSError as error:
            raise write_error(self._final, error) from error


@contextmanager
def _write_errors() -> Iterator[None]:
    """Make an error of the system, such as that of a full disk, one for the user."""
    try:
        yield
    except BrokenPipeError:  # the reader of a pipe has closed it
        raise
    except OSError as error:
        raise ShiplogError(f"cannot write: {error.strerror or error}") from error


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C to the end of the block: a write that it interrupts would damage the file."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    previous = signal.signal(signal.SIGINT, lambda number, _frame: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
        if pressed:
            signal.raise_signal(signal.SIGINT)
