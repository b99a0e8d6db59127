"""Markdown pages with numbers of a paper, printed against computed: tables and pictures.

A script calls `start_page` first, then `paragraph`, `table`, `comparison` and `picture`. Its output
is its page in docs/. The pictures are saved in a folder of docs/images, or in the folder given by
``--figures``.
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
PALETTE_SIZE = 64  # colours of a picture: enough for lines with smooth edges, a third of the bytes
COMPARISON_HEADER = ("quantity", "printed", "computed", "computed − printed", "remark")
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
    """A quantity as the paper prints it, beside the value computed by shiplog.

    Attributes
    ----------
    quantity
        Name and unit.
    printed
        The text of the paper, such as ``"0.0373"``; its last digit defines the rounding that a
        deviation is compared with. None where the paper prints no value.
    computed
        The value computed. Where this or `printed` is not a number, both are shown as they are and
        no difference is computed.
    remark
        The reason of a deviation, or another remark.
    """

    quantity: str
    printed: str | None
    computed: float | str
    remark: str = ""


def start_page(title: str, image_folder: str = "papers") -> None:
    """Read the command line, set the style of the pictures and print the title.

    Parameters
    ----------
    title
        The title of the page.
    image_folder
        The folder in docs/images for the pictures, unless ``--figures`` names another.
    """
    _command_line().set_defaults(figures=DOCS / "images" / image_folder)
    _figure_folder()
    mpl.use("Agg")
    mpl.rcParams.update(STYLE)
    print(f"# {title}")


def paragraph(text: str) -> None:
    """Print a paragraph or a heading."""
    print(f"\n{text}")


def comparison(title: str, rows: Iterable[Row]) -> None:
    """Print a table of printed against computed values.

    A deviation larger than the rounding of the printed digits is set in bold.
    """
    table(title, COMPARISON_HEADER, map(_cells, rows))


def table(title: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a Markdown table, below a heading if `title` is not empty."""
    print(f"\n## {title}\n" if title else "")
    print(f"| {' | '.join(header)} |\n|{'---|' * len(header)}")
    for row in rows:
        cells = (cell.replace("|", r"\|") for cell in row)
        print(f"| {' | '.join(cells)} |")


def picture(name: str, figure: Figure, caption: str) -> None:
    """Save a figure as ``name.png`` and print a link to it, with its caption."""
    folder = _figure_folder()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.png"
    png = BytesIO()
    figure.savefig(png, format="png")
    Image.open(png).convert("RGB").quantize(PALETTE_SIZE).save(path, optimize=True)
    link = Path(os.path.relpath(path.resolve(), DOCS)).as_posix()
    print(f"\n![{caption}]({link})\n\n*{caption}*")


def number(value: float, digits: int = 6) -> str:
    """Format a number with so many significant digits and a typographic minus."""
    return f"{value:.{digits}g}".replace("-", "−")


@cache
def _command_line() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description="Print numbers as a Markdown page of the docs, and draw its figures."
    )
    parser.add_argument(
        "--figures",
        metavar="FOLDER",
        type=Path,
        help="folder to save the pictures in (default: a folder of docs/images)",
    )
    return parser


@cache
def _figure_folder() -> Path:
    folder: Path = _command_line().parse_args().figures
    return folder


def _cells(row: Row) -> tuple[str, ...]:
    """Format a row of a comparison, with the deviation where both values are numbers."""
    printed, computed = row.printed or "–", row.computed
    decimal = _decimal(printed)
    if isinstance(computed, str) or decimal is None:
        shown = computed if isinstance(computed, str) else number(computed)
        return row.quantity, printed, shown, "", row.remark
    _, digits, exponent = decimal.as_tuple()
    deviation = computed - float(decimal)
    text = number(deviation, 2) if deviation else "0"
    if abs(deviation) > 10.0 ** int(exponent) / 2 * (1 + 1e-6):
        text = f"**{text}**"
    shown = np.format_float_positional(computed, len(digits) + 2, fractional=False, trim="-")
    return row.quantity, printed.replace("-", "−"), shown.replace("-", "−"), text, row.remark


def _decimal(text: str) -> Decimal | None:
    """Return the number in a text, with either minus sign; None if it is not a number."""
    try:
        return Decimal(text.replace("−", "-"))
    except InvalidOperation:
        return None
