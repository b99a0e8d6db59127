"""Sheets of the manoeuvres of a log as recorded, without a replay."""

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan

from .log_drawing import LogDrawing
from .manoeuvre_sheets import ManoeuvreSheet, manoeuvre_sheet
from .motion_panels import MotionHistory

MEASURED = ("heading", "yaw_rate", "speed", "sway")


def log_manoeuvre_sheets(
    drawing: LogDrawing,
) -> tuple[list[ManoeuvreSpan], list[ManoeuvreSheet]]:
    """Return the manoeuvres of a drawing and their sheets; none where none were looked for.

    Parameters
    ----------
    drawing
        Of a log; the times of what is returned count as its own do.
    """
    found = drawing.manoeuvres
    if found is None or not found.spans:
        return [], []
    offset = (found.start_ns - drawing.zero_ns) * 1e-9
    spans = [span.later(offset) for span in found.spans]
    values = found.signals.values()
    history = MotionHistory(
        offset + found.signals.time_secs,
        values["rudder"],
        values["rpm"],
        {name: values[name] for name in MEASURED},
    )
    tracks = [drawing.track] if drawing.track is not None else []
    sheets = [
        manoeuvre_sheet(span, history, tracks, None, f"manoeuvre_{span.number}") for span in spans
    ]
    return spans, sheets
