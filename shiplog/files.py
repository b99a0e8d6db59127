"""Writing files so that a final name never holds half of anything."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ShiplogError


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a sibling name to write to; it takes the final name only when the block succeeds.

    Raises `ShiplogError` where the place cannot be written to. After an error the partial file
    is gone and whatever stood under the final name stands there still.
    """
    final = Path(os.path.realpath(path))  # a link stays a link
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
    """Whether it is a device or a pipe: written to as it is, for it holds nothing to be spoilt."""
    return path.exists() and not (path.is_file() or path.is_dir())


def write_error(path: Path, error: OSError) -> ShiplogError:
    """The error of an output that cannot be written, with its remedy."""
    if path.is_dir():
        return ShiplogError(f"cannot write: it is a folder; name a file in it: {path}")
    if not path.parent.is_dir():
        return ShiplogError(
            f"cannot write: there is no folder {path.parent}; make it first: {path}"
        )
    reason = (error.strerror or str(error)).lower()
    return ShiplogError(f"cannot write: {reason}; choose another place with -o: {path}")
