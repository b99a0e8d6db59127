"""Trials as Parquet in long form, with header and checksum in the metadata of the schema."""

import os
from pathlib import Path
from typing import TYPE_CHECKING
from zlib import crc32

import numpy as np

from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.types import TrialLog

from .long_form import COLUMNS, HEADER_KEY, LongColumns, assemble, long_columns, row_labels
from .table_header import header_lines, with_checksum_warning

if TYPE_CHECKING:
    import pyarrow as pa

CHECKSUM_KEY = "shiplog.crc32"  # in the metadata of the schema
MAX_ROWS_PER_BYTE = 10  # of a file; a log with times one ns apart has 0.5
MIN_LIMIT_ROWS = 1_000_000  # fewer rows are read from a file of any size


def write_parquet(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a trial as Parquet in long form.

    If writing fails, a file that was there before is kept.

    Parameters
    ----------
    log
        The trial.
    path
        File to write.
    """
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import parquet  # noqa: PLC0415

    topics, topic_codes, fields, field_codes = row_labels(log)
    columns = (
        pa.DictionaryArray.from_arrays(topic_codes, pa.array(topics, pa.string())),
        pa.DictionaryArray.from_arrays(field_codes, pa.array(fields, pa.string())),
        *(pa.array(column) for column in long_columns(log)),
    )
    table = pa.Table.from_arrays(list(columns), names=list(COLUMNS))
    header = header_lines(log).encode()
    checksum = f"{_checksum(header, table):08x}"
    table = table.replace_schema_metadata({HEADER_KEY: header, CHECKSUM_KEY: checksum})
    with atomic_write(path) as part:
        parquet.write_table(
            table,
            part,
            compression="zstd",
            use_dictionary=list(COLUMNS[:2]),
            write_page_checksum=True,
        )


def read_parquet(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a Parquet file that `write_parquet` wrote.

    Returns
    -------
    log
        The trial, with a warning where its data do not have the checksum of the file.

    Raises
    ------
    LogError
        The file is missing, damaged, or was not written by shiplog.
    """
    import pyarrow as pa  # noqa: PLC0415 - slow to import

    path = Path(path)
    try:
        metadata, table = _table(path)
        header = metadata[HEADER_KEY.encode()]
        lines = header.decode().split("\n")
        columns = LongColumns(*(table.column(name).to_numpy() for name in COLUMNS))
        expected = metadata.get(CHECKSUM_KEY.encode())
        found = f"{_checksum(header, table):08x}".encode()
    except (pa.ArrowException, OSError, KeyError, ValueError, MemoryError) as error:
        reason = " ".join(str(error).split())
        if isinstance(error, OSError) and error.errno is not None:
            raise LogError(f"cannot read: {os.strerror(error.errno).lower()}: {path}") from error
        raise LogError(
            f"a damaged Parquet file ({reason:.200}); convert the log again: {path}"
        ) from error
    log = assemble(path.name, lines, columns)
    return with_checksum_warning(log, None if expected is None else expected == found)


def _table(path: Path) -> tuple[dict[bytes, bytes], "pa.Table"]:
    """Read the metadata of the schema and the columns, in the types in which they are written."""
    import pyarrow as pa  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    types = (pa.string(), pa.string(), pa.int64(), pa.int64(), pa.float64())
    with parquet.ParquetFile(path, page_checksum_verification=True) as file:
        metadata = file.schema_arrow.metadata or {}
        if HEADER_KEY.encode() not in metadata:
            raise LogError(f"a Parquet file, but not of shiplog; convert a log to Parquet: {path}")
        rows = file.metadata.num_rows
        if rows > max(MIN_LIMIT_ROWS, MAX_ROWS_PER_BYTE * path.stat().st_size):
            raise LogError(f"{rows} rows, more than its size can hold; copy it again: {path}")
        table = file.read(columns=list(COLUMNS))
    for name in COLUMNS[:-1]:
        if empty := table.column(name).null_count:
            raise LogError(
                f"{empty} empty cells in the column {name!r}; fill or remove those rows: {path}"
            )
    for name in COLUMNS[2:4]:
        if not pa.types.is_integer(kind := table.column(name).type):
            raise LogError(
                f"the column {name!r} must be whole numbers of ns since 1970, not {kind}; "
                f"convert the log again: {path}"
            )
    return metadata, table.select(list(COLUMNS)).cast(pa.schema(zip(COLUMNS, types, strict=True)))


def _checksum(header: bytes, table: "pa.Table") -> int:
    """Return the checksum of the header and the columns, however the file stores these."""
    checksum = crc32(header)
    for name in COLUMNS:
        column = table.column(name)
        if name in COLUMNS[:2]:  # texts: the distinct ones as they come, then their numbers
            coded = column.cast("string").combine_chunks().dictionary_encode()
            texts = "\n".join(coded.dictionary.to_pylist())
            checksum = crc32(texts.encode(), checksum)
            column = coded.indices
        checksum = crc32(np.ascontiguousarray(column.to_numpy()).data, checksum)
    return checksum
