"""The parameters as states that stay as they are: an extended Kalman filter over the runs.

The state is augmented by the parameters, the rudder's zero and the gyro's bias, none of which
moves; what was measured over a stride is taken in at once, by the derivatives of the run that
the augmented state predicts over them, and then the state goes on to their end. A run begins in an
unknown state of its own, while the parameters go on from run to run. The noise is the fit's, so
that at the end of one run the filter should say what output error says of it, but for what it took
in before it knew better: that is what its courses show. Source: Jazwinski, "Stochastic processes
and filtering theory", 1970, sections 8.3 and 8.4.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.identification.least_squares import weighted_residuals
from analysis.identification.output_error import OutputError
from analysis.identification.problem import Problem, residuals
from analysis.identification.segment import Segment
from shiplog.ships.motion import InputPath
from shiplog.ships.path import path_part
from shiplog.types import FloatArray

from .history import ParameterHistory, begins_secs, run_secs

EKF_METHOD = "extended Kalman filter"
STRIDE_SECS, MOST_STRIDES = 2.0, 1000  # a ship's fastest motion takes several; of long runs more
FIRST_STDS = 5.0  # of a sample's noise: how far off a first state may be
ROUNDS = 2  # of linearisation, each where the one before has led
STILL = 1e-9  # rad: what a heading may be off that nothing depends on


@dataclass(frozen=True, eq=False)
class _Belief:
    """What is believed at an instant, of parameters, state, offset and biases: (m,), (m, m)."""

    mean: FloatArray
    covariance: FloatArray


def parameter_ekf(fit: OutputError, priors: FloatArray) -> ParameterHistory:
    """The courses of a fit's parameters by the extended Kalman filter, from two priors, (2, p)."""
    reach = np.abs(priors[0] - priors[1]) / 2
    parts = [list(_course(fit, prior, reach)) for prior in priors]
    times = np.array([time for time, _, _ in parts[0]])
    values, stds = (np.array([[row[i] for row in part] for part in parts]) for i in (1, 2))
    return ParameterHistory(EKF_METHOD, fit.problem.free_names, times, values, stds, priors)


def _course(
    fit: OutputError, prior: FloatArray, reach: FloatArray
) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Instants, parameters and their standard deviations, (p,) each; NaN once the ship ran away."""
    problem, p = fit.problem, len(prior)
    values, covariance = prior, np.diag(reach**2)
    stride = max(STRIDE_SECS, run_secs(problem.segments) / MOST_STRIDES)
    for i, begins in enumerate(begins_secs(problem.segments)):
        yield begins, values.copy(), np.sqrt(np.diag(covariance))
        measured, weight = _calm(fit, i)
        belief = _begun(fit, i, values, covariance)
        for path, part in _strides(problem.segments[i], stride):
            belief = _taken_in(problem, belief, path, measured[part], weight[part])
            at = begins + (part.stop - 1) * problem.segments[i].dt_secs
            yield at, belief.mean[:p], np.sqrt(np.diag(belief.covariance)[:p])
        values, covariance = belief.mean[:p], belief.covariance[:p, :p]


def _calm(fit: OutputError, i: int) -> tuple[FloatArray, FloatArray]:
    """What was measured in a segment less the swell the fit found, and its weights: (n, c) each."""
    problem, z = fit.problem, fit.minimum.unknowns
    left = residuals(problem, z)[i]
    _, weight = weighted_residuals(left, fit.residual_stds[i])
    still = replace(problem, waves=())
    own = z[problem.own_slice(i)][: _own_size(problem)]
    parts = [z[: len(problem.free)]]
    parts += [own if j == i else np.zeros(_own_size(problem)) for j in range(len(problem.segments))]
    return left + still.predicted(np.concatenate(parts), i), weight


def _own_size(problem: Problem) -> int:
    return len(problem.model.state) + (problem.nuisance.rudder_std > 0) + len(problem.biases)


def _begun(fit: OutputError, i: int, values: FloatArray, covariance: FloatArray) -> _Belief:
    """What is believed as segment i begins."""
    problem, segment, p = fit.problem, fit.problem.segments[i], len(values)
    still = replace(problem, waves=())
    own, outputs = still.own_slice(i), problem.outputs
    mean = np.concatenate((values, still.start()[own]))
    with np.errstate(divide="ignore"):  # what a sensor tells has no prior
        stds = np.asarray(still.prior[1])[own] ** -0.5
    for k, value in enumerate(problem.model.state):
        if value.channel in outputs and segment.has(value.channel or ""):
            usual = fit.residual_stds[i].typical[0, outputs.index(value.channel or "")]
            stds[k] = FIRST_STDS * usual / problem.scale.of_channel(value.channel)
        elif value.channel == "heading":
            stds[k] = STILL
    whole = np.diag(np.concatenate((np.zeros(p), stds**2)))
    whole[:p, :p] = covariance
    return _Belief(mean, whole)


def _strides(segment: Segment, stride: float) -> Iterator[tuple[InputPath, slice]]:
    """A segment's path in pieces of about `stride` s, and the samples of each, ends included."""
    path = segment.path
    ends = np.flatnonzero(path.sample >= 0)
    numbers = np.asarray((path.sample[ends] * segment.dt_secs) // stride)
    last = np.append(np.flatnonzero(np.diff(numbers) > 0), len(ends) - 1)
    edges = [-1, *ends[last].tolist()]
    for before, end in pairwise(edges):
        first = int(path.sample[before]) if before >= 0 else 0
        yield path_part(path, before + 1, end + 1), slice(first, int(path.sample[end]) + 1)


def _taken_in(
    problem: Problem, belief: _Belief, path: InputPath, measured: FloatArray, weight: FloatArray
) -> _Belief:
    """What is believed at the end of a stride, its samples taken in but for the first.

    That one was the last of the stride before.
    """
    mean, moved = belief.mean, _directions(problem)
    for _ in range(ROUNDS):
        run = _run(problem, mean, path, len(measured), moved)
        off = (measured - run.predicted)[1:]
        known = np.isfinite(off) & (weight[1:] > 0)
        H = run.by_unknown[1:][known]
        root = np.sqrt(weight[1:][known])
        step, covariance = _corrected(belief, mean, H * root[:, None], off[known] * root)
        mean = _within(problem, mean + step)
    end = _run(problem, mean, path, len(measured), moved)
    if not np.isfinite(end.state).all():  # the ship has run away, and there is no more to believe
        return _Belief(np.full_like(mean, np.nan), np.full_like(covariance, np.nan))
    ahead = mean.copy()
    states = slice(len(problem.free), len(problem.free) + len(problem.model.state))
    ahead[states] = end.state
    F = np.eye(len(mean))
    F[states] = end.state_by
    return _Belief(ahead, F @ covariance @ F.T)


@dataclass(frozen=True, eq=False)
class _Run:
    """A stride as it is predicted, with its derivatives by the m unknowns."""

    predicted: FloatArray  # (n, c)
    by_unknown: FloatArray  # (n, c, m)
    state: FloatArray  # (s,) at its end
    state_by: FloatArray  # (s, m)


def _directions(problem: Problem) -> FloatArray:
    """(m - biases, p + s + 1) the unknowns that move the ship."""
    p, s = len(problem.values), len(problem.model.state)
    has_offset = problem.nuisance.rudder_std > 0
    return np.eye(p + s + 1)[[*problem.free, *range(p, p + s + has_offset)]]


def _run(
    problem: Problem, mean: FloatArray, path: InputPath, count: int, moved: FloatArray
) -> _Run:
    p, s = len(problem.free), len(problem.model.state)
    offset = float(mean[p + s]) if problem.nuisance.rudder_std > 0 else 0.0
    run = problem.model.propagate(
        problem.parameters(mean), mean[p : p + s], path, count, moved, offset=offset,
        scale=problem.scale,
    )  # fmt: skip
    known = len(moved)
    predicted = run.outputs[:, problem.columns]
    by_unknown = np.zeros((*predicted.shape, len(mean)))
    by_unknown[:, :, :known] = np.moveaxis(run.outputs_by[:, :, problem.columns], 0, 2)
    for k, (column, _) in enumerate(problem.biases):
        predicted[:, column] += mean[known + k]
        by_unknown[:, column, known + k] = 1.0
    state_by = np.zeros((s, len(mean)))
    state_by[:, :known] = run.end_by.T
    return _Run(predicted, by_unknown, run.end, state_by)


def _corrected(
    belief: _Belief, mean: FloatArray, H: FloatArray, off: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The step from `mean`, about which all is linear, and the covariance after it.

    H, (k, m), and what is off, (k,), are of unit noise. Joseph's form.
    """
    P = belief.covariance
    across = P @ H.T
    gain = np.linalg.solve(H @ across + np.eye(len(off)), across.T).T
    behind = belief.mean - mean
    step = behind + gain @ (off - H @ behind)
    kept = np.eye(len(mean)) - gain @ H
    return step, kept @ P @ kept.T + gain @ gain.T


def _within(problem: Problem, mean: FloatArray) -> FloatArray:
    """The parameters within their limits."""
    lowest, highest = problem.bounds
    p = len(problem.free)
    return np.concatenate((np.clip(mean[:p], lowest[:p], highest[:p]), mean[p:]))
