"""The panels of logs that are viewed without a replay, one over the other by time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.checks.event_table import OPERATOR
from shiplog.units import CATALOGUE

from .channel_series import DrawnQuantity
from .log_drawing import LogDrawing
from .panels import Panel, range_text, strokes, title_of, varies, with_range, words
from .quantity_panel import SOURCE_COLOURS, entity_part, joined_panel, turned_together
from .series import BLUE, GREEN, GREY, ORANGE, RED, Colour, Line, Series
from .steering_panels import MAX_OVERLAID_TURN, RUDDER_COLOUR

MAIN_PANELS = ("heading",), ("rudder",), ("yaw_rate",), ("speed", "speed_over_ground"), ("rpm",)
COLOURS = {"heading": BLUE, "yaw_rate": BLUE, "speed": ORANGE, "speed_over_ground": ORANGE,
           "rudder": RUDDER_COLOUR, "rpm": GREEN}  # fmt: skip
REFERENCE_SECS = (
    10.0  # of a heading, at its start or before the execute: its median is the reference
)
MARKS, GAPS = "00_marks", "gaps"  # series: marks are drawn below the others
MAX_MARKS = 50  # of people, drawn as vertical lines


def log_panels(drawings: Sequence[LogDrawing]) -> tuple[list[Panel], list[Panel]]:
    """Return the panels of the main quantities, and of all others.

    Where the ship turns by less than `MAX_OVERLAID_TURN`, as in a zig-zag, the rudder is drawn over
    the heading, which counts from the one at the start, or before the execute where times count
    from it. Several logs have a colour each. Gaps are red bars at the foot of a panel, marks of
    people vertical lines. Constant revolutions have no panel beside that of the speed, whose title
    gives them.

    Parameters
    ----------
    drawings
        The logs; the times of each count from its own start or execute.
    """
    quantities = list(dict.fromkeys(each for drawing in drawings for each in drawing.series))
    main = [[q for q in quantities if q.name in names and _is_usual(q)] for names in MAIN_PANELS]
    others = [[each] for each in quantities if not any(each in group for group in main)]
    panels = []
    headings, rudders = main[:2]
    if headings and rudders and _turn(drawings, headings) < MAX_OVERLAID_TURN:
        panels.append(_rudder_over_heading(drawings, headings, rudders))
        main = main[2:]
    elif headings and any(drawing.execute for drawing in drawings):
        panels.append(_heading_from_execute(drawings, headings))
        main = main[1:]
    panels += [_panel(drawings, group) for group in main if group]
    panels = _without_constant_rpm(panels)
    if any(panel.series[0].name == MARKS for panel in panels):
        panels[0] = replace(panels[0], legend=True)
    if len(drawings) > 1:  # the first legend serves all
        panels = [replace(panel, legend=panel is panels[0]) for panel in panels]
    return panels, [_panel(drawings, group) for group in others]


def _without_constant_rpm(panels: list[Panel]) -> list[Panel]:
    """Return panels without that of constant revolutions, if the one of the speed is before it."""
    names = [panel.name for panel in panels[-2:]]
    if len(names) < 2 or not names[0].startswith("channels_speed") or names[1] != "channels_rpm":
        return panels
    *others, speed, rpm = panels
    measured = [each for each in rpm.series if each.name != MARKS]
    values = np.concatenate([line.values for each in measured for line in each.lines])
    if varies(values) or any(each.name == GAPS for each in measured):
        return panels
    title = f"{speed.title}; at {np.nanmedian(values):.4g} rpm"
    return [*others, replace(speed, title=title)]


def _is_usual(quantity: DrawnQuantity) -> bool:
    """Whether a quantity of the catalogue has its unit there, so that others can be drawn with it.

    A log of another program may have a unit that is not known.
    """
    return quantity.unit == CATALOGUE[quantity.name].unit and not quantity.fields


def _turn(drawings: Sequence[LogDrawing], headings: Sequence[DrawnQuantity]) -> float:
    """Return the largest range of a heading, deg."""
    turns = [
        float(np.nanmax(series.lines[0].values) - np.nanmin(series.lines[0].values))
        for drawing in drawings
        for quantity in headings
        for series in drawing.series.get(quantity, ())
    ]
    return max(turns, default=0.0)


def _rudder_over_heading(
    drawings: Sequence[LogDrawing],
    headings: Sequence[DrawnQuantity],
    rudders: Sequence[DrawnQuantity],
) -> Panel:
    """Return the panel of the rudder over the heading, which counts from its reference."""
    relative, references = _relative_headings(drawings, headings)
    panel = _panel(relative, [*headings, *rudders])
    turned, steered = _values_text(relative, headings), _values_text(relative, rudders)
    start = _reference_text(drawings, references)
    return replace(panel, title=f"heading from {start}: {turned}; rudder: {steered} [deg]")


def _heading_from_execute(
    drawings: Sequence[LogDrawing], headings: Sequence[DrawnQuantity]
) -> Panel:
    """Return the panel of headings that count from those before the execute."""
    relative, references = _relative_headings(drawings, headings)
    start, turned = _reference_text(drawings, references), _values_text(relative, headings)
    return replace(_panel(relative, headings), title=f"heading from {start}: {turned} [deg]")


def _relative_headings(
    drawings: Sequence[LogDrawing], headings: Sequence[DrawnQuantity]
) -> tuple[list[LogDrawing], list[float]]:
    """Return the drawings with headings that count from their references, and these, deg."""
    relative, references = [], []
    for drawing in drawings:
        changed = dict(drawing.series)
        for quantity in headings:
            group = turned_together(changed.get(quantity, []), quantity.turn)
            if group:
                references.append(_reference_heading(group[0], drawing))
                changed[quantity] = [_lowered(each, references[-1]) for each in group]
        relative.append(replace(drawing, series=changed))
    return relative, references


def _values_text(drawings: Sequence[LogDrawing], quantities: Sequence[DrawnQuantity]) -> str:
    drawn = [s for drawing in drawings for q in quantities for s in drawing.series.get(q, [])]
    return range_text(*(line.values for series in drawn for line in series.lines))


def _reference_text(drawings: Sequence[LogDrawing], references: Sequence[float]) -> str:
    """Return the reference of a heading, or of those of several logs, in words."""
    if len(references) == 1:
        return f"{round(references[0], 1) % 360:.1f}°"
    if all(drawing.execute for drawing in drawings):
        return "that before the execute"
    mixed = any(drawing.execute for drawing in drawings)
    return "that before the execute or at the start" if mixed else "that at the start"


def _reference_heading(series: Series, drawing: LogDrawing) -> float:
    """Return the median of a heading at its start, or before the execute, deg."""
    values = series.lines[0].values
    known = np.isfinite(values)
    times, values = series.time_secs[known], values[known]
    first = times[0]
    if drawing.execute is not None:
        before = times[times <= 0]
        first = max(first, before[-1] - REFERENCE_SECS) if len(before) else first
        times, values = times[: max(1, len(before))], values[: max(1, len(before))]
    return float(np.median(values[(times >= first) & (times <= first + REFERENCE_SECS)]))


def _lowered(series: Series, by: float) -> Series:
    (line,) = series.lines
    return replace(series, lines=(replace(line, values=line.values - by),))


def _panel(drawings: Sequence[LogDrawing], quantities: Sequence[DrawnQuantity]) -> Panel:
    """Return the panel of quantities that share a unit, of all logs."""
    drawn: list[Series] = []
    colours: list[Colour] = []
    first = quantities[0]
    for number, drawing in enumerate(drawings):
        for quantity in quantities:
            group = turned_together(drawing.series.get(quantity, []), quantity.turn)
            parts = [drawing.name] if len(drawings) > 1 else []
            parts += [words(quantity.name)] if len(quantities) > 1 else []
            for each in group:
                label = ", ".join(parts if parts and len(group) == 1 else [*parts, each.name])
                drawn.append(
                    _labelled(each, label, is_thin=len(drawings) > 1 and quantity is not first)
                )
                colours += [SOURCE_COLOURS[number % len(SOURCE_COLOURS)]] * len(each.lines)
    if len(drawings) == 1:
        alone: tuple[Colour, ...] = (COLOURS.get(first.name, GREY),)
        colours = list(alone if len(colours) == 1 else SOURCE_COLOURS)
    title = title_of(" and ".join(words(each.name) for each in quantities), first.display[0])
    title = with_range(title, *(line.values for series in drawn for line in series.lines))
    name = f"channels_{entity_part(first.name)}_{'_'.join(map(entity_part, first.fields))}"
    panel = joined_panel(name.rstrip("_"), title, drawn, colours)
    return _marked(panel, drawings, quantities)


def _labelled(series: Series, label: str, *, is_thin: bool) -> Series:
    """Return a series with another name and another width of its lines."""
    width = 0.8 if is_thin else 1.5
    lines = (
        replace(line, name=label + line.name.removeprefix(series.name), width=width)
        for line in series.lines
    )
    return replace(series, lines=tuple(lines))


def _marked(
    panel: Panel, drawings: Sequence[LogDrawing], quantities: Sequence[DrawnQuantity]
) -> Panel:
    """Return the panel with its gaps as bars at its foot, and the marks of people."""
    gaps = np.concatenate([
        drawing.gaps.get(each, np.zeros((0, 2))) for drawing in drawings for each in quantities
    ])  # fmt: skip
    marks = [
        (event.time_ns - drawing.zero_ns) * 1e-9
        for drawing in drawings
        for event in drawing.events
        if event.source == OPERATOR
    ][:MAX_MARKS]
    low, high = panel.limits
    series = list(panel.series)
    if marks:
        spans = np.column_stack((marks, marks))
        lines = strokes(MARKS, spans, (low, high), Line("mark", np.zeros(0), GREY, 0.8))
        series.insert(0, lines)
    if len(gaps):
        series.append(strokes(GAPS, gaps, (low, low), Line("gap", np.zeros(0), RED, 5.0)))
    return replace(panel, series=tuple(series), legend=panel.legend or len(gaps) > 0)
