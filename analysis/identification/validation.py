"""Open-loop prediction of runs that were not fitted, and its errors.

The simulation starts in the run's initial state and is given only the recorded rudder and
revolutions.
"""

from dataclasses import dataclass

import numpy as np

from analysis.identification.fit.drift import DRIFT_INDICES, drift_is_unknown, without_sway
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.segment import Segment
from analysis.manoeuvres.execute import first_execute
from analysis.manoeuvres.indices import reason_without_indices
from analysis.manoeuvres.manoeuvre import ManoeuvreIndex
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .prediction import dead_reckoning, predict, predicted_indices
from .runs import Run

HEADING = MODEL_OUTPUTS.index("heading")
MIN_FIXES_SECS, MAX_FIXES_SECS = 5.0, 60.0  # of fixes before the rudder moves, to find a heading
MAX_TRACK_MISMATCH = 0.03  # rms distance over the track's length: beyond it no heading fits


@dataclass(frozen=True, eq=False)
class Validation:
    """Comparison of a segment that was not fitted with its simulation.

    Attributes
    ----------
    segment
        The inputs and what was measured.
    simulated
        (n, 4) outputs in the order of `MODEL_OUTPUTS`, SI; NaN from where the simulation diverges.
        The sway is zero where the fitted logs show no drift.
    track
        (n, 2) simulated position north and east of the start, m.
    measured_track
        (n, 2) the same as measured: by the position fixes, or else by speed and heading.
    rms
        Root mean square of simulated minus measured of each output that was measured and that the
        model predicts, and of the distance between the tracks (``track``): rad/s, m/s, rad, m.
    indices
        Indices of a turning circle or of a zig-zag; empty for any other run. Those that depend on
        the drift are missing where the fitted logs do not show it.
    no_indices
        The reason why there are no indices; empty where there are some.
    """

    segment: Segment
    simulated: FloatArray
    track: FloatArray
    measured_track: FloatArray
    rms: dict[str, float]
    indices: tuple[ManoeuvreIndex, ...]
    no_indices: str = ""

    @property
    def diverged(self) -> bool:
        """Whether the simulation diverged."""
        return not bool(np.isfinite(self.simulated).all())


def validate(fit: OutputError, run: Run) -> list[Validation]:
    """Compare a fit with each segment of a run that was not fitted.

    Parameters
    ----------
    fit
        The fitted model.
    run
        The run, with position fixes if it has any.

    Returns
    -------
    validations
        One for each segment, in order.
    """
    return [_validate_segment(fit, segment) for segment in run.segments]


def _validate_segment(fit: OutputError, segment: Segment) -> Validation:
    fixes = segment.fixes
    heading = 0.0 if fixes is None or segment.has("heading") else initial_heading(segment, fixes)
    if heading is None:  # fixes are of no use where the initial heading is unknown
        heading, fixes = 0.0, None
    measured = filled_measurements(segment, heading)
    simulated = predict(fit, _with_heading(segment, measured[:, HEADING]))
    no_drift = drift_is_unknown(fit.problem)
    if no_drift:
        simulated = without_sway(simulated)
    track = dead_reckoning(simulated, segment.dt_secs)
    measured_track = dead_reckoning(measured, segment.dt_secs)
    if fixes is not None:
        reference = measured_track if np.isnan(track).any() else track
        measured_track = shifted_to(fixes, reference)
    residual = simulated - segment.measured
    predicted = {*fit.problem.model.outputs, "heading"} - ({"sway"} if no_drift else set())
    rms = {
        name: nan_rms(residual[:, i])
        for i, name in enumerate(MODEL_OUTPUTS)
        if segment.has(name) and name in predicted
    }
    rms["track"] = nan_rms(np.hypot(*(track - measured_track).T))
    compared = predicted_indices(segment, measured, measured_track, simulated, track)
    indices = tuple(each for each in compared if not (no_drift and each.name in DRIFT_INDICES))
    no_indices = (
        ""
        if indices
        else reason_without_indices(
            segment.signals["rudder"], measured[:, HEADING], segment.dt_secs
        )
    )
    return Validation(segment, simulated, track, measured_track, rms, indices, no_indices)


def filled_measurements(segment: Segment, heading: float = 0.0) -> FloatArray:
    """Return the measured outputs with gaps interpolated.

    Parameters
    ----------
    segment
        A segment; an output without two samples stays NaN.
    heading
        Initial heading, rad, from which the yaw rate is integrated where no heading was measured.

    Returns
    -------
    outputs
        (n, 4) in the order of `MODEL_OUTPUTS`, SI.
    """
    columns = [_interpolated(column) for column in segment.measured.T]
    if not segment.has("heading"):
        rate = columns[0]
        turned = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2)) * segment.dt_secs
        columns[HEADING] = heading + turned
    return np.column_stack(columns)


def _interpolated(values: FloatArray) -> FloatArray:
    at = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), at, values[at]) if len(at) > 1 else 0.0 * values


def initial_heading(segment: Segment, fixes: FloatArray) -> float | None:
    """Find the initial heading that turns the dead-reckoned track onto the position fixes.

    Only fixes before the first rudder order are used: in a turn the ship drifts.

    Parameters
    ----------
    segment
        A segment without a measured heading.
    fixes
        (n, 2) positions north and east, m; NaN where unknown.

    Returns
    -------
    heading
        In rad; None where there are less than `MIN_FIXES_SECS` of fixes, or where they are more
        than `MAX_TRACK_MISMATCH` of the track's length away from it.
    """
    order = first_execute(segment.signals["rudder"], segment.dt_secs)
    fewest, most = (round(secs / segment.dt_secs) for secs in (MIN_FIXES_SECS, MAX_FIXES_SECS))
    straight = len(segment) if order is None else order + 1
    fixed = np.flatnonzero(np.isfinite(fixes[:straight]).all(axis=1))[:most]
    if len(fixed) <= fewest:
        return None
    reckoned = dead_reckoning(filled_measurements(segment), segment.dt_secs)[fixed]
    # as complex numbers, north + i east, about their means: a heading is a rotation
    track, seen = ((each - each.mean(axis=0)) @ [1, 1j] for each in (reckoned, fixes[fixed]))
    heading = float(np.angle(np.vdot(track, seen)))
    mismatch = nan_rms(np.abs(track * np.exp(1j * heading) - seen))
    return heading if mismatch < MAX_TRACK_MISMATCH * abs(track[-1] - track[0]) else None


def _with_heading(segment: Segment, heading: FloatArray) -> Segment:
    """Return the segment with its own heading or, where it has none, with this one, (n,)."""
    if segment.has("heading"):
        return segment
    measured = segment.measured.copy()
    measured[:, HEADING] = heading
    return Segment(segment.name, segment.signals, segment.path, measured)


def shifted_to(fixes: FloatArray, track: FloatArray) -> FloatArray:
    """Shift fixes, (n, 2), onto a track at the first fix, which may be later than its start."""
    fixed = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    return fixes - fixes[fixed[0]] + track[fixed[0]] if len(fixed) else fixes


def nan_rms(values: FloatArray) -> float:
    """Return the root mean square of the finite values; NaN where there are none.

    Examples
    --------
    >>> nan_rms(np.array([3.0, np.nan, -3.0]))
    3.0
    """
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else np.nan
