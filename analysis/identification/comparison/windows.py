"""The sliding-window identifier over a fit's runs: the equations in integral form, no prior."""

import numpy as np

from analysis.identification.output_error import OutputError
from analysis.identification.segment import Segment
from analysis.regression.coefficients import identify
from analysis.regression.sliding import History
from analysis.regression.weak_form import CHANNELS, weak_form
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .history import ParameterHistory, begins_secs, with_breaks

WINDOW_METHOD = "windows in weak form"


def window_estimates(fit: OutputError) -> ParameterHistory | None:
    """The window by window histories of the paper's coefficients; else None.

    What a window cannot tell is NaN.
    """
    problem = fit.problem
    names = tuple(name for name in problem.free_names if name in Coefficients._fields)
    usable = [t for t in problem.segments if all(t.has(c) for c in CHANNELS if c in MODEL_OUTPUTS)]
    if problem.model.kind is not Coefficients or not usable:
        return None
    model = problem.model.coefficients(fit.parameters)
    parts = [
        _history(segment, model, begins, names)
        for segment, begins in zip(problem.segments, begins_secs(problem.segments), strict=True)
        if segment in usable
    ]
    times, found, stds = (with_breaks(each) for each in zip(*parts, strict=True))
    return ParameterHistory(
        WINDOW_METHOD, names, times, found[None], stds[None], np.full((1, len(names)), np.nan)
    )


def _history(
    segment: Segment, model: Coefficients, begins: float, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Instants, values and standard deviations, (k,), (k, p) and (k, p), of one run."""
    yaw, surge = (identify(rows)[1] for rows in weak_form(segment.signals, model))
    columns = [_column(yaw if name in yaw.names else surge, name) for name in names]
    return (
        begins + yaw.time_secs,
        np.column_stack([value for value, _ in columns]),
        np.column_stack([std for _, std in columns]),
    )


def _column(history: History, name: str) -> tuple[FloatArray, FloatArray]:
    i = history.names.index(name)
    return history.values[:, i], history.stds[:, i]
