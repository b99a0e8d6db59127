"""The loop that writes a source of samples to a log, safe against crashes and Ctrl-C."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from shiplog.errors import ShiplogError
from shiplog.files import is_device, write_error
from shiplog.mcap.writer import LogWriter
from shiplog.types import Channel

from .source import Source


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
    """

    samples: int
    channels: int
    interrupted: bool


def record(
    source: Source,
    path: str | os.PathLike[str],
    *,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> Recording:
    """Write everything that a source yields to a log: samples, raw packets and events.

    While recording, the log grows beside its final name with ``.part`` appended, readable up to the
    last chunk even if the process is killed. Ctrl-C ends the recording and keeps the log. If the
    source fails, what was received until then stays in the ``.part`` file, complete, and the error
    names it; an older file at `path` is left as it was. However the recording ends, the metadata of
    the source that have changed since its beginning are written then.

    Parameters
    ----------
    source
        Where the samples come from.
    path
        The log to write; ``.mcap`` by convention. A device such as ``/dev/stdout`` is written
        directly.
    on_chunk
        Called after each chunk with the number of samples written so far.

    Raises
    ------
    ShiplogError
        The file cannot be written, an unfinished recording lies beside it, or the source failed.
    """
    final = Path(path)
    part = final if is_device(final) else final.with_name(final.name + ".part")
    if final.is_dir():
        raise write_error(final, IsADirectoryError())
    if part != final and part.exists():
        raise ShiplogError(
            "an unfinished recording lies there; rescue it with `shiplog convert`, "
            f"or delete it: {part}"
        )
    interrupted, topics = False, set[str]()
    writer = LogWriter(part, metadata=source.metadata, vessel_toml=source.vessel_toml)
    try:
        with writer, _metadata_at_end(source, writer):
            for chunk in source.chunks():
                writer.write(*chunk)
                writer.flush()
                topics.update(item.topic for item in chunk if isinstance(item, Channel))
                on_chunk(writer.samples)
    except KeyboardInterrupt:
        interrupted = True
    except ShiplogError as error:
        if writer.messages:
            message = f"{error}; the {writer.samples} samples until then are in {part}"
            raise ShiplogError(message) from error
        part.unlink(missing_ok=True)
        raise
    if part != final:
        part.replace(final)
    return Recording(writer.samples, len(topics), interrupted)


@contextmanager
def _metadata_at_end(source: Source, writer: LogWriter) -> Iterator[None]:
    """Write the metadata that have changed, such as counts of rejected packets, at the end."""
    try:
        yield
    finally:
        writer.update_metadata(source.metadata)
