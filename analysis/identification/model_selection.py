"""Which model to believe: the one that says best what runs it never saw did.

Each run is left out in turn, and predicted from a fit to the others (Stone, "Cross-validatory
choice and assessment of statistical predictions", 1974). A run is a manoeuvre to one side, so that
this is a validation across manoeuvres and across sides. How well a model fits says little: the
richest always fits best.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shiplog.errors import LogError, UsageError
from shiplog.ships import Model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .least_squares import minimise
from .output_error import OutputError, initial_residual_stds, output_error, reweighted_fit
from .prediction import SCORED_OUTPUTS, misfit
from .segment import Segment

JUDGED_COLUMNS = [MODEL_OUTPUTS.index(name) for name in SCORED_OUTPUTS]  # all models alike
WORST = 10.0  # of a relative error: a ship that runs away is no worse than ten times off


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model, fitted to all runs, and how far it is off runs it never saw."""

    model: Model
    fit: OutputError | None  # None where it runs away
    misfits: FloatArray  # (r, 4) of each run left out: rms over the std of what was measured

    @property
    def score(self) -> float:
        """The mean of the misfits that are judged; the smaller, the better."""
        judged = np.minimum(self.misfits[:, JUDGED_COLUMNS], WORST)
        return float(np.nanmean(judged)) if np.isfinite(judged).any() else WORST


def rank_models(
    segments: Sequence[Segment],
    models: Sequence[Model],
    **settings: Any,  # noqa: ANN401
) -> list[Candidate]:
    """The models by how well they predict, the best first; `settings` are `output_error`'s.

    Raises `UsageError` where there are fewer than two runs to tell them apart by.
    """
    if len({segment.name for segment in segments}) < 2:
        raise UsageError(
            "a model is chosen by runs it has not seen: give two logs or more, or name the model"
        )
    return sorted(
        (_candidate(segments, model, settings) for model in models), key=lambda c: c.score
    )


def _candidate(segments: Sequence[Segment], model: Model, settings: Mapping[str, Any]) -> Candidate:
    try:
        fitted = output_error(segments, model, **settings)
    except LogError:
        return Candidate(model, None, np.full((len(segments), len(MODEL_OUTPUTS)), np.inf))
    misfits = [row for run in fitted.problem.runs for row in _left_out(fitted, run)]
    return Candidate(model, fitted, np.array(misfits))


def _left_out(whole: OutputError, run: Sequence[int]) -> list[FloatArray]:
    """How far off the segments of a run is a fit to the others, which knows nothing of it.

    Its search begins where the whole fit is; its noise is its own, a swell counts as noise.
    """
    kept = [i for i in range(len(whole.problem.segments)) if i not in run]
    calm = replace(whole.problem, waves=())
    rest, _ = calm.select_segments(kept, calm.start())
    start = rest.start()
    start[: len(rest.free)] = whole.minimum.unknowns[: len(rest.free)]
    minimum = minimise(rest, start, initial_residual_stds(rest))
    if not np.isfinite(minimum.cost):
        return [np.full(len(MODEL_OUTPUTS), np.inf)] * len(run)
    others = reweighted_fit(rest, minimum)
    return [misfit(others, whole.problem.segments[i]) for i in run]
