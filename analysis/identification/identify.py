"""Identification of a ship model from logs: fit, uncertainty and validation."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from analysis.identification.comparison.history import ParameterHistory, two_priors
from analysis.identification.comparison.paper_scheme import paper_scheme
from analysis.identification.comparison.parameter_ekf import parameter_ekf
from analysis.identification.comparison.windows import window_estimates
from analysis.identification.fit.output_error import OutputError, make_problem, output_error
from analysis.identification.fit.uncertainty import Uncertainty, uncertainty
from analysis.replay.reading_options import DEFAULT_OPTIONS, ReadingOptions
from shiplog.checks.consistency.findings import naming_contradictions
from shiplog.errors import LogError, UsageError
from shiplog.mcap.stream import open_log
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model, loadable_models, ship_model
from shiplog.types import Log
from shiplog.vessel.vessel import Vessel, with_length

from .advice import DRIFT_MANOEUVRES, check_ties, manoeuvres_to_identify
from .fit_warnings import fit_warnings
from .fixed_parameters import check_fixed, fixed_values
from .hull_priors import with_hull_priors, with_stated_hull
from .identified_ship import IdentifiedShip, run_fits
from .model_selection import Candidate, rank_models, require_two_runs
from .parallel import single_blas_thread
from .predicted_indices import predict_manoeuvres
from .prior_sensitivity import PriorSensitivity, prior_sensitivity
from .runs import Run, common_vessel, consistency_warnings, distinct_runs
from .simulated_manoeuvres import approach_of
from .validation import validate

AUTO = "auto"
LogSource = Log | str | os.PathLike[str]


@single_blas_thread
def identify(
    logs: LogSource | Sequence[LogSource],
    model: str | Model | None = None,
    *,
    validation_logs: LogSource | Sequence[LogSource] = (),
    fixed: Mapping[str, float] | None = None,
    options: ReadingOptions = DEFAULT_OPTIONS,
    on_progress: ProgressCallback = no_progress,
) -> IdentifiedShip:
    """Fit a ship model to one or more logs of the same ship by output error.

    Parameters
    ----------
    logs
        A log, the path of a log file, or a sequence of either; all are fitted together.
    model
        The name of an installed ship model, a `Model`, or ``"auto"``: each installed model is
        fitted, and the one is taken that best predicts each log from the others. If None, the
        paper's model, in its tied form if T3 is fixed.
    validation_logs
        Logs that are not fitted but predicted, given as `logs`.
    fixed
        Parameters that are not estimated, by name, in their own units.
    options
        The vessel, the ship's length, the sources of channels, and whether contradictions are
        refused. The vessel gives the length, the parameters alpha1, alpha2 and alpha3 of the
        rudder, and the steering gear, or any of these; by default the one that the logs carry.
    on_progress
        Given each step and the share of the whole work that is done.

    Returns
    -------
    ship
        The model with its uncertainty, the fit of each log, and the validation.

    Raises
    ------
    LogError
        The logs cannot identify anything, are of different ships, or no model fits them.
    UsageError
        An unknown model or parameter, a log given twice, or fewer than two logs for ``"auto"``.

    Examples
    --------
    >>> ship = identify("sample_data/zigzag_20_20.mcap", fixed={"T3": 0.5})
    >>> ship.model.name, round(1e6 * ship.parameters["d"])
    ('burylin-tied', 133)
    """
    fixed = dict(fixed or {})
    model = model or ("burylin-tied" if "T3" in fixed else "burylin")
    models, warnings = _models_of(model)
    check_fixed(models, fixed)
    to_fit, to_predict = _opened(logs), _opened(validation_logs)
    if not to_fit:
        raise UsageError("no log to identify a ship from; give at least one")
    if model == AUTO:
        require_two_runs(len(to_fit))
    steps = _Steps(on_progress, auto=model == AUTO)
    steps.begin("read")
    runs, held_out = distinct_runs(to_fit, to_predict, options)
    ship = with_length(common_vessel([*runs, *held_out], options.vessel), options.length)
    ship = with_stated_hull(ship, to_fit)
    models, hull_warnings = with_hull_priors(models, ship)
    warnings += hull_warnings
    steps.begin("fit")
    with naming_contradictions([text for run in runs for text in run.contradictions]):
        candidates, fit = _fit(runs, models, fixed, ship, steps)
    estimates, sensitivity = _estimates(fit, steps)
    steps.begin("other methods")
    histories = _histories(fit, estimates)
    steps.begin("validation")
    validations = [each for run in held_out for each in validate(fit, run)]
    steps.begin("predictions")
    no_predictions = _reason_without_predictions(runs)
    approach = None if no_predictions else approach_of(fit.problem.recorded, ship)
    all_runs = [*runs, *held_out]
    warnings += [warning for run in all_runs for warning in run.warnings]
    warnings += consistency_warnings(all_runs)
    warnings += fit_warnings(fit, estimates, sensitivity, validations)
    warnings += _assumed_length(fit, ship)
    names, values = fit.problem.model.names, fit.parameters.tolist()
    return IdentifiedShip(
        model=fit.problem.model,
        fit=fit,
        uncertainty=estimates,
        prior_sensitivity=sensitivity,
        histories=histories,
        runs=tuple(run_fits(fit)),
        validations=tuple(validations),
        candidates=tuple(candidates),
        predictions=predict_manoeuvres(candidates, approach) if approach else (),
        no_predictions=no_predictions,
        approach=approach,
        ties=check_ties(fit),
        vessel=ship,
        length_given=ship is not None and ship.length is not None,
        fixed={n: v for n, v in zip(names, values, strict=True) if n not in estimates.names},
        advice=_advice(estimates),
        warnings=tuple(warnings),
        data_lost=any(run.data_lost for run in all_runs),
    )


STEPS = (
    "read", "fit", "uncertainty", "prior sensitivity", "other methods", "validation", "predictions",
)  # fmt: skip
NAMED_STARTS = (0.0, 0.03, 0.25, 0.5, 0.6, 0.9, 0.92)  # of each step, as a share of the duration
AUTO_STARTS = (0.0, 0.01, 0.75, 0.84, 0.86, 0.94, 0.95)


class _Steps:
    """Progress of an identification: its steps, and the progress within the fit."""

    def __init__(self, on_progress: ProgressCallback, *, auto: bool) -> None:
        self._on_progress = on_progress
        self._starts = dict(zip(STEPS, AUTO_STARTS if auto else NAMED_STARTS, strict=True))

    def begin(self, step: str) -> None:
        self._on_progress(step, self._starts[step])

    def within_fit(self, step: str, share: float | None = None, /) -> None:
        start, end = self._starts["fit"], self._starts["uncertainty"]
        self._on_progress(step, start + (end - start) * (share or 0.0))


def _models_of(model: str | Model) -> tuple[list[Model], list[str]]:
    """Return the models to fit, and a warning for each installed one that cannot be loaded."""
    if model == AUTO:
        models, warnings = loadable_models()
        return list(models), list(warnings)
    return [model if isinstance(model, Model) else ship_model(model)], []


def _opened(logs: LogSource | Sequence[LogSource]) -> list[Log]:
    """Return logs given as one log, one path, or a sequence of either."""
    is_one = isinstance(logs, str | os.PathLike) or hasattr(logs, "chunks")
    each = [cast("LogSource", logs)] if is_one else cast("Sequence[LogSource]", logs)
    return [open_log(log) if isinstance(log, str | os.PathLike) else log for log in each]


def _fit(
    runs: Sequence[Run],
    models: Sequence[Model],
    fixed: Mapping[str, float],
    ship: Vessel | None,
    steps: _Steps,
) -> tuple[list[Candidate], OutputError]:
    """Return the models compared on held-out runs, if there are two runs, and the fit taken."""
    segments = [segment for run in runs for segment in run.segments]
    length = ship.length if ship else None
    given = {model.name: fixed_values(model, fixed, ship) for model in models}
    if len(runs) < 2:
        (model,) = models
        return [], output_error(segments, model, fixed=given[model.name], length=length)
    make_problem(segments, models[0], length=length)  # rejects logs that are useless to any model
    candidates = rank_models(
        segments, models, fixed=given, vessel=ship, on_progress=steps.within_fit
    )
    return candidates, _best_fit(candidates)


def _best_fit(candidates: Sequence[Candidate]) -> OutputError:
    for candidate in candidates:
        if candidate.fit is not None:
            return candidate.fit
    raise LogError(
        "the simulation of every model diverges on these logs; check their signs and units"
    )


def _estimates(fit: OutputError, steps: _Steps) -> tuple[Uncertainty, PriorSensitivity]:
    """Return the uncertainty of a fit with the shares of the prior, and the second fit's."""
    steps.begin("uncertainty")
    estimates = uncertainty(fit)
    steps.begin("prior sensitivity")
    sensitivity = prior_sensitivity(fit, estimates)
    share = np.fmax(estimates.prior_share, sensitivity.shares)
    return replace(estimates, prior_share=share), sensitivity


def _histories(fit: OutputError, estimates: Uncertainty) -> tuple[ParameterHistory, ...]:
    """Return the estimates over time of the other methods that apply to the model."""
    priors = two_priors(estimates, fit.problem.bounds)
    histories = parameter_ekf(fit, priors), window_estimates(fit), paper_scheme(fit, priors)
    return tuple(history for history in histories if history is not None)


def _reason_without_predictions(runs: Sequence[Run]) -> str:
    """Return why the standard manoeuvres cannot be predicted with intervals; empty if they can."""
    if len(runs) > 1:
        return ""
    return (
        "one run does not show how well the model predicts another; give two or more, such as "
        "zig-zags 10/10 and 20/20"
    )


def _advice(estimates: Uncertainty) -> dict[str, str]:
    """Return by parameter that is not identifiable the manoeuvre that would determine it."""
    return {
        name: DRIFT_MANOEUVRES if name in estimates.unobserved else manoeuvres_to_identify(name)
        for name in estimates.unidentifiable
    }


def _assumed_length(fit: OutputError, ship: Vessel | None) -> Iterator[str]:
    """Yield a warning where a dimensionless model is scaled by an assumed length."""
    scale = fit.problem.scale
    if scale.secs != 1.0 and (ship is None or ship.length is None):
        yield (
            f"the ship's length is not given; {scale.secs * scale.speed:.0f} m is assumed as the "
            "scale of the dimensionless model, on which its priors depend a little; give it with "
            "--length, or in a vessel file"
        )
