"""What a fit says of a run it never saw."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.path import input_path
from shiplog.types import FloatArray, Signals

from .least_squares import minimise
from .output_error import OutputError, initial_residual_stds
from .segment import Segment

SCORED_OUTPUTS = ("yaw_rate", "speed", "heading")  # every model predicts them
ZIGZAG_STEP_SECS = 0.5
HARD_OVER = 0.8  # of the greatest rudder of a run: there it is held over


@dataclass(frozen=True)
class Turn:
    """A turning circle: metres, seconds, rad/s and m/s; NaN for what was not reached."""

    advance: float  # along the first course, at 90 degrees of heading
    transfer: float  # across it, at 90 degrees
    tactical_diameter: float  # across it, at 180 degrees
    time_90_secs: float
    time_180_secs: float
    steady_yaw_rate: float  # its size, over the latter half of the rudder held over
    steady_speed: float  # through the water, there


def predict(fit: OutputError, segment: Segment) -> FloatArray:
    """A fit's open-loop run under a segment's rudder and revolutions, (n, 4), SI.

    It begins as the segment began; nothing else of what was measured is used.
    """
    problem = replace(fit.problem, segments=(segment,), waves=())
    state = problem.start()[len(problem.free) :][: len(problem.model.state)]
    return problem.model.simulate(
        fit.parameters, state, segment.path, len(segment), scale=problem.scale
    )


def misfit(fit: OutputError, segment: Segment) -> FloatArray:
    """How far a fit is off a segment it never saw, (4,): rms over the std of what was measured.

    The segment's own unknowns are fitted to it, the parameters are not: no rudder's zero and no
    sensor's bias of one run is known from another. `SCORED_OUTPUTS` hold for every model,
    fitted to them or not. NaN for what was not measured or the model does not predict; inf
    where the ship runs away.
    """
    whole = fit.problem
    judged = tuple(
        o for o in MODEL_OUTPUTS if o in (*whole.outputs, *SCORED_OUTPUTS) and segment.has(o)
    )
    problem = replace(
        whole, segments=(segment,), outputs=judged, values=fit.parameters, free=(), waves=()
    )
    minimum = minimise(problem, problem.start(), initial_residual_stds(problem))
    found = np.full(len(MODEL_OUTPUTS), np.nan)
    off = problem.measured(0) - problem.predicted(minimum.unknowns, 0)
    for at, column in enumerate(problem.columns):
        known = np.isfinite(problem.measured(0)[:, at])
        if known.sum() > 1:
            size = float(np.std(problem.measured(0)[known, at]))
            rms = float(np.sqrt(np.mean(off[known, at] ** 2)))
            found[column] = rms / size if np.isfinite(rms) else np.inf
    return found


def dead_reckoning(outputs: FloatArray, dt: float) -> FloatArray:
    """North and east, (n, 2) in m from the first sample, of outputs that are known throughout."""
    _, ahead, sway, heading = outputs.T
    sway = np.nan_to_num(sway)
    north = ahead * np.cos(heading) - sway * np.sin(heading)
    east = ahead * np.sin(heading) + sway * np.cos(heading)
    rates = np.column_stack((north, east))
    steps = (rates[1:] + rates[:-1]) / 2 * dt
    return np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))


def turn(
    outputs: FloatArray, positions: FloatArray, rudder: FloatArray, dt: float, *,
    course: float | None = None,
) -> Turn:  # fmt: skip
    """The figures of a turning circle that begins with the first sample.

    `outputs` are (n, 4), `positions` (n, 2) in m, `rudder` (n,); `course`, in rad, is the first
    one where a single sample of the heading is too noisy for it. Source: IMO MSC.137(76).
    """
    over = np.flatnonzero(np.abs(rudder) > HARD_OVER * np.max(np.abs(rudder)))
    side = float(np.sign(np.median(rudder[over])))
    held = over[len(over) // 2 :]
    heading = outputs[:, 3]
    begun = float(heading[0]) if course is None else course
    turned = side * (heading - begun)
    first = np.array([np.cos(begun), np.sin(begun)])
    across = side * np.array([-first[1], first[0]])
    off = positions - positions[0]
    at_90, at_180 = reached(turned, pi / 2), reached(turned, pi)
    index = np.arange(len(turned))
    along, aside = off @ first, off @ across
    speed = np.hypot(outputs[:, 1], np.nan_to_num(outputs[:, 2]))
    return Turn(
        float(np.interp(at_90, index, along)) if np.isfinite(at_90) else np.nan,
        float(np.interp(at_90, index, aside)) if np.isfinite(at_90) else np.nan,
        float(np.interp(at_180, index, aside)) if np.isfinite(at_180) else np.nan,
        at_90 * dt,
        at_180 * dt,
        float(np.abs(np.median(outputs[held, 0]))),
        float(np.median(speed[held])),
    )


def reached(turned: FloatArray, angle: float) -> float:
    """The index, with its fraction, at which an angle is first reached; NaN if it never is."""
    beyond = np.flatnonzero(turned >= angle)
    if not len(beyond) or beyond[0] == 0:
        return np.nan
    k = int(beyond[0])
    return k - 1 + float((angle - turned[k - 1]) / (turned[k] - turned[k - 1]))


def zigzag_overshoots(
    fit: OutputError, rudder: float, heading: float, *,
    rudder_rate: float, speed: float, rpm: float, duration_secs: float,
) -> FloatArray:  # fmt: skip
    """The overshoots of a zig-zag that a fitted ship is steered through, (k,) rad.

    The rudder goes to `rudder`, the first time to the side of its sign, and is reversed whenever
    the heading is `heading` off, all in rad; an overshoot is how much further it goes. The ship
    begins straight ahead at `speed`. Only those are told that she came back from.
    """
    problem = fit.problem
    state = np.zeros(len(problem.model.state))
    for i, value in enumerate(problem.model.state):
        if value.channel == "speed":
            state[i] = speed / problem.scale.speed
    time = np.arange(0, duration_secs, ZIGZAG_STEP_SECS)
    times, angles = [0.0, abs(rudder) / rudder_rate], [0.0, rudder]
    executes: list[int] = []
    while True:
        # the ship does not know of orders yet to come: each is found by sailing without it
        held = {"rudder": np.interp(time, times, angles), "rpm": np.full(len(time), rpm)}
        path = input_path(Signals(0, ZIGZAG_STEP_SECS, held))
        out = problem.model.simulate(fit.parameters, state, path, len(time), scale=problem.scale)
        side = np.sign(angles[-1])
        off = side * out[:, 3] - abs(heading)
        since = executes[-1] if executes else 0
        beyond = since + np.flatnonzero(off[since:] >= 0)
        if not len(beyond) or not np.isfinite(off).all():
            return _overshoots(out[:, 3], executes, abs(heading))
        k = int(beyond[0])
        executes.append(k)
        at = time[k - 1] + ZIGZAG_STEP_SECS * float(off[k - 1] / (off[k - 1] - off[k]))
        there, ordered = float(np.interp(at, times, angles)), float(-side) * abs(rudder)
        past = [t for t in times if t < at]
        angles = [*angles[: len(past)], there, ordered]
        times = [*past, at, at + abs(ordered - there) / rudder_rate]


def _overshoots(heading: FloatArray, executes: Sequence[int], switch: float) -> FloatArray:
    """By how much the heading goes on after each execute, but for the last."""
    ends = executes[1:]
    return np.array(
        [
            float(np.max(np.abs(heading[start:end]))) - switch
            for start, end in zip(executes, ends, strict=False)
        ]
    )
