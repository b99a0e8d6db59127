"""What a paper prints against what shiplog computes: tables and pictures of a Markdown page.

A script calls `page` first, then `say`, `table`, `grid` and `picture`; what it prints is its page
in docs/. Pictures go to a folder of docs/images, or to the one that `--figures` names.
"""

import argparse
import os
from collections.abc import Iterable, Sequence
from decimal import Decimal, InvalidOperation
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.figure import Figure
from PIL import Image

DOCS = Path(__file__).resolve().parents[2] / "docs"
BLUE, AMBER, GREEN, RED, GREY = "#2a6f97", "#e09f3e", "#3a7d44", "#c1383f", "#8d99ae"
COLOURS = 64  # enough for lines and their edges, and a third of the bytes
HEAD = ("quantity", "printed", "computed", "computed − printed", "remark")
STYLE: dict[Any, Any] = {
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=[BLUE, AMBER, GREEN, RED, "#6d597a", GREY]),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": "medium",
    "figure.constrained_layout.use": True,
    "figure.dpi": 110,
    "font.size": 9.5,
    "grid.color": "#e5e5e5",
    "legend.frameon": False,
    "lines.linewidth": 1.6,
}


class Row(NamedTuple):
    """A quantity of the paper's, beside ours.

    `printed` as the paper spells it, "0.0373": its digits say what the deviation may be; None
    where it prints nothing. Text on either side is set as it is, and nothing is subtracted.
    """

    quantity: str
    printed: str | None
    computed: float | str
    remark: str = ""


def page(title: str, pictures: str = "papers") -> None:
    """The page's title; reads the command line and sets how pictures look.

    They go to the folder `pictures` of docs/images, unless the command line names another.
    """
    _command_line().set_defaults(figures=DOCS / "images" / pictures)
    _folder()
    mpl.use("Agg")
    mpl.rcParams.update(STYLE)
    print(f"# {title}")


def say(text: str) -> None:
    """A paragraph, or a heading."""
    print(f"\n{text}")


def table(title: str, rows: Iterable[Row]) -> None:
    """Printed against computed; a deviation beyond the printed digits' rounding is set bold."""
    grid(title, HEAD, map(_cells, rows))


def grid(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Any Markdown table, with a heading where `title` is not empty."""
    print(f"\n## {title}\n" if title else "")
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for row in rows:
        cells = (cell.replace("|", r"\|") for cell in row)
        print(f"| {' | '.join(cells)} |")


def figure(name: str) -> Path:
    """The file of the picture `name`, its folder made."""
    _folder().mkdir(parents=True, exist_ok=True)
    return _folder() / f"{name}.png"


def picture(name: str, drawn: Figure, caption: str) -> None:
    """Saves a figure and links it into the page."""
    path = figure(name)
    shot = BytesIO()
    drawn.savefig(shot, format="png")
    Image.open(shot).convert("RGB").quantize(COLOURS).save(path, optimize=True)
    link = Path(os.path.relpath(path.resolve(), DOCS)).as_posix()
    print(f"\n![{caption}]({link})\n\n*{caption}*")


def number(value: float, digits: int = 6) -> str:
    """A number as it stands in a table, with a true minus."""
    return f"{value:.{digits}g}".replace("-", "−")


@cache
def _command_line() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description="Print numbers as a Markdown page of the docs, and draw its figures."
    )
    parser.add_argument(
        "--figures", metavar="FOLDER", type=Path, help="where the pictures go (docs/images/...)"
    )
    return parser


@cache
def _folder() -> Path:
    folder: Path = _command_line().parse_args().figures
    return folder


def _cells(row: Row) -> tuple[str, ...]:
    printed, computed = row.printed or "–", row.computed
    spelled = _decimal(printed)
    if isinstance(computed, str) or spelled is None:
        shown = computed if isinstance(computed, str) else number(computed)
        return row.quantity, printed, shown, "", row.remark
    _, digits, exponent = spelled.as_tuple()
    off = computed - float(spelled)
    said = number(off, 2) if off else "0"
    if abs(off) > 10.0 ** int(exponent) / 2 * (1 + 1e-6):
        said = f"**{said}**"
    shown = np.format_float_positional(computed, len(digits) + 2, fractional=False, trim="-")
    return row.quantity, printed.replace("-", "−"), shown.replace("-", "−"), said, row.remark


def _decimal(text: str) -> Decimal | None:
    """The number a text spells, with any minus; None where it spells none."""
    try:
        return Decimal(text.replace("−", "-"))
    except InvalidOperation:
        return None
