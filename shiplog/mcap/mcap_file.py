"""An MCAP file opened for reading, of which all checksums are known."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode

from shiplog.errors import LogError, UsageError

from .file_check import FileCheck, check_file
from .inverted_bit import with_inverted_bit
from .limits import MAX_DESCRIPTION_BYTES
from .part_names import part_files
from .part_set import LogParts, join_parts, read_part
from .record_structure import content_size
from .records import MAGIC, RECORD_HEAD


@dataclass(frozen=True, eq=False)
class McapFile:
    """An open file: where it is, and what its checksums show."""

    path: Path
    stream: IO[bytes]
    check: FileCheck


LogPaths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


def checked_files(paths: LogPaths) -> tuple[Path, FileCheck | None]:
    """Return what names a log, and, where it is several files, what their checksums show.

    Parameters
    ----------
    paths
        One path, which is returned as it is, or those of the parts of a log, in any order.

    Raises
    ------
    UsageError
        There is no path.
    LogError
        A file cannot be read, or the files are not the parts of one log.
    """
    if isinstance(paths, str | os.PathLike):
        return Path(paths), None
    files = [file for path in paths for file in part_files(Path(path))]
    if not files:
        raise UsageError("no log to read; name at least one file")
    if len(files) == 1:
        return files[0], None
    name = files[0].with_name(f"{files[0].name} to {files[-1].name}")
    return name, _check_parts(name, files)


@contextmanager
def open_mcap(path: Path, check: FileCheck | None = None) -> Iterator[McapFile]:
    """Open a file that begins as an MCAP file does, and verify its checksums.

    Parameters
    ----------
    path
        The file, or what names the parts of a log; see `part_files`.
    check
        What its checksums showed before, so that they are not computed again.

    Raises
    ------
    LogError
        The file is missing, empty or not MCAP, reading it fails within the block, or the files
        are not the parts of one log.
    """
    if check is not None and check.parts is not None:
        yield McapFile(path, BytesIO(), check)
        return
    files = part_files(path)
    if len(files) > 1:
        yield McapFile(path, BytesIO(), _check_parts(path, files))
        return
    path = files[0]
    try:
        with path.open("rb") as stream:
            _require_mcap(path, stream)
            check = check or check_file(stream)
            yield McapFile(path, with_inverted_bit(stream, check.wrong_bit), check)
    except OSError as error:
        raise LogError(_read_failure(path, error)) from error


def _check_parts(path: Path, files: Sequence[Path]) -> FileCheck:
    """Verify the checksums of all parts of a log, and return them in their order."""
    parts = []
    for file in files:
        try:
            with file.open("rb") as stream:
                if file.stat().st_size:  # one of no bytes was just begun
                    _require_mcap(file, stream)
                    parts.append(read_part(file, stream))
        except OSError as error:
            raise LogError(_read_failure(file, error)) from error
    joined = join_parts(parts, path) if len(parts) > 1 else LogParts(tuple(parts))
    return FileCheck(all(part.check.is_finished for part in parts), parts=joined)


def _require_mcap(path: Path, stream: IO[bytes]) -> None:
    """Refuse what is no MCAP file; damaged first bytes are followed by a header."""
    magic = stream.read(len(MAGIC))
    if not magic:
        raise LogError(f"the file is empty; record or convert it again: {path}")
    if magic != MAGIC:
        head = stream.read(RECORD_HEAD.size)
        opcode, length = RECORD_HEAD.unpack(head.ljust(RECORD_HEAD.size, b"\0"))
        content = stream.read(length) if length <= MAX_DESCRIPTION_BYTES else b""
        if opcode != Opcode.HEADER or content_size(opcode, content) != length:
            raise LogError(f"not an MCAP file; `shiplog convert` reads tables: {path}")


def _read_failure(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return f"no such file: {path}"
    if isinstance(error, IsADirectoryError):
        return f"a folder, not a log; name one file in it: {path}"
    return f"cannot read: {(error.strerror or str(error)).lower()}: {path}"
