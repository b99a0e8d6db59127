"""The figures of a manoeuvre, measured and simulated, in a segment's units.

They count from the instant at which the rudder leaves its rest by `OFF_REST`, in the measured run
and in the simulated one alike: other rules change an advance by some per cent. Headings count from
their mean before it. Only zig-zags and circles have figures, and a run shows by its rudder and its
heading which it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import pi, radians

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal import savgol_filter

from analysis.identification.prediction import Turn, reached, turn
from analysis.identification.segment import Segment
from shiplog.types import FloatArray

OFF_REST = radians(0.5)
REST_SECS = 3.0  # of a run, over which the rudder's rest is what it mostly is
LEAST_RUDDER = 4 * OFF_REST  # what is less is no order
SPIKE_SECS = 3.0  # of the rudder: what is shorter is none of hers
CIRCLE = pi / 2  # turned to one side: less is no circle
SOON = CIRCLE / 2  # turned by then, a circle's rudder is where it stays
REVERSED = 0.5  # of the greatest rudder, passed on either side: a zig-zag,
HELD = 0.9  # in which so much of it is the rudder ordered, most of the time
ONE_ANGLE = radians(1.5), 0.1  # as near to it a rudder is the same, in rad or as a share
LIKE_SECS = 2.0  # beyond twice as long, a rudder's way over has been halted
USUAL_SWITCH, SWITCH = radians(5.0), radians(1.0)  # a zig-zag's heading is a multiple of one,
SWITCH_LATE = radians(2.0)  # by less than which she is reversed late,
SWITCH_OFF = radians(2.0)  # and by less than which all reversals are alike, but for noise
COURSE_SECS = 30.0  # before the rudder moves, over which the first course is a mean
SMOOTH = 1 / 6  # of the time a ship takes from side to side, before and after: a heading is smooth
MOST_OVERSHOOTS = 4
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
class ManoeuvreIndex:
    """A figure of a manoeuvre, SI."""

    name: str
    unit: str
    measured: float
    simulated: float

    @property
    def error(self) -> float:
        """Simulated less measured."""
        return self.simulated - self.measured


def first_execute(rudder: FloatArray, dt: float) -> int | None:
    """The last sample before the rudder first leaves its rest; None where it never does."""
    rest = float(np.median(rudder[: max(1, round(REST_SECS / dt))]))
    hard = np.flatnonzero(np.abs(rudder - rest) > LEAST_RUDDER)
    if not len(hard):
        return None
    resting = np.flatnonzero(np.abs(rudder[: hard[0] + 1] - rest) <= OFF_REST)
    return int(resting[-1]) if len(resting) else 0


def manoeuvre_indices(
    segment: Segment,
    measured: FloatArray,
    sailed: FloatArray,
    simulated: FloatArray,
    track: FloatArray,
) -> Iterator[ManoeuvreIndex]:
    """The figures of a circle or of a zig-zag; none of any other run, or where the ship ran away.

    Outputs are (n, 4), positions (n, 2) in m; measured ones must be known throughout.
    """
    dt = segment.dt_secs
    rudder = median_filter(segment.signals["rudder"], 1 + 2 * round(SPIKE_SECS / 2 / dt))
    order = first_execute(rudder, dt)
    if order is None or not np.isfinite(simulated).all():
        return
    holds = _holds(rudder, order)
    if _is_zigzag(rudder, order, holds, dt):
        yield from _zigzag(order, holds, (measured[:, 3], simulated[:, 3]), dt)
        return
    until, half = _turn_held(rudder, order, measured[:, 3])
    if until:
        yield from _circle(
            *(
                _turn(outputs[:until], positions[:until], rudder[:until], order, half, dt)
                for outputs, positions in ((measured, sailed), (simulated, track))
            )
        )


def _smoothed(heading: FloatArray, half: int) -> FloatArray:
    """By a parabola through so many samples before and after each: an extreme keeps its height."""
    return savgol_filter(heading, 1 + 2 * max(1, half), 2)


def _before(heading: FloatArray, order: int, dt: float) -> float:
    """The mean of a heading before the rudder moves."""
    return float(np.mean(heading[max(0, order - round(COURSE_SECS / dt)) : order + 1]))


def _near(values: FloatArray, angle: float) -> NDArray[np.bool_]:
    """Which of some rudders are one angle."""
    within, share = ONE_ANGLE
    return np.asarray(np.abs(values - angle) <= max(within, share * abs(angle)))


# ---- circles


def _turn_held(rudder: FloatArray, order: int, heading: FloatArray) -> tuple[int, int]:
    """Until which sample the rudder is held over in a circle, and how many make its heading smooth.

    Zeros where it is not held, at one angle and to one side, for `CIRCLE`.
    """
    turned = np.abs(heading[order:] - heading[order])
    if np.max(turned) < CIRCLE:
        return 0, 0
    rudder, quarter = rudder[order:], int(np.argmax(turned >= CIRCLE))
    angle = float(np.median(rudder[quarter // 2 : quarter + 1]))
    held = _near(rudder, angle)
    first = int(np.argmax(held))
    loose = first + np.flatnonzero(~held[first:])
    until = int(loose[0]) if len(loose) else len(rudder)
    way_over = rudder[: first + 1] * np.sign(angle)
    came_back = np.max(np.maximum.accumulate(way_over) - way_over) > LEAST_RUDDER
    if until <= quarter or turned[first] > SOON or came_back or abs(angle) < LEAST_RUDDER:
        return 0, 0
    return order + until, round(SMOOTH * quarter)


def _turn(
    outputs: FloatArray, positions: FloatArray, rudder: FloatArray, order: int, half: int, dt: float
) -> Turn:
    heading = _smoothed(outputs[:, 3], half)
    smooth = np.column_stack((outputs[:, :3], heading))[order:]
    return turn(smooth, positions[order:], rudder[order:], dt, course=_before(heading, order, dt))


def _circle(measured: Turn, simulated: Turn) -> Iterator[ManoeuvreIndex]:
    """The figures that were measured: none of a track that is not known where the turn began."""
    for each in fields(Turn):
        name, unit = FIGURES[each.name]
        figure = ManoeuvreIndex(
            name, unit, getattr(measured, each.name), getattr(simulated, each.name)
        )
        if np.isfinite(figure.measured):
            yield figure


# ---- zig-zags


def _holds(rudder: FloatArray, order: int) -> list[tuple[int, int]]:
    """From which sample to which the rudder is held over to one side, to the other, and so on."""
    size = np.abs(rudder)
    over = order + np.flatnonzero(size[order:] > REVERSED * np.max(size[order:]))
    sides = np.split(over, np.flatnonzero(np.diff(np.sign(rudder[over]))) + 1)
    return [_hold(size, side) for side in sides]


def _hold(size: FloatArray, over: NDArray[np.int64]) -> tuple[int, int]:
    held = over[size[over] > HELD * np.max(size[over])]
    angle = np.sort(size[held])[len(held) // 2]
    return int(held[0]), int(held[np.abs(size[held] - angle) <= OFF_REST][-1])


def _is_zigzag(rudder: FloatArray, order: int, holds: list[tuple[int, int]], dt: float) -> bool:
    """Whether it goes straight from one angle to the same on the other side, twice or more.

    The last hold may be cut short by the run's end.
    """
    parts = [np.abs(rudder[first : last + 1]) for first, last in holds]
    if len(parts) < 3:
        return False
    levels = np.array([np.median(part) for part in parts])
    angle = float(np.max(levels[:-1]) + np.min(levels[:-1])) / 2  # a rudder's zero may be off
    held = all(
        np.mean(_near(part, level)) > HELD for part, level in zip(parts, levels, strict=True)
    )
    ways = np.diff(np.array([order, *np.ravel(holds)]))[::2] * dt
    straight = np.max(ways) <= 2 * np.min(ways[1:]) + LIKE_SECS
    return bool(
        held and straight and np.all(_near(levels[:-1], angle)) and levels[-1] < angle / HELD
    )


def _zigzag(
    order: int, holds: list[tuple[int, int]], headings: tuple[FloatArray, FloatArray], dt: float
) -> Iterator[ManoeuvreIndex]:
    """Initial turning time, overshoots beyond the heading at which she is reversed, and period."""
    executes = [last for _, last in holds[:-1]]
    half = round(SMOOTH * float(np.min(np.diff(executes))))
    smooth = [_smoothed(heading, half) for heading in headings]
    both = [
        each - _before(heading, order, dt) for each, heading in zip(smooth, headings, strict=True)
    ]
    switch = _switch(both[0][executes], float(np.std(headings[0] - smooth[0])))
    if switch is None:
        return
    sides = np.sign(both[0][executes])
    reaches = [reached(sides[0] * off[order:], switch) * dt for off in both]
    yield ManoeuvreIndex("initial turning time", "s", *reaches)
    ends = [*executes[1:], holds[-1][1] + 1]
    spans = list(zip(sides, executes, ends, strict=True))[:MOST_OVERSHOOTS]
    for number, (side, start, end) in enumerate(spans):
        beyond = [_beyond(side * off[start:end], switch) for off in both]
        if all(np.isfinite(beyond)):
            yield ManoeuvreIndex(f"overshoot {number + 1}", "rad", *beyond)
    periods = [_period(off[order : ends[-1]], switch) * dt for off in both]
    if np.isfinite(periods[0]):
        yield ManoeuvreIndex("period", "s", *periods)


def _switch(there: FloatArray, noise: float) -> float | None:
    """The heading at which the rudder was to be reversed; None where there is not one.

    `there` is each heading at which it was. A rudder is late rather than early: the heading meant
    is the multiple of `USUAL_SWITCH` just passed, or else the nearest of `SWITCH`.
    """
    usual = float(np.median(np.abs(there)))
    switch = float(np.floor((usual + SWITCH) / USUAL_SWITCH) * USUAL_SWITCH)
    if switch == 0 or usual - switch > SWITCH_LATE:
        switch = float(np.round(usual / SWITCH) * SWITCH)
    by_turns = np.all(there[1:] * there[:-1] < 0)
    alike = np.all(np.abs(np.abs(there) - usual) < SWITCH_OFF + noise)
    return switch if switch and by_turns and alike else None


def _beyond(heading: FloatArray, switch: float) -> float:
    """How far a heading goes on beyond the switch; NaN where it has not come back by the end."""
    greatest = float(np.max(heading))
    return greatest - switch if heading[-1] < greatest - OFF_REST else np.nan


def _period(off: FloatArray, switch: float) -> float:
    """In samples, between like crossings of the first course; NaN with fewer than three in all.

    To cross it is to come from half the switch on one side to as much on the other: noise does not.
    """
    far = np.flatnonzero(np.abs(off) > switch / 2)
    side = np.sign(off[far])
    at = [
        far[k] + reached(-side[k] * off[far[k] : far[k + 1] + 1], 0.0)
        for k in np.flatnonzero(np.diff(side))
    ]
    return float(np.mean(np.subtract(at[2:], at[:-2]))) if len(at) > 2 else np.nan
