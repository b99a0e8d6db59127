"""A review in Rerun: the entities of an analysis, and one page on which to read them."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.errors import ShiplogError
from shiplog.files import replacing
from shiplog.types import FloatArray

from .chart import Chart, draw_track
from .drawing import CYAN, GREEN, GREY, ORANGE, RED, Series, Sketch
from .panels import Panel, coefficient_panels, equation_panels
from .pipeline import Analysis, Findings, Slab
from .plan import Plan

ROWS_SENT = 1 << 16  # at once
WHOLE_RUN = rrb.TimeAxis(
    view_range=rr.TimeRange(
        start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite()
    )
)
ROWS = [1.3, 0.9, 1.0, 0.9]  # heights: outputs, inputs, disturbances, residuals
KEY = """\
*Grey: measured, or in the model. Blue, orange: estimated, of yaw and of surge, ±2σ. \
Green: inputs. Red: disturbance; between the grey lines it may be sensor noise. Cyan: waves. \
Coefficients: in the title over the whole trial, ±2σ; as a line at the end of each window; red, \
if one changed, before and after. \
A gap: not measured, or a window that cannot tell.*

"""


class Review:
    """A review that is drawn as the slabs of a replay come; made by `reviewing`."""

    def __init__(self, plan: Plan, recording: rr.RecordingStream, *, full: bool) -> None:
        self._recording, self._full = recording, full
        self._start_ns = plan.clock.start_ns
        self._sketch = Sketch(plan.clock, plan.usual)

    def add(self, slab: Slab) -> None:
        """Draw the next slab."""
        dense = self._sketch.add(slab)
        if self._full:
            for entity, series in dense.items():
                _send_points(self._recording, entity, series, self._start_ns)

    def finish(self, findings: Findings, text: str) -> None:
        """Draw what is known at the end; `text` is the page of words, in Markdown."""
        recording, start_ns = self._recording, self._start_ns
        drawn = self._sketch.result()
        yaw, surge = equation_panels(findings, drawn)
        coefficients, chart = coefficient_panels(findings, drawn), draw_track(findings, drawn)
        rr.send_blueprint(_blueprint(yaw, surge, coefficients, chart), recording=recording)
        _send_properties(recording, findings)
        page = rr.TextDocument(KEY + text, media_type=rr.MediaType.MARKDOWN)
        recording.log("summary", page, static=True)
        for panel in (*yaw, *surge, *coefficients):
            for series in panel.series:
                entity = f"{panel.name}/{series.name}"
                _send_style(recording, entity, series)
                if not (self._full and series is drawn.get(entity)):
                    _send_points(recording, entity, series, start_ns)
        _send_chart(recording, chart, start_ns)
        recording.flush()


@contextmanager
def reviewing(plan: Plan, path: str | os.PathLike[str], *, full: bool = False) -> Iterator[Review]:
    """A review that becomes the .rrd file `path` when it was finished.

    Of a long trial the series are thinned to what a screen can show, with every extreme kept;
    `full` keeps every sample. Raises `ShiplogError` where `path` cannot be written to, or not to
    the end.
    """
    with replacing(path) as part:
        recording = _recording(plan)
        try:
            recording.save(part)
            yield Review(plan, recording, full=full)
        except RuntimeError as error:  # what Rerun makes of a full disk
            raise ShiplogError(f"cannot finish the review; is the disk full? {path}") from error
        finally:
            recording.disconnect()


def write_review(
    analysis: Analysis, path: str | os.PathLike[str], *, text: str, full: bool = False
) -> None:
    """Write the review of a whole analysis to an .rrd file; as `reviewing`."""
    with reviewing(analysis, path, full=full) as review:
        review.add(analysis)
        review.finish(analysis, text)


def _recording(plan: Plan) -> rr.RecordingStream:
    """A stream whose names depend on the log, the model and the noise alone.

    Each log is an application of its own to Rerun, which shares one layout among the recordings
    of an application; the axes of another ship would be wrong for this one.
    """
    name, usual, noise = plan.name, plan.usual, plan.noise
    known = (name, plan.clock.start_ns, plan.clock.count, plan.vessel, usual.measured)
    digest = sha256(repr(known).encode())
    for array in (usual.spread, noise.measurement_std, noise.process_ratio):
        digest.update(np.ascontiguousarray(array).tobytes())
    return rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog {name}"),
        recording_id=digest.hexdigest()[:32],
        send_properties=False,
    )


def _send_properties(recording: rr.RecordingStream, findings: Findings) -> None:
    recording.send_recording_name(findings.name)
    rr.send_recording_start_time_nanos(findings.clock.start_ns, recording=recording)
    trial = rr.AnyValues(
        vessel=findings.vessel.name,
        model=findings.model_origin,
        duration_secs=findings.survey.duration_secs,
        dt_secs=findings.clock.dt_secs,
        samples=findings.clock.count,
        warnings=list(findings.warnings) or ["none"],
    )
    recording.send_property("trial", trial)


def _send_style(recording: rr.RecordingStream, entity: str, series: Series) -> None:
    style = rr.SeriesLines(
        names=[line.name for line in series.lines],
        colors=[line.colour for line in series.lines],
        widths=[line.width for line in series.lines],
        aggregation_policy="MinMax" if series.spiky else "Average",
    )
    recording.log(entity, style, static=True)


def _send_points(recording: rr.RecordingStream, entity: str, series: Series, start_ns: int) -> None:
    """Send a series in slabs of a size that Rerun likes."""
    values = np.column_stack([line.values for line in series.lines])
    for start in range(0, len(values), ROWS_SENT):
        part = slice(start, start + ROWS_SENT)
        times = _times(series.time_secs[part], start_ns)
        recording.send_columns(entity, times, rr.Scalars.columns(scalars=values[part]))


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
