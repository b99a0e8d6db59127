"""Rerun review of an identified ship: its parameters, and each run."""

import os
import re
from collections.abc import Sequence
from hashlib import sha256

import rerun as rr

from analysis.identification.identified_ship import IdentifiedShip
from analysis.report.identification_tables import parameter_tables, proof_tables
from analysis.report.markdown import markdown_page
from analysis.report.predicted_tables import prediction_tables
from shiplog.printable import printable

from .identification_layout import identification_blueprint, text_origin
from .panels import Panel
from .parameter_panels import parameter_panels
from .rerun_io import save_recording, send_chart, send_points, send_style, send_text
from .review_tabs import SUMMARY, track_origin
from .run_sheets import run_sheets


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
    sheets, parameters = run_sheets(ship), parameter_panels(ship)
    with save_recording(recording, path):
        rr.send_blueprint(identification_blueprint(ship, sheets, parameters), recording=recording)
        title = f"{ship.model.title}, identified"
        tables = (*proof_tables(ship), *prediction_tables(ship), *parameter_tables(ship))
        page = markdown_page(title, tables, ship.warnings)
        send_text(recording, SUMMARY, page)
        fitted = ship.fit.problem.segments
        _send(recording, parameters, fitted[0].signals.start_ns)
        for sheet in sheets:
            _send(recording, list(sheet.panels()), sheet.start_ns)
            send_text(recording, text_origin(sheet), sheet.text)
            for origin, chart in sheet.charts():
                send_chart(recording, track_origin(origin), chart, sheet.start_ns)


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
