"""The loop of an estimator over samples: prediction, correction, covariance."""

from typing import NamedTuple

import numpy as np

from analysis.filters.kernels import copy_matrix, correct, output_covariance, propagate
from shiplog.compiled import compiled, copy_vector
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel
from .methods import EstimatorDesign


class StretchModel(NamedTuple):
    """Model and gain over a stretch of samples in which they are constant.

    Attributes
    ----------
    F, G0, G1, g, Q
        As in `ModelStep`.
    C, D
        (m, N) and (m, inputs).
    r
        (m,): variances of the measurement noise.
    M
        (N, m): the correction; not used where it is optimal.
    optimal
        Whether the optimal gain of each instant is used.
    """

    F: FloatArray
    G0: FloatArray
    G1: FloatArray
    g: FloatArray
    Q: FloatArray
    C: FloatArray
    D: FloatArray
    r: FloatArray
    M: FloatArray
    optimal: bool


class StretchResult(NamedTuple):
    """What the loop returns for k samples.

    Attributes
    ----------
    states, covariances
        (k, N) and (k, N, N): after the corrections of each sample.
    predicted
        (k, m): predicted outputs.
    innovations, variances
        (k, m): measured minus predicted, and the variances that the covariance predicts for it.
    gains
        (k, m, N): gain of each output; zero without a correction. Of the optimal filter the outputs
        correct one after the other.
    sequential, sequential_variances
        (k, m): innovation of each output after the corrections by those before it, zero without a
        correction, and its variance.
    """

    states: FloatArray
    covariances: FloatArray
    predicted: FloatArray
    innovations: FloatArray
    variances: FloatArray
    gains: FloatArray
    sequential: FloatArray
    sequential_variances: FloatArray


def stretch_model(model: EstimatorModel, design: EstimatorDesign) -> StretchModel:
    """Return model and gain in the form of the loop."""
    step, M = model.step, design.correction
    return StretchModel(
        step.F, step.G0, step.G1, step.g, step.Q, np.ascontiguousarray(model.C),
        np.ascontiguousarray(model.D), model.r,
        np.zeros(model.C.T.shape) if M is None else np.ascontiguousarray(M), M is None,
    )  # fmt: skip


def cascade_model(model: StretchModel, design: EstimatorDesign) -> StretchModel:
    """Return the model of all stages of a cascade as one, of stages · N states.

    Each stage after the first has N further outputs: its states minus those of the stage before,
    measured as zero. So that all are corrected at once, M contains the product of the corrections
    from an output to a stage.
    """
    count, (m, N) = design.stages, model.C.shape
    K = design.stage_correction
    assert K is not None  # noqa: S101 - of a cascade
    powers = [np.linalg.matrix_power(K, s) for s in range(count)]
    C, M = np.zeros((m + (count - 1) * N, count * N)), np.zeros((count * N, m + (count - 1) * N))
    C[:m, :N] = model.C
    C[m:] = np.eye((count - 1) * N, count * N, N) - np.eye((count - 1) * N, count * N)
    for stage in range(count):
        own = slice(stage * N, (stage + 1) * N)
        M[own, :m] = powers[stage] @ model.M
        for source in range(1, stage + 1):
            first = m + (source - 1) * N
            M[own, first : first + N] = powers[stage - source] @ K
    return StretchModel(
        np.kron(np.eye(count), model.F), np.tile(model.G0, (count, 1)),
        np.tile(model.G1, (count, 1)), np.tile(model.g, count),
        np.kron(np.ones((count, count)), model.Q), C,
        np.vstack((model.D, np.zeros((len(C) - m, model.D.shape[1])))),
        np.append(model.r, np.zeros(len(C) - m)), M, optimal=False,
    )  # fmt: skip


@compiled
def run_stretch(
    model: StretchModel,
    x: FloatArray,
    P: FloatArray,
    u_before: FloatArray,
    y: FloatArray,
    u: FloatArray,
    is_start: bool,
) -> StretchResult:
    """Run the estimator over k samples.

    Parameters
    ----------
    model
        Model and gain.
    x, P
        State (N,) and covariance (N, N) of the sample before; updated in place.
    u_before
        (inputs,): inputs of the sample before; updated in place.
    y
        (k, m): measurements, NaN where there are none.
    u
        (k, inputs).
    is_start
        Whether x and P are the prediction for the first sample already.
    """
    count, m, N = len(y), len(model.r), len(x)
    states, covariances = np.empty((count, N)), np.empty((count, N, N))
    predicted, innovations, variances = (
        np.empty((count, m)), np.empty((count, m)), np.empty((count, m)),
    )  # fmt: skip
    gains, sequential = np.zeros((count, m, N)), np.zeros((count, m))
    sequential_variances = np.ones((count, m))
    work, Pc, ahead = np.empty((N, N)), np.empty(N), np.empty(N)
    for k in range(count):
        if k > 0 or not is_start:
            _predict(model, x, u_before, u[k], ahead)
            propagate(P, model.F, model.Q, work, N)
        for j in range(m):
            predicted[k, j] = _output(model, j, x, u[k])
            innovations[k, j] = y[k, j] - predicted[k, j]
            variances[k, j] = output_covariance(P, model.C[j], Pc) + model.r[j]
        if model.optimal:
            _correct_optimally(
                model, x, P, y[k], u[k], Pc, gains[k], sequential[k], sequential_variances[k]
            )
        else:
            _correct_constantly(model, x, P, innovations[k], gains[k], work)
        copy_vector(u_before, u[k])
        copy_vector(states[k], x)
        copy_matrix(covariances[k], P)
    return StretchResult(
        states, covariances, predicted, innovations, variances, gains, sequential,
        sequential_variances,
    )  # fmt: skip


@compiled
def _predict(
    model: StretchModel, x: FloatArray, before: FloatArray, u: FloatArray, ahead: FloatArray
) -> None:
    """Set x to F x + G0 u_before + G1 u + g, in place."""
    for i in range(len(x)):
        ahead[i] = model.g[i]
        for j in range(len(x)):
            ahead[i] += model.F[i, j] * x[j]
        for j in range(len(u)):
            ahead[i] += model.G0[i, j] * before[j] + model.G1[i, j] * u[j]
    copy_vector(x, ahead)


@compiled
def _output(model: StretchModel, j: int, x: FloatArray, u: FloatArray) -> float:
    """Compute the output j, C x + D u."""
    value = 0.0
    for i in range(len(x)):
        value += model.C[j, i] * x[i]
    for i in range(len(u)):
        value += model.D[j, i] * u[i]
    return value


@compiled
def _correct_optimally(
    model: StretchModel,
    x: FloatArray,
    P: FloatArray,
    y: FloatArray,
    u: FloatArray,
    Pc: FloatArray,
    gains: FloatArray,
    sequential: FloatArray,
    variances: FloatArray,
) -> None:
    """Correct by the measured outputs, one after the other, each with its optimal gain."""
    for j in range(len(y)):
        if not np.isfinite(y[j]):
            continue
        S = output_covariance(P, model.C[j], Pc) + model.r[j]
        e = y[j] - _output(model, j, x, u)
        for i in range(len(x)):
            gains[j, i] = Pc[i] / S
        correct(x, P, gains[j], Pc, e, S)
        sequential[j], variances[j] = e, S


@compiled
def _correct_constantly(
    model: StretchModel,
    x: FloatArray,
    P: FloatArray,
    innovation: FloatArray,
    gains: FloatArray,
    work: FloatArray,
) -> None:
    """Correct by all measured outputs at once: P becomes (I - M C) P (I - M C)' + M R M'."""
    N = len(x)
    T, noise = np.eye(N), np.zeros((N, N))
    for j in range(len(innovation)):
        if not np.isfinite(innovation[j]):
            continue
        for i in range(N):
            gains[j, i] = model.M[i, j]
            x[i] += model.M[i, j] * innovation[j]
            for k in range(N):
                T[i, k] -= model.M[i, j] * model.C[j, k]
                noise[i, k] += model.M[i, j] * model.r[j] * model.M[k, j]
    propagate(P, T, noise, work, N)


@compiled
def combine(
    rows: FloatArray, states: FloatArray, covariances: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute q combinations of the states and their standard deviations.

    Parameters
    ----------
    rows
        (q, N).
    states, covariances
        (k, N) and (k, N, N).

    Returns
    -------
    values, stds
        (k, q) each.
    """
    count, N = states.shape
    values, stds = np.zeros((count, len(rows))), np.zeros((count, len(rows)))
    Pc = np.empty(N)
    for k in range(count):
        for q in range(len(rows)):
            for i in range(N):
                values[k, q] += rows[q, i] * states[k, i]
            stds[k, q] = np.sqrt(max(output_covariance(covariances[k], rows[q], Pc), 0.0))
    return values, stds
