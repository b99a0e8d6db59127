"""Rerun review of an identified ship: its parameters, and each run."""

import os
import re
from collections.abc import Sequence
from hashlib import sha256

import rerun as rr
import rerun.blueprint as rrb

from analysis.identification.comparison.history import total_duration_secs
from analysis.identification.identified_ship import IdentifiedShip
from analysis.report.identification_tables import identification_tables
from analysis.report.markdown import markdown_page
from shiplog.printable import printable

from .identification_panels import RunSheet, parameter_panels, run_sheets
from .panels import Panel
from .rerun_io import (
    axis_between,
    chart_view,
    make_blueprint,
    plot_view,
    save_recording,
    send_chart,
    send_points,
    send_style,
    send_text,
)

MAX_LARGE_PANELS = 12  # parameters; with more, the panels are in more columns
LEGEND = """\
*Parameters, over the runs put end to end. Grey: value by output error with its 95 % interval. \
Blue: extended Kalman filter from two priors. Green: windows in weak form, ±2σ. Red: the paper's \
scheme from the same two priors, for comparison. Faint: more than half of the estimate is prior. \
Runs: grey measured, coloured simulated. Residuals over their standard deviation, with ±2σ.*

"""


def write_identification_review(ship: IdentifiedShip, path: str | os.PathLike[str]) -> None:
    """Write the review of an identified ship to an .rrd file.

    Parameters
    ----------
    ship
        The result of `analysis.identify`.
    path
        Where to write; a file there is replaced when the new one is complete.

    Raises
    ------
    ShiplogError
        The path cannot be written to.
    """
    recording = _recording(ship)
    sheets, parameters = list(run_sheets(ship)), parameter_panels(ship)
    with save_recording(recording, path):
        rr.send_blueprint(_blueprint(ship, sheets, parameters), recording=recording)
        title = f"{ship.model.title}, identified"
        page = markdown_page(title, identification_tables(ship), ship.warnings)
        send_text(recording, "summary", LEGEND + page)
        _send(recording, parameters, sheets[0].start_ns)
        for i, sheet in enumerate(sheets):
            panels = [*sheet.outputs, *sheet.residuals, *sheet.inputs, sheet.correlation]
            _send(recording, panels, sheet.start_ns)
            if sheet.track is not None:
                send_chart(recording, _track_origin(i), sheet.track, sheet.start_ns)


def _recording(ship: IdentifiedShip) -> rr.RecordingStream:
    """Open a stream whose identity depends on the model, the logs and the result alone.

    The same identification therefore replaces its earlier review in a viewer.
    """
    logs = [segment.name for segment in ship.fit.problem.segments]
    digest = sha256(repr((ship.model.name, logs, ship.fit.parameters.tolist())).encode())
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog identify {ship.model.name} {logs[0]}")
    recording = rr.RecordingStream(
        name, recording_id=digest.hexdigest()[:32], send_properties=False
    )
    title = f"{ship.model.name} from {', '.join(dict.fromkeys(logs))}"
    recording.send_recording_name(printable(title))
    return recording


def _send(recording: rr.RecordingStream, panels: Sequence[Panel], start_ns: int) -> None:
    for panel in panels:
        for series in panel.series:
            entity = f"{panel.name}/{series.name}"
            send_style(recording, entity, series)
            send_points(recording, entity, series, start_ns)


def _track_origin(i: int) -> str:
    return f"track_{i + 1}"


def _blueprint(
    ship: IdentifiedShip, sheets: Sequence[RunSheet], parameters: Sequence[Panel]
) -> rrb.Blueprint:
    axis = axis_between(0.0, total_duration_secs(ship.fit.problem.segments))
    columns = 3 if len(parameters) <= MAX_LARGE_PANELS else 4
    overview = rrb.Horizontal(
        rrb.Grid(*(plot_view(panel, axis) for panel in parameters), grid_columns=columns),
        rrb.TextDocumentView(origin="summary", name="summary"),
        column_shares=[3, 2],
        name="parameters",
    )
    runs = [_run_tab(i, sheet) for i, sheet in enumerate(sheets)]
    return make_blueprint(rrb.Tabs(overview, *runs, active_tab=0))


def _run_tab(i: int, sheet: RunSheet) -> rrb.Container:
    """Return outputs over inputs on the left, residuals, autocorrelation and track on the right."""
    axis = axis_between(0.0, sheet.duration_secs)
    left = [plot_view(panel, axis) for panel in (*sheet.outputs, *sheet.inputs)]
    right: list[rrb.View] = [plot_view(panel, axis) for panel in sheet.residuals]
    right.append(plot_view(sheet.correlation, axis_between(0.0, sheet.lag_secs)))
    if sheet.track is not None:
        right.append(chart_view(_track_origin(i), sheet.track))
    shares = [1] * (len(right) - 1) + [2 if sheet.track is not None else 1]
    return rrb.Horizontal(
        rrb.Vertical(*left), rrb.Vertical(*right, row_shares=shares), name=printable(sheet.title)
    )
