"""Trials as Parquet in long form, with the header in the metadata of the schema."""

import os
from pathlib import Path

from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.types import TrialLog

from .long_form import (
    COLUMNS,
    HEADER_KEY,
    LongColumns,
    assemble,
    header_lines,
    long_columns,
    row_labels,
)


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
    table = table.replace_schema_metadata({HEADER_KEY: header_lines(log)})
    with atomic_write(path) as part:
        parquet.write_table(table, part, compression="zstd", use_dictionary=list(COLUMNS[:2]))


def read_parquet(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a Parquet file that `write_parquet` wrote.

    Raises
    ------
    LogError
        The file is missing, damaged, or was not written by shiplog.
    """
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import parquet  # noqa: PLC0415

    path = Path(path)
    try:
        with parquet.ParquetFile(path) as file:
            header = (file.schema_arrow.metadata or {}).get(HEADER_KEY.encode())
            if header is None:
                raise LogError(
                    f"a Parquet file, but not of shiplog; convert a log to Parquet: {path}"
                )
            table = file.read(columns=list(COLUMNS))
            columns = LongColumns(*(table.column(name).to_numpy() for name in COLUMNS))
    except OSError as error:
        raise LogError(f"cannot read: {str(error).lower()}: {path}") from error
    except (pa.ArrowException, KeyError) as error:
        raise LogError(
            f"a damaged Parquet file ({error}); convert the log again: {path}"
        ) from error
    return assemble(path.name, header.decode().split("\n"), columns)
