"""Tables for people, and pages of tables in Markdown."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """A table with a title and remarks, in the units people use.

    Attributes
    ----------
    title
        The title of the table.
    columns
        The heading of each column; a newline in it is a good place to break the line.
    rows
        The cells of each row, as many as there are columns.
    remarks
        Sentences below the table.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()


def markdown_page(title: str, sections: Iterable[Section], warnings: Iterable[str]) -> str:
    """Format tables, their remarks and warnings as a page in Markdown.

    Examples
    --------
    >>> table = Section("Track", ("north", "east"), (("1", "2"),))
    >>> print(markdown_page("zigzag", [table], ["no compass"]))
    # zigzag
    <BLANKLINE>
    ## Track
    <BLANKLINE>
    | north | east |
    | --- | --- |
    | 1 | 2 |
    <BLANKLINE>
    ## Warnings
    <BLANKLINE>
    - no compass
    <BLANKLINE>
    """
    blocks = [f"# {title}"]
    for section in sections:
        columns = (column.replace("\n", " ") for column in section.columns)
        blocks += [f"## {section.title}", _markdown_table(columns, section.rows)]
        blocks += [f"*{remark}*" for remark in section.remarks]
    listed = "\n".join(f"- {warning}" for warning in warnings)
    blocks += ["## Warnings", listed] if listed else []
    return "\n\n".join(blocks) + "\n"


def _markdown_table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    columns = [column or " " for column in columns]
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
