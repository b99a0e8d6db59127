"""One file to another, by their endings: a foreign table to a log, a log to a table."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from shiplog.checks.data_quality import times_in_words
from shiplog.checks.rudder_sign import rudder_sign_warning
from shiplog.errors import LogError, UsageError
from shiplog.mcap.reader import read
from shiplog.mcap.writer import write
from shiplog.types import TrialLog

from .foreign import read_table
from .layout import load_layout
from .table import CSV_MARK, read_csv, read_parquet, write_csv, write_parquet

SUFFIXES = (".mcap", ".csv", ".parquet")


def convert(source: Path, target: Path, layout: Path | None = None) -> tuple[TrialLog, list[str]]:
    """Write what `source` holds to `target`, each in the form that its suffix says.

    A foreign table needs a layout. From MCAP to MCAP each channel is sorted by measured time.
    Returns what was written, and warnings.

    Raises `UsageError` where the suffixes or the layout do not fit; otherwise as the reading and
    the writing do.
    """
    if target.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"cannot write {target.suffix or 'a file without suffix'!r}; "
            f"known are {', '.join(SUFFIXES)}: {target}"
        )
    if source.resolve() == target.resolve():
        raise UsageError(f"source and target are the same file; name another target: {target}")
    log = _read_any(source, layout)
    warnings = list(log.warnings)
    if source.suffix.lower() == target.suffix.lower() == ".mcap":
        log, notes = sorted_by_time(log)
        warnings += notes
    if layout is not None:
        contrary = rudder_sign_warning(log)
        warnings += [contrary] if contrary else []
    writers = {".mcap": write, ".csv": write_csv, ".parquet": write_parquet}
    writers[target.suffix.lower()](log, target)
    return log, warnings


def _read_any(source: Path, layout: Path | None) -> TrialLog:
    suffix = Path(source.name.removesuffix(".part")).suffix.lower()  # a recording not finished
    ours = {".mcap": read, ".parquet": read_parquet}
    if layout is not None:
        if suffix in ours or (suffix == ".csv" and _is_ours(source)):
            raise UsageError(
                f"a layout describes foreign tables, this is a log; leave --layout out: {source}"
            )
        return read_table(source, load_layout(layout))
    if suffix in ours:
        return ours[suffix](source)
    if suffix == ".csv" and (not source.is_file() or _is_ours(source)):
        return read_csv(source)
    if not source.exists():
        raise LogError(f"no such file: {source}")
    if source.is_dir():
        raise LogError(f"a folder, not a log; name one file in it: {source}")
    raise UsageError(
        f"a foreign table: say with --layout LAYOUT.toml what its columns are "
        f"(without one, {', '.join(SUFFIXES)} of shiplog are read): {source}"
    )


def _is_ours(path: Path) -> bool:
    """Whether a file begins as our CSV does, of whichever version."""
    mark = CSV_MARK.rpartition(" ")[0].encode()
    try:
        with path.open("rb") as stream:
            return stream.read(len(mark) + 3).removeprefix(b"\xef\xbb\xbf").startswith(mark)
    except OSError:
        return False


def sorted_by_time(log: TrialLog) -> tuple[TrialLog, list[str]]:
    """The log with each channel's samples in the order of measurement, and what that changed.

    A reader puts samples in the order in which they were received; so a sample that moves back
    behind others takes the latest time at which one before it was received.
    """
    channels, notes = [], []
    for channel in log:
        late = int(np.count_nonzero(np.diff(channel.measured_ns) < 0))
        if late:
            order = np.argsort(channel.measured_ns, kind="stable")
            channel = channel.take(order)  # noqa: PLW2901 - the same channel, in order
            received_ns = np.maximum.accumulate(channel.received_ns)
            channel = replace(channel, received_ns=received_ns)  # noqa: PLW2901
            notes.append(
                f"{channel.topic}: the measured times ran backwards {times_in_words(late)}; "
                "now sorted"
            )
        channels.append(channel)
    return replace(log, channels=tuple(channels)), notes
