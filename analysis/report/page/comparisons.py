"""Manoeuvres of one kind against each other: port against starboard, trial against trial."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, isfinite
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreSeries
from analysis.report.display import NOT_KNOWN
from shiplog.text_table import TextTable
from shiplog.types import FloatArray
from shiplog.units import UNITS

from .manoeuvre_histories import has_numbers
from .manoeuvre_track import (
    chart_inches,
    length_scale,
    mark_execute,
    prepare_chart,
    shown_track,
    track_limits,
)
from .numbering import ManoeuvrePlace
from .svg_figure import SERIES, PageFigure, new_figure, page_figure
from .value_text import half_width_text

KNOT = UNITS["kn"][1]  # m/s
DASHES: tuple[tuple[float, ...], ...] = ((), (6, 1.5), (2, 1.5), (6, 1.5, 1, 1.5))
PANEL_INCHES = 1.05
MAX_COLUMNS = 4  # of manoeuvres side by side on A4


@dataclass(frozen=True, eq=False)
class ManoeuvreComparison:
    """Manoeuvres that can be compared, as a section of the page.

    Attributes
    ----------
    anchor, title
        Of the section.
    figures
        Time histories and tracks, aligned at the execute.
    tables
        The indices side by side, of so many manoeuvres in each as A4 is wide.
    """

    anchor: str
    title: str
    figures: tuple[PageFigure, ...]
    tables: tuple[TextTable, ...]


# (heading, title) of a panel, its values in the order of sides, and the factor to its unit
Panel = tuple[str, Callable[[ManoeuvreSeries], FloatArray], float, bool]
PANELS: tuple[Panel, ...] = (
    ("rudder [°]", lambda series: series.rudder, degrees(1), True),
    ("heading [°]", lambda series: series.heading_change, degrees(1), True),
    ("yaw rate [°/s]", lambda series: series.yaw_rate, degrees(1), True),
    ("speed [kn]", lambda series: series.speed, 1 / KNOT, False),
)


def comparisons_of(
    places: Sequence[ManoeuvrePlace], length: float
) -> tuple[ManoeuvreComparison, ...]:
    """Compare all manoeuvres of the same kind, rudder angle and switch heading.

    Those to port are mirrored, so that a symmetric ship would give one curve.

    Parameters
    ----------
    places
        The manoeuvres of all logs.
    length
        Of the ship, m; NaN where unknown.
    """
    groups: dict[tuple[str, float, float], list[ManoeuvrePlace]] = {}
    for place in places:
        groups.setdefault(_likeness(place), []).append(place)
    alike = [group for group in groups.values() if len(group) > 1 and group[0].manoeuvre.side]
    return tuple(
        _comparison(group, length, f"comparison-{number}")
        for number, group in enumerate(alike, start=1)
    )


def _likeness(place: ManoeuvrePlace) -> tuple[str, float, float]:
    """Return what manoeuvres must share to be compared: kind and angles to a degree."""
    manoeuvre = place.manoeuvre
    rudder, switch = (
        round(abs(degrees(angle))) if isfinite(angle) else -1
        for angle in (manoeuvre.rudder, manoeuvre.switch_heading)
    )
    return str(manoeuvre.kind), rudder, switch


def _comparison(group: Sequence[ManoeuvrePlace], length: float, anchor: str) -> ManoeuvreComparison:
    kind, rudder, switch = _likeness(group[0])
    angles = f" {rudder}°" if rudder >= 0 else ""
    angles += f"/{switch}°" if switch >= 0 else ""
    title = f"{kind[:1].upper()}{kind[1:]}{angles}"
    figures = (
        _history_figure(group, f"{anchor}-histories", title),
        _track_figure(group, length, f"{anchor}-tracks", title),
    )
    shown = tuple(figure for figure in figures if figure is not None)
    parts = [group[i : i + MAX_COLUMNS] for i in range(0, len(group), MAX_COLUMNS)]
    tables = tuple(_index_table(part, title) for part in parts)
    return ManoeuvreComparison(anchor, title, shown, tables)


def _label(place: ManoeuvrePlace) -> str:
    return f"{place.position}, {place.manoeuvre.side}"


def _mirror(place: ManoeuvrePlace) -> float:
    return -1.0 if place.manoeuvre.side == "port" else 1.0


def _is_mirrored(group: Sequence[ManoeuvrePlace]) -> str:
    return "; port mirrored" if any(place.manoeuvre.side == "port" for place in group) else ""


def _style(number: int) -> dict[str, Any]:
    """Return the colour and the dashes of a line, which differ in print without colours too."""
    dashes = DASHES[number // len(SERIES) % len(DASHES)] or DASHES[number % len(DASHES)]
    return {"color": SERIES[number % len(SERIES)], "linestyle": (0, dashes) if dashes else "-"}


def _history_figure(group: Sequence[ManoeuvrePlace], anchor: str, title: str) -> PageFigure | None:
    panels = [
        panel
        for panel in PANELS
        if any(has_numbers(panel[1](place.manoeuvre.series)) for place in group)
    ]
    if not panels:
        return None
    with new_figure([PANEL_INCHES] * len(panels)) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            _draw_panel(axes, group, panel)
        grid[-1].set_xlabel("time from the execute [s]")
        grid[-1].set_xlim(
            min(place.manoeuvre.series.time_secs[0] for place in group),
            max(place.manoeuvre.series.time_secs[-1] for place in group),
        )
        grid[0].legend(
            loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2,
        )  # fmt: skip
        caption = f"Time histories aligned at the execute: {title}{_is_mirrored(group)}"
        text = f"{len(group)} manoeuvres over the same time axis: {_list(group)}."
        return page_figure(figure, anchor, caption, text)


def _draw_panel(axes: Axes, group: Sequence[ManoeuvrePlace], panel: Panel) -> None:
    label, values_of, factor, has_sides = panel
    for number, place in enumerate(group):
        values = values_of(place.manoeuvre.series)
        if has_numbers(values):
            sign = _mirror(place) if has_sides else 1.0
            axes.plot(
                place.manoeuvre.series.time_secs,
                sign * factor * values,
                label=_label(place),
                linewidth=1.1,
                **_style(number),
            )
    axes.set_ylabel(label)


def _track_figure(
    group: Sequence[ManoeuvrePlace], length: float, anchor: str, title: str
) -> PageFigure | None:
    tracks = [
        (number, place, shown_track(place.manoeuvre.series, length) * [1.0, _mirror(place)])
        for number, place in enumerate(group)
        if has_numbers(place.manoeuvre.series.track)
    ]
    if not tracks:
        return None
    low, high = track_limits(np.concatenate([track for _, _, track in tracks]))
    with new_figure([chart_inches(low, high)]) as (figure, (axes,)):
        chart = prepare_chart(axes, low, high)
        for number, place, track in tracks:
            chart.plot(track, label=_label(place), linewidth=1.1, **_style(number))
        mark_execute(chart)
        length_scale(chart, length)
        chart.axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2)
        caption = f"Tracks aligned at the execute: {title}{_is_mirrored(group)}"
        text = f"{len(tracks)} tracks from one execute and approach heading: {_list(group)}."
        return page_figure(figure, anchor, caption, text)


def _list(group: Sequence[ManoeuvrePlace]) -> str:
    return "; ".join(_label(place) for place in group)


def _index_table(group: Sequence[ManoeuvrePlace], title: str) -> TextTable:
    """Return the indices of the manoeuvres side by side, ± half their 95 % interval."""
    names = dict.fromkeys(index.name for place in group for index in place.manoeuvre.indices)
    rows = [(name, *(_cell(place, name) for place in group)) for name in names]
    columns = ("index", *(f"{_label(place)}\n(log {place.log_number})" for place in group))
    title += f", manoeuvres {', '.join(str(place.position) for place in group)}"
    remark = "Values with half the width of their 95 % interval."
    return TextTable(f"Indices side by side: {title}", columns, tuple(rows), (remark,))


def _cell(place: ManoeuvrePlace, name: str) -> str:
    index = place.manoeuvre.index(name)
    return NOT_KNOWN if index is None else half_width_text(index)
