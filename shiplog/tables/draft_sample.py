"""Sample of a foreign table: its encoding, delimiter, header and first rows, as detected."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.layouts.header_words import is_units_row
from shiplog.layouts.layout import DELIMITERS
from shiplog.types import FloatArray

SAMPLE_LINES = 5000  # of the table, from which a layout is drafted
ENCODINGS = ("utf-8", "cp1252")


@dataclass(frozen=True)
class TableSample:
    """The first rows of a table.

    Attributes
    ----------
    keys
        Keys of the layout's top level: encoding, delimiter, skip_rows, header, decimal_comma.
    columns
        Cells of each column, by its name in the header.
    units
        Units in the row under the header, by the name of the column; empty without such a row.
    """

    keys: dict[str, object]
    columns: dict[str, list[str]]
    units: dict[str, str]


def read_sample(path: Path) -> TableSample:
    """Read the first lines of a table and detect how they are delimited.

    Raises
    ------
    LayoutError
        The file cannot be read, is not delimited text, or has no header.
    """
    text, encoding = _read(path)
    delimiter = _delimiter(text, path)
    keys, header, rows = _table(text, delimiter, path)
    units: dict[str, str] = {}
    if len(rows) > 1 and is_units_row(rows[0], rows[1]):
        units = dict(zip(header, rows.pop(0), strict=False))
    columns = {name: [row[i] for row in rows] for i, name in enumerate(header) if name}
    return TableSample({"encoding": encoding, "delimiter": delimiter} | keys, columns, units)


def sample_numbers(cells: Sequence[str], *, comma: bool) -> FloatArray:
    """Return the numbers among cells, NaN for others; zeros where no cell is a number."""
    plain = [cell.replace(",", ".") if comma else cell for cell in cells]
    values = np.array([float(text) if _is_number(text) else np.nan for text in plain])
    return values if np.any(np.isfinite(values)) else np.zeros(len(values))


def _read(path: Path) -> tuple[str, str]:
    """Return the first lines of a table, and its encoding."""
    try:
        data = path.read_bytes()[:1_000_000]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LayoutError(f"cannot read: {reason}: {path}") from error
    data = b"\n".join(data.splitlines()[:SAMPLE_LINES])
    for encoding in ENCODINGS:
        try:
            return data.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    raise LayoutError(f"not text in {' or '.join(ENCODINGS)}; write the layout by hand: {path}")


def _delimiter(text: str, path: Path) -> str:
    """Return the delimiter that splits most lines into the same number of cells, above one."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    scores = {}
    for name, sign in DELIMITERS.items():
        counts = [len(line.split(sign)) for line in lines]
        typical = max(set(counts), key=counts.count) if counts else 0
        scores[name] = (counts.count(typical) > 0.9 * len(counts) and typical > 1, sign is not None)
    for name in (";", "tab", ",", "whitespace"):
        if scores[name][0]:
            return name
    raise LayoutError(
        f"no delimiter splits the lines into columns; write the layout by hand: {path}"
    )


def _table(
    text: str, delimiter: str, path: Path
) -> tuple[dict[str, object], list[str], list[list[str]]]:
    """Split the text; return the keys of the top level, the header and the rows."""
    sign = DELIMITERS[delimiter]
    try:
        cells = (
            [line.split() for line in text.splitlines()] if sign is None
            else list(csv.reader(io.StringIO(text), delimiter=sign, skipinitialspace=True))
        )  # fmt: skip
    except csv.Error as error:
        raise LayoutError(f"cannot be split ({error}); write the layout by hand: {path}") from error
    counts = [len(row) for row in cells if any(row)]
    typical = max(set(counts), key=counts.count) if counts else 0
    first = next((i for i, row in enumerate(cells) if len(row) >= typical - 1 and any(row)
                  and not row[0].startswith("#") and len(row) > 1), 0)  # fmt: skip
    header = [cell.strip() for cell in cells[first]] if cells else []
    rows = [[cell.strip() for cell in row] for row in cells[first + 1 :]
            if any(map(str.strip, row)) and not row[0].startswith("#")]  # fmt: skip
    if not rows or any(_is_number(cell) for cell in header):
        raise LayoutError(f"no header above the numbers; write the layout by hand: {path}")
    rows = [row + [""] * (len(header) - len(row)) for row in rows]
    numbers = [cell for row in rows[:100] for cell in row]
    comma = delimiter != "," and any(re.fullmatch(r"[+-]?\d+,\d+", cell) for cell in numbers)
    return {"skip_rows": first, "header": True, "decimal_comma": comma}, header, rows


def _is_number(text: str) -> bool:
    return bool(re.fullmatch(r"[+-]?\d+([.,]\d*)?([eE][+-]?\d+)?", text.strip()))
