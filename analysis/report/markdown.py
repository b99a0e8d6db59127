"""Pages of tables in Markdown."""

from collections.abc import Iterable

from shiplog.text_table import TextTable


def markdown_page(title: str, sections: Iterable[TextTable], warnings: Iterable[str]) -> str:
    """Format tables, their remarks and warnings as a page in Markdown.

    Examples
    --------
    >>> table = TextTable("Track", ("north", "east"), (("1", "2"),))
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
