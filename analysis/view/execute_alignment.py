"""Alignment of a log's drawing at the execute of its first manoeuvre."""

from dataclasses import replace

import numpy as np

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.trial.log_manoeuvres import LogManoeuvres
from shiplog.types import FloatArray

from .log_drawing import FirstExecute, LogDrawing
from .series import Series


def first_execute_of(found: LogManoeuvres) -> FirstExecute | None:
    """Return the execute of the first manoeuvre; None where only speed runs were sailed.

    Parameters
    ----------
    found
        The manoeuvres of a log.
    """
    for span in found.spans:
        if span.kind is not ManoeuvreKind.SPEED_RUN:
            at = found.start_ns + round(span.execute_secs * 1e9)
            return FirstExecute(span.title, at, span.approach_heading)
    return None


def aligned_at_execute(drawing: LogDrawing, execute: FirstExecute) -> LogDrawing:
    """Return a drawing whose times count from an execute, and its track from the ship's place then.

    The track keeps north and east as its axes.

    Parameters
    ----------
    drawing
        Its times count from the log's start.
    execute
        That of a manoeuvre in the log.
    """
    secs = (execute.at_ns - drawing.zero_ns) * 1e-9
    return replace(
        drawing,
        execute=execute,
        series={
            quantity: [replace(each, time_secs=each.time_secs - secs) for each in group]
            for quantity, group in drawing.series.items()
        },
        gaps={quantity: spans - secs for quantity, spans in drawing.gaps.items()},
        track=drawing.track and replace(drawing.track, time_secs=drawing.track.time_secs - secs),
    )


def track_from_execute(track: Series, heading: float) -> FloatArray:
    """Return a track from its place at the execute, ahead and to starboard, (k, 2) m.

    Parameters
    ----------
    track
        North and east, m; times count from the execute.
    heading
        That of the approach, rad.
    """
    north, east = (line.values for line in track.lines)
    known = np.isfinite(north) & np.isfinite(east)
    origin = [np.interp(0.0, track.time_secs[known], values[known]) for values in (north, east)]
    turned = ((north - origin[0]) + 1j * (east - origin[1])) * np.exp(-1j * heading)
    return np.column_stack((turned.real, turned.imag))
