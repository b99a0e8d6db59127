"""Extended Kalman filter with the parameters among its states.

The state is augmented by the parameters, the rudder offset and the sensor biases, which are
constant. All samples of a stride are processed in one update, linearised by the derivatives of the
run that the augmented state predicts over the stride; the state is then propagated to the end of
the stride. Each run begins in an unknown state of its own, while the parameters continue from run
to run. The measurement noise is that of the output-error fit, so that at the end the filter should
agree with the fit, except for the effect of early updates that were linearised far from it.

References
----------
Jazwinski, "Stochastic processes and filtering theory", 1970, sections 8.3 and 8.4.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.identification.fit.least_squares import weighted_residuals
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.problem import Problem, residuals
from analysis.identification.fit.segment import Segment
from shiplog.ships.motion import InputPath
from shiplog.ships.path import path_part
from shiplog.types import FloatArray

from .history import ParameterHistory, start_times_secs, total_duration_secs

EKF_METHOD = "extended Kalman filter"
STRIDE_SECS = 2.0  # a ship's fastest motion takes several of them
MAX_STRIDES = 1000  # over all runs; long runs have longer strides
INITIAL_STD_FACTOR = 5.0  # standard deviation of a measured initial state over a sample's noise
ITERATIONS = 2  # linearisations of an update, each at the estimate of the one before
FIXED_HEADING_STD = 1e-9  # rad, of an initial heading that no output depends on


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Mean, (m,), and covariance, (m, m), of parameters, state, rudder offset and biases."""

    mean: FloatArray
    covariance: FloatArray


def parameter_ekf(fit: OutputError, priors: FloatArray) -> ParameterHistory:
    """Estimate a fit's free parameters by the extended Kalman filter, from two priors.

    Parameters
    ----------
    fit
        The model, the segments and the measurement noise; swells that it found are subtracted.
    priors
        (2, p) the initial parameters of the two passes, as `two_priors`. Half their distance is
        the initial standard deviation.

    Returns
    -------
    history
        Two passes, at the end of each stride; NaN from where the simulated ship diverges.
    """
    prior_std = np.abs(priors[0] - priors[1]) / 2
    passes = [list(_pass(fit, prior, prior_std)) for prior in priors]
    times = np.array([time for time, _, _ in passes[0]])
    values, stds = (np.array([[row[i] for row in each] for each in passes]) for i in (1, 2))
    return ParameterHistory(EKF_METHOD, fit.problem.free_names, times, values, stds, priors)


def _pass(
    fit: OutputError, prior: FloatArray, prior_std: FloatArray
) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield instants, parameters and their standard deviations, (p,) each."""
    problem, p = _local_problem(fit.problem), len(prior)
    values, covariance = prior, np.diag(prior_std**2)
    stride = max(STRIDE_SECS, total_duration_secs(problem.segments) / MAX_STRIDES)
    for i, start in enumerate(start_times_secs(problem.segments)):
        yield start, values.copy(), np.sqrt(np.diag(covariance))
        measured, weight = _data_without_waves(fit, i)
        estimate = _initial_estimate(fit, i, values, covariance)
        for path, part in _strides(problem.segments[i], stride):
            estimate = _update_and_predict(problem, estimate, path, measured[part], weight[part])
            time = start + (part.stop - 1) * problem.segments[i].dt_secs
            yield time, estimate.mean[:p], np.sqrt(np.diag(estimate.covariance)[:p])
        values, covariance = estimate.mean[:p], estimate.covariance[:p, :p]


def _data_without_waves(fit: OutputError, i: int) -> tuple[FloatArray, FloatArray]:
    """Return segment i's outputs less swell and speed scale, and their weights: (n, c) each."""
    problem, z = fit.problem, fit.minimum.unknowns
    residual = residuals(problem, z)[i]
    _, weight = weighted_residuals(residual, fit.residual_stds[i])
    layout = problem.own_layout
    own = z[problem.own_slice(i)][: layout.calm].copy()
    own[layout.first_scale :] = 0.0
    rest = np.zeros(layout.calm)
    parts = [own if j == i else rest for j in range(len(problem.segments))]
    calm = replace(problem, waves=()).predicted(np.concatenate((z[: problem.common], *parts)), i)
    return (residual + calm)[:, : layout.waved], weight[:, : layout.waved]


def _local_problem(problem: Problem) -> Problem:
    """Return the problem as a filter takes it: no positions, each segment's rudder zero its own."""
    given = problem.nuisance
    own_std = float(np.hypot(given.common_rudder_std, given.rudder_std))
    return replace(
        problem,
        outputs=problem.outputs[: problem.own_layout.waved],
        nuisance=replace(given, common_rudder_std=0.0, rudder_std=own_std),
        waves=(),
    )


def _initial_estimate(
    fit: OutputError, i: int, values: FloatArray, covariance: FloatArray
) -> _Estimate:
    """Return the estimate at the beginning of segment i, given that of the parameters."""
    segment, p = fit.problem.segments[i], len(values)
    problem = _local_problem(fit.problem)
    own, outputs = problem.own_slice(i), problem.outputs
    mean = np.concatenate((values, problem.start()[own]))
    with np.errstate(divide="ignore"):  # a measured state has no prior, and a precision of 0
        stds = np.asarray(problem.prior[1])[own] ** -0.5
    for k, value in enumerate(problem.model.state):
        if value.channel in outputs and segment.has(value.channel or ""):
            noise_std = fit.residual_stds[i].typical[0, outputs.index(value.channel or "")]
            stds[k] = INITIAL_STD_FACTOR * noise_std / problem.scale.of_channel(value.channel)
        elif value.channel == "heading":
            stds[k] = FIXED_HEADING_STD
    joint = np.diag(np.concatenate((np.zeros(p), stds**2)))
    joint[:p, :p] = covariance
    return _Estimate(mean, joint)


def _strides(segment: Segment, stride: float) -> Iterator[tuple[InputPath, slice]]:
    """Yield the inputs of each stride of about `stride` s, and its samples, both ends included."""
    path = segment.path
    ends = np.flatnonzero(path.sample >= 0)
    numbers = np.asarray((path.sample[ends] * segment.dt_secs) // stride)
    last = np.append(np.flatnonzero(np.diff(numbers) > 0), len(ends) - 1)
    edges = [-1, *ends[last].tolist()]
    for before, end in pairwise(edges):
        first = int(path.sample[before]) if before >= 0 else 0
        yield path_part(path, before + 1, end + 1), slice(first, int(path.sample[end]) + 1)


def _update_and_predict(
    problem: Problem,
    prior: _Estimate,
    path: InputPath,
    measured: FloatArray,
    weight: FloatArray,
) -> _Estimate:
    """Update by a stride's samples, (n, c), and predict the estimate at its end.

    The first sample is skipped: it is the last one of the stride before.
    """
    mean, directions = prior.mean, _directions(problem)
    for _ in range(ITERATIONS):
        run = _predict_stride(problem, mean, path, len(measured), directions)
        residual = (measured - run.predicted)[1:]
        used = np.isfinite(residual) & (weight[1:] > 0)
        H = run.jacobian[1:][used]
        root = np.sqrt(weight[1:][used])
        step, covariance = _correction(prior, mean, H * root[:, None], residual[used] * root)
        mean = _clip_parameters(problem, mean + step)
    end = _predict_stride(problem, mean, path, len(measured), directions)
    if not np.isfinite(end.state).all():  # diverged: there is no estimate from here on
        return _Estimate(np.full_like(mean, np.nan), np.full_like(covariance, np.nan))
    ahead = mean.copy()
    states = slice(len(problem.free), len(problem.free) + len(problem.model.state))
    ahead[states] = end.state
    F = np.eye(len(mean))
    F[states] = end.state_jacobian
    return _Estimate(ahead, F @ covariance @ F.T)


@dataclass(frozen=True, eq=False)
class _Stride:
    """Prediction over a stride of n samples, with its derivatives by the m unknowns.

    Attributes
    ----------
    predicted
        (n, c) outputs, biases included.
    jacobian
        (n, c, m) their derivatives.
    state, state_jacobian
        (s,) and (s, m) at the end, in the units of the equations.
    """

    predicted: FloatArray
    jacobian: FloatArray
    state: FloatArray
    state_jacobian: FloatArray


def _directions(problem: Problem) -> FloatArray:
    """Return the (m - biases, p + s + 1) unit vectors of the unknowns that move the ship."""
    p, s = len(problem.values), len(problem.model.state)
    has_offset = problem.nuisance.rudder_std > 0
    return np.eye(p + s + 1)[[*problem.free, *range(p, p + s + has_offset)]]


def _predict_stride(
    problem: Problem, mean: FloatArray, path: InputPath, count: int, directions: FloatArray
) -> _Stride:
    p, s = len(problem.free), len(problem.model.state)
    offset = float(mean[p + s]) if problem.nuisance.rudder_std > 0 else 0.0
    run = problem.model.propagate(
        problem.parameters(mean), mean[p : p + s], path, count, directions, offset=offset,
        scale=problem.scale,
    )  # fmt: skip
    moving = len(directions)
    predicted = run.outputs[:, problem.columns]
    jacobian = np.zeros((*predicted.shape, len(mean)))
    jacobian[:, :, :moving] = np.moveaxis(run.outputs_by[:, :, problem.columns], 0, 2)
    for k, (column, _) in enumerate(problem.biases):
        predicted[:, column] += mean[moving + k]
        jacobian[:, column, moving + k] = 1.0
    state_jacobian = np.zeros((s, len(mean)))
    state_jacobian[:, :moving] = run.end_by.T
    return _Stride(predicted, jacobian, run.end, state_jacobian)


def _correction(
    prior: _Estimate, mean: FloatArray, H: FloatArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the step from `mean`, the point of linearisation, and the covariance after it.

    H, (k, m), and the residuals, (k,), are scaled to unit noise. The covariance is in Joseph form.
    """
    P = prior.covariance
    PHt = P @ H.T
    K = np.linalg.solve(H @ PHt + np.eye(len(residual)), PHt.T).T
    offset = prior.mean - mean
    step = offset + K @ (residual - H @ offset)
    I_KH = np.eye(len(mean)) - K @ H
    return step, I_KH @ P @ I_KH.T + K @ K.T


def _clip_parameters(problem: Problem, mean: FloatArray) -> FloatArray:
    """Clip the parameters to their limits."""
    lowest, highest = problem.bounds
    p = len(problem.free)
    return np.concatenate((np.clip(mean[:p], lowest[:p], highest[:p]), mean[p:]))
