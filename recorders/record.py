"""A source to a file: the one loop that every recorder runs in."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from shiplog.errors import ShiplogError
from shiplog.files import is_device, write_error
from shiplog.mcap.writer import LogWriter

from .source import Source


class Recorded(NamedTuple):
    """What came of a recording."""

    samples: int
    interrupted: bool  # by Ctrl-C


def record(
    source: Source,
    path: str | os.PathLike[str],
    *,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> Recorded:
    """Write all that `source` yields to `path`.

    `on_chunk` is told the samples written so far. While recording, the log grows beside its final
    name with `.part` behind it, readable up to the last chunk even if the process is killed. Ctrl-C
    ends the recording, not the log. If the source fails, what was received stays in the `.part`
    file, finished, and the error says so; `path` then is as it was before.
    """
    final = Path(path)
    part = final if is_device(final) else final.with_name(final.name + ".part")
    if final.is_dir():
        raise write_error(final, IsADirectoryError())
    if part != final and part.exists():
        raise ShiplogError(
            "a recording that was not finished lies there; rescue it with `shiplog convert`, "
            f"or delete it: {part}"
        )
    interrupted = False
    writer = LogWriter(part, metadata=source.metadata, vessel_toml=source.vessel_toml)
    try:
        with writer:
            for chunk in source.chunks():
                writer.write(*chunk)
                writer.flush()
                on_chunk(writer.samples)
    except KeyboardInterrupt:
        interrupted = True
    except ShiplogError as error:
        if writer.samples:
            message = f"{error}; the {writer.samples} samples until then are in {part}"
            raise ShiplogError(message) from error
        part.unlink(missing_ok=True)
        raise
    if part != final:
        part.replace(final)
    return Recorded(writer.samples, interrupted)
