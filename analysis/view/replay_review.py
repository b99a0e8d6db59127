"""The review of a replay in Rerun: its entities, and the page and the tab that show them."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from analysis.replay.plan import Plan
from analysis.replay.replay_results import Analysis, Findings, ReplayChunk
from shiplog.printable import printable
from shiplog.types import Event, EventLevel, Log

from .further_channels import FurtherChannels
from .panels import Panel
from .replay_panels import equation_panels, history_panels
from .rerun_io import (
    chart_view,
    events_view,
    make_blueprint,
    plot_view,
    save_recording,
    send_chart,
    send_events,
    send_points,
    send_style,
    send_text,
)
from .sensor_panels import sensor_panels
from .series_builder import SeriesBuilder
from .track_chart import TrackChart, draw_track

ROW_SHARES = [1.45, 0.8, 1.0, 0.9]  # heights: outputs, inputs, disturbances, innovations
LEGEND = """
## Legend

- **grey**: measured; in coefficient panels, the value of the model
- **blue**, **orange**: estimates of yaw and of surge, with ±2σ
- **green**: inputs; among the disturbances, moment and force of the wind
- **red**: disturbances (between the grey lines they may be sensor noise), and coefficients before \
and after a change
- **cyan**: waves
- **coefficients**: in the title, the value over the whole trial with ±2σ; as a curve, that of the \
sliding window that ends there
- **gap in a curve**: nothing measured, or a window that does not determine the coefficient
"""
SENSORS_NAME = "sensors"
SENSORS_LEGEND = f"""\
- **tab "{SENSORS_NAME}"**: sensor errors, current and coefficients of the wind with ±2σ, as \
estimated with the states; the heading, measured and estimated, and the innovations of heading and \
position
"""
FURTHER_NAME = "further channels"
FURTHER_LEGEND = f"""\
- **tab "{FURTHER_NAME}"**: what else the log has, as measured, and all sources of a quantity that \
has several; steps are values held until the next, such as orders
"""


class ReplayReview:
    """A review drawn while the chunks of a replay come; made by `open_replay_review`."""

    def __init__(self, plan: Plan, recording: rr.RecordingStream, *, full: bool) -> None:
        self._recording, self._full = recording, full
        self._start_ns = plan.clock.start_ns
        self._builder = SeriesBuilder(plan.clock, plan.stats)
        self._further = FurtherChannels(plan.screening, plan.clock, full=full)

    def add(self, chunk: ReplayChunk) -> None:
        """Draw the next chunk."""
        dense = self._builder.add(chunk)
        if self._full:
            for entity, series in dense.items():
                send_points(self._recording, entity, series, self._start_ns)

    def add_further_channels(self, log: Log) -> None:
        """Draw the channels that the replay does not use: a pass over the log if it has any.

        Parameters
        ----------
        log
            The log as recorded, as it was given to `plan_replay`.
        """
        if self._further:
            for chunk in log.chunks():
                self._further.add(chunk)

    def finish(self, findings: Findings, text: str) -> None:
        """Draw what is known only at the end.

        Parameters
        ----------
        findings
            The findings of the replay.
        text
            The page of text, in Markdown; a legend is added to it.
        """
        recording, start_ns = self._recording, self._start_ns
        drawn = self._builder.result()
        yaw, surge = equation_panels(findings, drawn)
        coefficients, chart = history_panels(findings, drawn), draw_track(findings, drawn)
        sensors = sensor_panels(findings, drawn)
        further, events = self._further.panels(), _events_with_changes(findings, start_ns)
        page = _replay_page(yaw, surge, coefficients, chart, has_events=bool(events))
        rr.send_blueprint(_blueprint(page, sensors, further), recording=recording)
        _send_properties(recording, findings)
        legends = (SENSORS_LEGEND if any(sensors) else "") + (FURTHER_LEGEND if further else "")
        send_text(recording, "summary", text + LEGEND + legends)
        for panel in (*yaw, *surge, *coefficients, *sensors[0], *sensors[1], *further):
            for series in panel.series:
                entity = f"{panel.name}/{series.name}"
                send_style(recording, entity, series)
                if not (self._full and series is drawn.get(entity)):
                    send_points(recording, entity, series, start_ns)
        if chart is not None:
            send_chart(recording, "track", chart, start_ns)
        if events:
            send_events(recording, "events", events, start_ns)


@contextmanager
def open_replay_review(
    plan: Plan, path: str | os.PathLike[str], *, full: bool = False
) -> Iterator[ReplayReview]:
    """Open a review, which becomes an .rrd file once it is finished.

    Parameters
    ----------
    plan
        The plan of the replay.
    path
        The file to write.
    full
        Whether to keep every sample; by default the series of a long trial are decimated to what a
        screen can show, with every extreme kept.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to.
    """
    recording = _recording(plan)
    with save_recording(recording, path):
        yield ReplayReview(plan, recording, full=full)


def write_replay_review(
    analysis: Analysis,
    path: str | os.PathLike[str],
    *,
    text: str,
    full: bool = False,
    log: Log | None = None,
) -> None:
    """Write the review of an analysis to an .rrd file; see `open_replay_review`.

    The channels that the replay did not use are drawn where the log is given.
    """
    with open_replay_review(analysis.findings.plan, path, full=full) as review:
        review.add(analysis.as_chunk())
        if log is not None:
            review.add_further_channels(log)
        review.finish(analysis.findings, text)


def _recording(plan: Plan) -> rr.RecordingStream:
    """Return a stream whose names depend only on the log, the model and the noise.

    Each log is an application of its own to Rerun, which shares one layout among the recordings
    of an application; the axes of another ship would be wrong for this one.
    """
    name, stats, noise = plan.name, plan.stats, plan.noise
    identity = (name, plan.clock.start_ns, plan.clock.count, plan.vessel, stats.sample_counts)
    digest = sha256(repr(identity).encode())
    for array in (stats.std, noise.measurement_std, noise.process_ratio):
        digest.update(np.ascontiguousarray(array).tobytes())
    return rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog {name}"),
        recording_id=digest.hexdigest()[:32],
        send_properties=False,
    )


def _send_properties(recording: rr.RecordingStream, findings: Findings) -> None:
    """Send the recording's name, start and properties."""
    recording.send_recording_name(printable(findings.plan.name))
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
    page: rrb.Container, sensors: tuple[list[Panel], list[Panel]], further: list[Panel]
) -> rrb.Blueprint:
    """Return a blueprint of the page, with tabs for sensors and further channels if there are any.

    Histories of sensor errors are on the left, heading and innovations on the right.
    """
    tabs = [page]
    if any(sensors):
        halves = (rrb.Vertical(*map(plot_view, panels)) for panels in sensors if panels)
        tabs.append(rrb.Horizontal(*halves, name=SENSORS_NAME))
    if further:
        columns = 1 + (len(further) > 3) + (len(further) > 8)
        tabs.append(rrb.Grid(*map(plot_view, further), grid_columns=columns, name=FURTHER_NAME))
    return make_blueprint(rrb.Tabs(*tabs, active_tab=0) if len(tabs) > 1 else page)


def _events_with_changes(findings: Findings, start_ns: int) -> tuple[Event, ...]:
    """Return the events of the log, and the changes of coefficients as warnings among them."""
    changes = (
        Event(start_ns + round(change.at_secs * 1e9), str(change), "replay", EventLevel.WARNING)
        for change in findings.changes
    )
    return tuple(sorted((*findings.events, *changes), key=lambda event: event.time_ns))


def _replay_page(
    yaw: list[Panel],
    surge: list[Panel],
    coefficients: list[Panel],
    chart: TrackChart | None,
    *,
    has_events: bool,
) -> rrb.Container:
    """Lay out one page: yaw and surge on the left; track, summary and coefficients on the right.

    The events of the log and the changes of coefficients are a list of texts below these.
    """
    plots = rrb.Horizontal(
        *(rrb.Vertical(*map(plot_view, column), row_shares=ROW_SHARES) for column in (yaw, surge))
    )
    top: list[rrb.View | rrb.Container] = [rrb.TextDocumentView(origin="summary", name="summary")]
    if chart is not None:
        top.insert(0, chart_view("track", chart))
    shares = [3, 4][2 - len(top) :]
    side: list[rrb.View | rrb.Container] = [rrb.Horizontal(*top, column_shares=shares)]
    if coefficients:
        side.append(rrb.Grid(*map(plot_view, coefficients), grid_columns=3, name="coefficients"))
    row_shares = [2, 3][: len(side)]
    if has_events:
        side.append(events_view())
        row_shares.append(1)
    right = rrb.Vertical(*side, row_shares=row_shares)
    return rrb.Horizontal(plots, right, column_shares=[1, 1], name="replay")
