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
from shiplog.ships.under_way import (
    CoefficientTuple,
    Excitation,
    Ship,
    ShipConstants,
    observed_real,
    outputs_si,
    runge_kutta_step,
    write_rates_si,
)
from shiplog.types import FloatArray, TimeArray
from shiplog.vessel.ship import ship_from_vessel

from .manoeuvres import Manoeuvre

GRID_SECS = 0.1  # the longest step; Runge-Kutta's error is then below 1e-10
INSTANT_SECS = 1e-9  # times closer than this are the same

# one row of a trajectory: the time, the state, and from -7 on what acts from there on
_TIME, _ACTING, _INPUTS, _PUSHES = 0, 7, slice(-7, -4), slice(-4, None)


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
class RandomForcing:
    """White noise that pushes the ship: gusts, and the sea below the waves' band.

    Each is the standard deviation of a mean over one second: that of a yaw moment as large as so
    much rudder at the approach speed, and that of a surge force.
    """

    rudder: float = 0.0  # rad
    force: float = 0.0  # m/s^2


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A voyage: rows at the grid and at every knot, (n, s + 10)."""

    ship: Ship
    constants: ShipConstants
    rows: FloatArray
    has_random_forcing: bool = False

    def at(self, times_secs: FloatArray) -> dict[str, FloatArray]:
        """The truth at any times, (n,) each: integrated from the row before, not interpolated.

        With an random_forcing there is a `surge_disturbance`, too, in m/s^2.
        """
        found = acting = self._rows_before(times_secs)
        if (
            self.has_random_forcing
        ):  # the grid's 3 * 0.1 lies behind 0.3, where the next push is to be seen
            acting = self._rows_before(times_secs + INSTANT_SECS)
        states = _told_at(
            self.ship.coefficients,
            self.constants,
            self.rows,
            found,
            acting,
            times_secs,
            self.ship.yaw,
        )
        delta, delta_dot, rpm = self.rows[found, _INPUTS].T
        moment, wave, frequency, force = self.rows[acting, _PUSHES].T
        per_rudder, _ = self.ship.moment_per_rudder(self.constants)
        truth = {
            "yaw_rate": states[:, 0],
            "yaw_acceleration": states[:, 1],
            "speed": states[:, 2],
            "sway": states[:, 3],
            "heading": states[:, 4],
            "position": states[:, 5:7],
            "rudder": delta + delta_dot * (times_secs - self.rows[found, _TIME]),
            "rpm": rpm,
            "yaw_disturbance": per_rudder * (moment + wave * np.sin(frequency * times_secs)),
        }
        return truth | {"surge_disturbance": force} if self.has_random_forcing else truth

    def _rows_before(self, times_secs: FloatArray) -> TimeArray:
        return np.searchsorted(self.rows[:, _TIME], times_secs, side="right") - 1


def compute_trajectory(
    vessel: Vessel,
    ordered: Manoeuvre,
    duration_secs: float,
    *,
    gusts: tuple[Gust, ...] = (),
    wave: WaveMoment | None = None,
    random_forcing: RandomForcing | None = None,
    rng: np.random.Generator | None = None,
) -> Trajectory:
    """The ship's way through a manoeuvre, free of any sensor's noise.

    `rng` draws the random_forcing. Raises `UsageError` for a ship that runs away, or has no steady
    speed to begin with.
    """
    ship, rpm = ship_from_vessel(vessel), ordered.orders[0].rpm
    speed = ordered.initial_speed
    speed = ship.steady_speed(rpm) if speed is None else speed
    if ship.model.dimensionless and not speed > 0:
        raise UsageError(
            f"{vessel.name} finds no steady speed at {rpm:g} rpm, for nothing holds her back or "
            "nothing drives her; correct her model's surge or choose other revolutions"
        )
    constants, zigzag = ship.constants(speed, rpm), ordered.zigzag
    sailed = _sail(
        ship.coefficients,
        constants,
        ship.straight_state(speed),
        _schedule(ordered, gusts),
        (zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (inf, 0.0, 0.0),
        (wave.rudder, 2 * pi / wave.period_secs) if wave else (0.0, 0.0),
        _random_forcing(random_forcing, duration_secs, rng or np.random.default_rng(0)),
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
    return Trajectory(ship, constants, sailed, random_forcing is not None)


def _random_forcing(
    random_forcing: RandomForcing | None, duration_secs: float, rng: np.random.Generator
) -> FloatArray:
    """The moment and the force of each step of the grid, the last for all that follow, (k, 2)."""
    if random_forcing is None:
        return np.full((1, 2), -0.0)  # added to any number, it leaves even the sign of a zero
    stds = np.array([random_forcing.rudder, random_forcing.force]) / sqrt(GRID_SECS)
    drawn: FloatArray = stds * rng.standard_normal((round(duration_secs / GRID_SECS) + 1, 2))
    return drawn


def _schedule(ordered: Manoeuvre, gusts: tuple[Gust, ...]) -> FloatArray:
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
        rows.append((time, order.rudder, order.rpm, moment))
    return np.array(rows)


@compiled
def _sail(
    c: CoefficientTuple,
    constants: ShipConstants,
    state: FloatArray,
    schedule: FloatArray,
    zigzag: tuple[float, float, float],
    waves: tuple[float, float],
    random_forcing: FloatArray,
    rudder_max: float,
    rudder_rate: float,
    duration: float,
    grid: float,
) -> FloatArray:
    zigzag_start, zigzag_rudder, zigzag_heading = zigzag
    rows = np.empty((int(duration / grid) + 64, 1 + len(state) + _ACTING))
    work, own = np.empty((3, len(state))), 1 + len(state)
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
        push, force = random_forcing[min(grid_index, len(random_forcing)) - 1]
        moment = schedule[at, 3] + push
        acting = Excitation(delta, delta_dot, schedule[at, 2], moment, waves[0], waves[1], force)
        if count == len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[count, _TIME] = t
        rows[count, 1:own] = state
        rows[count, own:] = acting
        count += 1
        if t >= duration:
            return rows[:count]
        end = min(grid_index * grid, duration, arrival)
        end = min(end, schedule[at + 1, 0] if at + 1 < len(schedule) else inf)
        end = min(end, zigzag_start if t < zigzag_start else inf)
        # a zig-zag turns the rudder at the very instant the heading is reached
        side, within = np.sign(order), end - t
        after = runge_kutta_step(c, constants, state, acting, t, within, work)
        if t >= zigzag_start and observed_real(c, after)[3] * side >= zigzag_heading:
            end = t + _reaching(c, constants, state, acting, t, within, side, zigzag_heading, work)
            after = runge_kutta_step(c, constants, state, acting, t, end - t, work)
            order = -order
        delta += delta_dot * (end - t)
        state[:] = after
        t = end


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
    c: CoefficientTuple,
    constants: ShipConstants,
    state: FloatArray,
    acting: Excitation,
    t: float,
    within: float,
    side: float,
    heading: float,
    work: FloatArray,
) -> float:
    """After how long, at most `within`, the heading is reached on that side: by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        if (
            observed_real(c, runge_kutta_step(c, constants, state, acting, t, middle, work))[3]
            * side
            >= heading
        ):
            high = middle
        else:
            low = middle
    return high


@compiled
def _told_at(
    c: CoefficientTuple,
    constants: ShipConstants,
    rows: FloatArray,
    found: TimeArray,
    acting: TimeArray,
    times: FloatArray,
    yaw: int,
) -> FloatArray:
    """What `told` says at the times, (n, 7), from the rows before them and what acts then."""
    out, own = np.empty((len(times), 7)), rows.shape[1] - _ACTING
    work, rates = np.empty((3, own - 1)), np.empty(own - 1)
    for i in range(len(times)):
        row, then = rows[found[i]], rows[acting[i]]
        state = runge_kutta_step(
            c, constants, row[1:own], _acting(row[own:]), row[0], times[i] - row[0], work
        )
        write_rates_si(c, constants, state, _acting(then[own:]), then[0], times[i] - then[0], rates)
        out[i] = outputs_si(c, constants, state, rates, yaw)
    return out


@compiled
def _acting(row: FloatArray) -> Excitation:
    return Excitation(row[0], row[1], row[2], row[3], row[4], row[5], row[6])
