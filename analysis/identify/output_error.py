"""Output error: the parameters whose simulated runs come nearest to the runs recorded.

All trials at once, each with its own initial state, sensor biases and rudder offset. The noise is
found from what the fit leaves, and the fit repeated with it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from analysis.weak_form import LEAST_RUDDER
from shiplog.errors import LogError, UsageError
from shiplog.ships import Model
from shiplog.types import FloatArray

from .least_squares import Minimum, Spread, minimise
from .noise import Noise, noise_of, spreads_of
from .problem import Nuisance, Problem, residuals
from .start import starts
from .trial import Trial, usual
from .waves import frequency_of

USUAL_LENGTH = 150.0  # m, of a ship whose length nobody gave: its scale only
LEAST_SPEED, LEAST_RPM = 0.1, 1.0  # m/s, rpm
UNEXPLAINED = 0.2  # of what stays off: if a wave leaves more, it was none
ROUNDS = 3
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


def _require_way(trials: Sequence[Trial], speed: float, rpm: float) -> None:
    if not (speed > LEAST_SPEED and rpm > LEAST_RPM):
        names = ", ".join(trial.name for trial in trials)
        raise LogError(
            f"the ship begins with {speed:.2g} m/s at {rpm:.2g} rpm, and a model is of a ship "
            f"under way; give logs that begin on a steady run: {names}"
        )


def fit(problem: Problem, *, waves: bool = True) -> OutputError:
    """The fit, its noise found from what it leaves."""
    spreads = first_spreads(problem)
    tried = []
    for start in starts(problem, spreads):
        tried.append(minimise(problem, start, spreads))
        if tried[-1].settled:
            break
    minimum = min(tried, key=lambda each: each.cost)
    if not np.isfinite(minimum.cost):
        raise LogError(
            f"the model {problem.model.name} runs away on these trials from every start tried; "
            f"give --start or another model: {', '.join(t.name for t in problem.trials)}"
        )
    calm = _settled(problem, minimum)
    return _with_waves(calm) if waves else calm


def _settled(problem: Problem, minimum: Minimum) -> OutputError:
    """The fit and its noise, found in turn from a first fit."""
    for _ in range(ROUNDS):
        noises, spreads = noise_left(problem, minimum.unknowns)
        minimum = minimise(problem, minimum.unknowns, spreads, minimum.jacobians)
    return OutputError(problem, minimum, tuple(noises), tuple(spreads))


def _with_waves(calm: OutputError) -> OutputError:
    """The fit with a wave in each trial, where that explains all that stays off."""
    problem = calm.problem
    left = [np.asarray(r) for r in residuals(problem, calm.minimum.unknowns)]
    slow = [noise.slow for noise in calm.noises]
    found = [
        frequency_of(r, spread.usual, problem.trials[i].dt_secs, slow)
        for i, (r, spread) in enumerate(zip(left, calm.spreads, strict=True))
    ]
    waves = tuple((omega,) for omega in found if omega is not None)
    if len(waves) < len(found):
        return calm
    with_waves = replace(problem, waves=waves)
    start = with_waves.start()
    start[: len(problem.free)] = calm.minimum.unknowns[: len(problem.free)]
    for i in range(len(problem.trials)):
        own, old = with_waves.own_slice(i), calm.minimum.unknowns[problem.own_slice(i)]
        start[own.start : own.start + len(old)] = old
    wavy = _settled(with_waves, minimise(with_waves, start, calm.spreads))
    explained = all(
        new.slow**2 * new.slow_count <= UNEXPLAINED * old.slow**2 * old.slow_count
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


def noise_left(problem: Problem, z: FloatArray) -> tuple[list[Noise], list[Spread]]:
    """The noise of each output, and the spread of each trial's residuals."""
    count = range(len(problem.trials))
    levels = [problem.predicted(z, i) for i in count]
    left = [problem.measured(i) - levels[i] for i in count]
    noises = [
        noise_of(
            [r[:, c] for r in left], [y[:, c] for y in levels],
            proportional=output != "heading", least=LEAST_STD[output],
        )
        for c, output in enumerate(problem.outputs)
    ]  # fmt: skip
    return noises, spreads_of(noises, levels)
