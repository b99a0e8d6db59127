"""Atomic writing of output files: complete under their names, on the disk, by one writer a name."""

import errno
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import ShiplogError
from .interrupts import deferred

if sys.platform != "win32":
    import fcntl

_claims: dict[Path, int] = {}  # outputs that this process writes, and the threads that do


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path to write to, and rename it to `path` when the block succeeds.

    The temporary file is in the folder of the final one. After an error it is deleted, and a file
    that existed under the final name is unchanged. A symbolic link is kept: its target is replaced.
    A device or pipe is written to directly. The data are on the disk before the name is.

    Parameters
    ----------
    path
        The final name.

    Raises
    ------
    ShiplogError
        The file cannot be written, or another process is writing it. A folder given as `path` is
        rejected before the block runs.

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
    with claimed_name(final) as part:
        try:
            yield part
            replace_durably(part, final)
        except OSError as error:
            raise write_error(final, error) from error


@contextmanager
def claimed_name(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Be the only writer of an output within the block, and yield a hidden file beside it.

    The claim is a lock on the hidden file. The system releases it when the process ends, however
    that may be, so that what a killed process has left there is taken over. The thread that has
    claimed a name may claim it again.

    Parameters
    ----------
    path
        The final name. A device has no claim, and is yielded itself.

    Raises
    ------
    ShiplogError
        Another process is writing the output, or its folder cannot be written to.
    """
    final = Path(os.path.realpath(path))
    if is_device(final):
        yield final
        return
    if final.is_dir():
        raise write_error(final, IsADirectoryError())
    hidden = final.with_name(f".{final.name}.part")
    if _claims.get(final) == threading.get_ident():
        yield hidden
        return
    with deferred():
        descriptor = _locked(hidden, final)
        _claims[final] = threading.get_ident()
    try:
        yield hidden
    finally:
        with deferred():
            del _claims[final]
            if _is_file(hidden, descriptor):  # else it has its final name, or another writer's
                hidden.unlink()
            os.close(descriptor)


def replace_durably(part: Path, final: Path) -> None:
    """Rename a file when its data are on the disk, and return when its name is, too.

    Raises
    ------
    OSError
        The disk is full or gone, or the folder cannot be written to.
    """
    with deferred():
        sync_file(part)
        part.replace(final)
        sync_folder(final.parent)


def sync_file(path: Path) -> None:
    """Force the data of a file to the disk; raises OSError."""
    descriptor = os.open(path, os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_folder(path: Path) -> None:
    """Force the names in a folder to the disk, on systems and disks that can."""
    with suppress(OSError):  # the file itself is safe
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


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


def _locked(hidden: Path, final: Path) -> int:
    """Create the hidden file of an output and lock it; return its descriptor."""
    while True:
        try:
            # never through a link that another user may have put there
            flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
            descriptor = os.open(hidden, flags, 0o666)
        except OSError as error:
            raise write_error(final, error) from error
        if not _lock(descriptor):
            os.close(descriptor)
            raise ShiplogError(
                f"another process is writing it; wait for its end, or name another output: {final}"
            )
        if _is_file(hidden, descriptor):
            return descriptor
        os.close(descriptor)  # its writer has just renamed or deleted it


def _lock(descriptor: int) -> bool:
    """Lock an open file; True also where the system or the disk has no locks."""
    if sys.platform == "win32":
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EACCES)
    return True


def _is_file(path: Path, descriptor: int) -> bool:
    """Whether a path is the file that is open."""
    try:
        return os.path.samestat(path.lstat(), os.fstat(descriptor))
    except OSError:
        return False
