"""Trials as CSV in long form, with the header in comments and a checksum in the last line."""

import csv
import json
import os
import re
from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, Self
from zlib import crc32

import numpy as np

from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.printable import escape_json
from shiplog.types import TrialLog

from .long_form import COLUMNS, LongColumns, assemble, field_names
from .table_header import header_lines, with_checksum_warning

CSV_MARK = "# shiplog csv 2"  # first line
CSV_MARK_1 = "# shiplog csv 1"  # without a checksum, and without JSON among the cells
# last line by first line; without it the file was cut off
LAST_LINES = {CSV_MARK: re.compile("# end crc32 [0-9a-f]{8}"), CSV_MARK_1: re.compile("# end")}
FORMULA_SIGNS = "=+-@＝＋－＠"  # with which a spreadsheet begins a formula
_FORMULA_IN_HEADER = re.compile(f'(?<=[,;"])(\\s*)([{re.escape(FORMULA_SIGNS)}])')


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
    checksum = 0
    with atomic_write(path) as part, part.open("wb") as stream:
        for text in _blocks(log):
            data = text.encode()
            checksum = crc32(data, checksum)
            stream.write(data)
        stream.write(f"{_end_line(checksum)}\n".encode())


def _blocks(log: TrialLog) -> Iterator[str]:
    """Yield the lines of a CSV but the last one, those of one sample together."""
    yield f"{CSV_MARK}\n"
    for line in header_lines(log).split("\n"):
        yield f"# {_without_formulas(line)}\n"
    yield ",".join(COLUMNS) + "\n"
    for channel in log:
        heads = [f"{cell_text(channel.topic)},{field}" for field in field_names(channel)]
        texts = map(repr, channel.values.ravel().tolist())
        stamps = zip(channel.measured_ns.tolist(), channel.received_ns.tolist(), strict=True)
        for measured, received in stamps:
            yield "".join(f"{head},{measured},{received},{next(texts)}\n" for head in heads)


def read_csv(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a CSV that `write_csv` wrote.

    Returns
    -------
    log
        The trial, with a warning where its data do not have the checksum of the file.

    Raises
    ------
    LogError
        The file is missing, was not written by shiplog, or was damaged since; the message names
        the line.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            lines = _CheckedLines(stream)
            mark, header = _csv_header(path, lines)
            columns, is_unchanged = _csv_rows(path, lines, len(header) + 2, LAST_LINES[mark])
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LogError(f"cannot read: {reason}: {path}") from error
    except UnicodeDecodeError as error:
        raise LogError(f"not UTF-8 text; convert the log again: {path}") from error
    log = assemble(path.name, header, columns)
    return with_checksum_warning(log, is_unchanged if mark == CSV_MARK else None)


class _CheckedLines:
    """The lines of a file as text; `checksum` is that of the lines before the current one.

    A mark of the encoding and the kind of line ends, which editors change, are not part of it.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self._line, self.checksum = stream, b"", 0

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> str:
        raw = next(self._stream)
        self.checksum = crc32(self._line, self.checksum)
        self._line = raw.removeprefix(BOM_UTF8).rstrip(b"\r\n") + b"\n"
        return self._line.decode()


def _csv_header(path: Path, lines: Iterator[str]) -> tuple[str, list[str]]:
    """Read the first line, and the header without the comment signs."""
    mark = next(lines, "").rstrip("\n")
    if mark not in LAST_LINES:
        any_version = CSV_MARK.rpartition(" ")[0]
        remedy = "install a newer shiplog" if mark.startswith(any_version) else "it needs a layout"
        raise LogError(f"the first line is not {CSV_MARK!r} but {mark[:40]!r}; {remedy}: {path}")
    header = []
    while (line := next(lines, "").rstrip("\n")).startswith("# "):
        header.append(line.removeprefix("# "))
    if line != ",".join(COLUMNS):
        raise LogError(
            f"line {len(header) + 2} should be {','.join(COLUMNS)!r}; convert the log again: {path}"
        )
    return mark, header


def _csv_rows(
    path: Path, lines: _CheckedLines, before: int, last_line: re.Pattern[str]
) -> tuple[LongColumns, bool]:
    """Read the five columns of the samples, and whether the last line has the checksum of all.

    `before` is the number of lines above the samples.
    """
    rows: tuple[list[Any], ...] = ([], [], [], [], [])
    topics, fields, measured, received, values = rows
    reader, cells, last, checksum = csv.reader(lines), list(COLUMNS), "", 0
    try:
        for cells in reader:
            if last:
                raise LogError(f"rows after the last line {last[:40]!r}; remove them: {path}")
            if len(cells) == 1 and last_line.fullmatch(cells[0]):
                last, checksum = cells[0], lines.checksum
                continue
            topic, field, measured_text, received_text, text = cells
            topics.append(topic if topic[:1] != '"' else _json_text(topic))
            fields.append(field)
            measured.append(int(measured_text))
            received.append(int(received_text))
            values.append(float(text or "nan"))
        if not last:
            raise LogError(f"cut off, the last line is not '# end'; copy it again: {path}")
        measured_ns, received_ns = (np.array(c, np.int64) for c in (measured, received))
        columns = LongColumns(topics, fields, measured_ns, received_ns, np.array(values))
        return columns, last == _end_line(checksum)
    except OverflowError:
        raise LogError(f"a time needs more than 64 bits; convert the log again: {path}") from None
    except UnicodeDecodeError:
        raise
    except (ValueError, csv.Error) as error:
        reason = str(error) if len(cells) == 5 else f"it has {len(cells)} columns, not 5"
        raise LogError(
            f"line {before + reader.line_num} cannot be read ({reason}); "
            f"correct it or remove it: {path}"
        ) from None


def _end_line(checksum: int) -> str:
    return f"# end crc32 {checksum:08x}"


def cell_text(text: str) -> str:
    """Return the cell of a text, from which the text can be restored, for a writer without quotes.

    A text with characters that do not print, and one that a spreadsheet would take for a formula,
    is a string of JSON. Others are quoted if they need it: a quoted `#` begins no comment.
    """
    if not text.isprintable() or text.startswith(('"', *FORMULA_SIGNS)):
        text = escape_json(json.dumps(text, ensure_ascii=False))
    return '"' + text.replace('"', '""') + '"' if set(text) & set('#,;"') else text


def _json_text(cell: str) -> str:
    """Return the text of a cell that is a string of JSON."""
    text = json.loads(cell)
    if not isinstance(text, str):
        raise ValueError(f"{cell[:40]!r} is no text")  # noqa: TRY004 - the caller names the line
    return text


def _without_formulas(line: str) -> str:
    """Escape what begins a formula where a spreadsheet splits a line of JSON into cells."""
    return _FORMULA_IN_HEADER.sub(lambda found: f"{found[1]}\\u{ord(found[2]):04x}", line)
