"""The ship's way through a manoeuvre, and what pushes her off it.

The ship is integrated exactly between the knots of its forcing: a step ends where the rudder
arrives, where an order is given, and where the heading of a zig-zag calls for the next one.
"""

from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from shiplog import Vessel
from shiplog.compiled import compiled
from shiplog.errors import UsageError
from shiplog.ship import Coefficients, Forcing, State, rudder_effect, steady_speed, step
from shiplog.types import FloatArray, TimeArray

from .manoeuvres import Manoeuvre

GRID_SECS = 0.1  # the longest step; Runge-Kutta's error is then below 1e-10
INSTANT_SECS = 1e-9  # times closer than this are the same

# one row of a trajectory: the time, the state, and the forcing from there on
_TIME, _STATE, _INPUTS, _PUSHES = 0, slice(1, 7), slice(7, 10), slice(10, 14)
_ROW = 14


@dataclass(frozen=True)
class Gust:
    """A yaw moment that sets in and ceases, as large as so much rudder at the approach speed."""

    rudder: float  # rad
    start_secs: float
    duration_secs: float = inf


@dataclass(frozen=True)
class WaveMoment:
    """A sinusoidal yaw moment, its amplitude as large as so much rudder at the approach speed."""

    rudder: float  # rad
    period_secs: float


@dataclass(frozen=True)
class Unrest:
    """White noise that pushes the ship: gusts, and the sea below the waves' band.

    Each is the standard deviation of a mean over one second: that of a yaw moment as large as so
    much rudder at the approach speed, and that of a surge force.
    """

    rudder: float = 0.0  # rad
    force: float = 0.0  # m/s^2


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A voyage: rows at the grid and at every knot, (n, 14)."""

    coefficients: Coefficients
    rows: FloatArray
    has_unrest: bool = False

    def at(self, times_secs: FloatArray) -> dict[str, FloatArray]:
        """The truth at any times, (n,) each: integrated from the row before, not interpolated.

        With an unrest there is a `surge_disturbance`, too, in m/s^2.
        """
        found = acting = self._rows_before(times_secs)
        if self.has_unrest:  # the grid's 3 * 0.1 lies behind 0.3, where the next push is to be seen
            acting = self._rows_before(times_secs + INSTANT_SECS)
        states = _states_at(self.coefficients, self.rows, found, times_secs)
        delta, delta_dot, rpm = self.rows[found, _INPUTS].T
        moment, wave, frequency, force = self.rows[acting, _PUSHES].T
        truth = {
            "yaw_rate": states[:, 0],
            "yaw_acceleration": states[:, 1],
            "speed": states[:, 2],
            "heading": states[:, 3],
            "position": states[:, 4:6],
            "rudder": delta + delta_dot * (times_secs - self.rows[found, _TIME]),
            "rpm": rpm,
            "yaw_disturbance": moment + wave * np.sin(frequency * times_secs),
        }
        return truth | {"surge_disturbance": force} if self.has_unrest else truth

    def _rows_before(self, times_secs: FloatArray) -> TimeArray:
        return np.searchsorted(self.rows[:, _TIME], times_secs, side="right") - 1


def sail(
    vessel: Vessel,
    ordered: Manoeuvre,
    duration_secs: float,
    *,
    gusts: tuple[Gust, ...] = (),
    wave: WaveMoment | None = None,
    unrest: Unrest | None = None,
    rng: np.random.Generator | None = None,
) -> Trajectory:
    """The ship's way through a manoeuvre, free of any sensor's noise.

    `rng` draws the unrest. Raises `UsageError` for a ship that runs away.
    """
    c, rpm = vessel.coefficients, ordered.orders[0].rpm
    speed = ordered.initial_speed
    speed = steady_speed(c, rpm) if speed is None else speed
    per_rudder = c.d * rudder_effect(c, speed, rpm)  # a moment of so much rudder, rad/s^3
    waves = (per_rudder * wave.rudder, 2 * pi / wave.period_secs) if wave else (0.0, 0.0)
    zigzag = ordered.zigzag
    sailed = _sail(
        c,
        State(0.0, 0.0, speed, 0.0, 0.0, 0.0),
        _schedule(ordered, gusts, per_rudder),
        (zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (inf, 0.0, 0.0),
        waves,
        _unrest(unrest, duration_secs, per_rudder, rng or np.random.default_rng(0)),
        vessel.rudder_max,
        vessel.rudder_rate,
        duration_secs,
        GRID_SECS,
    )
    if not np.all(np.isfinite(sailed)):
        raise UsageError(
            f"{vessel.name} runs away in {ordered.name}: its model is unstable there; "
            "correct its coefficients or choose a gentler manoeuvre"
        )
    return Trajectory(c, sailed, unrest is not None)


def _unrest(
    unrest: Unrest | None, duration_secs: float, per_rudder: float, rng: np.random.Generator
) -> FloatArray:
    """The moment and the force of each step of the grid, the last for all that follow, (k, 2)."""
    if unrest is None:
        return np.full((1, 2), -0.0)  # added to any number, it leaves even the sign of a zero
    stds = np.array([per_rudder * unrest.rudder, unrest.force]) / sqrt(GRID_SECS)
    drawn: FloatArray = stds * rng.standard_normal((round(duration_secs / GRID_SECS) + 1, 2))
    return drawn


def _schedule(ordered: Manoeuvre, gusts: tuple[Gust, ...], per_rudder: float) -> FloatArray:
    """Rows of time, rudder ordered, rpm and moment, valid from that time on, (n, 4)."""
    edges = [edge for g in gusts for edge in (g.start_secs, g.start_secs + g.duration_secs)]
    times = sorted({order.time_secs for order in ordered.orders} | {e for e in edges if e < inf})
    rows = []
    for time in times:
        order = max(
            (o for o in ordered.orders if o.time_secs <= time), key=lambda order: order.time_secs
        )
        moment = sum(
            g.rudder for g in gusts if g.start_secs <= time < g.start_secs + g.duration_secs
        )
        rows.append((time, order.rudder, order.rpm, per_rudder * moment))
    return np.array(rows)


@compiled
def _sail(
    c: Coefficients,
    state: State,
    schedule: FloatArray,
    zigzag: tuple[float, float, float],
    waves: tuple[float, float],
    unrest: FloatArray,
    rudder_max: float,
    rudder_rate: float,
    duration: float,
    grid: float,
) -> FloatArray:
    zigzag_start, zigzag_rudder, zigzag_heading = zigzag
    rows = np.empty((int(duration / grid) + 64, _ROW))
    count, t, delta, at, grid_index = 0, 0.0, 0.0, 0, 0
    order = schedule[0, 1]
    while True:
        while at + 1 < len(schedule) and schedule[at + 1, 0] <= t:
            at += 1
            if t < zigzag_start:
                order = schedule[at, 1]
        if t >= zigzag_start and order == 0.0:
            order = zigzag_rudder
        while grid_index * grid <= t + INSTANT_SECS:
            grid_index += 1
        # what acts until the next knot
        delta, delta_dot, arrival = _steer(delta, order, t, rudder_max, rudder_rate)
        push, force = unrest[min(grid_index, len(unrest)) - 1]
        moment = schedule[at, 3] + push
        forcing = Forcing(delta, delta_dot, schedule[at, 2], moment, waves[0], waves[1], force)
        if count == len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[count, _TIME] = t
        rows[count, 1:7] = state
        rows[count, 7:14] = forcing
        count += 1
        if t >= duration:
            return rows[:count]
        end = min(grid_index * grid, duration, arrival)
        end = min(end, schedule[at + 1, 0] if at + 1 < len(schedule) else inf)
        end = min(end, zigzag_start if t < zigzag_start else inf)
        # a zig-zag turns the rudder at the very instant the heading is reached
        after = step(c, state, forcing, t, end - t)
        if t >= zigzag_start and after.heading * np.sign(order) >= zigzag_heading:
            end = t + _reaching(c, state, forcing, t, end - t, np.sign(order), zigzag_heading)
            after = step(c, state, forcing, t, end - t)
            order = -order
        delta += delta_dot * (end - t)
        state, t = after, end


@compiled
def _steer(
    delta: float, order: float, t: float, largest: float, rate: float
) -> tuple[float, float, float]:
    """Where the rudder is, how fast it moves, and when it arrives: never, if it is there."""
    aim = min(max(order, -largest), largest)
    arrival = t + abs(aim - delta) / rate
    if arrival > t + 1e-12:
        return delta, np.sign(aim - delta) * rate, arrival
    return aim, 0.0, inf


@compiled
def _reaching(
    c: Coefficients,
    state: State,
    forcing: Forcing,
    t: float,
    within: float,
    side: float,
    heading: float,
) -> float:
    """After how long, at most `within`, the heading is reached on that side: by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        if step(c, state, forcing, t, middle).heading * side >= heading:
            high = middle
        else:
            low = middle
    return high


@compiled
def _states_at(
    c: Coefficients, rows: FloatArray, found: TimeArray, times: FloatArray
) -> FloatArray:
    states = np.empty((len(times), 6))
    for i in range(len(times)):
        row = rows[found[i]]
        state = State(row[1], row[2], row[3], row[4], row[5], row[6])
        forcing = Forcing(row[7], row[8], row[9], row[10], row[11], row[12], row[13])
        states[i] = step(c, state, forcing, row[0], times[i] - row[0])
    return states
