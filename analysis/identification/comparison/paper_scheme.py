"""The identification paper's own scheme, run for comparison.

Burylin takes w'' and v', which no sensor measures, from a filter that contains a model of the ship,
and estimates that model's coefficients by least squares, eq. (7), over a sliding window. The
filter's w'' and v' are those its model predicts. The regression therefore returns that model
again, whatever the data, and amplifies its errors (docs/papers_continuous_identification.md).
"""

from collections.abc import Iterator

import numpy as np

from analysis.filters.factory import filter_states
from analysis.filters.noise_model import NoiseModel
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.segment import Segment
from shiplog.ships.paper import Coefficients, rudder_effects
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import FilterSettings

from .history import ParameterHistory, start_times_secs, with_breaks

PAPER_METHOD = "the paper's scheme"
Q, R = 0.01, 400.0  # process and measurement noise of the paper's filter
WINDOW_SECS, STRIDE_SECS = 200.0, 2.0
IDENTIFIED_NAMES = Coefficients._fields[:9]  # those the paper estimates; the alphas are given


def paper_scheme(fit: OutputError, priors: FloatArray) -> ParameterHistory | None:
    """Estimate the coefficients of the paper's model as the paper does, from two priors.

    Parameters
    ----------
    fit
        A fit of either form of the paper's model.
    priors
        (2, p) values of the fit's free parameters that the filter is given, as `two_priors`.

    Returns
    -------
    history
        Two passes; NaN where the filter diverges or where a regressor is zero throughout the
        window. It holds no T3, for which e stands. None for any other model.
    """
    problem = fit.problem
    if problem.model.kind is not Coefficients:
        return None
    free = [i for i, name in enumerate(problem.free_names) if name in IDENTIFIED_NAMES]
    names = tuple(problem.free_names[i] for i in free)
    passes = [list(_pass(problem.segments, _coefficients(fit, prior))) for prior in priors]
    times = with_breaks([time for time, _ in passes[0]])
    values = np.array([with_breaks([found for _, found in each]) for each in passes])
    values = values[:, :, [IDENTIFIED_NAMES.index(name) for name in names]]
    values[values == 0] = np.nan  # the pseudo-inverse's 0 for a column of zeros is no estimate
    no_stds = np.full(values.shape, np.nan)
    return ParameterHistory(PAPER_METHOD, names, times, values, no_stds, priors[:, free])


def _coefficients(fit: OutputError, prior: FloatArray) -> Coefficients:
    """Return the paper's coefficients with these values, (p,), of the free parameters."""
    coefficients: Coefficients = fit.problem.model.coefficients(fit.problem.parameters(prior))
    return coefficients


def _pass(
    segments: tuple[Segment, ...], prior: Coefficients
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield of each segment the instants, (k,), and the nine coefficients, (k, 9)."""
    for segment, start in zip(segments, start_times_secs(segments), strict=True):
        states = paper_states(segment.signals, prior)
        ends, coefficients = window_coefficients(segment.signals, prior, states)
        yield start + ends, coefficients


def paper_states(signals: Signals, prior: Coefficients, *, as_printed: bool = True) -> FloatArray:
    """Filter signals by the paper's filter.

    Parameters
    ----------
    signals
        Yaw rate, speed, rudder and rpm on one clock.
    prior
        The coefficients of the model that the filter contains.
    as_printed
        Whether w'' stays continuous as in the paper's printed equations; otherwise it jumps where
        the rudder starts or stops, as the equations of motion require.

    Returns
    -------
    states
        (n, 5) of w, w', w'', v, v', SI.
    """
    noise = NoiseModel(np.full(2, np.sqrt(R / signals.dt_secs)), np.full(2, Q / R))
    settings = FilterSettings(kind="pseudo-input", as_printed=as_printed)
    return filter_states(signals, prior, noise, settings).states


def window_coefficients(
    signals: Signals, prior: Coefficients, states: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Estimate the nine coefficients over sliding windows of filtered states.

    Parameters
    ----------
    signals
        Rudder and rpm on the clock of the states.
    prior
        Coefficients of which only the alphas are used.
    states
        (n, 5) as `paper_states` returns them.

    Returns
    -------
    ends
        (k,) the end of each window, s. The first windows are shorter: they begin at the start.
    coefficients
        (k, 9) in the order of `IDENTIFIED_NAMES`; 0 for a coefficient whose regressor is zero
        throughout the window, as the pseudo-inverse has it.
    """
    dt = signals.dt_secs
    stride = max(1, round(STRIDE_SECS / dt))
    ends = np.arange(stride, len(states) + 1, stride)
    window, parts = max(1, round(WINDOW_SECS / dt) // stride), []
    for rows in regression_rows(signals, prior, states):
        strides = rows[: len(ends) * stride].reshape(len(ends), stride, -1)
        triangles = np.asarray(np.linalg.qr(strides, mode="r"))
        spans = ((max(0, k - window), k) for k in range(1, len(ends) + 1))
        parts.append([solve_window(np.concatenate(triangles[i:k])) for i, k in spans])
    return ends * dt, np.concatenate([np.array(part) for part in parts], axis=1)


def regression_rows(
    signals: Signals, prior: Coefficients, states: FloatArray
) -> Iterator[FloatArray]:
    """Yield the rows of eq. (7), first of yaw, (n, 7), then of surge, (n, 4).

    The last column is the target, w'' or v'; the others are the regressors. Of `prior` only the
    alphas are used.
    """
    w, w_dot, w_ddot, v, v_dot = np.ascontiguousarray(states.T)
    delta, n = signals["rudder"], signals["rpm"]
    ks = rudder_effects(prior, v, n)
    rate = np.diff(delta, append=delta[-1]) / signals.dt_secs
    with np.errstate(over="ignore", invalid="ignore"):  # of a filter that diverged
        yaw = np.column_stack((w_dot, w, w * abs(w), w**3, ks * delta, ks * rate, w_ddot))
        surge = np.column_stack((w * w, v * v, n, v_dot))
    yield from (yaw, surge)


def solve_window(rows: FloatArray) -> FloatArray:
    """Solve least squares by the pseudo-inverse of columns scaled to unit length.

    Parameters
    ----------
    rows
        (m, p + 1) regressors and, in the last column, the target.

    Returns
    -------
    coefficients
        (p,); 0 for a column of zeros, NaN where the filter has diverged.

    Examples
    --------
    >>> solve_window(np.array([[1.0, 2.0], [2.0, 4.0]])).round(6)
    array([2.])
    """
    triangle = np.asarray(np.linalg.qr(rows, mode="r"))  # the same normal equations, fewer rows
    if not np.isfinite(triangle).all():
        return np.full(rows.shape[1] - 1, np.nan)
    X, target = triangle[:, :-1], triangle[:, -1]
    scale = np.sqrt((X * X).sum(axis=0))
    scale[scale == 0] = 1
    return np.asarray(np.linalg.pinv(X / scale, rcond=1e-13) @ target / scale)
