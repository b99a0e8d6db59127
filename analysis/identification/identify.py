"""From logs to a ship's coefficients, what they are worth, and what they say of other logs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.identification.comparison.history import ParameterHistory, two_priors
from analysis.identification.comparison.paper_scheme import paper_scheme
from analysis.identification.comparison.parameter_ekf import parameter_ekf
from analysis.identification.comparison.windows import window_estimates
from shiplog.errors import LogError, UsageError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model, loadable_models, ship_model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray, Log
from shiplog.vessel.vessel import Vessel

from .advice import TieCheck, check_ties, manoeuvres_to_identify
from .model_selection import Candidate, rank_models
from .output_error import OutputError, make_problem, output_error
from .prior_sensitivity import PriorSensitivity, prior_sensitivity
from .problem import residuals
from .runs import common_vessel, consistency_warnings, distinct_runs
from .segment import Segment
from .uncertainty import Uncertainty, uncertainty
from .validation import Validation, nan_rms, validate

AUTO = "auto"
ALPHAS = ("alpha1", "alpha2", "alpha3")
UNEXPLAINED = 0.2  # of what was measured, in the rms: a fit that leaves more says little
CONTRADICTING = 3.0  # times what noise explains: runs that differ so much are not one ship's


@dataclass(frozen=True, eq=False)
class RunFit:
    """How a fit goes with a run it was made from."""

    name: str
    duration_secs: float
    rms: Mapping[str, float]  # of the residuals of each output, SI
    rudder_offset: float  # rad: the rudder's zero, and every constant yaw moment
    biases: Mapping[str, float]  # of sensors, SI
    wave_secs: tuple[float, ...]  # the periods of swells


@dataclass(frozen=True, eq=False)
class IdentifiedShip:
    """A model of a ship from logs of hers."""

    model: Model
    fit: OutputError
    uncertainty: Uncertainty
    prior_sensitivity: PriorSensitivity
    histories: tuple[ParameterHistory, ...]  # of other methods, for comparison
    runs: tuple[RunFit, ...]
    validations: tuple[Validation, ...]
    candidates: tuple[Candidate, ...]  # the best first; empty where the model was named
    ties: TieCheck | None  # of the paper's model
    vessel: Vessel | None  # whose length and steering gear were taken
    length_given: bool
    fixed: Mapping[str, float]  # parameters that were not sought
    advice: Mapping[str, str] = field(default_factory=dict)  # by parameter: what would tell it
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    @property
    def coefficients(self) -> dict[str, float]:
        """All the model's parameters, sought or known, in their own units."""
        return dict(zip(self.model.names, self.fit.parameters.tolist(), strict=True))

    @property
    def covariance(self) -> FloatArray:
        """(p, p) of the parameters sought, `uncertainty.names`."""
        return self.uncertainty.covariance

    @property
    def identifiable(self) -> tuple[str, ...]:
        """The parameters that these logs do tell."""
        return tuple(n for n in self.uncertainty.names if n not in self.uncertainty.unidentifiable)


def identify(
    logs: Sequence[Log],
    model: str | Model | None = None,
    *,
    validation_logs: Sequence[Log] = (),
    fixed: Mapping[str, float] | None = None,
    vessel: Vessel | None = None,
    on_progress: ProgressCallback = no_progress,
) -> IdentifiedShip:
    """Fit a model of `shiplog.ships` to logs of one ship, all at once.

    `model` is a `Model`, the name of an installed one, or "auto": all installed ones are compared,
    and the one is taken that predicts each run best from the others. Without a name it is the
    paper's model, tied where T3 is known. `known` parameters are not sought. Length, the rudder's
    alphas and the steering gear are those of `vessel`, or of the vessel file the logs carry.

    Raises `LogError` where the logs cannot identify anything or are of different ships, and
    `UsageError` for names nobody knows.
    """
    if not logs:
        raise UsageError("no log to identify from; give at least one")
    stated = dict(fixed or {})
    model = model or ("burylin-tied" if "T3" in stated else "burylin")
    considered, warnings = _considered(model)
    _require_known(considered, stated)
    on_progress("read")
    runs, held_out = distinct_runs(logs, validation_logs)
    ship = common_vessel([*runs, *held_out], vessel)
    segments = [segment for run in runs for segment in run.segments]
    length = ship.length if ship else None
    candidates: list[Candidate] = []
    if model == AUTO:
        candidates = _compared(segments, considered, stated, ship, length, on_progress)
        fit = _best(candidates)
    else:
        on_progress(f"fit {considered[0].name}")
        settled = _settled(considered[0], stated, ship)
        fit = output_error(segments, considered[0], fixed=settled, length=length)
    on_progress("uncertainty")
    found = uncertainty(fit)
    on_progress("echo")
    echo = prior_sensitivity(fit, found)
    found = replace(found, prior_share=np.fmax(found.prior_share, echo.shares))
    priors = two_priors(found, fit.problem.bounds)
    histories = parameter_ekf(fit, priors), window_estimates(fit), paper_scheme(fit, priors)
    on_progress("validation")
    validations = [each for run in held_out for each in validate(fit, run)]
    every = [*runs, *held_out]
    warnings += [w for run in every for w in run.warnings]
    warnings += [*consistency_warnings(every), *_doubts(fit, found, echo, validations)]
    if fit.problem.scale.secs != 1.0 and length is None:
        warnings.append(
            f"no length is known, {fit.problem.scale.secs * fit.problem.scale.speed:.0f} m is "
            "taken for the scale of a model without dimensions, whose priors depend on it a "
            "little; state it in a vessel file"
        )
    return IdentifiedShip(
        fit.problem.model, fit, found, echo, tuple(each for each in histories if each is not None),
        tuple(_run_fits(fit)), tuple(validations),
        tuple(candidates), check_ties(fit), ship, length is not None,
        {n: v for n, v in zip(fit.problem.model.names, fit.parameters.tolist(), strict=True)
         if n not in found.names},
        {name: manoeuvres_to_identify(name) for name in found.unidentifiable},
        tuple(warnings), any(run.data_lost for run in every),
    )  # fmt: skip


def _considered(model: str | Model) -> tuple[list[Model], list[str]]:
    """Return the models to fit, and a warning for each installed one that cannot be loaded."""
    if model == AUTO:
        models, warnings = loadable_models()
        return list(models), list(warnings)
    return [model if isinstance(model, Model) else ship_model(model)], []


def _require_known(models: Sequence[Model], known: Mapping[str, float]) -> None:
    for model in models:
        if all(parameter.fixed or parameter.name in known for parameter in model.parameters):
            raise UsageError(
                f"every parameter of {model.name} is known, and nothing is left to seek"
            )
    for name, value in known.items():
        having = [model for model in models if name in model.names]
        if not having:
            models[0].parameter(name)
        units = {model.parameter(name).unit for model in having}
        if len(units) > 1:
            raise UsageError(
                f"--known {name} is in {' or '.join(sorted(units))}, as the model has it; "
                "name the model with --model"
            )
        lowest, highest = (
            pick(getattr(model.parameter(name), limit) for model in having)
            for pick, limit in ((max, "lowest"), (min, "highest"))
        )
        if not (np.isfinite(value) and lowest <= value <= highest):
            raise UsageError(
                f"--known {name} must be a finite number from {lowest:g} to {highest:g}, "
                f"got {value:g}"
            )


def _settled(model: Model, known: Mapping[str, float], ship: Vessel | None) -> dict[str, float]:
    """What is known of a model's parameters: what was said, and the alphas of the vessel file."""
    settled = {name: known[name] for name in model.names if name in known}
    if ship is not None and ship.coefficients is not None:
        alphas = {n: getattr(ship.coefficients, n) for n in ALPHAS if n in model.names}
        settled = alphas | settled
    return settled


def _compared(
    segments: Sequence[Segment],
    models: Sequence[Model],
    known: Mapping[str, float],
    ship: Vessel | None,
    length: float | None,
    on_progress: ProgressCallback,
) -> list[Candidate]:
    make_problem(segments, models[0], length=length)  # raises for useless logs
    found: list[Candidate] = []
    for i, model in enumerate(models):
        on_progress(f"cross-validate {model.name}", i / len(models))
        found += rank_models(segments, [model], fixed=_settled(model, known, ship), length=length)
    return sorted(found, key=lambda candidate: (candidate.fit is None, candidate.score))


def _best(candidates: Sequence[Candidate]) -> OutputError:
    for candidate in candidates:
        if candidate.fit is not None:
            return candidate.fit
    raise LogError("every model runs away on these logs; look at their signs and units")


def _run_fits(fit: OutputError) -> Iterator[RunFit]:
    problem, z = fit.problem, fit.minimum.unknowns
    left = residuals(problem, z)
    for i, segment in enumerate(problem.segments):
        own = z[problem.own_slice(i)]
        at = len(problem.model.state)
        has_offset = problem.nuisance.rudder_std > 0
        biases = at + has_offset
        waves = biases + len(problem.biases)
        omegas = own[waves :: 1 + 2 * len(problem.outputs)]
        yield RunFit(
            segment.name, (len(segment) - 1) * segment.dt_secs,
            {output: nan_rms(left[i][:, c]) for c, output in enumerate(problem.outputs)},
            float(own[at]) if has_offset else 0.0,
            {problem.outputs[c]: float(own[biases + k])
             for k, (c, _) in enumerate(problem.biases)},
            tuple(float(2 * np.pi / abs(omega)) for omega in omegas),
        )  # fmt: skip


def _unexplained(fit: OutputError) -> Iterator[str]:
    """The runs of which the fit leaves much, white noise aside."""
    problem = fit.problem
    for segment, left, spread in zip(
        problem.segments, residuals(problem, fit.minimum.unknowns), fit.residual_stds, strict=True
    ):
        for c, output in enumerate(problem.outputs):
            measured = segment.measured[:, MODEL_OUTPUTS.index(output)]
            white = max(float(np.mean(spread.typical[:, c] ** 2)) - fit.noises[c].slow ** 2, 0.0)
            stays = np.sqrt(max(nan_rms(left[:, c]) ** 2 - white, 0.0))
            size = float(np.nanstd(measured)) if np.isfinite(measured).any() else 0.0
            if stays > UNEXPLAINED * size and stays**2 > white:
                yield (
                    f"{segment.name}: the fit leaves {100 * stays / size:.0f} % of the "
                    f"{output.replace('_', ' ')} unexplained: "
                    "a contrary rudder, wrong units, another ship, or a model that is not hers"
                )


def _doubts(
    fit: OutputError, found: Uncertainty, echo: PriorSensitivity, validations: Sequence[Validation]
) -> Iterator[str]:
    """What makes a fit hard to believe."""
    if not fit.minimum.converged:
        yield "the search has not come to an end: the values are where it stopped"
    if echo.elsewhere:
        yield (
            "from another start the search ends elsewhere, where the fit is "
            f"{'better' if echo.worse_by < 0 else 'worse'}: the logs hardly tell this model; "
            "give more manoeuvres, or take a simpler one"
        )
    yield from _unexplained(fit)
    apart = found.agreement.contradiction
    if apart > CONTRADICTING:
        alone = len(fit.problem.runs) == 1
        who = f"the halves of {fit.problem.segments[0].name}" if alone else "the logs"
        odd = f", {found.agreement.outlier} the others" if found.agreement.outlier else ""
        yield (
            f"{who} contradict each other{odd}, {apart:.0f} times what their noise explains: "
            "another ship, loading or depth, or a model that is not hers; the intervals allow for "
            "it"
        )
    if set(found.unidentifiable) == set(found.names):
        yield "nothing is identifiable from these logs: no value of the model is to be believed"
    for validation in validations:
        if validation.diverged:
            yield f"{validation.segment.name}: the simulated ship runs away: no prediction of it"
