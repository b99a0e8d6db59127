"""Drift of a ship: whether segments show it, and the parameters and indices that depend on it.

Yaw rate, speed and heading do not determine the sway: a ship with twice the drift can have the same
three. Positions or a measured sway do.
"""

from collections.abc import Sequence

import numpy as np

from shiplog.ships import Model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .segment import Segment

# of the sway equations of all models
SWAY_PARAMETERS = (
    "c1", "c2", "Td", "yv", "yr", "cy", "yd", "yvvv", "yvvr", "yvrr", "yrrr",
)  # fmt: skip
DRIFT_INDICES = ("advance", "transfer", "tactical diameter")
DRIFT_UNKNOWN = "not identifiable without positions or sway"
DRIFT_REMEDY = "log the position (GNSS) or the sway velocity"


def shows_drift(segments: Sequence[Segment]) -> bool:
    """Return whether positions or the sway were measured in any segment.

    Parameters
    ----------
    segments
        The segments of a fit.
    """
    return any(segment.has("sway") or _has_fixes(segment) for segment in segments)


def drift_is_unknown(model: Model, segments: Sequence[Segment]) -> bool:
    """Return whether a model predicts a sway that no segment shows.

    Parameters
    ----------
    model
        The model.
    segments
        The segments of a fit.
    """
    return "sway" in model.outputs and not shows_drift(segments)


def without_sway(outputs: FloatArray) -> FloatArray:
    """Return outputs, (n, 4) in the order of `MODEL_OUTPUTS`, with a sway of zero.

    What is not finite stays so: a simulation that diverges is still one.
    """
    column = MODEL_OUTPUTS.index("sway")
    result = outputs.copy()
    result[:, column] = np.where(np.isfinite(result[:, column]), 0.0, np.nan)
    return result


def unobserved_parameters(model: Model, segments: Sequence[Segment]) -> tuple[str, ...]:
    """Return the parameters of a model's sway equation, if no segment shows the drift.

    Parameters
    ----------
    model
        The model.
    segments
        The segments of a fit.
    """
    if not drift_is_unknown(model, segments):
        return ()
    return tuple(name for name in model.names if name in SWAY_PARAMETERS)


def _has_fixes(segment: Segment) -> bool:
    fixes = segment.fixes
    return fixes is not None and int(np.isfinite(fixes).all(axis=1).sum()) > 1
