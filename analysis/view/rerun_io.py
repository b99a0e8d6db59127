"""Rerun recordings: series, text and track charts sent to them, views and blueprints.

Names and texts, which may come from a file, are made printable here.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.errors import ShiplogError
from shiplog.files import atomic_write, is_device, write_error
from shiplog.geodesy import GeographicPositions
from shiplog.printable import printable
from shiplog.types import Event, EventLevel, FloatArray

from .file_pipe import pipe_to_file
from .panels import Panel, free_corner
from .series import BLUE, GREEN, GREY, ORANGE, PALE, RED, Colour, Series
from .track_chart import TrackChart

RRD_MAGIC, FOOTER_MAGIC, FOOTER_BYTES = b"RRF2", b"RRF2FOOT", 32
MAX_ROWS = 1 << 16  # sent at once
AXIS_MARGIN = 0.05  # of the length of a time axis, after its end
EVENT_LEVELS = {EventLevel.INFO: "INFO", EventLevel.WARNING: "WARN", EventLevel.ERROR: "ERROR"}
WHOLE_RUN = rrb.TimeAxis(
    view_range=rr.TimeRange(
        start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite()
    )
)


@contextmanager
def save_recording(recording: rr.RecordingStream, path: str | os.PathLike[str]) -> Iterator[None]:
    """Save to an .rrd file what is sent to a recording while the context lasts.

    The file appears only when it is complete.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to, or the disk is full.
    """
    with atomic_write(path) as part:
        try:
            with pipe_to_file(part) as pipe:
                try:
                    recording.save(pipe)
                    yield
                finally:
                    recording.disconnect()
        except OSError as error:
            raise write_error(Path(path), error) from error
        except RuntimeError as error:  # raised by Rerun
            raise _unfinished(path) from error
        if not _is_complete(part):  # Rerun raises nothing where its last write has failed
            raise _unfinished(path)


def _unfinished(path: str | os.PathLike[str]) -> ShiplogError:
    return ShiplogError(f"cannot write the review to the end; is the disk full? {path}")


def _is_complete(path: Path) -> bool:
    """Whether an .rrd file of Rerun's second format ends with a footer; a pipe cannot be read."""
    if is_device(path):
        return True
    with path.open("rb") as stream:
        has_footer = stream.read(len(RRD_MAGIC)) == RRD_MAGIC
        stream.seek(-min(path.stat().st_size, FOOTER_BYTES), os.SEEK_END)
        return not has_footer or FOOTER_MAGIC in stream.read()


def send_style(recording: rr.RecordingStream, entity: str, series: Series) -> None:
    """Send the names, colours and widths of a series' lines."""
    style = rr.SeriesLines(
        names=[printable(line.name) for line in series.lines],
        colors=[line.colour for line in series.lines],
        widths=[line.width for line in series.lines],
        aggregation_policy="MinMax" if series.spiky else "Average",
        interpolation_mode="StepAfter" if series.steps else "Linear",
    )
    recording.log(entity, style, static=True)


def send_points(
    recording: rr.RecordingStream, entity: str, series: Series, start_ns: int | None
) -> None:
    """Send the points of a series, in batches of `MAX_ROWS`; without dates where none is known."""
    values = np.column_stack([line.values for line in series.lines])
    for start in range(0, len(values), MAX_ROWS):
        part = slice(start, start + MAX_ROWS)
        times = _times(series.time_secs[part], start_ns)
        recording.send_columns(entity, times, rr.Scalars.columns(scalars=values[part]))


def _times(time_secs: FloatArray, start_ns: int | None) -> list[rr.TimeColumn]:
    """Return the two timelines: time since the start, and date and time if the start has one."""
    since = np.round(time_secs * 1e9).astype(np.int64)
    times = [rr.TimeColumn("time", duration=since.astype("m8[ns]"))]
    if start_ns is not None:
        times.append(rr.TimeColumn("stamp", timestamp=(start_ns + since).astype("M8[ns]")))
    return times


def send_events(
    recording: rr.RecordingStream, entity: str, events: Sequence[Event], start_ns: int
) -> None:
    """Send events as a log of texts with their levels."""
    stamps = np.array([event.time_ns for event in events], np.int64)
    times = [
        rr.TimeColumn("time", duration=(stamps - start_ns).astype("m8[ns]")),
        rr.TimeColumn("stamp", timestamp=stamps.astype("M8[ns]")),
    ]
    # the column of times is narrower than a time
    texts = [
        printable(f"{_elapsed(event.time_ns - start_ns)} {event.source}: {event.text}")
        for event in events
    ]
    levels = [EVENT_LEVELS[event.level] for event in events]
    recording.send_columns(entity, times, rr.TextLog.columns(text=texts, level=levels))


def _elapsed(duration_ns: int) -> str:
    """Return a time since the start as hours, minutes and seconds."""
    seconds = round(abs(duration_ns) * 1e-9)
    sign = "-" if duration_ns < 0 and seconds else ""
    return f"{sign}{seconds // 3600}:{seconds // 60 % 60:02}:{seconds % 60:02}"


def send_text(recording: rr.RecordingStream, entity: str, text: str) -> None:
    """Send a page of text in Markdown."""
    page = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
    recording.log(entity, page, static=True)


def send_chart(
    recording: rr.RecordingStream,
    origin: str,
    chart: TrackChart,
    start_ns: int | None,
    colours: tuple[Colour, Colour] = (GREY, PALE),
) -> None:
    """Send a track with its ships, ends and scale, and the position at each time.

    The colours are those of the track and of the ships.
    """
    thin, dot = rr.Radius.ui_points(0.8), rr.Radius.ui_points(5.0)
    track = rr.LineStrips2D([chart.track], colors=[colours[0]], radii=thin)
    recording.log(f"{origin}/line", track, static=True)
    ships = rr.LineStrips2D(chart.ships, colors=[colours[1]], radii=thin)
    recording.log(f"{origin}/ships", ships, static=True)
    if chart.simulated is not None:
        simulated = rr.LineStrips2D([chart.simulated], colors=[BLUE], radii=thin)
        recording.log(f"{origin}/simulated", simulated, static=True)
    if chart.parts:
        parts = rr.LineStrips2D(
            [part.points for part in chart.parts],
            colors=[part.colour for part in chart.parts],
            labels=[printable(part.label) for part in chart.parts],
            radii=rr.Radius.ui_points(1.6),
            show_labels=all(part.label for part in chart.parts),
        )
        recording.log(f"{origin}/manoeuvres", parts, static=True)
    if chart.marks:
        marks = rr.Points2D(
            [mark.point for mark in chart.marks],
            colors=[mark.colour for mark in chart.marks],
            labels=[printable(mark.label) for mark in chart.marks],
            radii=rr.Radius.ui_points(3.5),
            show_labels=True,
        )
        recording.log(f"{origin}/marks", marks, static=True)
    ends = rr.Points2D(
        chart.track[[0, -1]], labels=["start", "end"], colors=[GREEN, RED], radii=dot
    )
    recording.log(f"{origin}/ends", ends, static=True)
    scale = rr.LineStrips2D([chart.scale], labels=[chart.scale_label], colors=[GREY], radii=thin)
    recording.log(f"{origin}/scale", scale, static=True)
    now = rr.Points2D.from_fields(colors=[ORANGE], radii=dot)
    recording.log(f"{origin}/now", now, static=True)
    recording.send_columns(
        f"{origin}/now",
        _times(chart.time_secs, start_ns),
        rr.Points2D.columns(positions=chart.track),
    )


def send_map_track(
    recording: rr.RecordingStream, entity: str, positions: GeographicPositions, colour: Colour
) -> None:
    """Send a track for a map view."""
    points = np.column_stack((positions.latitude, positions.longitude))
    line = rr.GeoLineStrings(lat_lon=[points], colors=[colour], radii=rr.Radius.ui_points(1.5))
    recording.log(entity, line, static=True)


def plot_view(panel: Panel, axis: rrb.TimeAxis = WHOLE_RUN) -> rrb.TimeSeriesView:
    """Return a view of a panel, by default over the whole trial."""
    return rrb.TimeSeriesView(
        origin=panel.name,
        name=printable(panel.title),
        axis_x=axis,
        axis_y=rrb.ScalarAxis(range=panel.limits),
        plot_legend=rrb.PlotLegend(free_corner(panel), visible=panel.legend),
    )


def axis_between(start_secs: float, end_secs: float) -> rrb.TimeAxis:
    """Return a time axis between two instants, s, with room for the label of its last tick."""
    last = end_secs + AXIS_MARGIN * (end_secs - start_secs)
    ends = (rr.TimeRangeBoundary.absolute(seconds=at) for at in (start_secs, last))
    return rrb.TimeAxis(view_range=rr.TimeRange(*ends))


def chart_view(origin: str, chart: TrackChart) -> rrb.Spatial2DView:
    """Return a view of a track chart."""
    low, high = chart.bounds
    bounds = rrb.VisualBounds2D(x_range=(low[0], high[0]), y_range=(low[1], high[1]))
    return rrb.Spatial2DView(origin=origin, name=printable(chart.title), visual_bounds=bounds)


def events_view() -> rrb.TextLogView:
    """Return a view of the events that `send_events` sent as ``events``: time, level and text."""
    columns = rrb.archetypes.TextLogColumns(
        timeline_columns=[rrb.encodings.TimelineColumn("time")],
        text_log_columns=[
            rrb.encodings.TextLogColumn("loglevel"),
            rrb.encodings.TextLogColumn("body"),
        ],
    )
    return rrb.TextLogView(origin="events", name="events", columns=columns)


def make_blueprint(content: rrb.View | rrb.Container) -> rrb.Blueprint:
    """Return a blueprint that shows only this content; Rerun's own panels are collapsed."""
    return rrb.Blueprint(
        content,
        rrb.TimePanel(state="collapsed", timeline="time", play_state="Paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
