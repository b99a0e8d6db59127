"""Choice of a model by cross-validation over the runs.

Each run is held out in turn and predicted by a fit to the others. A run is a manoeuvre to one side,
so that this validates across manoeuvres and across sides. How well a model fits is no criterion:
the model with the most parameters always fits best.

References
----------
Stone, "Cross-validatory choice and assessment of statistical predictions", 1974.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.identification.fit.least_squares import minimise
from analysis.identification.fit.output_error import (
    OutputError,
    initial_residual_stds,
    output_error,
    reweighted_fit,
)
from analysis.identification.fit.segment import Segment
from shiplog.errors import LogError, UsageError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .parallel import parallel_map
from .prediction import SCORED_OUTPUTS, misfit

JUDGED_COLUMNS = [MODEL_OUTPUTS.index(name) for name in SCORED_OUTPUTS]  # the same for all models
MAX_MISFIT = 10.0  # relative error that a diverging simulation counts with


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model fitted to all runs, and its error on runs it was not fitted to.

    Attributes
    ----------
    model
        The model.
    fit
        The fit to all runs; None where its simulation diverges.
    misfits
        (r, 4) of each segment, held out with its run: rms of predicted minus measured over the
        standard deviation of the measured, in the order of `MODEL_OUTPUTS`.
    """

    model: Model
    fit: OutputError | None
    misfits: FloatArray

    @property
    def score(self) -> float:
        """The mean misfit of yaw rate, speed and heading; the smaller, the better."""
        judged = np.minimum(self.misfits[:, JUDGED_COLUMNS], MAX_MISFIT)
        return float(np.nanmean(judged)) if np.isfinite(judged).any() else MAX_MISFIT


def rank_models(
    segments: Sequence[Segment],
    models: Sequence[Model],
    *,
    fixed: Mapping[str, Mapping[str, float]] | None = None,
    length: float | None = None,
    on_progress: ProgressCallback = no_progress,
    threads: int | None = None,
) -> list[Candidate]:
    """Rank models by how well they predict each run from the others.

    The fits are shared among the processor's cores; the result does not depend on their number.

    Parameters
    ----------
    segments
        Of two runs or more.
    models
        The models to compare.
    fixed
        By model name, the parameters that are not estimated.
    length
        Ship length, m, for dimensionless models.
    on_progress
        Given ``"model 3 of 7 (slipstream), run 2 of 6"`` and the share of this ranking.
    threads
        How many fits are made at a time; as many as there are cores if None.

    Returns
    -------
    candidates
        The best first; those without a fit last.

    Raises
    ------
    UsageError
        There are fewer than two runs.
    """
    runs = _runs_of(segments)
    require_two_runs(len(runs))
    # the models with the most parameters take longest, and are begun first
    order = sorted(range(len(models)), key=lambda i: -_free_count(models[i]))
    progress = _RankingProgress(models, order, len(runs), on_progress)

    def fit_all(i: int) -> OutputError | None:
        given = (fixed or {}).get(models[i].name)
        try:
            return output_error(segments, models[i], fixed=given, length=length)
        except LogError:  # its simulation diverges from every start
            return None

    done = parallel_map(fit_all, order, progress.reporter([(i, None) for i in order]), threads)
    fits = dict(zip(order, done, strict=True))
    held_out = [(i, k) for i in order if fits[i] is not None for k in range(len(runs))]

    def fit_others(pair: tuple[int, int]) -> list[FloatArray]:
        whole = fits[pair[0]]
        assert whole is not None  # noqa: S101 - for the type checker
        return _leave_out(whole, runs[pair[1]])

    rows = parallel_map(fit_others, held_out, progress.reporter(held_out), threads)
    misfits = dict(zip(held_out, rows, strict=True))
    candidates = []
    for i, model in enumerate(models):
        own = [row for k in range(len(runs)) for row in misfits.get((i, k), [])]
        diverged = np.full((len(segments), len(MODEL_OUTPUTS)), np.inf)
        candidates.append(Candidate(model, fits[i], np.array(own) if own else diverged))
    return sorted(candidates, key=lambda c: (c.fit is None, c.score))


def require_two_runs(count: int) -> None:
    """Reject a number of runs that does not suffice to predict one from the others.

    Raises
    ------
    UsageError
        There are fewer than two runs.
    """
    if count < 2:
        raise UsageError(
            "models are compared by predicting each run from the others: give two logs or more, "
            "or name the model"
        )


def _runs_of(segments: Sequence[Segment]) -> tuple[tuple[int, ...], ...]:
    """Return the indices of the segments of each run."""
    names = [segment.name for segment in segments]
    return tuple(
        tuple(i for i, each in enumerate(names) if each == name) for name in dict.fromkeys(names)
    )


def _free_count(model: Model) -> int:
    return sum(not parameter.fixed for parameter in model.parameters)


class _RankingProgress:
    """Progress of a ranking: of each model the fit to all runs, then one without each run."""

    def __init__(
        self,
        models: Sequence[Model],
        order: Sequence[int],
        runs: int,
        on_progress: ProgressCallback,
    ) -> None:
        self._models = models
        self._numbers = {i: number for number, i in enumerate(order, start=1)}
        self._runs = runs
        self._on_progress = on_progress
        # a fit takes about as long as its parameters, squared, times its runs
        self._weights = [float(_free_count(model)) ** 2 for model in models]
        self._whole = sum(self._weights) * (runs + runs * (runs - 1))
        self._done = 0.0

    def reporter(self, fits: Sequence[tuple[int, int | None]]) -> Callable[[int, bool], None]:
        """Return the callback of a `parallel_map` over fits: each a model and the run held out."""

        def report(item: int, done: bool) -> None:
            i, run = fits[item]
            if done:
                self._done += self._weights[i] * (self._runs - (run is not None))
            step = f"model {self._numbers[i]} of {len(self._models)} ({self._models[i].name})"
            step += ", all runs" if run is None else f", run {run + 1} of {self._runs}"
            self._on_progress(step, self._done / self._whole)

        return report


def _leave_out(whole: OutputError, run: Sequence[int]) -> list[FloatArray]:
    """Return the misfits, (4,) each, of a run's segments under a fit to the other runs.

    The search starts from the fit to all runs. The noise is estimated again without the run, and
    a swell counts as noise.
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
