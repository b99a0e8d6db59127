"""Paths on the command line: what is wrong with them is reported before any work."""

from collections.abc import Sequence
from pathlib import Path

from shiplog.errors import LogError, UsageError
from shiplog.files import is_device, write_error

StrPath = str | Path


def require_inputs(*paths: StrPath | None) -> None:
    """Refuse a log that is missing or a folder without any; raises `LogError`."""
    from shiplog.mcap.part_names import part_files

    for path in (Path(path) for path in paths if path):
        if part_files(path) != (path,):
            continue
        if not path.exists():
            raise LogError(f"no such file: {path}")
        if path.is_dir():
            raise LogError(f"a folder, not a log; name one file in it: {path}")


def require_outputs(*paths: StrPath | None) -> None:
    """Refuse an output whose folder is missing or that is a folder; raises `ShiplogError`."""
    for path in (Path(path) for path in paths if path and str(path) != "-"):
        if path.is_dir():
            raise write_error(path, IsADirectoryError())
        if not path.parent.is_dir():
            raise write_error(path, FileNotFoundError())


def require_distinct(outputs: Sequence[StrPath | None], inputs: Sequence[StrPath | None]) -> None:
    """Refuse to write over an input, a part of one, or another output; devices may be shared."""
    from shiplog.mcap.part_names import part_files

    written = [Path(path).resolve() for path in outputs if path and str(path) != "-"]
    written = [path for path in written if not is_device(path)]
    read = {
        file.resolve() for path in inputs if path for file in (Path(path), *part_files(Path(path)))
    }
    for path in written:
        if written.count(path) > 1 or path in read:
            raise UsageError(f"the same file is named twice; name another for the output: {path}")


def require_suffix(suffix: str, *outputs: StrPath | None) -> None:
    """Refuse an output whose name does not end as its kind of file does."""
    for path in (Path(output) for output in outputs if output):
        if path.suffix.lower() != suffix and not (is_device(path) or path.is_dir()):
            raise UsageError(f"the output is a {suffix} file; give it a name that ends so: {path}")
