"""Drift of a ship: whether segments show it, and the parameters and indices that depend on it.

Yaw rate, speed and heading do not determine the sway: a ship with twice the drift can have the same
three. Positions or a measured sway do.
"""

import numpy as np

from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .problem import Problem

# of the sway equations of all models
SWAY_PARAMETERS = (
    "c1", "c2", "Td", "yv", "yr", "cy", "yd", "yvvv", "yvvr", "yvrr", "yrrr",
)  # fmt: skip
DRIFT_INDICES = ("advance", "transfer", "tactical diameter")
DRIFT_UNKNOWN = "not identifiable without positions or sway"
DRIFT_REMEDY = "log the position (GNSS) or the sway velocity"


def shows_drift(problem: Problem) -> bool:
    """Return whether a sway or velocities over ground were measured in any segment.

    Parameters
    ----------
    problem
        The problem of a fit, with fitted sway and velocities or without.
    """
    return any(
        segment.has("sway") or problem.has_velocities(i)
        for i, segment in enumerate(problem.segments)
    )


def drift_is_unknown(problem: Problem) -> bool:
    """Return whether a model predicts a sway that no segment shows.

    Parameters
    ----------
    problem
        The problem of the fit.
    """
    return "sway" in problem.model.outputs and not shows_drift(problem)


def without_sway(outputs: FloatArray) -> FloatArray:
    """Return outputs, (n, 4) in the order of `MODEL_OUTPUTS`, with a sway of zero.

    What is not finite stays so: a simulation that diverges is still one.
    """
    column = MODEL_OUTPUTS.index("sway")
    result = outputs.copy()
    result[:, column] = np.where(np.isfinite(result[:, column]), 0.0, np.nan)
    return result


def unobserved_parameters(problem: Problem) -> tuple[str, ...]:
    """Return the parameters of a model's sway equation, if no segment shows the drift.

    Parameters
    ----------
    problem
        The problem of the fit.
    """
    if not drift_is_unknown(problem):
        return ()
    return tuple(name for name in problem.model.names if name in SWAY_PARAMETERS)
