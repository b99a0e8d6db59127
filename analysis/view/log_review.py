"""A review of logs as recorded, in Rerun: their channels, tracks and events, without a replay."""

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan
from shiplog.geodesy import GeographicPositions, LocalPositions
from shiplog.printable import printable
from shiplog.types import Event, FloatArray

from .execute_alignment import track_from_execute
from .log_drawing import LogDrawing
from .log_manoeuvre_sheets import log_manoeuvre_sheets
from .log_panels import log_panels
from .manoeuvre_sheets import (
    MAX_NAMED,
    ManoeuvreSheet,
    manoeuvre_events,
    with_executes,
    with_manoeuvres,
)
from .panels import Panel
from .quantity_panel import SOURCE_COLOURS
from .rerun_io import (
    axis_between,
    make_blueprint,
    plot_view,
    save_recording,
    send_chart,
    send_events,
    send_map_track,
    send_points,
    send_style,
    send_text,
)
from .review_tabs import SUMMARY, TRACK, gathered_tabs, manoeuvre_tab, overview_tab, track_origin
from .series import GREY, PALE, Colour
from .track_chart import TrackChart, make_chart

OTHERS_NAME = "other channels"
TILE_PIXELS, MAP_PIXELS = 256, 500  # of a map's tile, and of the track on the map
MAX_ZOOM = 18.0  # of the tiles that servers have
MAP_NAME = "map (tiles from the internet)"


def write_log_review(
    drawings: Sequence[LogDrawing], path: str | os.PathLike[str], text: str
) -> None:
    """Write the review of one log, or of several over each other from their starts or executes.

    Parameters
    ----------
    drawings
        The logs.
    path
        The .rrd file to write.
    text
        The page of text, in Markdown; from what times count is added to it.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to.
    """
    recording, main_log = _recording(drawings), drawings[0]
    main, others = log_panels(drawings)
    charts, maps = _charts(drawings), list(map(_geographic_track, drawings))
    starts = [each.zero_ns if len(drawings) == 1 else None for each in drawings]
    spans, sheets = log_manoeuvre_sheets(main_log) if len(drawings) == 1 else ([], [])
    events = _events(main_log, spans) if len(drawings) == 1 else ()
    if spans:
        main = [with_executes(main[0], spans, legend=len(spans) <= MAX_NAMED), *main[1:]]
        charts = [with_manoeuvres(charts[0], spans)]
    blueprint = _blueprint(
        main,
        others,
        next((chart for chart in charts if chart is not None), None),
        sheets,
        has_events=bool(events),
        map_zoom=_map_zoom([positions for positions in maps if positions is not None]),
    )
    with save_recording(recording, path):
        rr.send_blueprint(blueprint, recording=recording)
        recording.send_recording_name(printable(" ".join(each.name for each in drawings)))
        if len(drawings) == 1:
            rr.send_recording_start_time_nanos(main_log.stats.span_ns[0], recording=recording)
        send_text(recording, SUMMARY, text + _times_text(drawings))
        _send_panels(recording, (*main, *others), starts[0])
        for sheet in sheets:
            _send_panels(recording, sheet.panels, starts[0])
            if sheet.chart is not None:
                send_chart(recording, track_origin(sheet.origin), sheet.chart, starts[0])
        for number, (chart, positions) in enumerate(zip(charts, maps, strict=True)):
            colours = _colours(number, len(drawings))
            if chart is not None:
                send_chart(recording, f"{TRACK}/{number}", chart, starts[number], colours)
            if positions is not None:
                send_map_track(recording, f"map/{number}", positions, colours[0])
        if events:
            send_events(recording, "events", events, main_log.zero_ns)


def _events(drawing: LogDrawing, spans: Sequence[ManoeuvreSpan]) -> tuple[Event, ...]:
    """Return the events of a log and its manoeuvres, in the order of time."""
    events = (*drawing.events, *manoeuvre_events(spans, drawing.zero_ns))
    return tuple(sorted(events, key=lambda event: event.time_ns))


def _times_text(drawings: Sequence[LogDrawing]) -> str:
    """Return from what the times of each log count, as the end of the page."""
    items = [
        f"- time of {each.name} counts from the execute of its {each.execute.manoeuvre}, "
        f"{(each.zero_ns - each.stats.span_ns[0]) * 1e-9:.1f} s after its start"
        for each in drawings
        if each.execute is not None
    ]
    if len(items) < len(drawings):
        items.append(f"- time counts from the start of each {'other ' if items else ''}log")
    return "\n".join(("\n## Time\n", *items, ""))


def _recording(drawings: Sequence[LogDrawing]) -> rr.RecordingStream:
    """Return a stream whose names depend only on the logs; a layout belongs to one of them."""
    names = " ".join(drawing.name for drawing in drawings)
    counts = [(each.topic, each.samples) for drawing in drawings for each in drawing.stats]
    identity = (names, [(each.stats.span_ns, each.zero_ns) for each in drawings], counts)
    return rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog view {names}"),
        recording_id=sha256(repr(identity).encode()).hexdigest()[:32],
        send_properties=False,
    )


def _charts(drawings: Sequence[LogDrawing]) -> list[TrackChart | None]:
    """Return the chart of each log's track; several share their bounds and one scale."""
    charts = [_chart(drawing) for drawing in drawings]
    known = [chart for chart in charts if chart is not None]
    if len(known) < 2:
        return charts
    low = np.min([chart.bounds[0] for chart in known], axis=0)
    high = np.max([chart.bounds[1] for chart in known], axis=0)
    widest = max(known, key=lambda chart: float((chart.bounds[1] - chart.bounds[0]).max()))
    foot = np.array([low[0], high[1]]) + 0.05 * (high - low) * [1, -1]
    scale = widest.scale - widest.scale[0] + foot
    title = " or ".join(dict.fromkeys(chart.title for chart in known))
    shared = {"bounds": (low, high), "scale": scale, "scale_label": widest.scale_label}
    return [chart and replace(chart, title=title, **shared) for chart in charts]


def _chart(drawing: LogDrawing) -> TrackChart | None:
    """Return the chart of a log's track; None where it has no positions."""
    if drawing.track is None:
        return None
    heading = _heading_along(drawing)
    if drawing.execute is not None:
        up = 0.0 if heading is None else drawing.execute.approach_heading
        title = f"track from the execute, {'north' if heading is None else 'approach heading'} up"
        positions = track_from_execute(drawing.track, up)
        heading = None if heading is None else heading - up
    else:
        title = "track from its start, north up"
        positions = np.column_stack([line.values for line in drawing.track.lines])
    return make_chart(title, positions, drawing.track.time_secs, heading, None)


def _heading_along(drawing: LogDrawing) -> FloatArray | None:
    """Return the heading at the points of the track, rad; None where the log has none."""
    for quantity, (series, *_) in drawing.series.items():
        if quantity.name == "heading" and drawing.track is not None:
            values = series.lines[0].values / quantity.display[1]
            known = np.isfinite(values)
            at = drawing.track.time_secs
            return np.asarray(np.interp(at, series.time_secs[known], values[known]))
    return None


def _colours(number: int, count: int) -> tuple[Colour, Colour]:
    """Return the colours of the track and the ships of one of several logs."""
    if count == 1:
        return GREY, PALE
    colour = SOURCE_COLOURS[number % len(SOURCE_COLOURS)]
    return colour, colour


def _send_panels(
    recording: rr.RecordingStream, panels: Sequence[Panel], start_ns: int | None
) -> None:
    for panel in panels:
        for series in panel.series:
            entity = f"{panel.name}/{series.name}"
            send_style(recording, entity, series)
            send_points(recording, entity, series, start_ns)


def _geographic_track(drawing: LogDrawing) -> GeographicPositions | None:
    """Return latitude and longitude of a track; None where it is local or there is none."""
    track, frame = drawing.track, drawing.frame
    if track is None or frame is None or not frame.geographic:
        return None
    north, east = (line.values for line in track.lines)
    return frame.to_geographic(LocalPositions(north, east))


def _map_zoom(tracks: Sequence[GeographicPositions]) -> float | None:
    """Return the zoom at which a map shows tracks, by the rule of web maps; None without tracks.

    At zoom 0 the equator takes one tile; each step doubles the scale.
    """
    if not tracks:
        return None
    latitude = np.concatenate([each.latitude for each in tracks])
    longitude = np.unwrap(np.concatenate([each.longitude for each in tracks]), period=360.0)
    widest = max(np.ptp(latitude) / np.cos(np.radians(latitude.mean())), np.ptp(longitude), 1e-4)
    return float(min(np.log2(360 / widest * MAP_PIXELS / TILE_PIXELS), MAX_ZOOM))


def _blueprint(
    main: list[Panel],
    others: list[Panel],
    chart: TrackChart | None,
    sheets: Sequence[ManoeuvreSheet],
    *,
    has_events: bool,
    map_zoom: float | None,
) -> rrb.Blueprint:
    """Lay out the page of the main panels, and tabs of manoeuvres, other channels and the map."""
    axis = _time_axis([*main, *others])
    page = overview_tab(
        "log", main or others, axis, chart, has_events=has_events, has_manoeuvres=bool(sheets)
    )
    tabs: list[rrb.View | rrb.Container] = [page]
    tabs += gathered_tabs([manoeuvre_tab(sheet) for sheet in sheets], "manoeuvres")
    if main and others:
        columns = 1 + (len(others) > 3) + (len(others) > 8)
        views = (plot_view(panel, axis) for panel in others)
        tabs.append(rrb.Grid(*views, grid_columns=columns, name=OTHERS_NAME))
    if map_zoom is not None:
        tabs.append(rrb.MapView(origin="map", name=MAP_NAME, zoom=map_zoom))
    return make_blueprint(rrb.Tabs(*tabs, active_tab=0) if len(tabs) > 1 else page)


def _time_axis(panels: Sequence[Panel]) -> rrb.TimeAxis:
    """Return an axis over all series of some panels."""
    spans = [s.time_secs[[0, -1]] for panel in panels for s in panel.series if len(s.time_secs)]
    if not spans:
        return axis_between(0.0, 1.0)
    return axis_between(float(np.min(spans)), float(np.max(spans)))
