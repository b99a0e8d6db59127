"""What a verb prints: progress, tables, lines, warnings, JSON.

Verbs print by these functions alone: they escape what could control a terminal, and replace what
its encoding lacks.
"""

import json
import sys
import textwrap
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from shiplog.errors import CacheWarning
from shiplog.files import atomic_write
from shiplog.printable import escape_json, printable, shortened
from shiplog.progress import ProgressCallback, no_progress
from shiplog.text_table import TextTable

from .terminal import encodable

MIN_NAME_WIDTH = 12  # characters of a shortened cell in the first column
MAX_NAME_LINES = 2  # of a cell in the first column that is wrapped
MIN_PROSE_WIDTH = 30  # characters of a column that is wrapped
EDGES, GAP = 4, 3  # of a printed table, in characters
FIRST_ESTIMATE_SECS = 2.0  # of work, before the remaining time is estimated


@contextmanager
def progress(compiles: str | None = None, *, lines: bool = False) -> Iterator[ProgressCallback]:
    """Show the progress of long work on stderr.

    On a terminal as a bar with the elapsed and the remaining time; elsewhere only where `lines`
    is set, one line a step.

    Parameters
    ----------
    compiles
        The package whose loops the work needs; where they were never compiled on this computer,
        the text states that they are.
    lines
        Whether to print a line for each step of a known share where stderr is no terminal.
    """
    note = ""
    if compiles:
        from shiplog.compiled import is_compiled

        note = "" if is_compiled(compiles) else " (first run: compiling the loops, once)"
    if sys.stderr.isatty():
        with _progress_bar(note) as on_progress:
            yield on_progress
    else:
        yield _progress_lines(note) if lines else no_progress


@contextmanager
def _progress_bar(note: str) -> Iterator[ProgressCallback]:
    """Show the progress as a bar that is removed at the end, with the note after each step."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    bar_columns = (SpinnerColumn("line"), BarColumn(bar_width=24), TimeElapsedColumn())
    columns = (*bar_columns, TextColumn("{task.description}"))
    start = time.monotonic()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def on_progress(step: str, share: float | None = None, /) -> None:
            text = f"{printable(step)}{note}{_remaining(time.monotonic() - start, share)}"
            total = None if share is None else 1.0
            bar.update(task, description=text, total=total, completed=share or 0.0)

        yield on_progress


def _progress_lines(note: str) -> ProgressCallback:
    """Return a callback that prints each step of a known share once, the first with the note."""
    start, reported = time.monotonic(), set[str]()

    def on_progress(step: str, share: float | None = None, /) -> None:
        if share is not None and step not in reported:
            text = f"{step}{_remaining(time.monotonic() - start, share)}"
            print_line(text if reported else text + note, to_stderr=True)
            reported.add(step)

    return on_progress


def _remaining(elapsed_secs: float, share: float | None) -> str:
    """Estimate the remaining time, in words; nothing where it is too early."""
    if not share or elapsed_secs < FIRST_ESTIMATE_SECS or share >= 1.0:
        return ""
    secs = elapsed_secs * (1 - share) / share
    return f", about {secs:.0f} s left" if secs < 100 else f", about {secs / 60:.0f} min left"


def print_tables(tables: Sequence[TextTable], *, to_stderr: bool = False) -> None:
    """Print tables and their remarks, in the width of the console.

    No number is broken: headings and cells of the first column wrap between words, long words in
    that column are shortened in the middle as far as the cells stay distinct, and a table that is
    still too wide is printed in parts. Sentences in the last column wrap between words.
    """
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    console = Console(stderr=to_stderr, highlight=False, markup=False)  # [deg] is a unit

    def safe(text: str) -> str:
        return encodable(printable(text), console.encoding)

    for table in tables:
        headings = ["\n".join(map(safe, heading.split("\n"))) for heading in table.columns]
        rows = [tuple(map(safe, row)) for row in table.rows]
        fixed = len(table.columns) - table.has_prose  # columns that are not wrapped
        room = console.width - (MIN_PROSE_WIDTH + GAP if table.has_prose else 0)
        parts = _fitted(headings[:fixed], [row[:fixed] for row in rows], room)
        for number, part in enumerate(parts):
            title = safe(table.title) + (" (continued)" if number else "")
            shown = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE)
            for i, heading in enumerate(part[0]):
                shown.add_column(
                    heading, justify="left" if i == 0 else "right", no_wrap=True, overflow="fold"
                )
            prose = fixed if number == 0 else len(headings)  # where it begins in this part
            for heading in headings[prose:]:
                shown.add_column(heading, overflow="fold")
            for cells, row in zip(part[1:], rows, strict=True):
                shown.add_row(*cells, *row[prose:])
            console.print(shown)
        for remark in table.remarks:
            console.print(safe(remark))
        console.print()


def _fitted(
    columns: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> Iterator[list[list[str]]]:
    """Parts of a table that fit a width, headings first, the first column in each."""
    room = width - EDGES
    sizes = _sizes(columns, rows, lambda heading: max(map(len, heading.split("\n"))))
    least = _sizes(columns, rows, lambda heading: max(map(len, heading.split()), default=0))
    least[0] = min(least[0], _distinct_width([row[0] for row in rows]))
    while _total(sizes) > room and sizes != least:
        widest = max(range(len(sizes)), key=lambda i: (sizes[i] - least[i], -i))
        sizes[widest] -= 1
    first, parts, used = sizes[0], [[0]], sizes[0]
    for i in range(1, len(columns)):
        if used + GAP + sizes[i] > room and len(parts[-1]) > 1:
            parts.append([0])
            used = first
        parts[-1].append(i)
        used += GAP + sizes[i]
    for part in parts:
        headings = [_wrapped(columns[i], sizes[i]) for i in part]
        cells = [[_name(row[i], sizes[i]) if i == 0 else row[i] for i in part] for row in rows]
        yield [headings, *cells]


def _sizes(
    columns: Sequence[str], rows: Sequence[Sequence[str]], least: Callable[[str], int]
) -> list[int]:
    """Return the width of each column, given the least width of a heading."""
    return [
        max(1, least(heading), *(len(row[i]) for row in rows)) for i, heading in enumerate(columns)
    ]


def _distinct_width(names: Sequence[str]) -> int:
    """Return the least width at which names stay distinct and need at most `MAX_NAME_LINES`."""
    distinct = len(set(names))
    width = MIN_NAME_WIDTH
    while True:
        cells = {_name(name, width) for name in names}
        if len(cells) == distinct and all(cell.count("\n") < MAX_NAME_LINES for cell in cells):
            return width
        width += 1


def _name(text: str, size: int) -> str:
    """Wrap a cell of the first column between words, and shorten the words that are too long."""
    if len(text) <= size:
        return text
    indent = text[: len(text) - len(text.lstrip())]
    lines = textwrap.wrap(
        text, size, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(shortened(line, size) for line in lines)


def _total(sizes: Sequence[int]) -> int:
    return sum(sizes) + GAP * (len(sizes) - 1)


def _wrapped(heading: str, size: int) -> str:
    lines = [textwrap.wrap(line, size, break_long_words=False) for line in heading.split("\n")]
    return "\n".join(part for line in lines for part in line)


def print_line(text: str, *, to_stderr: bool = False) -> None:
    """Print a text in one line at once: a result on stdout, any other information on stderr."""
    print(printable(text), file=sys.stderr if to_stderr else sys.stdout, flush=to_stderr)


def print_lines(text: str, *, to_stderr: bool = False) -> None:
    """Print a text whose line ends are ours."""
    for line in text.split("\n"):
        print_line(line, to_stderr=to_stderr)


def print_warnings(warnings: Sequence[str]) -> None:
    """Print warnings on stderr, a line each."""
    for warning in warnings:
        print_line(f"warning: {warning}", to_stderr=True)


def print_cache_warnings() -> None:
    """Print warnings about the cache of compiled loops as those of data; others as Python does."""
    show_others = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *place: Any, **kept: Any) -> None:  # noqa: ANN401
        if issubclass(category, CacheWarning):
            print_warnings([str(message)])
        else:
            show_others(message, category, *place, **kept)

    warnings.showwarning = show


def print_toml(text: str) -> None:
    """Print a file in TOML on stdout, with what its encoding may lack as escapes of TOML."""
    if not _is_unicode(sys.stdout.encoding):
        text = "".join(c if c.isascii() else f"\\U{ord(c):08x}" for c in text)
    sys.stdout.write(text)


def write_json(value: object, where: str) -> None:
    """Write a value as JSON to a file, or to stdout where its name is ``-``.

    Characters that do not print are escaped, as for a terminal, and on stdout those that its
    encoding may lack.
    """
    ensure_ascii = where == "-" and not _is_unicode(sys.stdout.encoding)
    text = json.dumps(value, indent=2, ensure_ascii=ensure_ascii, allow_nan=False)
    text = "\n".join(map(escape_json, text.split("\n"))) + "\n"
    if where == "-":
        sys.stdout.write(text)
        return
    with atomic_write(where) as part:
        part.write_text(text, encoding="utf-8")


def _is_unicode(encoding: str | None) -> bool:
    """Whether an encoding has all characters; None, of a text in memory, has them."""
    return encoding is None or encoding.lower().startswith("utf")
