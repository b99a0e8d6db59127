"""Trials as CSV in long form, with the header in comments."""

import csv
import os
from pathlib import Path
from typing import IO, Any

import numpy as np

from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.types import TrialLog

from .long_form import COLUMNS, LongColumns, assemble, field_names, header_lines

CSV_MARK = "# shiplog csv 1"  # first line
CSV_END = "# end"  # last line; without it the file was cut off


def write_csv(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a trial as CSV in long form.

    If writing fails, a file that was there before is kept.

    Parameters
    ----------
    log
        The trial.
    path
        File to write.
    """
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        stream.write(f"{CSV_MARK}\n")
        stream.writelines(f"# {line}\n" for line in header_lines(log).split("\n"))
        stream.write(",".join(COLUMNS) + "\n")
        for channel in log:
            heads = [f"{_quoted(channel.topic)},{field}" for field in field_names(channel)]
            texts = map(repr, channel.values.ravel().tolist())
            stamps = zip(channel.measured_ns.tolist(), channel.received_ns.tolist(), strict=True)
            for measured, received in stamps:
                for head in heads:
                    stream.write(f"{head},{measured},{received},{next(texts)}\n")
        stream.write(f"{CSV_END}\n")


def read_csv(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a CSV that `write_csv` wrote.

    Raises
    ------
    LogError
        The file is missing, was not written by shiplog, or was damaged since; the message names
        the line.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            header = _csv_header(path, stream)
            return assemble(path.name, header, _csv_rows(path, stream, len(header) + 2))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LogError(f"cannot read: {reason}: {path}") from error
    except UnicodeDecodeError as error:
        raise LogError(f"not UTF-8 text; convert the log again: {path}") from error


def _csv_header(path: Path, stream: IO[str]) -> list[str]:
    """Read the header, without the comment signs; the stream is then at the first sample."""
    mark = stream.readline().rstrip("\r\n")
    if mark != CSV_MARK:
        any_version = CSV_MARK.rpartition(" ")[0]
        remedy = "install a newer shiplog" if mark.startswith(any_version) else "it needs a layout"
        raise LogError(f"the first line is not {CSV_MARK!r} but {mark[:40]!r}; {remedy}: {path}")
    header = []
    while (line := stream.readline().rstrip("\r\n")).startswith("# "):
        header.append(line.removeprefix("# "))
    if line != ",".join(COLUMNS):
        raise LogError(
            f"line {len(header) + 2} should be {','.join(COLUMNS)!r}; convert the log again: {path}"
        )
    return header


def _csv_rows(path: Path, stream: IO[str], before: int) -> LongColumns:
    """Read the five columns of the samples; `before` is the number of lines above them."""
    rows: tuple[list[Any], ...] = ([], [], [], [], [])
    topics, fields, measured, received, values = rows
    reader, ended = csv.reader(stream), False
    try:
        for cells in reader:
            if ended:
                raise LogError(f"rows after the last line {CSV_END!r}; remove them: {path}")
            if cells == [CSV_END]:
                ended = True
                continue
            topic, field, measured_text, received_text, text = cells
            topics.append(topic)
            fields.append(field)
            measured.append(int(measured_text))
            received.append(int(received_text))
            values.append(float(text or "nan"))
        if not ended:
            raise LogError(f"cut off, the last line is not {CSV_END!r}; copy it again: {path}")
        measured_ns, received_ns = (np.array(c, np.int64) for c in (measured, received))
        return LongColumns(topics, fields, measured_ns, received_ns, np.array(values))
    except OverflowError:
        raise LogError(f"a time needs more than 64 bits; convert the log again: {path}") from None
    except (ValueError, csv.Error) as error:
        reason = str(error) if len(cells) == 5 else f"it has {len(cells)} columns, not 5"
        raise LogError(
            f"line {before + reader.line_num} cannot be read ({reason}); "
            f"correct it or remove it: {path}"
        ) from None


def _quoted(text: str) -> str:
    """Quote a text for CSV if it needs it; a quoted `#` begins no comment in pandas."""
    return '"' + text.replace('"', '""') + '"' if set(text) & set('#,"\r\n') else text
