"""A pipe to a file, by which errors of the disk reach Python and not the library that writes."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

DESCRIPTORS = Path("/dev/fd")  # not on all systems
PIECE_BYTES = 1 << 16


@contextmanager
def pipe_to_file(path: Path) -> Iterator[Path]:
    """Yield a path to write to; what is written there is in a file when the block ends.

    Rerun's writer waits for ever where a disk is full. It never meets the disk here: what is
    written after an error is dropped, and the error is raised at the end of the block. Whoever
    writes must have closed the pipe by then. On a system without `DESCRIPTORS` the path is that of
    the file.

    Parameters
    ----------
    path
        The file, or a device.

    Raises
    ------
    OSError
        The file cannot be written to the end.
    """
    if not DESCRIPTORS.is_dir():
        yield path
        return
    with path.open("wb", buffering=0) as file:
        reader, writer = os.pipe()
        errors: list[OSError] = []
        copying = Thread(target=_copy, args=(reader, file.fileno(), errors), daemon=True)
        copying.start()
        try:
            yield DESCRIPTORS / str(writer)
        finally:
            os.close(writer)
            copying.join()
            os.close(reader)
    if errors:
        raise errors[0]


def _copy(reader: int, file: int, errors: list[OSError]) -> None:
    """Copy a pipe to a file until its end; after an error, read it without writing."""
    while piece := os.read(reader, PIECE_BYTES):
        rest = memoryview(piece)
        try:
            while rest and not errors:
                rest = rest[os.write(file, rest) :]
        except OSError as error:
            errors.append(error)
