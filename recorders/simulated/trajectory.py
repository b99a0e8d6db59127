"""The simulated motion of a ship through a manoeuvre, with its disturbances.

Integration steps end at the knots of the inputs: where the rudder arrives at its order, where an
order is given, and where the heading of a zig-zag triggers the next one.
"""

from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import NamedTuple

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

MAX_STEP_SECS = 0.1  # Runge-Kutta's error is then below 1e-10
INSTANT_SECS = 1e-9  # times closer than this are the same

# one row of a trajectory: the time, the state, and the excitation from there on
_TIME, _EXCITATION, _INPUTS, _DISTURBANCES = 0, 7, slice(-7, -4), slice(-4, None)


@dataclass(frozen=True)
class Gust:
    """A constant yaw moment over some time.

    Attributes
    ----------
    rudder
        Its size, as the rudder that turns the ship as much at the approach speed, rad.
    start_secs, duration_secs
        When it begins and how long it lasts, s.
    """

    rudder: float
    start_secs: float
    duration_secs: float = inf


@dataclass(frozen=True)
class WaveMoment:
    """A sinusoidal yaw moment.

    Attributes
    ----------
    rudder
        Its amplitude, as the rudder that turns the ship as much at the approach speed, rad.
    period_secs
        Its period, s.
    """

    rudder: float
    period_secs: float


@dataclass(frozen=True)
class RandomForcing:
    """White noise in the yaw moment and the surge force, such as of wind and of the sea.

    Attributes
    ----------
    rudder
        The standard deviation of the yaw moment's mean over one second, as the rudder that turns
        the ship as much at the approach speed, rad.
    force
        The standard deviation of the surge force's mean over one second, m/s².
    """

    rudder: float = 0.0
    force: float = 0.0


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The motion of a ship at every integration step.

    Attributes
    ----------
    ship
        The ship that moves.
    constants
        What compiled code needs of it.
    rows
        (n, s + 10) the time, the state with the position, and the excitation, a row for each step.
    has_random_forcing
        Whether a random forcing acts.
    """

    ship: Ship
    constants: ShipConstants
    rows: FloatArray
    has_random_forcing: bool = False

    def at(self, times_secs: FloatArray) -> dict[str, FloatArray]:
        """Compute the true motion at any times, integrated from the step before.

        Parameters
        ----------
        times_secs
            (n,) times from the start, s.

        Returns
        -------
        dict
            By name, in SI: yaw_rate, yaw_acceleration, speed, sway, heading, rudder, rpm and
            yaw_disturbance, (n,) each; position, (n, 2), north and east; with a random forcing also
            surge_disturbance, (n,), in m/s².
        """
        before = acting = self._rows_before(times_secs)
        if self.has_random_forcing:
            # 3 * 0.1 > 0.3: at 0.3 s the forcing is that of the step that starts there
            acting = self._rows_before(times_secs + INSTANT_SECS)
        outputs = _outputs_at(
            self.ship.coefficients,
            self.constants,
            self.rows,
            before,
            acting,
            times_secs,
            self.ship.yaw,
        )
        delta, delta_dot, rpm = self.rows[before, _INPUTS].T
        moment, wave, frequency, force = self.rows[acting, _DISTURBANCES].T
        per_rudder, _ = self.ship.moment_per_rudder(self.constants)
        truth = {
            "yaw_rate": outputs[:, 0],
            "yaw_acceleration": outputs[:, 1],
            "speed": outputs[:, 2],
            "sway": outputs[:, 3],
            "heading": outputs[:, 4],
            "position": outputs[:, 5:7],
            "rudder": delta + delta_dot * (times_secs - self.rows[before, _TIME]),
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
    """Compute the true motion of a ship through a manoeuvre.

    Parameters
    ----------
    vessel
        The ship, its steering gear and its model.
    ordered
        The manoeuvre.
    duration_secs
        The length of the run, s.
    gusts, wave, random_forcing
        The disturbances.
    rng
        Draws the random forcing; seeded with 0 by default.

    Raises
    ------
    UsageError
        The model diverges in this manoeuvre, or has no steady speed to start from.

    Examples
    --------
    >>> from recorders.simulated.manoeuvres import manoeuvre
    >>> from shiplog import load_vessel
    >>> vessel = load_vessel("table1")[0]
    >>> trajectory = compute_trajectory(vessel, manoeuvre("turning-circle", 60.0, 80.0), 60.0)
    >>> trajectory.at(np.array([60.0]))["speed"].round(2).tolist()
    [9.88]
    """
    ship, rpm = ship_from_vessel(vessel), ordered.orders[0].rpm
    speed = ordered.initial_speed
    speed = ship.steady_speed(rpm) if speed is None else speed
    if ship.model.dimensionless and not speed > 0:
        raise UsageError(
            f"{vessel.name} has no steady speed at {rpm:g} rpm: its resistance or its thrust is "
            "zero or has the wrong sign; correct the surge coefficients or choose other revolutions"
        )
    constants, zigzag = ship.constants(speed, rpm), ordered.zigzag
    plan = _RunPlan(
        _schedule(ordered, gusts),
        *((zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (inf, 0.0, 0.0)),
        *((wave.rudder, 2 * pi / wave.period_secs) if wave else (0.0, 0.0)),
        _draw_forcing(random_forcing, duration_secs, rng or np.random.default_rng(0)),
        vessel.rudder_max,
        vessel.rudder_rate,
        duration_secs,
    )
    rows = _integrate(ship.coefficients, constants, ship.straight_state(speed), plan)
    if not np.all(np.isfinite(rows)):
        raise UsageError(
            f"the simulation of {vessel.name} diverges in {ordered.name}: the model is unstable "
            "there; correct its coefficients or choose a gentler manoeuvre"
        )
    return Trajectory(ship, constants, rows, random_forcing is not None)


class _RunPlan(NamedTuple):
    """What compiled code needs of a run: orders, disturbances and the steering gear."""

    schedule: FloatArray  # (n, 4) rows of time, ordered rudder, rpm and gust, valid from then on
    zigzag_start: float  # s, infinite where there is no zig-zag
    zigzag_rudder: float  # rad
    zigzag_heading: float  # rad
    wave: float  # rad of rudder
    wave_frequency: float  # rad/s
    forcing: (
        FloatArray  # (k, 2) the moment and the force of each step, the last for all that follow
    )
    rudder_max: float  # rad
    rudder_rate: float  # rad/s
    duration: float  # s


def _draw_forcing(
    random_forcing: RandomForcing | None, duration_secs: float, rng: np.random.Generator
) -> FloatArray:
    """Draw the moment and the force of each step, (k, 2)."""
    if random_forcing is None:
        return np.full((1, 2), -0.0)  # added to any number, it keeps even the sign of a zero
    stds = np.array([random_forcing.rudder, random_forcing.force]) / sqrt(MAX_STEP_SECS)
    drawn: FloatArray = stds * rng.standard_normal((round(duration_secs / MAX_STEP_SECS) + 1, 2))
    return drawn


def _schedule(ordered: Manoeuvre, gusts: tuple[Gust, ...]) -> FloatArray:
    """Make the rows of time, ordered rudder, rpm and gust, valid from that time on, (n, 4)."""
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
def _integrate(
    c: CoefficientTuple, constants: ShipConstants, state: FloatArray, plan: _RunPlan
) -> FloatArray:
    """Integrate a run from knot to knot; returns the rows of a `Trajectory`."""
    schedule = plan.schedule
    rows = np.empty((int(plan.duration / MAX_STEP_SECS) + 64, 1 + len(state) + _EXCITATION))
    work, own = np.empty((3, len(state))), 1 + len(state)
    count, t, delta, at, step = 0, 0.0, 0.0, 0, 0
    order = schedule[0, 1]
    while True:
        while at + 1 < len(schedule) and schedule[at + 1, 0] <= t:
            at += 1
            if t < plan.zigzag_start:
                order = schedule[at, 1]
        if t >= plan.zigzag_start and order == 0.0:
            order = plan.zigzag_rudder
        while step * MAX_STEP_SECS <= t + INSTANT_SECS:
            step += 1
        delta, delta_dot, arrival = _steer(delta, order, t, plan.rudder_max, plan.rudder_rate)
        random_moment, force = plan.forcing[min(step, len(plan.forcing)) - 1]
        moment = schedule[at, 3] + random_moment
        u = Excitation(
            delta, delta_dot, schedule[at, 2], moment, plan.wave, plan.wave_frequency, force
        )
        if count == len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[count, _TIME] = t
        rows[count, 1:own] = state
        rows[count, own:] = u
        count += 1
        if t >= plan.duration:
            return rows[:count]
        end = min(step * MAX_STEP_SECS, plan.duration, arrival)
        end = min(end, schedule[at + 1, 0] if at + 1 < len(schedule) else inf)
        end = min(end, plan.zigzag_start if t < plan.zigzag_start else inf)
        # a zig-zag reverses the rudder at the very instant the heading is reached
        side, within = np.sign(order), end - t
        after = runge_kutta_step(c, constants, state, u, t, within, work)
        if t >= plan.zigzag_start and observed_real(c, after)[3] * side >= plan.zigzag_heading:
            heading = plan.zigzag_heading
            end = t + _time_to_heading(c, constants, state, u, t, within, side, heading, work)
            after = runge_kutta_step(c, constants, state, u, t, end - t, work)
            order = -order
        delta += delta_dot * (end - t)
        state[:] = after
        t = end


@compiled
def _steer(
    delta: float, order: float, t: float, rudder_max: float, rate: float
) -> tuple[float, float, float]:
    """Compute the rudder's angle, its rate, and when it arrives: infinite where it is there."""
    aim = min(max(order, -rudder_max), rudder_max)
    arrival = t + abs(aim - delta) / rate
    if arrival > t + 1e-12:
        return delta, np.sign(aim - delta) * rate, arrival
    return aim, 0.0, inf


@compiled
def _time_to_heading(
    c: CoefficientTuple,
    constants: ShipConstants,
    state: FloatArray,
    u: Excitation,
    t: float,
    within: float,
    side: float,
    heading: float,
    work: FloatArray,
) -> float:
    """Compute the time, at most `within`, to the heading on a side, s: by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        after = runge_kutta_step(c, constants, state, u, t, middle, work)
        if observed_real(c, after)[3] * side >= heading:
            high = middle
        else:
            low = middle
    return high


@compiled
def _outputs_at(
    c: CoefficientTuple,
    constants: ShipConstants,
    rows: FloatArray,
    before: TimeArray,
    acting: TimeArray,
    times: FloatArray,
    yaw: int,
) -> FloatArray:
    """Compute `outputs_si` at times, (n, 7).

    The state is integrated from the rows `before`, the acceleration is that of the rows `acting`.
    """
    out, own = np.empty((len(times), 7)), rows.shape[1] - _EXCITATION
    work, rates = np.empty((3, own - 1)), np.empty(own - 1)
    for i in range(len(times)):
        row, now = rows[before[i]], rows[acting[i]]
        state = runge_kutta_step(
            c, constants, row[1:own], _excitation(row[own:]), row[0], times[i] - row[0], work
        )
        write_rates_si(
            c, constants, state, _excitation(now[own:]), now[0], times[i] - now[0], rates
        )
        out[i] = outputs_si(c, constants, state, rates, yaw)
    return out


@compiled
def _excitation(row: FloatArray) -> Excitation:
    return Excitation(row[0], row[1], row[2], row[3], row[4], row[5], row[6])
