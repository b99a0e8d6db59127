"""Reading of any log: of shiplog as MCAP, CSV or Parquet, or of another program by a layout."""

from codecs import BOM_UTF8
from dataclasses import replace
from pathlib import Path

from shiplog.errors import LogError, UsageError
from shiplog.foreign_mcap.foreign_log import read_foreign_mcap
from shiplog.foreign_mcap.ulog import is_ulog, ulog_as_mcap
from shiplog.layouts.layout import load_layout
from shiplog.layouts.mcap_layout import load_mcap_layout
from shiplog.mcap.clock_repair import MixedTimes, refuse_mixed_times
from shiplog.mcap.part_names import SUFFIX, log_suffix, part_files
from shiplog.mcap.reader import read_unchecked
from shiplog.mcap.stream import LogFile, open_log
from shiplog.types import TrialLog

from .csv_form import CSV_MARK, read_csv
from .foreign import read_table
from .parquet_form import read_parquet
from .plain_csv import LONG_COLUMNS

SUFFIXES = (".mcap", ".csv", ".parquet")


def is_mcap_log(path: Path) -> bool:
    """Return whether a log is an MCAP file, or several that are its parts."""
    return log_suffix(path) == SUFFIX or part_files(path) != (path,)


def open_any_log(
    path: Path,
    layout: Path | None = None,
    start: float | str | None = None,
    end: float | str | None = None,
) -> TrialLog | LogFile:
    """Open any log; one of MCAP that is longer than memory in its file, as `open_log` does.

    Parameters
    ----------
    path
        As the source of `read_any_log`.
    layout
        As that of `read_any_log`.
    start, end
        The part to open, as `TrialLog.between` takes them.

    Raises
    ------
    UsageError, LogError, LayoutError
        As `read_any_log` and `open_log` do.
    """
    if layout is None and is_mcap_log(path):
        return open_log(path, start, end)
    log, mixed = read_any_log(path, layout)
    part = log.between(start, end)
    refuse_mixed_times(mixed, part.span_ns)
    return part


def read_any_log(source: Path, layout: Path | None = None) -> tuple[TrialLog, list[MixedTimes]]:
    """Read a log of any format into memory.

    Parameters
    ----------
    source
        An MCAP file, a table that shiplog wrote (`.csv`, `.parquet`), a foreign table, or a ULog
        file of PX4 (`.ulg`).
    layout
        Layout file of a foreign table, or of an MCAP or ULog file of another program.

    Returns
    -------
    log, mixed
        The trial, and the spans for which the caller has to call `refuse_mixed_times`.

    Raises
    ------
    UsageError
        The layout does not fit the file, or is missing.
    LogError, LayoutError
        The file cannot be read.
    """
    if is_ulog(source):
        return _read_ulog(source, layout)
    if not is_mcap_log(source):
        return _read_table(source, layout), []
    if layout is None:
        return read_unchecked(source)
    return read_foreign_mcap(source, load_mcap_layout(layout))


def _read_ulog(source: Path, layout: Path | None) -> tuple[TrialLog, list[MixedTimes]]:
    """Read the topics of a ULog file that a layout describes."""
    if layout is None:
        raise UsageError(
            "a ULog file; describe its topics with --layout LAYOUT.toml, which `shiplog layout` "
            f"drafts: {source}"
        )
    described = load_mcap_layout(layout)
    with ulog_as_mcap(source) as copy:
        log, mixed = read_foreign_mcap(copy.path, described)
    warnings = (*copy.warnings, *log.warnings)
    return replace(log, warnings=warnings, data_lost=log.data_lost or copy.data_lost), mixed


def _read_table(source: Path, layout: Path | None) -> TrialLog:
    """Read a table of shiplog, or a foreign one by its layout."""
    suffix = log_suffix(source)
    if layout is not None:
        if suffix == ".parquet" or (suffix == ".csv" and _is_shiplog_csv(source)):
            raise UsageError(
                f"a layout is for foreign tables, but this is a log; omit --layout: {source}"
            )
        return read_table(source, load_layout(layout))
    if suffix == ".parquet":
        return read_parquet(source)
    if suffix == ".csv" and (not source.is_file() or _is_shiplog_csv(source)):
        return read_csv(source)
    if not source.exists():
        raise LogError(f"no such file: {source}")
    if source.is_dir():
        raise LogError(f"a folder, not a log; name one file in it: {source}")
    if _is_plain_long_csv(source):
        raise UsageError(
            "a long CSV for other programs, from which no log can be read; read the log that it "
            f"was converted from, or convert that without --units: {source}"
        )
    raise UsageError(
        f"a foreign table; describe its columns with --layout LAYOUT.toml, which `shiplog layout` "
        f"drafts "
        f"(without a layout, {', '.join(SUFFIXES)} of shiplog can be read): {source}"
    )


def _is_shiplog_csv(path: Path) -> bool:
    """Whether a file begins like a CSV of shiplog, of any version."""
    return _begins_with(path, CSV_MARK.rpartition(" ")[0])


def _is_plain_long_csv(path: Path) -> bool:
    """Whether a file begins like a long CSV for other programs, which no layout describes."""
    return _begins_with(path, ",".join(LONG_COLUMNS))


def _begins_with(path: Path, text: str) -> bool:
    mark = text.encode()
    try:
        with path.open("rb") as stream:
            begin = stream.read(len(mark) + len(BOM_UTF8))
    except OSError:
        return False
    return begin.removeprefix(BOM_UTF8).startswith(mark)
