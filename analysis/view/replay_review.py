"""A review in Rerun: the entities of an analysis, and one page on which to read them."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from analysis.replay.plan import Plan
from analysis.replay.replay import Analysis, Findings, ReplayChunk

from .panels import Panel, equation_panels, history_panels
from .rerun_io import (
    chart_view,
    make_blueprint,
    plot_view,
    save_recording,
    send_chart,
    send_points,
    send_style,
    send_text,
)
from .series import SeriesBuilder
from .track_chart import TrackChart, draw_track

ROWS = [1.3, 0.9, 1.0, 0.9]  # heights: outputs, inputs, disturbances, residuals
KEY = """\
*Grey: measured, or in the model. Blue, orange: estimated, of yaw and of surge, ±2σ. \
Green: inputs. Red: disturbance; between the grey lines it may be sensor noise. Cyan: waves. \
Coefficients: in the title over the whole trial, ±2σ; as a line at the end of each window; red, \
if one changed, before and after. \
A gap: not measured, or a window that cannot tell.*

"""


class ReplayReview:
    """A review that is drawn as the chunks of a replay come; made by `open_replay_review`."""

    def __init__(self, plan: Plan, recording: rr.RecordingStream, *, full: bool) -> None:
        self._recording, self._full = recording, full
        self._start_ns = plan.clock.start_ns
        self._sketch = SeriesBuilder(plan.clock, plan.stats)

    def add(self, chunk: ReplayChunk) -> None:
        """Draw the next chunk."""
        dense = self._sketch.add(chunk)
        if self._full:
            for entity, series in dense.items():
                send_points(self._recording, entity, series, self._start_ns)

    def finish(self, findings: Findings, text: str) -> None:
        """Draw what is known at the end; `text` is the page of words, in Markdown."""
        recording, start_ns = self._recording, self._start_ns
        drawn = self._sketch.result()
        yaw, surge = equation_panels(findings, drawn)
        coefficients, chart = (
            history_panels(findings, drawn),
            draw_track(findings, drawn),
        )
        rr.send_blueprint(_blueprint(yaw, surge, coefficients, chart), recording=recording)
        _send_properties(recording, findings)
        send_text(recording, "summary", KEY + text)
        for panel in (*yaw, *surge, *coefficients):
            for series in panel.series:
                entity = f"{panel.name}/{series.name}"
                send_style(recording, entity, series)
                if not (self._full and series is drawn.get(entity)):
                    send_points(recording, entity, series, start_ns)
        if chart is not None:
            send_chart(recording, "track", chart, start_ns)
        recording.flush()


@contextmanager
def open_replay_review(
    plan: Plan, path: str | os.PathLike[str], *, full: bool = False
) -> Iterator[ReplayReview]:
    """A review that becomes the .rrd file `path` when it was finished.

    Of a long trial the series are thinned to what a screen can show, with every extreme kept;
    `full` keeps every sample. Raises `ShiplogError` where `path` cannot be written to, or not to
    the end.
    """
    recording = _recording(plan)
    with save_recording(recording, path):
        yield ReplayReview(plan, recording, full=full)


def write_replay_review(
    analysis: Analysis, path: str | os.PathLike[str], *, text: str, full: bool = False
) -> None:
    """Write the review of a whole analysis to an .rrd file; as `open_replay_review`."""
    with open_replay_review(analysis.findings.plan, path, full=full) as review:
        review.add(analysis.as_chunk())
        review.finish(analysis.findings, text)


def _recording(plan: Plan) -> rr.RecordingStream:
    """A stream whose names depend on the log, the model and the noise alone.

    Each log is an application of its own to Rerun, which shares one layout among the recordings
    of an application; the axes of another ship would be wrong for this one.
    """
    name, usual, noise = plan.name, plan.stats, plan.noise
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
    recording.send_recording_name(findings.plan.name)
    rr.send_recording_start_time_nanos(findings.plan.clock.start_ns, recording=recording)
    trial = rr.AnyValues(
        vessel=findings.plan.vessel.name,
        model=findings.plan.model_origin,
        duration_secs=findings.plan.log_stats.duration_secs,
        dt_secs=findings.plan.clock.dt_secs,
        samples=findings.plan.clock.count,
        warnings=list(findings.warnings) or ["none"],
    )
    recording.send_property("trial", trial)


def _blueprint(
    yaw: list[Panel], surge: list[Panel], coefficients: list[Panel], drawn: TrackChart | None
) -> rrb.Blueprint:
    plots = rrb.Horizontal(
        *(rrb.Vertical(*map(plot_view, column), row_shares=ROWS) for column in (yaw, surge))
    )
    page: list[rrb.View | rrb.Container] = [rrb.TextDocumentView(origin="summary", name="summary")]
    if drawn is not None:
        page.insert(0, chart_view("track", drawn))
    side: list[rrb.View | rrb.Container] = [rrb.Horizontal(*page)]
    if coefficients:
        side.append(rrb.Grid(*map(plot_view, coefficients), grid_columns=3, name="coefficients"))
    return make_blueprint(
        rrb.Horizontal(
            plots, rrb.Vertical(*side, row_shares=[2, 3][: len(side)]), column_shares=[1, 1]
        )
    )
