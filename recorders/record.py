"""The loop that writes a source of samples to a log, safe against crashes and signals."""

import os
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from uuid import uuid4

from shiplog.errors import ShiplogError
from shiplog.files import claimed_name, is_device, replace_durably, write_error
from shiplog.interrupts import deferred, handled_signals, interruptible, take_waiting
from shiplog.mcap.part_names import UNFINISHED, recorded_files
from shiplog.mcap.writer import LogWriter
from shiplog.types import Channel, Event

from .disk_sync import SYNC_SECS, DiskSync
from .part_series import PartSeries
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
        Whether a signal, such as that of Ctrl-C, ended the recording.
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
    sync_secs: float = SYNC_SECS,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> Recording:
    """Write everything that a source yields to a log: samples, raw packets and events.

    While recording, the log grows beside its final name with ``.part`` appended, readable up to the
    last chunk even if the process is killed, and up to the last synchronisation with the disk if
    the power fails. SIGINT, SIGTERM and SIGHUP end the recording between chunks and keep the log,
    also where Python alone would not handle them. If the source fails or the disk is full, what was
    received until then stays in the ``.part`` file, and the error names it; an older file at `path`
    is not changed. However the recording ends, the metadata of the source that have changed since
    its beginning are written then.

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
    sync_secs
        How often what was written is forced to the disk, s.
    on_chunk
        Called after each chunk with the number of samples written so far.

    Raises
    ------
    ShiplogError
        The file cannot be written, another process is writing it, an unfinished recording or a log
        that is not to be replaced lies there, or the source failed.
    """
    path = Path(path)
    with handled_signals(), deferred(), claimed_name(path):
        _require_free(path, rotation, overwrites=overwrites)
        chunks = source.chunks()
        files = _Files(path, rotation, sync_secs, overwrites=overwrites)
        try:
            return _record_files(source, chunks, files, on_chunk)
        finally:
            if isinstance(chunks, Generator):
                chunks.close()  # stops the readers of live streams


def growing_file(path: Path, rotation: Rotation | None) -> Path:
    """Return the file to which a running recording of a log is written at the moment."""
    if is_device(path):
        return path
    parts = [
        file
        for file in recorded_files(path, is_divided=rotation is not None)
        if file.name.endswith(UNFINISHED)
    ]
    return parts[-1] if parts else path


def _require_free(path: Path, rotation: Rotation | None, *, overwrites: bool) -> None:
    """Refuse an output in whose way older files lie, now and not when the recording gets there."""
    if is_device(path):
        return
    if path.is_dir() or not path.parent.is_dir():
        raise write_error(path, FileNotFoundError())
    for file in recorded_files(path, is_divided=rotation is not None):
        if file.name.endswith(UNFINISHED):
            raise _unfinished(file)
        if not overwrites:
            raise ShiplogError(
                f"a log of this name exists, and a live recording replaces none; name another with "
                f"-o, or move it: {file}"
            )


def _unfinished(part: Path) -> ShiplogError:
    return ShiplogError(
        "an unfinished recording lies there; rescue it with `shiplog convert`, or delete it: "
        f"{part}"
    )


@dataclass(frozen=True)
class _Files:
    """Where a recording is written, and how.

    Attributes
    ----------
    path
        The log.
    rotation
        When to go on in a new file; None for never.
    sync_secs
        How often the files are forced to the disk, s.
    overwrites
        Whether they replace older ones.
    """

    path: Path
    rotation: Rotation | None
    sync_secs: float
    overwrites: bool

    def final(self, number: int) -> Path:
        """Return the final name of a file, by its number from 1 on."""
        if self.rotation is None:
            return self.path
        return self.path.with_name(f"{self.path.stem}.{number:03}{self.path.suffix}")


def _record_files(
    source: Source,
    chunks: Iterator[tuple[Recordable, ...]],
    files: _Files,
    on_chunk: Callable[[int], None],
) -> Recording:
    """Write one file after the other until the source ends."""
    topics, finals, samples = set[str](), list[Path](), 0
    set_id, index = uuid4().hex, dict[str, str]()
    first: tuple[Recordable, ...] | None = None
    while True:
        final = files.final(len(finals) + 1)
        series = None if files.rotation is None else PartSeries(set_id, len(finals) + 1, index)
        part = _RecordedPart(source, final, files, series)
        end = part.write(first, chunks, partial(_report, on_chunk, samples))
        topics |= part.topics
        samples += part.samples
        finals.append(final)
        first = part.following
        if first is None:
            interrupted = take_waiting() or end is _End.INTERRUPTED
            return Recording(samples, len(topics), interrupted, tuple(finals))


def _next_chunk(chunks: Iterator[tuple[Recordable, ...]]) -> tuple[Recordable, ...] | None:
    """Return the next chunk of a source, None at its end; a signal is raised here."""
    with interruptible():
        return next(chunks, None)


def _report(on_chunk: Callable[[int], None], before: int, samples: int) -> None:
    """Report the samples of a file and of the files before it."""
    on_chunk(before + samples)


class _End(Enum):
    """What ended a file."""

    SOURCE = "source"
    INTERRUPTED = "interrupted"
    ROTATED = "rotated"


class _RecordedPart:
    """One file of a recording."""

    def __init__(
        self, source: Source, final: Path, files: _Files, series: PartSeries | None
    ) -> None:
        self._source, self._final, self._files = source, final, files
        self._rotation = files.rotation or Rotation()
        self._part = final if is_device(final) else final.with_name(final.name + UNFINISHED)
        self._has_data = False  # samples or raw packets: a log of events alone is worth nothing
        self._series = series
        self.topics = set[str]()
        self.samples = 0
        self.following: tuple[Recordable, ...] | None = None  # the chunk of the next part

    def write(
        self,
        first: tuple[Recordable, ...] | None,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        """Write chunks until something ends the file, and give it its final name.

        Parameters
        ----------
        first
            The chunk that is written before the others; None where they are all.
        chunks
            The chunks of the source.
        on_chunk
            Called after each with the number of samples in this file.

        Raises
        ------
        KeyboardInterrupt
            A signal came before there was anything to keep; no file is left.
        """
        self._create()
        own = self._series.beginning() if self._series else {}
        writer = LogWriter(
            self._part,
            metadata={**self._source.metadata, **own},
            vessel_toml=self._source.vessel_toml,
        )
        try:
            end = self._write_all(writer, first, chunks, on_chunk)
        except KeyboardInterrupt:  # the file is complete
            if not self._has_data:
                self._delete()
                raise
            end = _End.INTERRUPTED
        except ShiplogError as error:
            if self._has_data:
                message = f"{error}; at least {self.samples} samples until then are in {self._part}"
                raise ShiplogError(message) from error
            self._delete()
            raise
        if self._part != self._final:
            self._rename()
        return end

    def _following_name(self) -> str:
        """Return the name of the part in which the recording goes on; empty where in none."""
        if self._series is None or self.following is None:
            return ""
        return self._files.final(self._series.number + 1).name

    def _create(self) -> None:
        """Create the file that grows."""
        if self._part == self._final:
            return
        try:
            self._part.touch(exist_ok=False)
        except FileExistsError:
            raise _unfinished(self._part) from None
        except OSError as error:
            raise write_error(self._final, error) from error

    def _delete(self) -> None:
        """Delete the file that grows, which holds nothing."""
        if self._part != self._final:
            self._part.unlink(missing_ok=True)

    def _write_all(
        self,
        writer: LogWriter,
        first: tuple[Recordable, ...] | None,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        """Write chunks, and whatever ends them, the metadata of the end."""
        try:
            with DiskSync(self._part, self._files.sync_secs) as disk:
                return self._write_chunks(writer, disk, first, chunks, on_chunk)
        finally:
            with _write_errors(), writer:
                # those that have changed, such as counts of rejected packets
                writer.update_metadata(self._source.metadata)
                if self._series:
                    writer.update_metadata(self._series.end(self._following_name()))

    def _write_chunks(
        self,
        writer: LogWriter,
        disk: DiskSync,
        first: tuple[Recordable, ...] | None,
        chunks: Iterator[tuple[Recordable, ...]],
        on_chunk: Callable[[int], None],
    ) -> _End:
        opened = time.monotonic()
        with _write_errors():
            writer.flush()  # a file that is killed before its first sample can be read
        chunk = _next_chunk(chunks) if first is None else first
        while chunk is not None:
            self._has_data |= any(len(item) for item in chunk if not isinstance(item, Event))
            with _write_errors():
                writer.write(*chunk)
                writer.flush()
                disk.check()
                size = self._part.stat().st_size  # fails, too, where the file was deleted
            self.samples = writer.samples
            self.topics.update(item.topic for item in chunk if isinstance(item, Channel))
            if self._series:
                self._series.add(chunk)
            with interruptible():
                on_chunk(writer.samples)
            chunk = _next_chunk(chunks)
            if self._series is None or chunk is None:
                continue
            # a simulated or converted recording is received faster than its own times pass
            secs = max(time.monotonic() - opened, self._series.span_secs)
            if self._rotation.is_due(secs, size):
                self.following = chunk
                return _End.ROTATED
        return _End.SOURCE

    def _rename(self) -> None:
        """Give the complete file its final name."""
        if self._final.exists() and not self._files.overwrites:
            raise ShiplogError(
                f"a file of the log's name has appeared; the recording is complete in {self._part}"
            )
        try:
            replace_durably(self._part, self._final)
        except OSError as error:
            raise ShiplogError(
                f"cannot write: {error.strerror or error}; the recording is in {self._part}"
            ) from error


@contextmanager
def _write_errors() -> Iterator[None]:
    """Make an error of the system, such as that of a full disk, one for the user."""
    try:
        yield
    except BrokenPipeError:  # the reader of a pipe has closed it
        raise
    except OSError as error:
        raise ShiplogError(f"cannot write: {error.strerror or error}") from error
