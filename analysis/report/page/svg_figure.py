"""Figures as SVG in a page: readable text, the page's colours in light and dark, alternative texts.

matplotlib draws them. Its colours are replaced by the page's CSS variables, so that one drawing
serves the light page, the dark page and the print.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import StringIO

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from shiplog.printable import printable

WIDTH_INCHES = 7.0  # of a figure: the text's width on A4
MARGINS_INCHES = (0.7, 0.6, 0.45, 0.3)  # left, right, below, above
CHART_INCHES = WIDTH_INCHES - MARGINS_INCHES[0] - MARGINS_INCHES[1]  # width of the axes
GAP_INCHES = 0.12  # between panels
LABEL_SHARE = 0.1  # of the width of the axes, from them to their vertical labels
# a colour that no figure uses otherwise, and the variable of the page that takes its place
INK, MUTED, GRID, PAPER = "#010101", "#010102", "#010103", "#010104"
SERIES = ("#010111", "#010112", "#010113", "#010114", "#010115", "#010116")
VARIABLES = {
    INK: "var(--ink)",
    MUTED: "var(--muted)",
    GRID: "var(--grid)",
    PAPER: "var(--paper)",
    **{colour: f"var(--series-{i + 1})" for i, colour in enumerate(SERIES)},
}
STYLE = {
    "svg.fonttype": "none",  # text stays text: it can be read, found and copied
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Arial", "Helvetica"],
    "font.size": 8.5,
    "text.parse_math": False,  # a $ in a file's text is a $
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.titlesize": 8.5,
    "figure.facecolor": "none",
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.3,
    "path.simplify_threshold": 0.4,  # points of 1/72 inch: what print does not resolve is omitted
}


@dataclass(frozen=True)
class PageFigure:
    """A figure of the page.

    Attributes
    ----------
    anchor
        Its id in the page.
    caption
        What it shows, in a sentence, below it.
    svg
        The element ``<svg>``.
    """

    anchor: str
    caption: str
    svg: Markup


@contextmanager
def new_figure(heights_inches: Sequence[float]) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure in the style of the page, to be drawn and converted in the block.

    Its margins are fixed, so that the time axes of all figures are alike.

    Parameters
    ----------
    heights_inches
        Of the panels, one above the other over the same horizontal axis.

    Yields
    ------
    figure
        The figure.
    axes
        Its panels, from above.
    """
    left, right, bottom, top = MARGINS_INCHES
    height = sum(heights_inches) + GAP_INCHES * (len(heights_inches) - 1) + bottom + top
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]  # its keys are a long literal type
        figure = Figure(figsize=(WIDTH_INCHES, height))
        grid = figure.subplots(
            len(heights_inches),
            1,
            sharex=True,
            squeeze=False,
            height_ratios=heights_inches,
            gridspec_kw={
                "left": left / WIDTH_INCHES,
                "right": 1 - right / WIDTH_INCHES,
                "bottom": bottom / height,
                "top": 1 - top / height,
                "hspace": GAP_INCHES * len(heights_inches) / sum(heights_inches),
            },
        )
        for axes in grid[:, 0]:
            axes.yaxis.set_label_coords(-LABEL_SHARE, 0.5)
        yield figure, list(grid[:, 0])


def page_figure(figure: Figure, anchor: str, caption: str, description: str) -> PageFigure:
    """Convert a figure to SVG for the page.

    Parameters
    ----------
    figure
        Drawn within the block of `new_figure`.
    anchor
        Its id, unique in the page; the ids within the figure begin with it.
    caption
        What it shows: its title for screen readers, too.
    description
        Its content in words, for those who cannot see it.
    """
    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": anchor}):  # else the ids are random
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>", "", svg, flags=re.DOTALL)
    svg = _with_numbered_ids(svg)
    svg = re.sub(r'(\bid="|url\(#|xlink:href="#)', rf"\g<1>{anchor}-", svg)
    svg = re.sub(r' (?:d|x|y|transform|points)="[^"]*"', _rounded, svg)
    for colour, variable in VARIABLES.items():
        svg = svg.replace(colour, variable)
    head = _head(svg, anchor, caption, description)
    body = svg[svg.index(">") + 1 :]
    return PageFigure(anchor, caption, Markup(head + re.sub(r"\s*\n\s*", "\n", body)))  # noqa: S704 - matplotlib escapes its texts


def _with_numbered_ids(svg: str) -> str:
    """Number the ids that are hashes of coordinates, whose last bits differ from run to run."""
    numbers: dict[str, str] = {}
    for hashed in re.findall(r'(?:\bid="|#)([A-Za-z]\w*[0-9a-f]{10})\b', svg):
        numbers.setdefault(hashed, f"{hashed[0]}{len(numbers) + 1}")
    return re.sub(r"\b[A-Za-z]\w*[0-9a-f]{10}\b", lambda id_: numbers.get(id_[0], id_[0]), svg)


def _rounded(attribute: re.Match[str]) -> str:
    """Round the coordinates of an attribute to 1/100 point, which halves the size of a figure."""
    return re.sub(r"-?\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", attribute[0])


def _head(svg: str, anchor: str, caption: str, description: str) -> str:
    """Return the opening tag with title and description; the page scales it to its width."""
    found = re.search(r'viewBox="[^"]*"', svg)
    assert found is not None  # noqa: S101 - matplotlib writes one
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'{found[0]} role="img" aria-labelledby="{anchor}-title {anchor}-text">'
        f'<title id="{anchor}-title">{escape(printable(caption))}</title>'
        f'<desc id="{anchor}-text">{escape(printable(description))}</desc>'
    )
