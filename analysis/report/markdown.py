"""Pages of tables in Markdown."""

import re
from collections.abc import Iterable

from shiplog.printable import printable
from shiplog.text_table import TextTable


def markdown_page(title: str, tables: Iterable[TextTable], warnings: Iterable[str]) -> str:
    """Format warnings and tables with their remarks as a page in Markdown, warnings first.

    Parameters
    ----------
    title
        The heading of the page.
    tables
        The tables, each with a heading of its own; their remarks are listed below them.
    warnings
        Sentences; without any there is no heading for them.

    Examples
    --------
    >>> table = TextTable("Track", ("north", "east"), (("1", "2"),))
    >>> print(markdown_page("zigzag", [table], ["no compass"]))
    # zigzag
    <BLANKLINE>
    ## Warnings
    <BLANKLINE>
    - no compass
    <BLANKLINE>
    ## Track
    <BLANKLINE>
    | north | east |
    | --- | --- |
    | 1 | 2 |
    <BLANKLINE>
    """
    blocks, listed = [f"# {_inline(title)}"], _markdown_list(warnings)
    if listed:
        blocks += ["## Warnings", listed]
    for table in tables:
        blocks += [f"## {_inline(table.title)}", *_table_blocks(table)]
    return "\n\n".join(blocks) + "\n"


def markdown_tables(tables: Iterable[TextTable]) -> str:
    """Format tables with their remarks, without headings, for a small text beside a picture."""
    return "\n\n".join(block for table in tables for block in _table_blocks(table)) + "\n"


def _table_blocks(table: TextTable) -> list[str]:
    columns = (column.replace("\n", " ") for column in table.columns)
    rows = _markdown_table(columns, table.rows)
    return [rows, _markdown_list(table.remarks)] if table.remarks else [rows]


def _markdown_list(items: Iterable[str]) -> str:
    return "\n".join(f"- {_inline(item)}" for item in items)


def _markdown_table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    columns = [_cell(column) or " " for column in columns]
    cells = (map(_cell, row) for row in rows)
    lines = [columns, ["---"] * len(columns), *cells]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(text: str) -> str:
    return _inline(text.replace("\n", " ")).replace("|", "\\|")


def _inline(text: str) -> str:
    """Return a text in one line without links, images and HTML, as it may come from a file."""
    return re.sub(r"\\|\](?=[(\[:])|<(?=[A-Za-z/!?])", r"\\\g<0>", printable(text))
