"""Sliding-window estimates over a fit's runs, without a prior."""

import numpy as np

from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.segment import Segment
from analysis.regression.coefficients import fit_coefficients
from analysis.regression.sliding import CoefficientHistory
from analysis.regression.weak_form import CHANNELS, weak_form
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .history import ParameterHistory, start_times_secs, with_breaks

WINDOW_METHOD = "windows in weak form"


def window_estimates(fit: OutputError) -> ParameterHistory | None:
    """Estimate the coefficients of the paper's model window by window, as a replay does.

    Parameters
    ----------
    fit
        A fit of either form of the paper's model; its segments are used where all channels of the
        regression were measured, and its coefficients scale the regressors.

    Returns
    -------
    history
        One pass without a prior; NaN where a window does not determine a coefficient. None for
        any other model, or where no segment has all channels.
    """
    problem = fit.problem
    if problem.model.kind is not Coefficients:
        return None
    names = tuple(name for name in problem.free_names if name in Coefficients._fields)
    model = problem.model.coefficients(fit.parameters)
    needed = [channel for channel in CHANNELS if channel in MODEL_OUTPUTS]
    parts = [
        _segment_history(segment, model, start, names)
        for segment, start in zip(problem.segments, start_times_secs(problem.segments), strict=True)
        if all(segment.has(channel) for channel in needed)
    ]
    if not parts:
        return None
    times, values, stds = (with_breaks(each) for each in zip(*parts, strict=True))
    no_prior = np.full((1, len(names)), np.nan)
    return ParameterHistory(WINDOW_METHOD, names, times, values[None], stds[None], no_prior)


def _segment_history(
    segment: Segment, model: Coefficients, start: float, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return instants, values and standard deviations of one segment: (k,), (k, p), (k, p)."""
    yaw, surge = (fit_coefficients(rows)[1] for rows in weak_form(segment.signals, model))
    columns = [_column(yaw if name in yaw.names else surge, name) for name in names]
    return (
        start + yaw.time_secs,
        np.column_stack([values for values, _ in columns]),
        np.column_stack([stds for _, stds in columns]),
    )


def _column(history: CoefficientHistory, name: str) -> tuple[FloatArray, FloatArray]:
    i = history.names.index(name)
    return history.values[:, i], history.stds[:, i]
