"""A fit against runs it never saw: simulated open loop, in the units of a segment.

The ship begins as the run began, and then hears of nothing but rudder and revolutions.
"""

from dataclasses import dataclass

import numpy as np

from analysis.manoeuvres.indices import ManoeuvreIndex, first_execute, manoeuvre_indices
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .output_error import OutputError
from .prediction import dead_reckoning, predict
from .runs import Run
from .segment import Segment

FIXES_SECS = 5.0, 60.0  # of fixes before the rudder moves, at least and at most, tell a course
ASTRAY = 0.03  # of their length, off the way sailed: more is no course


@dataclass(frozen=True, eq=False)
class Validation:
    """A run, and what the fit says of it."""

    segment: Segment
    simulated: FloatArray  # (n, 4) in the order of MODEL_OUTPUTS, NaN where the ship ran away
    track: FloatArray  # (n, 2) m north and east from the start, as simulated,
    measured_track: FloatArray  # and as measured: by the fixes, or else by speed and heading
    rms: dict[str, float]  # rad/s, m/s, rad, m: of each output measured, and of the track
    figures: tuple[ManoeuvreIndex, ...]  # of a circle or of a zig-zag

    @property
    def diverged(self) -> bool:
        """Whether the simulated ship did."""
        return not bool(np.isfinite(self.simulated).all())


def validate(fit: OutputError, run: Run) -> list[Validation]:
    """A fit against each piece of a run."""
    return [
        _validation(fit, segment, fixes)
        for segment, fixes in zip(run.segments, run.positions, strict=True)
    ]


def _validation(fit: OutputError, segment: Segment, fixes: FloatArray | None) -> Validation:
    course = 0.0 if fixes is None or segment.has("heading") else initial_heading(segment, fixes)
    if course is None:  # the fixes are north and east of a ship that headed nobody knows where
        course, fixes = 0.0, None
    measured = filled_measurements(segment, course)
    simulated = predict(fit, _headed(segment, measured))
    track, sailed = (
        dead_reckoning(simulated, segment.dt_secs),
        dead_reckoning(measured, segment.dt_secs),
    )
    if fixes is not None:
        sailed = _from_first_fix(fixes, sailed if np.isnan(track).any() else track)
    off = simulated - segment.measured
    predicted = (*fit.problem.model.outputs, "heading")
    rms = {
        name: nan_rms(off[:, i])
        for i, name in enumerate(MODEL_OUTPUTS)
        if segment.has(name) and name in predicted
    }
    rms["track"] = nan_rms(np.hypot(*(track - sailed).T))
    figures = tuple(manoeuvre_indices(segment, measured, sailed, simulated, track))
    return Validation(segment, simulated, track, sailed, rms, figures)


def filled_measurements(segment: Segment, course: float = 0.0) -> FloatArray:
    """What was measured, its holes filled in.

    A heading nobody measured is the turning summed up, from the `course` she began on.
    """
    columns = [_filled_in(column) for column in segment.measured.T]
    if not segment.has("heading"):
        rate = columns[0]
        turned = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2)) * segment.dt_secs
        columns[3] = course + turned
    return np.column_stack(columns)


def _filled_in(values: FloatArray) -> FloatArray:
    at = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), at, values[at]) if len(at) > 1 else 0.0 * values


def initial_heading(segment: Segment, fixes: FloatArray) -> float | None:
    """The course a ship without heading began on, in rad: that which lays her way on the fixes.

    Only those before the rudder moves are looked at, for in a turn she drifts. None where they are
    too few, or where no course lays one on the other.
    """
    order = first_execute(segment.signals["rudder"], segment.dt_secs)
    least, most = (round(secs / segment.dt_secs) for secs in FIXES_SECS)
    before = len(segment) if order is None else order + 1
    known = np.flatnonzero(np.isfinite(fixes[:before]).all(axis=1))[:most]
    if len(known) <= least:
        return None
    sailed = dead_reckoning(filled_measurements(segment), segment.dt_secs)[known]
    way, seen = ((each - each.mean(axis=0)) @ [1, 1j] for each in (sailed, fixes[known]))
    course = float(np.angle(np.vdot(way, seen)))
    off = nan_rms(np.abs(way * np.exp(1j * course) - seen))
    return course if off < ASTRAY * abs(way[-1] - way[0]) else None


def _headed(segment: Segment, measured: FloatArray) -> Segment:
    """The segment with a heading to begin with."""
    if segment.has("heading"):
        return segment
    given = segment.measured.copy()
    given[:, 3] = measured[:, 3]
    return Segment(segment.name, segment.signals, segment.path, given)


def _from_first_fix(fixes: FloatArray, track: FloatArray) -> FloatArray:
    """The fixes laid on a track at the first of them, which need not be where the run begins."""
    known = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    return fixes - fixes[known[0]] + track[known[0]] if len(known) else fixes


def nan_rms(off: FloatArray) -> float:
    """The root of the mean square of what is known; NaN where nothing is."""
    known = off[np.isfinite(off)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan
