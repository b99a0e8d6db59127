"""Atomic writing of output files.

An output appears under its final name only when it is complete.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ShiplogError


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path to write to, and rename it to `path` when the block succeeds.

    The temporary file is in the folder of the final one. After an error it is deleted, and a file
    that existed under the final name is unchanged. A symbolic link is kept: its target is replaced.
    A device or pipe is written to directly.

    Parameters
    ----------
    path
        The final name.

    Raises
    ------
    ShiplogError
        The file cannot be written. A folder given as `path` is rejected before the block runs.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     with atomic_write(f"{folder}/out.txt") as part:
    ...         _ = part.write_text("complete")
    ...     Path(f"{folder}/out.txt").read_text()
    'complete'
    """
    final = Path(os.path.realpath(path))
    if is_device(final):
        yield final
        return
    if final.is_dir():
        raise write_error(final, IsADirectoryError())
    part = final.with_name(f".{final.name}.{os.getpid()}.part")
    try:
        part.touch()
    except OSError as error:
        raise write_error(final, error) from error
    try:
        yield part
        part.replace(final)
    except OSError as error:
        raise write_error(final, error) from error
    finally:
        part.unlink(missing_ok=True)


def is_device(path: Path) -> bool:
    """Whether a path is a device or a pipe, which is written to directly."""
    return path.exists() and not (path.is_file() or path.is_dir())


def write_error(path: Path, error: OSError) -> ShiplogError:
    """Return the exception for an output that cannot be written, with its cause and remedy."""
    if path.is_dir():
        return ShiplogError(f"cannot write: it is a folder; name a file in it: {path}")
    if not path.parent.is_dir():
        return ShiplogError(f"cannot write: there is no folder {path.parent}; create it: {path}")
    reason = (error.strerror or str(error)).lower()
    return ShiplogError(f"cannot write: {reason}; choose another place with -o: {path}")
