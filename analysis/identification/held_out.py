"""Prediction of runs that a model was not fitted to: the errors, and what they mean for a fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.identification.fit.fix_blocks import simulated_track
from analysis.identification.fit.least_squares import minimise
from analysis.identification.fit.noise_weights import initial_residual_stds
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.problem import Problem
from analysis.identification.fit.segment import Segment
from analysis.identification.fit.uncertainty import parameter_covariance
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

TRACK = "track"
PREDICTED = (*MODEL_OUTPUTS, TRACK)  # what the error of a prediction is computed of
JUDGED = ("yaw_rate", "speed", "heading", TRACK)  # every model predicts them
JUDGED_COLUMNS = [PREDICTED.index(name) for name in JUDGED]


@dataclass(frozen=True, eq=False)
class HeldOutErrors:
    """How far a fit to the other runs is from the segments of a run.

    Attributes
    ----------
    misfits
        (k, 5) of each segment: the rms error of each of `PREDICTED`, white noise deducted, over the
        standard deviation of its measurement. NaN for what was not measured or is not predicted;
        inf where the simulation diverges.
    excess
        The mean square of the errors over that predicted by noise and covariance; NaN where the
        simulation diverges.
    """

    misfits: FloatArray
    excess: float


def predict_without(whole: OutputError, held_out: Sequence[int]) -> HeldOutErrors:
    """Fit a model to the other segments and predict the ones held out.

    The search starts from the fit to all runs, with the noise of that fit. Of a held-out segment
    only its own unknowns are estimated (initial state, rudder zero, sensor errors, current): they
    are not known from another run.

    Parameters
    ----------
    whole
        The fit to all segments.
    held_out
        The numbers of the segments to predict.
    """
    kept = [i for i in range(len(whole.problem.segments)) if i not in held_out]
    rest, start = whole.problem.select_segments(kept, whole.minimum.unknowns)
    stds = tuple(whole.residual_stds[i] for i in kept)
    minimum = minimise(rest, start, stds)
    if not np.isfinite(minimum.cost):
        return HeldOutErrors(np.full((len(held_out), len(PREDICTED)), np.inf), np.nan)
    others = OutputError(rest, minimum, whole.noises, stds)
    errors = [_predicted_segment(others, whole.problem.segments[i]) for i in held_out]
    return HeldOutErrors(
        np.array([misfit for misfit, _ in errors]),
        _mean_known([excess for _, excess in errors]),
    )


def _mean_known(values: Sequence[float]) -> float:
    """Return the mean of the values that are not NaN; NaN where all are."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else np.nan


def misfit(fit: OutputError, segment: Segment) -> FloatArray:
    """Compute how far a fit is from a segment that was not fitted, (5,) as in `HeldOutErrors`."""
    return _predicted_segment(fit, segment)[0]


def _predicted_segment(fit: OutputError, segment: Segment) -> tuple[FloatArray, float]:
    """Return the misfits of a segment, and the excess of its squared errors."""
    problem, z = _with_own_unknowns(fit, segment)
    residual = problem.measured(0) - problem.predicted(z, 0)
    misfits = np.full(len(PREDICTED), np.nan)
    for at, name in enumerate(problem.outputs):
        if name in MODEL_OUTPUTS:
            white = _white_std(fit, name, problem.measured(0)[:, at])
            misfits[PREDICTED.index(name)] = _relative_rms(
                residual[:, at], problem.measured(0)[:, at], white
            )
    misfits[-1] = _track_misfit(problem, z)
    return misfits, _excess(fit, problem, z, residual)


def _with_own_unknowns(fit: OutputError, segment: Segment) -> tuple[Problem, FloatArray]:
    """Fit the segment's own unknowns, all parameters held."""
    whole = fit.problem
    judged = [name for name in MODEL_OUTPUTS if name in (*whole.outputs, *JUDGED)]
    further = [name for name in whole.outputs if name not in MODEL_OUTPUTS]
    outputs = (*(name for name in judged if segment.has(name)), *further)
    problem = replace(
        whole, segments=(segment,), outputs=outputs, values=fit.parameters, free=(), waves=()
    )
    minimum = minimise(problem, problem.start(), initial_residual_stds(problem))
    return problem, minimum.unknowns


def _white_std(fit: OutputError, name: str, measured: FloatArray) -> float:
    """Return the rms white noise of a measured output, (n,); 0 for one that was not fitted."""
    outputs = fit.problem.outputs
    if name not in outputs or not np.isfinite(measured).any():
        return 0.0
    noise = fit.noises[outputs.index(name)]
    return float(np.hypot(noise.white, noise.relative * np.sqrt(np.nanmean(measured**2))))


def _relative_rms(residual: FloatArray, measured: FloatArray, white: float) -> float:
    """Return the rms error, white noise deducted, over the standard deviation of the measured."""
    valid = np.isfinite(measured)
    if valid.sum() < 2:
        return np.nan
    square = float(np.mean(residual[valid] ** 2))
    if not np.isfinite(square):
        return np.inf
    # what remains of white noise after the deduction is its sampling error
    least = white**2 * np.sqrt(2 / valid.sum())
    size = float(np.std(measured[valid]))
    return float(np.sqrt(max(square - white**2, least))) / size if size > 0 else np.nan


def _track_misfit(problem: Problem, z: FloatArray) -> float:
    """Return the rms distance of the tracks over the measured track's about its mean course.

    Both tracks are reduced by their own constant and drift in time, which current and start have.
    """
    (segment,) = problem.segments
    if segment.fixes is None:
        return np.nan
    known = np.isfinite(segment.fixes).all(axis=1)
    if known.sum() < 3:
        return np.nan
    simulated = problem.simulated(z, 0)
    if not np.isfinite(simulated[:, 1]).all():
        return np.inf
    simulated[:, 2] = np.nan_to_num(simulated[:, 2])
    track = simulated_track(simulated, segment.dt_secs, segment.antenna)
    time = segment.signals.time_secs[known]
    trend = np.column_stack((np.ones(len(time)), time - time.mean()))

    def reduced(values: FloatArray) -> FloatArray:
        return np.asarray(values - trend @ np.linalg.lstsq(trend, values, rcond=None)[0])

    distance = reduced(segment.fixes[known] - track[known])
    size = reduced(segment.fixes[known])
    return float(np.sqrt(np.mean(distance**2) / np.mean(size**2)))


def _excess(fit: OutputError, problem: Problem, z: FloatArray, residual: FloatArray) -> float:
    """Return the squared errors over those that noise and the fit's covariance predict."""
    if not np.isfinite(residual[:, 0]).any():
        return np.nan
    free = replace(problem, free=fit.problem.free)
    full = np.concatenate((fit.minimum.unknowns[: len(free.free)], z))
    jacobian = free.jacobian(full, 0)[:, :, : len(free.free)]
    covariance = parameter_covariance(fit)[: len(free.free), : len(free.free)]
    spread = np.einsum("ncp,pq,ncq->nc", jacobian, covariance, jacobian)
    ratios = []
    for at, name in enumerate(problem.outputs):
        if name not in fit.problem.outputs:
            continue
        known = np.isfinite(residual[:, at])
        if known.sum() < 2:
            continue
        noise = fit.noises[fit.problem.outputs.index(name)]
        _, typical = noise.stds(problem.measured(0)[known, at], problem.segments[0].dt_secs)
        predicted = np.mean(typical**2) + np.mean(spread[known, at])
        ratios.append(np.mean(residual[known, at] ** 2) / predicted)
    return float(np.mean(ratios)) if ratios else np.nan
