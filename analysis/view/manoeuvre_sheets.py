"""Sheets of manoeuvres: heading with the rudder over it, yaw rate, speed, and the track."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan
from shiplog.types import Event

from .execute_alignment import track_from_execute
from .motion_panels import MotionHistory, motion_panels
from .panels import Panel, strokes
from .series import (
    BROWN,
    CYAN,
    GREEN,
    LIME,
    MAGENTA,
    PALE,
    PINK,
    STEEL,
    VIOLET,
    YELLOW,
    Colour,
    Line,
    Series,
)
from .steering_panels import WIDTH
from .track_chart import ChartMark, ChartPart, TrackChart, make_chart

# of the tracks and executes of manoeuvres, in order; heading and rudder have other ones
MANOEUVRE_COLOURS = CYAN, MAGENTA, YELLOW, VIOLET, GREEN, BROWN, LIME, PINK, STEEL
COMPARED_TITLE = "{} (grey: measured, blue: simulated)"  # of a chart, which has no legend
MAX_NAMED = 6  # manoeuvres in the legend of a panel
MAX_MARKS = 20  # of a manoeuvre that are drawn; a longer one would be covered by them
APPROACH_SECS = 30.0  # before the execute, shown on a sheet
TRIAL_MARKS = ("90°", "180°")  # on the track of the whole trial
SOURCE = "manoeuvre {}"  # of its events


@dataclass(frozen=True, eq=False)
class ManoeuvreSheet:
    """What a tab shows of one manoeuvre.

    Attributes
    ----------
    name
        The name of the tab, such as ``1 zig-zag 20°/20°``.
    origin
        The beginning of the paths of its entities.
    panels
        Heading and rudder first.
    chart
        Its track; None where no position is known.
    start_secs, end_secs
        Of its time axis, s since the start of the signals.
    """

    name: str
    origin: str
    panels: tuple[Panel, ...]
    chart: TrackChart | None
    start_secs: float
    end_secs: float


def manoeuvre_colour(span: ManoeuvreSpan) -> Colour:
    """Return the colour of a manoeuvre's track and execute."""
    return MANOEUVRE_COLOURS[(span.number - 1) % len(MANOEUVRE_COLOURS)]


def short_title(span: ManoeuvreSpan) -> str:
    """Return the number of a manoeuvre and its title without the side."""
    return f"{span.number} {span.title.partition(', first')[0].partition(' to ')[0]}"


def manoeuvre_sheet(
    span: ManoeuvreSpan,
    history: MotionHistory,
    tracks: Sequence[Series],
    length: float | None,
    origin: str,
) -> ManoeuvreSheet:
    """Return the sheet of a manoeuvre; its times are those of the whole trial.

    Parameters
    ----------
    span
        The manoeuvre.
    history
        Of the whole trial.
    tracks
        North and east, m, of the whole trial: measured, and then simulated if it was; or none.
    length
        Of the ship, m; None where it is not known.
    origin
        The beginning of the paths of its entities.
    """
    start = max(span.start_secs, span.execute_secs - APPROACH_SECS)
    part = history.part(start, span.end_secs)
    up = span.approach_heading if np.isfinite(span.approach_heading) else None
    first, *others = motion_panels(origin, part, up)
    panels = (with_executes(first, [span]), *others)
    chart = _chart(span, part, tracks, length)
    return ManoeuvreSheet(short_title(span), origin, panels, chart, start, span.end_secs)


def with_executes(panel: Panel, spans: Sequence[ManoeuvreSpan], *, legend: bool = False) -> Panel:
    """Return a panel with a vertical line at the execute of each manoeuvre, in its colour.

    The legend names each manoeuvre where asked for.
    """
    lines = [
        strokes(
            f"00_execute_{span.number}",
            np.full((1, 2), span.execute_secs),
            panel.limits,
            Line(
                short_title(span) if legend else "execute", np.zeros(0), manoeuvre_colour(span),
                WIDTH,
            ),
        )
        for span in spans
    ]  # fmt: skip
    has_legend = panel.legend or (legend and len(lines) > 0)
    return replace(panel, series=(*lines, *panel.series), legend=has_legend)


def _chart(
    span: ManoeuvreSpan,
    part: MotionHistory,
    tracks: Sequence[Series],
    length: float | None,
) -> TrackChart | None:
    """Return the track from the execute with the approach heading up, or north up without one."""
    known = np.isfinite(span.approach_heading)
    up = span.approach_heading if known else 0.0
    ends = part.time_secs[[0, -1]]
    turned = [
        track_from_execute(replace(each, time_secs=each.time_secs - span.execute_secs), up)[
            (each.time_secs >= ends[0]) & (each.time_secs <= ends[1])
        ]
        for each in tracks
        if np.isfinite(each.lines[0].values).any()
    ]
    if not turned:
        return None
    at = tracks[0].time_secs
    at = at[(at >= ends[0]) & (at <= ends[1])]
    heading, compass = None, part.measured["heading"]
    if np.isfinite(compass).any():
        measured = np.isfinite(compass)
        heading = np.interp(at, part.time_secs[measured], compass[measured]) - up
    title = f"track from the execute, {'approach heading' if known else 'north'} up"
    if len(turned) > 1:
        title = COMPARED_TITLE.format(title)
    chart = make_chart(title, turned[0], at, heading, length, *turned[1:])
    return with_manoeuvres(chart, [span], every_mark=True)


def with_manoeuvres(
    chart: TrackChart | None, spans: Sequence[ManoeuvreSpan], *, every_mark: bool = False
) -> TrackChart | None:
    """Return a chart with its manoeuvres in their colours, numbered, and with their marks.

    Where a simulated track is compared with the measured one, these have the colours.

    Parameters
    ----------
    chart
        None stays None.
    spans
        The manoeuvres.
    every_mark
        Whether all marks are drawn, without the numbers; otherwise those of `TRIAL_MARKS`.
    """
    if chart is None:
        return None
    parts: list[ChartPart] = []
    marks: list[ChartMark] = []
    is_compared = chart.simulated is not None
    for span in spans:
        colour, at = PALE if is_compared else manoeuvre_colour(span), chart.time_secs
        inside = (at >= span.execute_secs) & (at <= span.end_secs)
        if inside.sum() > 1 and not is_compared:
            number = "" if every_mark else str(span.number)
            parts.append(ChartPart(number, colour, chart.track[inside]))
        shown = [each for each in span.marks if every_mark or each.label in TRIAL_MARKS]
        for mark in shown[:MAX_MARKS]:
            instant = span.execute_secs + mark.time_secs
            if at[0] <= instant <= at[-1]:
                place = [np.interp(instant, at, column) for column in chart.track.T]
                marks.append(ChartMark(mark.label, colour, np.array(place)))
    return replace(chart, parts=tuple(parts), marks=tuple(marks))


def manoeuvre_events(spans: Sequence[ManoeuvreSpan], start_ns: int) -> list[Event]:
    """Return the marks of the manoeuvres as events; the first of each has its title.

    Parameters
    ----------
    spans
        The manoeuvres.
    start_ns
        The instant from which their times count, ns since 1970-01-01 UTC.
    """
    events = []
    for span in spans:
        texts = {span.execute_secs: [span.title]}
        for mark in span.marks[:MAX_MARKS]:
            texts.setdefault(span.execute_secs + mark.time_secs, []).append(mark.label)
        texts.setdefault(span.end_secs, []).append("end")
        events += [
            Event(start_ns + round(at * 1e9), ", ".join(parts), SOURCE.format(span.number))
            for at, parts in texts.items()
        ]
    return events
