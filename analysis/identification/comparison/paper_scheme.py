"""The identification paper's own scheme, kept for comparison: it finds the model it was given.

Burylin takes w'' and v', which nothing measures, from a filter that holds a model of the ship, and
finds that model's coefficients by least squares, eq. (7), over a sliding window. The filter's w''
and v' are what its model says; so the regression finds that model again, whatever the data, and
makes its errors larger (docs/papers_continuous_identification.md).
"""

from collections.abc import Iterator

import numpy as np

from analysis.filters.factory import filter_states
from analysis.filters.noise_model import NoiseModel
from analysis.identification.output_error import OutputError
from analysis.identification.segment import Segment
from shiplog.ships.paper import Coefficients, rudder_effects
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import FilterSettings

from .history import ParameterHistory, begins_secs, with_breaks

PAPER_METHOD = "the paper's scheme"
Q, R = 0.01, 400.0  # of its filter
WINDOW_SECS, STRIDE_SECS = 200.0, 2.0
IDENTIFIED_NAMES = Coefficients._fields[:9]  # what it identifies; the alphas are known


def paper_scheme(fit: OutputError, priors: FloatArray) -> ParameterHistory | None:
    """Its courses of the coefficients of the paper's model, from two priors, (2, p); else None.

    There are none where a model in the filter runs away, and none of T3: e stands for it.
    """
    problem = fit.problem
    if problem.model.kind is not Coefficients:
        return None
    parts = [list(_courses(problem.segments, _coefficients(fit, prior))) for prior in priors]
    wanted = [
        IDENTIFIED_NAMES.index(name) for name in problem.free_names if name in IDENTIFIED_NAMES
    ]
    columns = [i for i, name in enumerate(problem.free_names) if name in IDENTIFIED_NAMES]
    times = with_breaks([time for time, _ in parts[0]])
    values = np.array([with_breaks([found for _, found in part]) for part in parts])
    values = values[:, :, wanted]
    values[values == 0] = np.nan  # of a column of zeros: the pseudo-inverse's 0 is nobody's
    names = tuple(problem.free_names[i] for i in columns)
    return ParameterHistory(
        PAPER_METHOD, names, times, values, np.full(values.shape, np.nan), priors[:, columns]
    )


def _coefficients(fit: OutputError, prior: FloatArray) -> Coefficients:
    """The paper's coefficients with these values of the parameters that were sought."""
    found: Coefficients = fit.problem.model.coefficients(fit.problem.parameters(prior))
    return found


def _courses(
    segments: tuple[Segment, ...], prior: Coefficients
) -> Iterator[tuple[FloatArray, FloatArray]]:
    for segment, begins in zip(segments, begins_secs(segments), strict=True):
        ends, found = window_coefficients(
            segment.signals, prior, paper_states(segment.signals, prior)
        )
        yield begins + ends, found


def paper_states(signals: Signals, prior: Coefficients, *, as_printed: bool = True) -> FloatArray:
    """w, w', w'', v, v' by the paper's filter with `prior` in it, (n, 5).

    Not `as_printed`, w'' jumps where the rudder starts or stops, as the equations have it.
    """
    noise = NoiseModel(np.full(2, np.sqrt(R / signals.dt_secs)), np.full(2, Q / R))
    settings = FilterSettings(kind="pseudo-input", as_printed=as_printed)
    return filter_states(signals, prior, noise, settings).states


def window_coefficients(
    signals: Signals, prior: Coefficients, states: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """When each window ends, in s, and its nine coefficients, (k,) and (k, 9).

    The first windows grow. A coefficient whose column is zero is 0, as the pseudo-inverse has it.
    """
    dt = signals.dt_secs
    stride = max(1, round(STRIDE_SECS / dt))
    ends = np.arange(stride, len(states) + 1, stride)
    reach, parts = max(1, round(WINDOW_SECS / dt) // stride), []
    for rows in regression_rows(signals, prior, states):
        strides = rows[: len(ends) * stride].reshape(len(ends), stride, -1)
        triangles = np.asarray(np.linalg.qr(strides, mode="r"))
        spans = ((max(0, k - reach), k) for k in range(1, len(ends) + 1))
        parts.append([solve_window(np.concatenate(triangles[i:k])) for i, k in spans])
    return ends * dt, np.concatenate([np.array(part) for part in parts], axis=1)


def regression_rows(
    signals: Signals, prior: Coefficients, states: FloatArray
) -> Iterator[FloatArray]:
    """The rows of eq. (7), of yaw and of surge: regressors and, in the last column, the target.

    Of `prior` only the alphas are used.
    """
    w, w_dot, w_ddot, v, v_dot = np.ascontiguousarray(states.T)
    delta, n = signals["rudder"], signals["rpm"]
    ks = rudder_effects(prior, v, n)
    rate = np.diff(delta, append=delta[-1]) / signals.dt_secs
    yield np.column_stack((w_dot, w, w * abs(w), w**3, ks * delta, ks * rate, w_ddot))
    yield np.column_stack((w * w, v * v, n, v_dot))


def solve_window(rows: FloatArray) -> FloatArray:
    """Least squares by the pseudo-inverse of scaled columns; the last column is the target.

    NaN where the filter has run away.
    """
    triangle = np.asarray(np.linalg.qr(rows, mode="r"))  # as many numbers as tell the same
    if not np.isfinite(triangle).all():
        return np.full(rows.shape[1] - 1, np.nan)
    X, target = triangle[:, :-1], triangle[:, -1]
    scale = np.sqrt((X * X).sum(axis=0))
    scale[scale == 0] = 1
    return np.asarray(np.linalg.pinv(X / scale, rcond=1e-13) @ target / scale)
