"""Delimited text of a foreign table, split into cells."""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.errors import LayoutError
from shiplog.layouts.header_words import is_units_row
from shiplog.layouts.layout import DELIMITERS, Layout


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
    units
        Cells of the row of units under the header; empty without one.
    """

    path: Path
    lines: list[int]
    rows: list[list[str]]
    header: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)


def read_cells(path: Path, layout: Layout) -> CellTable:
    """Split a text into cells as its layout describes it; blank lines and comments are skipped.

    Raises
    ------
    LayoutError
        The text cannot be read or split, has no rows, or a row of another length; the message
        names the line.
    """
    lines = _text(path, layout).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    numbers: list[int] = []
    rows: list[list[str]] = []
    comments: list[tuple[int, list[str]]] = []  # before the first row, as cells
    for number, row in _split(lines[layout.skip_rows :], path, layout):
        is_comment = layout.comment and row and row[0].lstrip().startswith(layout.comment)
        if is_comment:
            if not rows:
                row[0] = row[0].lstrip().removeprefix(layout.comment)
                comments.append((number, row if row[0].strip() else row[1:]))
        elif any(map(str.strip, row)):
            numbers.append(number + layout.skip_rows)
            rows.append([cell.strip() for cell in row])
    header: list[str] = []
    if layout.header and rows:
        first_line = numbers[0]
        if _commented_header(comments, rows[0]):
            header = [name.strip() for name in comments[-1][1]]
        else:
            header = rows.pop(0)
            numbers.pop(0)
    units: list[str] = []
    if header and len(rows) > 1 and is_units_row(rows[0], rows[1]):
        units = rows.pop(0) + [""] * len(header)
        numbers.pop(0)
    if not rows:
        raise LayoutError(f"no rows of numbers after line {layout.skip_rows}: {path}")
    reference = first_line if header else numbers[0]
    _equalise(rows, numbers, header, reference, path, layout)
    return CellTable(path, numbers, rows, header, units[: len(header)])


def _split(body: list[str], path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Split lines into cells; yield the number of the line, from 1, and its cells."""
    delimiter = DELIMITERS[layout.delimiter]
    if delimiter is None:
        yield from ((number, line.split()) for number, line in enumerate(body, 1))
        return
    reader = csv.reader(body, delimiter=delimiter, skipinitialspace=True)
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as error:
        at = layout.skip_rows + reader.line_num
        raise LayoutError(f"line {at} cannot be split ({error}); correct it: {path}") from error


def _commented_header(comments: list[tuple[int, list[str]]], first: list[str]) -> bool:
    """Whether the header is in the comment before the first row, which then has a number."""
    if not comments or len(comments[-1][1]) != len(first):
        return False
    return any(
        re.fullmatch(r"[+-]?\d+([.,]\d*)?(e[+-]?\d+)?", cell, re.IGNORECASE) for cell in first
    )


def _equalise(
    rows: list[list[str]],
    numbers: list[int],
    header: list[str],
    reference: int,
    path: Path,
    layout: Layout,
) -> None:
    """Give all rows one length: delimiters at the ends of rows make no columns."""
    width = len(header or rows[0])
    needed = max((i + 1 for i, name in enumerate(header) if name), default=0)
    if not header:
        needed = max(_filled(row) for row in rows)
    for i, row in enumerate(rows):
        if len(row) < min(needed, width) or _filled(row) > width:
            raise LayoutError(
                f"line {numbers[i]} has {len(row)} columns where line {reference} has {width}; "
                f"correct the line, or the delimiter or skip_rows in {layout.where}: {path}"
            )
        rows[i] = row[:width] + [""] * (width - len(row))


def _filled(row: list[str]) -> int:
    """Return the number of cells up to the last one that is not empty."""
    count = len(row)
    while count and not row[count - 1]:
        count -= 1
    return count


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
    except UnicodeError as error:
        line = data.count(b"\n", 0, getattr(error, "start", 0)) + 1
        raise LayoutError(
            f"line {line} is not {layout.encoding}; give the encoding (cp1252 is common) in "
            f"{layout.where}: {path}"
        ) from error
