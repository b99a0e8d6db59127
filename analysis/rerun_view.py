"""A review in Rerun: the entities of an analysis, and one page on which to read them."""

import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from hashlib import sha256
from typing import IO

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.errors import ShiplogError
from shiplog.files import replacing
from shiplog.types import FloatArray

from .chart import Chart, draw_track
from .panels import (
    CYAN,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Panel,
    Series,
    coefficient_panels,
    decimated,
    equation_panels,
)
from .pipeline import Analysis

VIEWER_SECS = 20.0  # within which a viewer listens, or never will
WHOLE_RUN = rrb.TimeAxis(
    view_range=rr.TimeRange(
        start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite()
    )
)
ROWS = [1.3, 0.9, 1.0, 0.9]  # heights: outputs, inputs, disturbances, residuals
KEY = """\
*Grey: measured, or in the model. Blue, orange: estimated, of yaw and of surge, ±2σ. \
Green: inputs. Red: disturbance; between the grey lines it may be sensor noise. \
Coefficients: in the title over the whole trial, ±2σ; as a line at the end of each window. \
A gap: not measured, or a window that cannot tell.*

"""


def write_review(analysis: Analysis, path: str | os.PathLike[str], *, text: str) -> None:
    """Write the review to an .rrd file; `text` is its page of words, in Markdown.

    Raises `ShiplogError` where `path` cannot be written to, or not to the end.
    """
    with replacing(path) as part:
        recording = _recording(analysis)
        try:
            recording.save(part)
            _send(recording, analysis, text)
        except RuntimeError as error:  # what Rerun makes of a full disk
            raise ShiplogError(f"cannot finish the review; is the disk full? {path}") from error
        recording.disconnect()


def view_review(analysis: Analysis, *, text: str) -> None:
    """Open the review in a viewer of its own, which listens to this computer only.

    The viewer stays open when the caller ends. Raises `ShiplogError` where none can start, for
    want of a screen as a rule.
    """
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "rerun_cli", "--bind", "127.0.0.1", "--port", str(port)]
    with tempfile.TemporaryFile() as said:
        viewer = subprocess.Popen(  # noqa: S603 - our own interpreter
            command, stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
        )
        _await(viewer, port, said)
        recording = _recording(analysis)
        recording.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy")
        _send(recording, analysis, text)
        recording.disconnect()


def _await(viewer: subprocess.Popen[bytes], port: int, said: IO[bytes]) -> None:
    """Wait until the viewer listens; it does so a moment before it looks for a screen."""
    deadline, listening = time.monotonic() + VIEWER_SECS, False
    while viewer.poll() is None and time.monotonic() < deadline:
        if listening:
            return
        with socket.socket() as probe:
            listening = probe.connect_ex(("127.0.0.1", port)) == 0
        time.sleep(1.0 if listening else 0.1)
    _end(viewer)
    said.seek(0)
    lines = said.read().decode(errors="replace").strip().splitlines()
    reason = lines[-1].rpartition(": ")[2].rstrip(".") if lines else "it does not answer"
    raise ShiplogError(
        f"the Rerun viewer cannot start here ({reason}); "
        "write the review to a file and open it on a computer with a screen"
    )


def _end(viewer: subprocess.Popen[bytes]) -> None:
    """End the command and, where there are process groups, the viewer it started."""
    if viewer.poll() is None and hasattr(os, "killpg"):
        os.killpg(viewer.pid, signal.SIGTERM)
    viewer.terminate()
    viewer.wait()


def _recording(analysis: Analysis) -> rr.RecordingStream:
    """A stream whose names depend on the analysis alone.

    Each log is an application of its own to Rerun, which shares one layout among the recordings
    of an application; the axes of another ship would be wrong for this one.
    """
    name = analysis.log.name
    digest = sha256(f"{name} {analysis.signals.start_ns} {analysis.vessel!r}".encode())
    digest.update(np.ascontiguousarray(analysis.estimates.states).tobytes())
    return rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog {name}"),
        recording_id=digest.hexdigest()[:32],
        send_properties=False,
    )


def _send(recording: rr.RecordingStream, analysis: Analysis, text: str) -> None:
    yaw, surge = equation_panels(analysis)
    coefficients, drawn = coefficient_panels(analysis), draw_track(analysis)
    rr.send_blueprint(_blueprint(yaw, surge, coefficients, drawn), recording=recording)
    _send_properties(recording, analysis)
    page = rr.TextDocument(KEY + text, media_type=rr.MediaType.MARKDOWN)
    recording.log("summary", page, static=True)
    for panel in (*yaw, *surge, *coefficients):
        for series in panel.series:
            entity = f"{panel.name}/{series.name}"
            _send_series(recording, entity, decimated(series), analysis.signals.start_ns)
    _send_chart(recording, drawn, analysis.signals.start_ns)
    recording.flush()


def _send_properties(recording: rr.RecordingStream, analysis: Analysis) -> None:
    recording.send_recording_name(analysis.log.name)
    rr.send_recording_start_time_nanos(analysis.signals.start_ns, recording=recording)
    trial = rr.AnyValues(
        vessel=analysis.vessel.name,
        model=analysis.model_origin,
        duration_secs=analysis.log.duration_secs,
        dt_secs=analysis.signals.dt_secs,
        samples=len(analysis.signals),
        warnings=list(analysis.warnings) or ["none"],
    )
    recording.send_property("trial", trial)


def _send_series(recording: rr.RecordingStream, entity: str, series: Series, start_ns: int) -> None:
    lines = series.lines
    style = rr.SeriesLines(
        names=[line.name for line in lines],
        colors=[line.colour for line in lines],
        widths=[line.width for line in lines],
        aggregation_policy="MinMax" if series.spiky else "Average",
    )
    recording.log(entity, style, static=True)
    values = np.column_stack([line.values for line in lines])
    recording.send_columns(
        entity, _times(series.time_secs, start_ns), rr.Scalars.columns(scalars=values)
    )


def _times(time_secs: FloatArray, start_ns: int) -> list[rr.TimeColumn]:
    since = np.round(time_secs * 1e9).astype(np.int64)
    return [
        rr.TimeColumn("time", duration=since.astype("m8[ns]")),
        rr.TimeColumn("stamp", timestamp=(start_ns + since).astype("M8[ns]")),
    ]


def _send_chart(recording: rr.RecordingStream, drawn: Chart | None, start_ns: int) -> None:
    if drawn is None:
        return
    thin, dot = rr.Radius.ui_points(0.8), rr.Radius.ui_points(5.0)
    track = rr.LineStrips2D([drawn.track], colors=[GREY], radii=thin)
    recording.log("track/line", track, static=True)
    ships = rr.LineStrips2D(drawn.ships, colors=[CYAN], radii=thin)
    recording.log("track/ships", ships, static=True)
    ends = rr.Points2D(
        drawn.track[[0, -1]], labels=["start", "end"], colors=[GREEN, RED], radii=dot
    )
    recording.log("track/ends", ends, static=True)
    scale = rr.LineStrips2D([drawn.scale], labels=[drawn.scale_label], colors=[GREY], radii=thin)
    recording.log("track/scale", scale, static=True)
    recording.log("track/now", rr.Points2D.from_fields(colors=[ORANGE], radii=dot), static=True)
    recording.send_columns(
        "track/now",
        _times(drawn.time_secs, start_ns),
        rr.Points2D.columns(positions=drawn.track),
    )


def _blueprint(
    yaw: list[Panel], surge: list[Panel], coefficients: list[Panel], drawn: Chart | None
) -> rrb.Blueprint:
    plots = rrb.Horizontal(
        *(rrb.Vertical(*map(_plot, column), row_shares=ROWS) for column in (yaw, surge))
    )
    page: list[rrb.View | rrb.Container] = [rrb.TextDocumentView(origin="summary", name="summary")]
    if drawn is not None:
        low, high = drawn.bounds
        view = rrb.Spatial2DView(
            origin="track",
            name=drawn.title,
            visual_bounds=rrb.VisualBounds2D(x_range=(low[0], high[0]), y_range=(low[1], high[1])),
        )
        page.insert(0, view)
    side: list[rrb.View | rrb.Container] = [rrb.Horizontal(*page)]
    if coefficients:
        side.append(rrb.Grid(*map(_plot, coefficients), grid_columns=3, name="coefficients"))
    return rrb.Blueprint(
        rrb.Horizontal(
            plots, rrb.Vertical(*side, row_shares=[2, 3][: len(side)]), column_shares=[1, 1]
        ),
        rrb.TimePanel(state="collapsed", timeline="time", play_state="Paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _plot(panel: Panel) -> rrb.TimeSeriesView:
    """A view of a panel over the whole trial."""
    return rrb.TimeSeriesView(
        origin=panel.name,
        name=panel.title,
        axis_x=WHOLE_RUN,
        axis_y=rrb.ScalarAxis(range=panel.limits),
        plot_legend=rrb.PlotLegend(visible=False),
    )
