"""Output error: fit a model's simulated outputs to the recorded ones.

The parameters minimise the sum of squared differences between the measured outputs and those
simulated from the recorded rudder and revolutions, over all segments at once. Each segment has its
own initial state, rudder offset and sensor biases. The noise is estimated from the residuals, and
the fit repeated with it (iterative reweighting); for Gaussian noise this is the maximum likelihood
estimate.

References
----------
L. Ljung, "System Identification: Theory for the User", 2nd edition, 1999, section 7.
R. V. Jategaonkar, "Flight Vehicle System Identification", 2nd edition, 2015, chapter 4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.regression.weak_form import MIN_RUDDER_RANGE
from shiplog.errors import LogError, UsageError
from shiplog.ships import Model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .fix_blocks import GROUND_VELOCITY
from .initial_guess import initial_guesses
from .least_squares import Minimum, ResidualStd, minimise
from .noise_weights import estimate_noise, initial_residual_stds
from .nuisance import Nuisance
from .problem import Problem, residuals
from .residual_noise import (
    FINE_WHITE_SHARE,
    MIN_WHITE_SHARE,
    ResidualNoise,
)
from .segment import Segment, averaged, initial_level
from .swell import swell_frequency

DEFAULT_LENGTH = 150.0  # m, for the scale of dimensionless models where no length is given
MIN_SPEED, MIN_RPM = 0.1, 1.0  # m/s, rpm: initial values of a ship under way
SAMPLES_PER_LENGTH = 60  # in the time of sailing a ship length: the fastest that a fit needs
MAX_SLOW_SHARE = 0.2  # of the slow noise that may remain when waves are fitted
REWEIGHTINGS = 3
MAX_RMS_GROWTH = 1.5  # of an output's residuals in a reweighted fit


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fitted model.

    Attributes
    ----------
    problem
        What was fitted to what.
    minimum
        The unknowns and their information.
    noises
        The noise of each output, in the order of ``problem.outputs``.
    residual_stds
        For each segment.
    """

    problem: Problem
    minimum: Minimum
    noises: tuple[ResidualNoise, ...]
    residual_stds: tuple[ResidualStd, ...]

    @property
    def parameters(self) -> FloatArray:
        """(p,) all the model's parameters, free and fixed."""
        return self.problem.parameters(self.minimum.unknowns)


def output_error(
    segments: Sequence[Segment],
    model: Model,
    *,
    start: Mapping[str, float] | None = None,
    fixed: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    length: float | None = None,
    nuisance: Nuisance | None = None,
    outputs: Sequence[str] | None = None,
) -> OutputError:
    """Fit a model to segments.

    Parameters
    ----------
    segments
        One or more, of one ship.
    model
        One of `shiplog.ships`.
    start
        Initial values of free parameters, in the model's units; by default the model's own.
    fixed
        Parameters that keep the given value.
    free
        Parameters to estimate although the model holds them fixed.
    length
        The ship's length, m, for the scale of a dimensionless model; default `DEFAULT_LENGTH`.
    nuisance
        The unknowns of each segment besides its initial state; default `Nuisance()`.
    outputs
        The outputs to fit; default all that the model predicts and that were measured.

    Returns
    -------
    OutputError
        The fit, with its noise.

    Raises
    ------
    UsageError
        No segments, or a parameter that the model does not have.
    LogError
        Logs that cannot identify a model: no rudder or yaw motion, no speed, or a simulation that
        diverges from every start.
    """
    problem = make_problem(
        segments, model, start=start, fixed=fixed, free=free, length=length,
        nuisance=nuisance, outputs=outputs,
    )  # fmt: skip
    return fit_problem(problem)


def make_problem(
    segments: Sequence[Segment], model: Model, *,
    start: Mapping[str, float] | None = None,
    fixed: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    length: float | None = None,
    nuisance: Nuisance | None = None,
    outputs: Sequence[str] | None = None,
) -> Problem:  # fmt: skip
    """Check the segments and lay out the unknowns; the parameters are those of `output_error`."""
    if not segments:
        raise UsageError("no segment to identify from; give at least one log")
    _require_steering(segments)
    _require_turning(segments)
    values = model.start_values()
    for name, value in {**(start or {}), **(fixed or {})}.items():
        values[model.names.index(model.parameter(name).name)] = value
    free_names = {model.parameter(name).name for name in free}
    free_names |= {p.name for p in model.parameters if not p.fixed}
    free_names -= set(fixed or {})
    speed, rpm = initial_level(segments, "speed"), initial_level(segments, "rpm")
    _require_way(segments, speed, rpm)
    scale = model.scale(length or DEFAULT_LENGTH, speed, rpm)
    used = [o for o in (outputs or model.outputs) if any(segment.has(o) for segment in segments)]
    fitted = segments
    if model.dimensionless:
        fitted = [averaged(segment, scale.secs / SAMPLES_PER_LENGTH) for segment in segments]
    problem = Problem(
        model, tuple(fitted), scale, tuple(used), values,
        tuple(i for i, name in enumerate(model.names) if name in free_names),
        Nuisance() if nuisance is None else nuisance,
        recorded=tuple(segments),
    )  # fmt: skip
    if "sway" in model.outputs and any(map(problem.has_velocities, range(len(fitted)))):
        return replace(problem, outputs=(*problem.outputs, *GROUND_VELOCITY))
    return problem


def _require_steering(segments: Sequence[Segment]) -> None:
    range_rad = max(float(np.ptp(segment.signals["rudder"])) for segment in segments)
    if range_rad < MIN_RUDDER_RANGE:
        raise LogError(
            f"the rudder moves by {np.degrees(range_rad):.1f}° in all, too little to identify a "
            f"ship; give a log of a zig-zag or of a turning circle: {_names(segments)}"
        )


def _require_turning(segments: Sequence[Segment]) -> None:
    column = MODEL_OUTPUTS.index("yaw_rate")
    if not any(
        segment.has("yaw_rate") and np.nanstd(segment.measured[:, column]) > 0
        for segment in segments
    ):
        raise LogError(
            "the yaw rate never changes, so that nothing can be identified; check the gyro, "
            f"which may be stuck: {_names(segments)}"
        )


def _require_way(segments: Sequence[Segment], speed: float, rpm: float) -> None:
    if not (speed > MIN_SPEED and rpm > MIN_RPM):
        raise LogError(
            f"the logs start with {speed:.2g} m/s at {rpm:.2g} rpm, but the models describe a ship "
            f"under way; give logs that start on a steady straight run: {_names(segments)}"
        )


def _names(segments: Sequence[Segment]) -> str:
    return ", ".join(dict.fromkeys(segment.name for segment in segments))


def fit_problem(
    problem: Problem, *, start: FloatArray | None = None, waves: bool = True
) -> OutputError:
    """Fit a problem and estimate its noise.

    Parameters
    ----------
    problem
        As of `make_problem`.
    start
        (m,) unknowns to start from instead of `initial_guesses`.
    waves
        Whether to look for a swell in the residuals and, if it explains them, to fit it too.

    Returns
    -------
    OutputError
        The fit.

    Raises
    ------
    LogError
        The simulation diverges from every start.
    """
    residual_stds = initial_residual_stds(problem)
    minima = []
    for begin in [start] if start is not None else initial_guesses(problem, residual_stds):
        minima.append(minimise(problem, begin, residual_stds))
        if minima[-1].converged:
            break
    minimum = min(minima, key=lambda each: each.cost)
    if not np.isfinite(minimum.cost):
        fixed = (i for i in range(len(problem.values)) if i not in problem.free)
        given = ", ".join(f"{problem.model.names[i]} = {problem.values[i]:g}" for i in fixed)
        raise LogError(
            f"the simulation of model {problem.model.name} diverges from every start; check the "
            f"signs and units of the channels{f' and the fixed {given}' if given else ''}, or fit "
            f"another model: {_names(problem.segments)}"
        )
    fit = reweighted_fit(problem, minimum)
    return _with_fine_weights(_with_waves(fit) if waves else fit)


def reweighted_fit(
    problem: Problem, minimum: Minimum, share: float = MIN_WHITE_SHARE
) -> OutputError:
    """Estimate the noise and repeat the fit with it, `REWEIGHTINGS` times.

    The noise weights the next fit. Where runs contradict each other, an output could so get ever
    less weight, to the benefit of another: the iteration ends before an output's rms residual
    exceeds `MAX_RMS_GROWTH` times its initial value.

    Parameters
    ----------
    problem
        The problem.
    minimum
        A first fit.
    share
        As of `fit_residual_noise`.

    Returns
    -------
    OutputError
        The last accepted fit, with the noise estimated from it.
    """
    noises, residual_stds = estimate_noise(problem, minimum.unknowns, share)
    initial_rms = _rms_residuals(problem, minimum)
    for _ in range(REWEIGHTINGS):
        reweighted = minimise(problem, minimum.unknowns, residual_stds, minimum.jacobians)
        if (_rms_residuals(problem, reweighted) > MAX_RMS_GROWTH * initial_rms).any():
            break
        minimum = reweighted
        noises, residual_stds = estimate_noise(problem, minimum.unknowns, share)
    return OutputError(problem, minimum, tuple(noises), tuple(residual_stds))


def tempered_fit(fit: OutputError, inflation: float) -> OutputError:
    """Repeat a fit with the variance of its residuals multiplied.

    Residuals contain the errors of the model, which are not independent from run to run. Where
    runs that were not fitted are predicted worse than the fit's covariance states, the data have
    less weight against the priors than their noise alone would give them (a power posterior).

    Parameters
    ----------
    fit
        The fit.
    inflation
        By how much the squared errors of held-out runs exceed the predicted ones, at least 1.

    References
    ----------
    P. Grünwald and T. van Ommen, "Inconsistency of Bayesian inference for misspecified linear
    models, and a proposal for repairing it", Bayesian Analysis 12, 2017.
    """
    if inflation <= 1:
        return fit
    factor = float(np.sqrt(inflation))
    stds = tuple(
        ResidualStd(each.effective * factor, each.typical * factor) for each in fit.residual_stds
    )
    minimum = minimise(fit.problem, fit.minimum.unknowns, stds)
    return replace(fit, minimum=minimum, residual_stds=stds)


def _with_fine_weights(fit: OutputError) -> OutputError:
    """Repeat the fit with a lower limit of the white noise, unless that reveals slow noise.

    With noise in proportion to the output, samples near zero are the most precise. Where their
    residuals are slow, they are not the instrument's noise, and must not get such weights.
    """
    fine = reweighted_fit(fit.problem, fit.minimum, FINE_WHITE_SHARE)
    slower = any(new.slow > old.slow for new, old in zip(fine.noises, fit.noises, strict=True))
    return fit if slower else fine


def _rms_residuals(problem: Problem, minimum: Minimum) -> FloatArray:
    """(c,) of each output over all segments."""
    residual = np.concatenate(residuals(problem, minimum.unknowns))
    count = np.isfinite(residual).sum(axis=0)
    return np.asarray(np.sqrt(np.nansum(residual**2, axis=0) / np.maximum(count, 1)))


def _with_waves(fit: OutputError) -> OutputError:
    """Repeat the fit with a wave in each segment that has one, if they explain the slow noise."""
    problem = fit.problem
    waved = problem.own_layout.waved
    slow = [noise.slow for noise in fit.noises[:waved]]
    frequencies = [
        swell_frequency(residual[:, :waved], std.typical[:, :waved], segment.dt_secs, slow)
        for segment, residual, std in zip(
            problem.segments,
            residuals(problem, fit.minimum.unknowns),
            fit.residual_stds,
            strict=True,
        )
    ]
    if not any(frequencies):
        return fit
    waves = tuple(() if omega is None else (omega,) for omega in frequencies)
    with_waves = replace(problem, waves=waves)
    start = with_waves.start()
    start[: problem.common] = fit.minimum.unknowns[: problem.common]
    for i in range(len(problem.segments)):
        own, old = with_waves.own_slice(i), fit.minimum.unknowns[problem.own_slice(i)]
        start[own.start : own.start + len(old)] = old
    wave_fit = reweighted_fit(with_waves, minimise(with_waves, start, fit.residual_stds))
    explained = all(
        new.slow**2 * new.slow_secs <= MAX_SLOW_SHARE * old.slow**2 * old.slow_secs
        for new, old in zip(wave_fit.noises, fit.noises, strict=True)
    )
    return wave_fit if explained else fit
