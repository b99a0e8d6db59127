"""A fit against runs it never saw: simulated open loop, in the units of a trial.

The ship begins as the run began, and then hears of nothing but rudder and revolutions. Figures
count from the instant at which the rudder leaves its rest by `OFF_REST`, in the measured run and in
the simulated one alike: other rules change an advance by some per cent.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import pi, radians

import numpy as np

from shiplog.ships.motion import OUTPUTS
from shiplog.types import FloatArray

from .output_error import OutputError
from .prediction import Turn, made_good, predict, turn
from .runs import Run
from .trial import Trial

OFF_REST = radians(0.5)
REST_SECS = 3.0  # of a run, over which the rudder's rest is what it mostly is
CIRCLE = pi / 2  # turned to one side: less is no circle
REVERSED = 0.5  # of the greatest rudder, passed on either side: a zig-zag,
HELD = 0.9  # in which so much of it is the rudder ordered
SWITCH = radians(1.0)  # a zig-zag's heading is a whole number of these
MOST_OVERSHOOTS = 4
FIXES_SECS = 5.0, 60.0  # of fixes before the rudder moves, at least and at most, tell a course
ASTRAY = 0.03  # of their length, off the way sailed: more is no course
FIGURES = {
    "advance": ("advance", "m"),
    "transfer": ("transfer", "m"),
    "tactical_diameter": ("tactical diameter", "m"),
    "time_90_secs": ("time to 90°", "s"),
    "time_180_secs": ("time to 180°", "s"),
    "steady_yaw_rate": ("steady yaw rate", "rad/s"),
    "steady_speed": ("steady speed", "m/s"),
}


@dataclass(frozen=True)
class Figure:
    """A figure of a manoeuvre, SI."""

    name: str
    unit: str
    measured: float
    simulated: float

    @property
    def error(self) -> float:
        """Simulated less measured."""
        return self.simulated - self.measured


@dataclass(frozen=True, eq=False)
class Validation:
    """A run, and what the fit says of it."""

    trial: Trial
    simulated: FloatArray  # (n, 4) in the order of OUTPUTS, NaN where the ship ran away
    track: FloatArray  # (n, 2) m north and east from the start, as simulated,
    measured_track: FloatArray  # and as measured: by the fixes, or else by speed and heading
    rms: dict[str, float]  # rad/s, m/s, rad, m: of each output measured, and of the track
    figures: tuple[Figure, ...]  # of a circle or of a zig-zag

    @property
    def ran_away(self) -> bool:
        """Whether the simulated ship did."""
        return not bool(np.isfinite(self.simulated).all())


def validate(fit: OutputError, run: Run) -> list[Validation]:
    """A fit against each piece of a run."""
    return [
        _validation(fit, trial, fixes)
        for trial, fixes in zip(run.trials, run.positions, strict=True)
    ]


def _validation(fit: OutputError, trial: Trial, fixes: FloatArray | None) -> Validation:
    course = 0.0 if fixes is None or trial.has("heading") else first_course(trial, fixes)
    if course is None:  # the fixes are north and east of a ship that headed nobody knows where
        course, fixes = 0.0, None
    measured = known_throughout(trial, course)
    simulated = predict(fit, _headed(trial, measured))
    track, sailed = made_good(simulated, trial.dt_secs), made_good(measured, trial.dt_secs)
    if fixes is not None:
        sailed = _from_first_fix(fixes, sailed if np.isnan(track).any() else track)
    off = simulated - trial.measured
    predicted = (*fit.problem.model.outputs, "heading")
    rms = {
        name: rms_of(off[:, i])
        for i, name in enumerate(OUTPUTS)
        if trial.has(name) and name in predicted
    }
    rms["track"] = rms_of(np.hypot(*(track - sailed).T))
    figures = tuple(_figures(trial, measured, sailed, simulated, track))
    return Validation(trial, simulated, track, sailed, rms, figures)


def known_throughout(trial: Trial, course: float = 0.0) -> FloatArray:
    """What was measured, its holes filled in.

    A heading nobody measured is the turning summed up, from the `course` she began on.
    """
    columns = [_filled_in(column) for column in trial.measured.T]
    if not trial.has("heading"):
        rate = columns[0]
        turned = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2)) * trial.dt_secs
        columns[3] = course + turned
    return np.column_stack(columns)


def _filled_in(values: FloatArray) -> FloatArray:
    at = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), at, values[at]) if len(at) > 1 else 0.0 * values


def first_course(trial: Trial, fixes: FloatArray) -> float | None:
    """The course a ship without heading began on, in rad: that which lays her way on the fixes.

    Only those before the rudder moves are looked at, for in a turn she drifts. None where they are
    too few, or where no course lays one on the other.
    """
    order = first_order(trial.signals["rudder"], trial.dt_secs)
    least, most = (round(secs / trial.dt_secs) for secs in FIXES_SECS)
    before = len(trial) if order is None else order + 1
    known = np.flatnonzero(np.isfinite(fixes[:before]).all(axis=1))[:most]
    if len(known) <= least:
        return None
    sailed = made_good(known_throughout(trial), trial.dt_secs)[known]
    way, seen = ((each - each.mean(axis=0)) @ [1, 1j] for each in (sailed, fixes[known]))
    course = float(np.angle(np.vdot(way, seen)))
    off = rms_of(np.abs(way * np.exp(1j * course) - seen))
    return course if off < ASTRAY * abs(way[-1] - way[0]) else None


def _headed(trial: Trial, measured: FloatArray) -> Trial:
    """The trial with a heading to begin with."""
    if trial.has("heading"):
        return trial
    given = trial.measured.copy()
    given[:, 3] = measured[:, 3]
    return Trial(trial.name, trial.signals, trial.path, given)


def _from_first_fix(fixes: FloatArray, track: FloatArray) -> FloatArray:
    """The fixes laid on a track at the first of them, which need not be where the run begins."""
    known = np.flatnonzero(np.isfinite(fixes).all(axis=1))
    return fixes - fixes[known[0]] + track[known[0]] if len(known) else fixes


def rms_of(off: FloatArray) -> float:
    """The root of the mean square of what is known; NaN where nothing is."""
    known = off[np.isfinite(off)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def _figures(
    trial: Trial,
    measured: FloatArray,
    sailed: FloatArray,
    simulated: FloatArray,
    track: FloatArray,
) -> Iterator[Figure]:
    rudder, dt = trial.signals["rudder"], trial.dt_secs
    order = first_order(rudder, dt)
    if order is None or not np.isfinite(simulated).all():
        return
    rudder = rudder[order:]
    turned = measured[order:, 3] - measured[order, 3]
    reverses = _reverses(rudder)
    if len(reverses) > 1:
        yield from _zigzag(reverses, measured[order:, 3], simulated[order:, 3], dt)
    elif np.max(np.abs(turned)) > CIRCLE:
        pair = [
            turn(outputs[order:], positions[order:], rudder, dt)
            for outputs, positions in ((measured, sailed), (simulated, track))
        ]
        yield from _circle(*pair)


def first_order(rudder: FloatArray, dt: float) -> int | None:
    """The last sample before the rudder first leaves its rest; None where it never does."""
    rest = float(np.median(rudder[: max(1, round(REST_SECS / dt))]))
    hard = np.flatnonzero(np.abs(rudder - rest) > 4 * OFF_REST)
    if not len(hard):
        return None
    resting = np.flatnonzero(np.abs(rudder[: hard[0] + 1] - rest) <= OFF_REST)
    return int(resting[-1]) if len(resting) else 0


def _circle(measured: Turn, simulated: Turn) -> Iterator[Figure]:
    """The figures that were measured: none of a track that is not known where the turn began."""
    for each in fields(Turn):
        name, unit = FIGURES[each.name]
        figure = Figure(name, unit, getattr(measured, each.name), getattr(simulated, each.name))
        if np.isfinite(figure.measured):
            yield figure


def _reverses(rudder: FloatArray) -> list[int]:
    """The samples at which the rudder was ordered over to the other side."""
    greatest = float(np.max(np.abs(rudder)))
    over = np.flatnonzero(np.abs(rudder) > REVERSED * greatest)
    sides = np.sign(rudder[over])
    held = np.flatnonzero(np.abs(rudder) > HELD * greatest)
    found = [held[held <= over[k]] for k in np.flatnonzero(np.diff(sides) != 0)]
    return [int(before[-1]) for before in found if len(before)]


def _zigzag(
    reverses: list[int], measured: FloatArray, simulated: FloatArray, dt: float
) -> Iterator[Figure]:
    """Overshoots beyond the heading at which the rudder is ordered over, and the period."""
    both = [heading - heading[0] for heading in (measured, simulated)]
    switch = _switch(both[0], reverses)
    ends = [*reverses[1:], len(measured)]
    for number, (start, end) in enumerate(zip(reverses, ends, strict=True)):
        if number == MOST_OVERSHOOTS:
            break
        side = float(np.sign(both[0][start]))
        beyond = [_beyond(side * heading[start:end], switch) for heading in both]
        if all(np.isfinite(beyond)):
            yield Figure(f"overshoot {number + 1}", "rad", *beyond)
    periods = [_period(heading) * dt for heading in both]
    if np.isfinite(periods[0]):
        yield Figure("period", "s", *periods)


def _switch(heading: FloatArray, reverses: list[int]) -> float:
    """The heading at which the rudder was ordered over, a whole number of `SWITCH`."""
    there = [abs(heading[k]) for k in reverses]
    return float(np.round(np.median(there) / SWITCH) * SWITCH)


def _beyond(heading: FloatArray, switch: float) -> float:
    """How far a heading goes on beyond the switch; NaN where it has not come back by the end."""
    k = int(np.argmax(heading))
    came_back = k < len(heading) - 1
    return float(heading[k]) - switch if came_back else np.nan


def _period(heading: FloatArray) -> float:
    """In samples, between like crossings of the first course; NaN with fewer than two."""
    signs = np.sign(heading)
    at = np.flatnonzero((signs[:-1] < 0) & (signs[1:] >= 0) | (signs[:-1] > 0) & (signs[1:] <= 0))
    away = [int(k) for k in at if np.max(np.abs(heading[: k + 1])) > OFF_REST]
    return float(np.mean(np.diff(away))) * 2 if len(away) > 1 else np.nan
