"""Choice of a model by cross-validation over the runs.

Each run is held out in turn and predicted by a fit to the others. A run is a manoeuvre to one side,
so that this validates across manoeuvres and across sides. How well a model fits is no criterion:
the model with the most parameters always fits best.

References
----------
Stone, "Cross-validatory choice and assessment of statistical predictions", 1974.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import radians

import numpy as np

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment, segments_by_run
from shiplog.errors import LogError, UsageError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model
from shiplog.types import FloatArray
from shiplog.vessel.vessel import Vessel

from .held_out import JUDGED_COLUMNS, PREDICTED, HeldOutErrors, predict_without
from .parallel import parallel_map
from .simulated_manoeuvres import Approach, approach_of, turns_hard_over

MAX_MISFIT = 10.0  # relative error that a diverging simulation counts with
RUN_NUMBERS = 4  # independent numbers of a run: its error is slow, and yaw, speed and track differ
HARD_SHARE = 0.75  # of the largest rudder angle: from it a run is one of the hardest
LEAST_ANGLE = radians(0.1)  # of a straight run: ratios of angles stay finite
LEAST_WEIGHT = 0.05  # of the best model's: below it a model is not averaged


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
        (r, 5) of each segment, held out with its run and again with all of the hardest runs: the
        error of each of `PREDICTED`, as in `HeldOutErrors`.
    hard_misfits
        (5,) of them the mean over the hardest runs, predicted from the others together.
    hard_ratio
        The largest rudder angle over that of the runs from which the hardest ones are predicted.
    excess
        The mean square of those errors over that predicted; at least 1.
    fault
        Why the model is not to be chosen: it has not converged, a parameter is at its limit, or
        the simulated ship does not turn with the rudder hard over; empty for none.
    weight
        Its share in predictions that average over the models, 0 to 1.
    """

    model: Model
    fit: OutputError | None
    misfits: FloatArray
    hard_misfits: FloatArray = field(default_factory=lambda: np.full(len(PREDICTED), np.nan))
    hard_ratio: float = 1.0
    excess: float = 1.0
    fault: str = ""
    weight: float = 0.0

    @property
    def score(self) -> float:
        """The mean misfit of yaw rate, speed, heading and track; the smaller, the better."""
        judged = np.minimum(self.misfits[:, JUDGED_COLUMNS], MAX_MISFIT)
        return float(np.nanmean(judged)) if np.isfinite(judged).any() else MAX_MISFIT


def rank_models(
    segments: Sequence[Segment],
    models: Sequence[Model],
    *,
    fixed: Mapping[str, Mapping[str, float]] | None = None,
    vessel: Vessel | None = None,
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
    vessel
        Gives the ship's length for dimensionless models, and the rate of the steering gear.
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
    runs = segments_by_run(segments)
    require_two_runs(len(runs))
    length = vessel.length if vessel else None
    # the models with the most parameters take longest, and are begun first
    order = sorted(range(len(models)), key=lambda i: -_free_count(models[i]))
    sets = held_out_sets(segments)
    progress = _RankingProgress(models, order, len(sets), on_progress)

    def fit_all(i: int) -> OutputError | None:
        given = (fixed or {}).get(models[i].name)
        try:
            return output_error(segments, models[i], fixed=given, length=length)
        except LogError:  # its simulation diverges from every start
            return None

    done = parallel_map(fit_all, order, progress.reporter([(i, None) for i in order]), threads)
    fits = dict(zip(order, done, strict=True))
    held_out = [(i, k) for i in order if fits[i] is not None for k in range(len(sets))]

    def fit_others(pair: tuple[int, int]) -> HeldOutErrors:
        whole = fits[pair[0]]
        assert whole is not None  # noqa: S101 - for the type checker
        return predict_without(whole, sets[pair[1]])

    errors = parallel_map(fit_others, held_out, progress.reporter(held_out), threads)
    by_model: dict[int, list[HeldOutErrors]] = {i: [] for i in range(len(models))}
    for (i, _), each in zip(held_out, errors, strict=True):
        by_model[i].append(each)
    candidates = [_candidate(model, fits[i], sets, by_model[i]) for i, model in enumerate(models)]
    approach = approach_of(segments, vessel)
    candidates = [_checked(each, approach) for each in candidates]
    ranked = sorted(candidates, key=lambda c: (c.fit is None, bool(c.fault), c.score))
    return _weighted(ranked, len(runs))


def _candidate(
    model: Model,
    fit: OutputError | None,
    sets: Sequence[tuple[int, ...]],
    errors: Sequence[HeldOutErrors],
) -> Candidate:
    if fit is None:
        return Candidate(model, None, np.full((1, len(PREDICTED)), np.inf))
    angles = [largest_rudder(segment) for segment in fit.problem.segments]
    # the hardest set is the one after which the others have the smallest angles
    others = [max(a for i, a in enumerate(angles) if i not in each) for each in sets]
    hardest = min(range(len(sets)), key=lambda k: (others[k], -len(sets[k])))
    excess = errors[hardest].excess
    return Candidate(
        model,
        fit,
        np.concatenate([each.misfits for each in errors]),
        _mean_misfits(errors[hardest].misfits),
        max(angles) / others[hardest],
        max(1.0, excess) if np.isfinite(excess) else 1.0,
    )


def _mean_misfits(misfits: FloatArray) -> FloatArray:
    """Return the mean over segments, (5,), of misfits, (k, 5); NaN where none was measured."""
    known = ~np.isnan(misfits)
    total = np.where(known, np.minimum(misfits, MAX_MISFIT), 0.0).sum(axis=0)
    count = known.sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _checked(candidate: Candidate, approach: Approach) -> Candidate:
    """Return the candidate with its fault, if it has one."""
    if candidate.fit is None:
        return candidate
    return replace(candidate, fault=fault_of(candidate.fit, approach))


def largest_rudder(segment: Segment) -> float:
    """Return the largest rudder angle of a segment, rad, outliers aside; at least `LEAST_ANGLE`."""
    return max(float(np.quantile(np.abs(segment.signals["rudder"]), 0.9)), LEAST_ANGLE)


def fault_of(fit: OutputError, approach: Approach) -> str:
    """Return why a fit is not to be trusted; empty for none."""
    if not fit.minimum.converged:
        return "not converged"
    lowest, highest = fit.problem.bounds
    z = fit.minimum.unknowns
    at_limit = np.flatnonzero((z <= lowest) | (z >= highest))
    if len(at_limit):
        return f"at its limit: {', '.join(fit.problem.free_names[i] for i in at_limit)}"
    return "" if turns_hard_over(fit, approach) else "no 35° turn"


def _weighted(ranked: Sequence[Candidate], runs: int) -> list[Candidate]:
    """Return candidates with their weights in averages.

    The likelihood of held-out runs by a model whose error they state falls with the power of the
    score that is the number of independent numbers in them. A model with a fault has no weight
    unless all have one.
    """
    sound = [c for c in ranked if c.fit is not None and not c.fault]
    eligible = sound or [c for c in ranked if c.fit is not None]
    if not eligible:
        return list(ranked)
    best = min(c.score for c in eligible)
    power = -RUN_NUMBERS * runs
    weights = {id(c): (max(c.score, 1e-9) / max(best, 1e-9)) ** power for c in eligible}
    kept = {key: weight for key, weight in weights.items() if weight >= LEAST_WEIGHT}
    total = sum(kept.values())
    return [replace(c, weight=kept.get(id(c), 0.0) / total) for c in ranked]


def held_out_sets(segments: Sequence[Segment]) -> tuple[tuple[int, ...], ...]:
    """List the segments to hold out together: each run, and all of the hardest runs.

    A run to one side is predicted well from its like to the other side. The runs with the largest
    rudder angles show how a model does beyond what it was fitted to.
    """
    runs = segments_by_run(segments)
    angles = [max(largest_rudder(segments[i]) for i in run) for run in runs]
    hard = [k for k, angle in enumerate(angles) if angle >= HARD_SHARE * max(angles)]
    if len(hard) < 2 or len(hard) == len(runs):
        return runs
    return (*runs, tuple(i for k in hard for i in runs[k]))


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
