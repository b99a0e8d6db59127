"""Delimited text of a foreign table, split into cells."""

import csv
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.errors import LayoutError

from .layout import DELIMITERS, Layout


@dataclass(frozen=True)
class CellTable:
    """The cells of a delimited text.

    Attributes
    ----------
    path
        File of the text.
    lines
        Line number of each row, from 1.
    rows
        Cells of each row; all rows have the same number.
    header
        Names of the columns; empty without a header.
    """

    path: Path
    lines: list[int]
    rows: list[list[str]]
    header: list[str] = field(default_factory=list)


def read_cells(path: Path, layout: Layout) -> CellTable:
    """Split a text into cells as its layout describes it; blank lines are left out.

    Raises
    ------
    LayoutError
        The text cannot be read or split, has no rows, or a row of another length; the message
        names the line.
    """
    lines = _text(path, layout).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    delimiter = DELIMITERS[layout.delimiter]
    body = lines[layout.skip_rows :]
    numbers: list[int] = []
    rows: list[list[str]] = []
    if delimiter is None:
        cells = [(number, line.split()) for number, line in enumerate(body, 1)]
    else:
        reader = csv.reader(body, delimiter=delimiter, skipinitialspace=True)
        try:
            cells = [(reader.line_num, row) for row in reader]
        except csv.Error as error:
            at = layout.skip_rows + reader.line_num
            raise LayoutError(f"line {at} cannot be split ({error}); correct it: {path}") from error
    for number, row in cells:
        if any(row) and any(map(str.strip, row)):
            numbers.append(number + layout.skip_rows)
            rows.append(row)
    header = [name.strip() for name in rows.pop(0)] if layout.header and rows else []
    first = numbers.pop(0) if header else None
    if not rows:
        raise LayoutError(f"no rows of numbers after line {layout.skip_rows}: {path}")
    width, reference = (len(header), first) if header else (len(rows[0]), numbers[0])
    for number, row in zip(numbers, rows, strict=True):
        if len(row) != width:
            raise LayoutError(
                f"line {number} has {len(row)} columns where line {reference} has {width}; "
                f"correct the line, or the delimiter or skip_rows in {layout.where}: {path}"
            )
    return CellTable(path, numbers, rows, header)


def _text(path: Path, layout: Layout) -> str:
    """Read the file in the encoding of the layout, without a byte order mark."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise LayoutError(f"no such file: {path}") from None
    except OSError as error:
        raise LayoutError(
            f"cannot read: {(error.strerror or str(error)).lower()}: {path}"
        ) from error
    try:
        return data.decode(layout.encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise LayoutError(
            f"line {line} is not {layout.encoding}; give the encoding (cp1252 is common) in "
            f"{layout.where}: {path}"
        ) from error
