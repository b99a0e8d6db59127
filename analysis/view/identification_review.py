"""An identified ship in Rerun: a sheet of her coefficients, and one for each run."""

import os
import re
from hashlib import sha256

import rerun as rr
import rerun.blueprint as rrb

from analysis.identification.comparison.history import run_secs
from analysis.identification.identify import IdentifiedShip
from analysis.report.identification_tables import identification_tables
from analysis.report.markdown import markdown_page

from .identification_panels import RunSheet, parameter_panels, run_sheets
from .panels import Panel
from .rerun_io import (
    axis_until,
    chart_view,
    make_blueprint,
    plot_view,
    save_recording,
    send_chart,
    send_points,
    send_style,
    send_text,
)

MOST_LARGE = 12  # coefficients; more are drawn smaller
KEY = """\
*Runs: grey measured, coloured simulated. Residuals over what is usual, with ±2σ. Coefficients, \
over the runs put end to end: grey the value by output error with its 95 % interval; blue the \
extended Kalman filter from two priors; green windows in weak form, ±2σ; red the paper's own \
scheme from the same two priors, for comparison. Faint: more than half of it is its prior.*

"""


def write_review(found: IdentifiedShip, path: str | os.PathLike[str]) -> None:
    """Write the review to an .rrd file.

    Raises `ShiplogError` where `path` cannot be written to.
    """
    recording = _recording(found)
    sheets, coefficients = list(run_sheets(found)), parameter_panels(found)
    with save_recording(recording, path):
        rr.send_blueprint(_blueprint(found, sheets, coefficients), recording=recording)
        text = markdown_page(
            f"{found.model.title}, identified", identification_tables(found), found.warnings
        )
        send_text(recording, "summary", KEY + text)
        _send(recording, coefficients, sheets[0].start_ns)
        for i, sheet in enumerate(sheets):
            panels = (*sheet.outputs, *sheet.residuals, *sheet.inputs, sheet.correlation)
            _send(recording, panels, sheet.start_ns)
            if sheet.track is not None:
                send_chart(recording, _track_origin(i), sheet.track, sheet.start_ns)
        recording.flush()


def _recording(found: IdentifiedShip) -> rr.RecordingStream:
    """A stream whose names depend on the model and the logs alone; see the replay's."""
    logs = [segment.name for segment in found.fit.problem.segments]
    digest = sha256(repr((found.model.name, logs, found.fit.parameters.tolist())).encode())
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog identify {found.model.name} {logs[0]}")
    recording = rr.RecordingStream(
        name, recording_id=digest.hexdigest()[:32], send_properties=False
    )
    recording.send_recording_name(f"{found.model.name} from {', '.join(dict.fromkeys(logs))}")
    return recording


def _send(
    recording: rr.RecordingStream, panels: list[Panel] | tuple[Panel, ...], start_ns: int
) -> None:
    for panel in panels:
        for series in panel.series:
            entity = f"{panel.name}/{series.name}"
            send_style(recording, entity, series)
            send_points(recording, entity, series, start_ns)


def _track_origin(i: int) -> str:
    return f"track_{i + 1}"


def _blueprint(
    found: IdentifiedShip, sheets: list[RunSheet], coefficients: list[Panel]
) -> rrb.Blueprint:
    axis = axis_until(run_secs(found.fit.problem.segments))
    columns = 3 if len(coefficients) <= MOST_LARGE else 4
    overview = rrb.Horizontal(
        rrb.Grid(*(plot_view(panel, axis) for panel in coefficients), grid_columns=columns),
        rrb.TextDocumentView(origin="summary", name="summary"),
        column_shares=[3, 2],
        name="coefficients",
    )
    runs = [_run(i, sheet) for i, sheet in enumerate(sheets)]
    return make_blueprint(rrb.Tabs(overview, *runs, active_tab=0))


def _run(i: int, sheet: RunSheet) -> rrb.Container:
    axis = axis_until(sheet.duration_secs)
    left = [plot_view(panel, axis) for panel in (*sheet.outputs, *sheet.inputs)]
    right: list[rrb.View] = [plot_view(panel, axis) for panel in sheet.residuals]
    right.append(plot_view(sheet.correlation, axis_until(sheet.lag_secs)))
    if sheet.track is not None:
        right.append(chart_view(_track_origin(i), sheet.track))
    shares = [1] * (len(right) - 1) + [2 if sheet.track is not None else 1]
    return rrb.Horizontal(
        rrb.Vertical(*left), rrb.Vertical(*right, row_shares=shares), name=sheet.title
    )
