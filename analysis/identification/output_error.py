"""Output error: the parameters whose simulated runs come nearest to the runs recorded.

All segments at once, each with its own initial state, sensor biases and rudder offset. The noise is
found from what the fit leaves, and the fit repeated with it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from analysis.regression.weak_form import LEAST_RUDDER
from shiplog.errors import LogError, UsageError
from shiplog.ships import Model
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .initial_guess import initial_guesses
from .least_squares import Minimum, ResidualStd, minimise
from .problem import Nuisance, Problem, residuals
from .residual_noise import (
    FINEST_SHARE,
    LEAST_SHARE,
    OutputResiduals,
    ResidualNoise,
    fit_residual_noise,
    interval_secs,
)
from .segment import Segment, initial_level
from .swell import swell_frequency

USUAL_LENGTH = 150.0  # m, of a ship whose length nobody gave: its scale only
LEAST_SPEED, LEAST_RPM = 0.1, 1.0  # m/s, rpm
UNEXPLAINED = 0.2  # of what stays off: if a wave leaves more, it was none
ROUNDS = 3
GIVEN_UP = 1.5  # times what an output was off: noise that lets it grow so explains it away
MIN_STDS = {  # of what any instrument is off
    "yaw_rate": radians(1e-5), "speed": 1e-4, "sway": 1e-4, "heading": radians(0.02)
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class OutputError:
    """A fit."""

    problem: Problem
    minimum: Minimum
    noises: tuple[ResidualNoise, ...]  # of each output
    residual_stds: tuple[ResidualStd, ...]  # of each segment

    @property
    def parameters(self) -> FloatArray:
        """(p,) all the model's parameters."""
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

    `known` parameters keep the value given, those of `free` are sought though the model takes them
    for known; `start` is where the others begin.
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
    """The problem of fitting a model to segments, as `output_error` has it."""
    if not segments:
        raise UsageError("no segment to identify from; give at least one log")
    _require_steering(segments)
    _require_turning(segments)
    values = model.start_values()
    for name, value in {**(start or {}), **(fixed or {})}.items():
        values[model.names.index(model.parameter(name).name)] = value
    sought = {model.parameter(name).name for name in free}
    sought |= {p.name for p in model.parameters if not p.fixed}
    sought -= set(fixed or {})
    speed, rpm = initial_level(segments, "speed"), initial_level(segments, "rpm")
    _require_way(segments, speed, rpm)
    scale = model.scale(length or USUAL_LENGTH, speed, rpm)
    used = [o for o in (outputs or model.outputs) if any(segment.has(o) for segment in segments)]
    return Problem(
        model, tuple(segments), scale, tuple(used), values,
        tuple(i for i, name in enumerate(model.names) if name in sought),
        Nuisance() if nuisance is None else nuisance,
    )  # fmt: skip


def _require_steering(segments: Sequence[Segment]) -> None:
    moved = max(float(np.ptp(segment.signals["rudder"])) for segment in segments)
    if moved < LEAST_RUDDER:
        names = ", ".join(segment.name for segment in segments)
        raise LogError(
            f"the rudder moves by {np.degrees(moved):.1f}° in all, and from that nothing can be "
            f"identified; give a log of a zig-zag or of a turning circle: {names}"
        )


def _require_turning(segments: Sequence[Segment]) -> None:
    column = MODEL_OUTPUTS.index("yaw_rate")
    if not any(
        segment.has("yaw_rate") and np.nanstd(segment.measured[:, column]) > 0
        for segment in segments
    ):
        names = ", ".join(segment.name for segment in segments)
        raise LogError(
            f"the yaw rate never changes, and from that nothing can be identified; is the gyro "
            f"stuck? {names}"
        )


def _require_way(segments: Sequence[Segment], speed: float, rpm: float) -> None:
    if not (speed > LEAST_SPEED and rpm > LEAST_RPM):
        names = ", ".join(segment.name for segment in segments)
        raise LogError(
            f"the ship begins with {speed:.2g} m/s at {rpm:.2g} rpm, and a model is of a ship "
            f"under way; give logs that begin on a steady run: {names}"
        )


def fit_problem(
    problem: Problem, *, start: FloatArray | None = None, waves: bool = True
) -> OutputError:
    """The fit, its noise found from what it leaves; `start` is another beginning of the search."""
    residual_stds = initial_residual_stds(problem)
    tried = []
    for begin in [start] if start is not None else initial_guesses(problem, residual_stds):
        tried.append(minimise(problem, begin, residual_stds))
        if tried[-1].converged:
            break
    minimum = min(tried, key=lambda each: each.cost)
    if not np.isfinite(minimum.cost):
        raise LogError(
            f"the model {problem.model.name} runs away on these segments from every start tried; "
            f"look at their signs and units, or fit another model: "
            f"{', '.join(dict.fromkeys(t.name for t in problem.segments))}"
        )
    calm = reweighted_fit(problem, minimum)
    return _refined(_with_waves(calm) if waves else calm)


def reweighted_fit(problem: Problem, minimum: Minimum, share: float = LEAST_SHARE) -> OutputError:
    """The fit and its noise, found in turn from a first fit.

    ResidualNoise is found from what a fit leaves, and tells the next fit what to leave: where runs
    contradict each other an output could so be given up to please another. There it ends before.
    """
    noises, residual_stds = estimate_noise(problem, minimum.unknowns, share)
    off = _rms_left(problem, minimum)
    for _ in range(ROUNDS):
        after = minimise(problem, minimum.unknowns, residual_stds, minimum.jacobians)
        if (_rms_left(problem, after) > GIVEN_UP * off).any():
            break
        minimum = after
        noises, residual_stds = estimate_noise(problem, minimum.unknowns, share)
    return OutputError(problem, minimum, tuple(noises), tuple(residual_stds))


def _refined(found: OutputError) -> OutputError:
    """The fit with the quietest samples believed as far as they are quiet.

    An instrument whose noise is in proportion says most when it says least; but where something
    stays off, it is no noise of the instrument's.
    """
    fine = reweighted_fit(found.problem, found.minimum, FINEST_SHARE)
    stays = any(new.slow > old.slow for new, old in zip(fine.noises, found.noises, strict=True))
    return found if stays else fine


def _rms_left(problem: Problem, minimum: Minimum) -> FloatArray:
    """(c,) of each output over all segments."""
    left = np.concatenate(residuals(problem, minimum.unknowns))
    known = np.isfinite(left).sum(axis=0)
    return np.asarray(np.sqrt(np.nansum(left**2, axis=0) / np.maximum(known, 1)))


def _with_waves(calm: OutputError) -> OutputError:
    """The fit with a wave in each segment that has one, where they explain all that stays off."""
    problem = calm.problem
    left = residuals(problem, calm.minimum.unknowns)
    slow = [noise.slow for noise in calm.noises]
    found = [
        swell_frequency(r, spread.typical, problem.segments[i].dt_secs, slow)
        for i, (r, spread) in enumerate(zip(left, calm.residual_stds, strict=True))
    ]
    if not any(found):
        return calm
    waves = tuple(() if omega is None else (omega,) for omega in found)
    with_waves = replace(problem, waves=waves)
    start = with_waves.start()
    start[: len(problem.free)] = calm.minimum.unknowns[: len(problem.free)]
    for i in range(len(problem.segments)):
        own, old = with_waves.own_slice(i), calm.minimum.unknowns[problem.own_slice(i)]
        start[own.start : own.start + len(old)] = old
    wavy = reweighted_fit(with_waves, minimise(with_waves, start, calm.residual_stds))
    explained = all(
        new.slow**2 * new.slow_secs <= UNEXPLAINED * old.slow**2 * old.slow_secs
        for new, old in zip(wavy.noises, calm.noises, strict=True)
    )
    return wavy if explained else calm


def initial_residual_stds(problem: Problem) -> list[ResidualStd]:
    """Before anything is fitted: a tenth of what an output does is off."""
    stds = []
    for column, output in enumerate(problem.outputs):
        every = np.concatenate(
            [problem.measured(i)[:, column] for i in range(len(problem.segments))]
        )
        stds.append(max(float(np.nanstd(every)) / 10, MIN_STDS[output]))
    every_std = np.array(stds)
    return [
        ResidualStd(np.tile(every_std, (len(segment), 1)), np.tile(every_std, (len(segment), 1)))
        for segment in problem.segments
    ]


def estimate_noise(
    problem: Problem, z: FloatArray, share: float = LEAST_SHARE
) -> tuple[list[ResidualNoise], list[ResidualStd]]:
    """The noise of each output, and each segment's residual stds; `share` as `noise_of`."""
    segments = range(len(problem.segments))
    levels = [problem.predicted(z, i) for i in segments]
    off = [problem.measured(i) - levels[i] for i in segments]
    noises = [
        fit_residual_noise(
            [
                OutputResiduals.of(off[i][:, c], levels[i][:, c], problem.segments[i].dt_secs)
                for i in segments
            ],
            proportional=output != "heading", least=MIN_STDS[output], share=share,
        )
        for c, output in enumerate(problem.outputs)
    ]  # fmt: skip
    return noises, [_spread(problem, i, noises, levels[i]) for i in segments]


def _spread(
    problem: Problem, i: int, noises: Sequence[ResidualNoise], level: FloatArray
) -> ResidualStd:
    """Of a segment whose predicted outputs are `level`, (n, c)."""
    measured, dt = problem.measured(i), problem.segments[i].dt_secs
    pairs = [
        noise.stds(level[:, c], interval_secs(measured[:, c], dt)) for c, noise in enumerate(noises)
    ]
    return ResidualStd(
        np.column_stack([p[0] for p in pairs]), np.column_stack([p[1] for p in pairs])
    )
