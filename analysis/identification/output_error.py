"""Output error: the parameters whose simulated runs come nearest to the runs recorded.

All trials at once, each with its own initial state, sensor biases and rudder offset. The noise is
found from what the fit leaves, and the fit repeated with it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from analysis.regression.weak_form import LEAST_RUDDER
from shiplog.errors import LogError, UsageError
from shiplog.ships import Model
from shiplog.ships.motion import OUTPUTS
from shiplog.types import FloatArray

from .initial_guess import starts
from .least_squares import Minimum, Spread, minimise
from .problem import Nuisance, Problem, residuals
from .residual_noise import FINEST_SHARE, LEAST_SHARE, Left, Noise, interval_secs, noise_of
from .segment import Trial, usual
from .swell import frequency_of

USUAL_LENGTH = 150.0  # m, of a ship whose length nobody gave: its scale only
LEAST_SPEED, LEAST_RPM = 0.1, 1.0  # m/s, rpm
UNEXPLAINED = 0.2  # of what stays off: if a wave leaves more, it was none
ROUNDS = 3
GIVEN_UP = 1.5  # times what an output was off: noise that lets it grow so explains it away
LEAST_STD = {  # of what any instrument is off
    "yaw_rate": radians(1e-5), "speed": 1e-4, "sway": 1e-4, "heading": radians(0.02)
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fit."""

    problem: Problem
    minimum: Minimum
    noises: tuple[Noise, ...]  # of each output
    spreads: tuple[Spread, ...]  # of each trial

    @property
    def parameters(self) -> FloatArray:
        """(p,) all the model's parameters."""
        return self.problem.parameters(self.minimum.unknowns)


def output_error(
    trials: Sequence[Trial],
    model: Model,
    *,
    start: Mapping[str, float] | None = None,
    known: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    length: float | None = None,
    nuisance: Nuisance | None = None,
    outputs: Sequence[str] | None = None,
) -> OutputError:
    """Fit a model to trials.

    `known` parameters keep the value given, those of `free` are sought though the model takes them
    for known; `start` is where the others begin.
    """
    problem = pose(
        trials, model, start=start, known=known, free=free, length=length,
        nuisance=nuisance, outputs=outputs,
    )  # fmt: skip
    return fit(problem)


def pose(
    trials: Sequence[Trial], model: Model, *,
    start: Mapping[str, float] | None = None,
    known: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    length: float | None = None,
    nuisance: Nuisance | None = None,
    outputs: Sequence[str] | None = None,
) -> Problem:  # fmt: skip
    """The problem of fitting a model to trials, as `output_error` has it."""
    if not trials:
        raise UsageError("no trial to identify from; give at least one log")
    _require_steering(trials)
    _require_turning(trials)
    values = model.starts()
    for name, value in {**(start or {}), **(known or {})}.items():
        values[model.names.index(model.parameter(name).name)] = value
    sought = {model.parameter(name).name for name in free}
    sought |= {p.name for p in model.parameters if not p.known}
    sought -= set(known or {})
    speed, rpm = usual(trials, "speed"), usual(trials, "rpm")
    _require_way(trials, speed, rpm)
    scale = model.scale(length or USUAL_LENGTH, speed, rpm)
    used = [o for o in (outputs or model.outputs) if any(trial.has(o) for trial in trials)]
    return Problem(
        model, tuple(trials), scale, tuple(used), values,
        tuple(i for i, name in enumerate(model.names) if name in sought),
        Nuisance() if nuisance is None else nuisance,
    )  # fmt: skip


def _require_steering(trials: Sequence[Trial]) -> None:
    moved = max(float(np.ptp(trial.signals["rudder"])) for trial in trials)
    if moved < LEAST_RUDDER:
        names = ", ".join(trial.name for trial in trials)
        raise LogError(
            f"the rudder moves by {np.degrees(moved):.1f}° in all, and from that nothing can be "
            f"identified; give a log of a zig-zag or of a turning circle: {names}"
        )


def _require_turning(trials: Sequence[Trial]) -> None:
    column = OUTPUTS.index("yaw_rate")
    if not any(
        trial.has("yaw_rate") and np.nanstd(trial.measured[:, column]) > 0 for trial in trials
    ):
        names = ", ".join(trial.name for trial in trials)
        raise LogError(
            f"the yaw rate never changes, and from that nothing can be identified; is the gyro "
            f"stuck? {names}"
        )


def _require_way(trials: Sequence[Trial], speed: float, rpm: float) -> None:
    if not (speed > LEAST_SPEED and rpm > LEAST_RPM):
        names = ", ".join(trial.name for trial in trials)
        raise LogError(
            f"the ship begins with {speed:.2g} m/s at {rpm:.2g} rpm, and a model is of a ship "
            f"under way; give logs that begin on a steady run: {names}"
        )


def fit(problem: Problem, *, start: FloatArray | None = None, waves: bool = True) -> OutputError:
    """The fit, its noise found from what it leaves; `start` is another beginning of the search."""
    spreads = first_spreads(problem)
    tried = []
    for begin in [start] if start is not None else starts(problem, spreads):
        tried.append(minimise(problem, begin, spreads))
        if tried[-1].settled:
            break
    minimum = min(tried, key=lambda each: each.cost)
    if not np.isfinite(minimum.cost):
        raise LogError(
            f"the model {problem.model.name} runs away on these trials from every start tried; "
            f"look at their signs and units, or fit another model: "
            f"{', '.join(dict.fromkeys(t.name for t in problem.trials))}"
        )
    calm = settled(problem, minimum)
    return _refined(_with_waves(calm) if waves else calm)


def settled(problem: Problem, minimum: Minimum, share: float = LEAST_SHARE) -> OutputError:
    """The fit and its noise, found in turn from a first fit.

    Noise is found from what a fit leaves, and tells the next fit what to leave: where runs
    contradict each other an output could so be given up to please another. There it ends before.
    """
    noises, spreads = noise_left(problem, minimum.unknowns, share)
    off = _rms_left(problem, minimum)
    for _ in range(ROUNDS):
        after = minimise(problem, minimum.unknowns, spreads, minimum.jacobians)
        if (_rms_left(problem, after) > GIVEN_UP * off).any():
            break
        minimum = after
        noises, spreads = noise_left(problem, minimum.unknowns, share)
    return OutputError(problem, minimum, tuple(noises), tuple(spreads))


def _refined(found: OutputError) -> OutputError:
    """The fit with the quietest samples believed as far as they are quiet.

    An instrument whose noise is in proportion says most when it says least; but where something
    stays off, it is no noise of the instrument's.
    """
    fine = settled(found.problem, found.minimum, FINEST_SHARE)
    stays = any(new.slow > old.slow for new, old in zip(fine.noises, found.noises, strict=True))
    return found if stays else fine


def _rms_left(problem: Problem, minimum: Minimum) -> FloatArray:
    """(c,) of each output over all trials."""
    left = np.concatenate(residuals(problem, minimum.unknowns))
    known = np.isfinite(left).sum(axis=0)
    return np.asarray(np.sqrt(np.nansum(left**2, axis=0) / np.maximum(known, 1)))


def _with_waves(calm: OutputError) -> OutputError:
    """The fit with a wave in each trial that has one, where they explain all that stays off."""
    problem = calm.problem
    left = residuals(problem, calm.minimum.unknowns)
    slow = [noise.slow for noise in calm.noises]
    found = [
        frequency_of(r, spread.usual, problem.trials[i].dt_secs, slow)
        for i, (r, spread) in enumerate(zip(left, calm.spreads, strict=True))
    ]
    if not any(found):
        return calm
    waves = tuple(() if omega is None else (omega,) for omega in found)
    with_waves = replace(problem, waves=waves)
    start = with_waves.start()
    start[: len(problem.free)] = calm.minimum.unknowns[: len(problem.free)]
    for i in range(len(problem.trials)):
        own, old = with_waves.own_slice(i), calm.minimum.unknowns[problem.own_slice(i)]
        start[own.start : own.start + len(old)] = old
    wavy = settled(with_waves, minimise(with_waves, start, calm.spreads))
    explained = all(
        new.slow**2 * new.slow_secs <= UNEXPLAINED * old.slow**2 * old.slow_secs
        for new, old in zip(wavy.noises, calm.noises, strict=True)
    )
    return wavy if explained else calm


def first_spreads(problem: Problem) -> list[Spread]:
    """Before anything is fitted: a tenth of what an output does is off."""
    stds = []
    for column, output in enumerate(problem.outputs):
        every = np.concatenate([problem.measured(i)[:, column] for i in range(len(problem.trials))])
        stds.append(max(float(np.nanstd(every)) / 10, LEAST_STD[output]))
    every_std = np.array(stds)
    return [
        Spread(np.tile(every_std, (len(trial), 1)), np.tile(every_std, (len(trial), 1)))
        for trial in problem.trials
    ]


def noise_left(
    problem: Problem, z: FloatArray, share: float = LEAST_SHARE
) -> tuple[list[Noise], list[Spread]]:
    """The noise of each output, and the spread of each trial's residuals; `share` as `noise_of`."""
    trials = range(len(problem.trials))
    levels = [problem.predicted(z, i) for i in trials]
    off = [problem.measured(i) - levels[i] for i in trials]
    noises = [
        noise_of(
            [Left.of(off[i][:, c], levels[i][:, c], problem.trials[i].dt_secs) for i in trials],
            proportional=output != "heading", least=LEAST_STD[output], share=share,
        )
        for c, output in enumerate(problem.outputs)
    ]  # fmt: skip
    return noises, [_spread(problem, i, noises, levels[i]) for i in trials]


def _spread(problem: Problem, i: int, noises: Sequence[Noise], level: FloatArray) -> Spread:
    """Of a trial whose predicted outputs are `level`, (n, c)."""
    measured, dt = problem.measured(i), problem.trials[i].dt_secs
    pairs = [
        noise.spread(level[:, c], interval_secs(measured[:, c], dt))
        for c, noise in enumerate(noises)
    ]
    return Spread(np.column_stack([p[0] for p in pairs]), np.column_stack([p[1] for p in pairs]))
