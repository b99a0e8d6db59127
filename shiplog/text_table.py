"""A table of text, for a terminal or a page."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TextTable:
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
    has_prose
        Whether the cells of the last column are sentences, which may be wrapped.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()
    has_prose: bool = False
