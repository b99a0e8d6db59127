"""Names of the parts of a log: a recording that was divided, or the hourly files of a recorder."""

import re
from pathlib import Path

SUFFIX, UNFINISHED = ".mcap", ".part"
_WILDCARDS = frozenset("*?[")


def part_files(path: Path) -> tuple[Path, ...]:
    """Return the files of a log.

    Parameters
    ----------
    path
        A file; or, where there is none of that name, that of a recording whose parts are numbered,
        a folder of logs, or a pattern such as ``day/*.mcap``.

    Returns
    -------
    files
        In the order of their names; `path` alone where nothing is found.
    """
    if path.is_dir():
        found = [file for file in path.iterdir() if _is_log(file)]
    elif path.exists():
        return (path,)
    elif _WILDCARDS & set(path.name):
        found = [file for file in path.parent.glob(path.name) if _is_log(file)]
    else:
        found = recorded_files(path, is_divided=True)
    return tuple(sorted(found)) or (path,)


def recorded_files(path: Path, *, is_divided: bool) -> list[Path]:
    """Return the files that a recording of a log has, or an older one has, finished or not.

    Parameters
    ----------
    path
        The name of the recording.
    is_divided
        Whether its files are numbered parts, ``trial.001.mcap`` of ``trial.mcap``.

    Returns
    -------
    files
        In the order of their names.
    """
    if not path.parent.is_dir():
        return []
    number = r"\.\d{3,}" if is_divided else ""
    name = rf"{re.escape(path.stem)}{number}{re.escape(path.suffix)}(?:{re.escape(UNFINISHED)})?"
    return sorted(file for file in path.parent.iterdir() if re.fullmatch(name, file.name))


def log_suffix(path: Path) -> str:
    """Return the suffix of a log in small letters, of an unfinished one that of its final name.

    Examples
    --------
    >>> log_suffix(Path("trial.MCAP.part"))
    '.mcap'
    """
    return Path(path.name.removesuffix(UNFINISHED)).suffix.lower()


def log_stem(path: Path) -> str:
    """Return what a log is called, without the suffix, as the beginning of names of its outputs.

    Examples
    --------
    >>> log_stem(Path("trial.mcap")), log_stem(Path("day/h*.mcap")), log_stem(Path("day/*.mcap"))
    ('trial', 'h', 'day')
    """
    plain = re.sub(r"[*?\[\]]", "", path.stem if path.suffix else path.name).strip("._-")
    return plain or path.resolve().parent.name


def _is_log(file: Path) -> bool:
    name = file.name.removesuffix(UNFINISHED)
    return file.is_file() and name.endswith(SUFFIX) and not name.startswith(".")
