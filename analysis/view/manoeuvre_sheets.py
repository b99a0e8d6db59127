"""Sheets of manoeuvres: heading with the rudder over it, yaw rate, speed, and the track."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan
from shiplog.types import Event, FloatArray

from .decimation import decimated
from .execute_alignment import track_from_execute
from .panels import Panel, limits, review_unit, strokes, title_of, varies, with_range
from .series import (
    BLUE,
    BROWN,
    CYAN,
    GREEN,
    GREY,
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
    measured_line,
)
from .steering_panels import MEASURED_WIDTH, WIDTH, heading_series, rudder_series, steering_panels
from .track_chart import ChartMark, ChartPart, TrackChart, make_chart

# of the tracks and executes of manoeuvres, in order; heading and rudder have other ones
MANOEUVRE_COLOURS = CYAN, MAGENTA, YELLOW, VIOLET, GREEN, BROWN, LIME, PINK, STEEL
OUTPUTS = ("yaw_rate", "speed", "sway")  # that have a panel each
COMPARED_TITLE = "{} (grey: measured, blue: simulated)"  # of a chart, which has no legend
MAX_NAMED = 6  # manoeuvres in the legend of a panel
MAX_MARKS = 20  # of a manoeuvre that are drawn; a longer one would be covered by them
APPROACH_SECS = 30.0  # before the execute, shown on a sheet
TRIAL_MARKS = ("90°", "180°")  # on the track of the whole trial
SOURCE = "manoeuvre {}"  # of its events


@dataclass(frozen=True, eq=False)
class MotionHistory:
    """The motion of a ship over time, measured and computed, SI.

    Attributes
    ----------
    time_secs
        (n,) s since the start of the signals.
    rudder
        (n,) rad.
    rpm
        (n,) revolutions per minute.
    measured
        (n,) each, by the name of the channel: ``heading``, ``yaw_rate``, ``speed``, and ``sway``
        if it may be measured; NaN where it is not.
    computed
        The same, simulated or estimated.
    computed_name
        What it is, in a word.
    """

    time_secs: FloatArray
    rudder: FloatArray
    rpm: FloatArray
    measured: Mapping[str, FloatArray]
    computed: Mapping[str, FloatArray] = field(default_factory=dict)
    computed_name: str = "simulated"

    def part(self, start_secs: float, end_secs: float) -> "MotionHistory":
        """Return the stretch between two instants, both included."""
        cut = (self.time_secs >= start_secs) & (self.time_secs <= end_secs)
        measured, computed = (
            {name: values[cut] for name, values in each.items()}
            for each in (self.measured, self.computed)
        )
        return replace(
            self, time_secs=self.time_secs[cut], rudder=self.rudder[cut], rpm=self.rpm[cut],
            measured=measured, computed=computed,
        )  # fmt: skip


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


def motion_panels(
    origin: str, history: MotionHistory, reference: float | None = None
) -> list[Panel]:
    """Return the panels of heading with rudder, outputs, and rpm where they vary, as known.

    Parameters
    ----------
    origin
        The beginning of the paths of their entities.
    history
        The motion.
    reference
        The heading from which headings are drawn, rad; None draws them from north.
    """
    at = history.time_secs
    headings: list[Series] = []
    if np.isfinite(history.measured["heading"]).any():
        degrees = [
            np.degrees(values["heading"] - (reference or 0.0))
            for values in (history.measured, history.computed)
            if "heading" in values
        ]
        headings = [_drawn(each) for each in heading_series(at, *degrees)]
    rudder = _drawn(rudder_series(at, np.degrees(history.rudder)))
    counted = "" if reference is None else f"{round(np.degrees(reference), 1) % 360:.1f}°"
    panels = steering_panels(f"{origin}/steering", rudder, headings, counted)
    outputs = [_output_panel(origin, history, name) for name in OUTPUTS if name in history.measured]
    known = [panel for panel in outputs if panel is not None]
    # the first legend serves all
    panels += [replace(panel, legend=panel.legend and panel is known[0]) for panel in known]
    if varies(history.rpm):
        line = Line("rpm", history.rpm, GREEN, WIDTH)
        rpm = _drawn(Series("rpm", at, (line,), spiky=True))
        title = with_range("rpm", history.rpm)
        panels.append(Panel(f"{origin}/rpm", title, (rpm,), limits(history.rpm)))
    return panels


def _output_panel(origin: str, history: MotionHistory, name: str) -> Panel | None:
    """Return the panel of an output, measured and computed; None where neither is known."""
    unit, factor = review_unit(name)
    lines = [Line("measured", history.measured[name] * factor, GREY, MEASURED_WIDTH)]
    if name in history.computed:
        values = history.computed[name] * factor
        lines.append(Line(history.computed_name, values, BLUE, WIDTH))
    lines = [line for line in lines if np.isfinite(line.values).any()]
    if not lines:
        return None
    drawn = [  # the last one on top, by the alphabet
        _drawn(Series(f"{i}_{line.name}", history.time_secs, (line,), spiky=not i))
        for i, line in enumerate(lines)
    ]
    return Panel(
        f"{origin}/{name}",
        with_range(title_of(name, unit), lines[0].values),
        tuple(drawn),
        limits(*(line.values for line in lines)),
        legend=len(lines) > 1,
    )


def _drawn(series: Series) -> Series:
    """Return a series as it is drawn: its samples joined, with one NaN in each gap."""
    (line,) = series.lines
    at = series.time_secs
    if len(at) > 1 and not np.isfinite(line.values).all():
        times, values = measured_line(line.values, float(at[1] - at[0]))
        series = replace(series, time_secs=at[0] + times, lines=(replace(line, values=values),))
    return decimated(series)


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
