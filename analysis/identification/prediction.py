"""Prediction of runs that were not fitted: open-loop simulation, its misfit, and zig-zags."""

from dataclasses import replace

import numpy as np

from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.segment import Segment
from analysis.manoeuvres.indices import manoeuvre_indices
from analysis.manoeuvres.manoeuvre import ManoeuvreIndex, ManoeuvreMotion
from shiplog.types import FloatArray


def predict(fit: OutputError, segment: Segment) -> FloatArray:
    """Simulate a segment open loop with the fitted parameters.

    Parameters
    ----------
    fit
        The fitted model.
    segment
        Gives rudder, revolutions and the initial state; its other measurements are not used.

    Returns
    -------
    outputs
        (n, 4) in the order of `MODEL_OUTPUTS`, SI; NaN from where the simulation diverges.
    """
    problem = replace(fit.problem, segments=(segment,), waves=())
    state = problem.start()[problem.common :][: len(problem.model.state)]
    zero = fit.problem.rudder_zero(fit.minimum.unknowns)
    return problem.model.simulate(
        fit.parameters, state, segment.path, len(segment), offset=zero, scale=problem.scale
    )


def dead_reckoning(outputs: FloatArray, dt: float) -> FloatArray:
    """Integrate speed, sway and heading to positions by the trapezoidal rule.

    Parameters
    ----------
    outputs
        (n, 4) in the order of `MODEL_OUTPUTS`, SI; a missing sway (NaN) counts as zero.
    dt
        Sample interval, s.

    Returns
    -------
    positions
        (n, 2) m north and east of the first sample.

    Examples
    --------
    >>> import numpy as np
    >>> outputs = np.tile([0.0, 5.0, np.nan, 0.0], (3, 1))
    >>> dead_reckoning(outputs, dt=2.0).tolist()
    [[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]]
    """
    _, ahead, sway, heading = outputs.T
    sway = np.nan_to_num(sway)
    north = ahead * np.cos(heading) - sway * np.sin(heading)
    east = ahead * np.sin(heading) + sway * np.cos(heading)
    rates = np.column_stack((north, east))
    steps = (rates[1:] + rates[:-1]) / 2 * dt
    return np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def manoeuvre_motion(outputs: FloatArray, positions: FloatArray) -> ManoeuvreMotion:
    """Convert outputs, (n, 4), and positions, (n, 2) m, to what the manoeuvring indices need."""
    speed = np.hypot(outputs[:, 1], np.nan_to_num(outputs[:, 2]))
    return ManoeuvreMotion(outputs[:, 3], outputs[:, 0], speed, positions)


def predicted_indices(
    segment: Segment,
    measured: FloatArray,
    measured_track: FloatArray,
    simulated: FloatArray,
    track: FloatArray,
) -> tuple[ManoeuvreIndex, ...]:
    """Compare the manoeuvring indices of a segment with those of its simulation.

    Parameters
    ----------
    segment
        Gives the rudder and the sample interval.
    measured, simulated
        (n, 4) outputs in the order of `MODEL_OUTPUTS`, SI; measured ones with their gaps filled.
    measured_track, track
        (n, 2) the positions of either, m north and east.

    Returns
    -------
    indices
        Empty for a run that is neither a turning circle nor a zig-zag. Where the simulation
        diverges, its values are NaN.
    """
    rudder, dt = segment.signals["rudder"], segment.dt_secs
    motion = manoeuvre_motion(measured, measured_track)
    if not np.isfinite(simulated).all():
        indices = manoeuvre_indices(rudder, motion, motion, dt)
        return tuple(replace(index, simulated=np.nan) for index in indices)
    return tuple(manoeuvre_indices(rudder, motion, manoeuvre_motion(simulated, track), dt))
