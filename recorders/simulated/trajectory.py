"""The simulated motion of a ship through a manoeuvre, with its disturbances."""

from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from shiplog import Vessel
from shiplog.errors import UsageError
from shiplog.ships.under_way import Ship, ShipConstants
from shiplog.types import FloatArray, TimeArray
from shiplog.vessel.ship import ship_from_vessel

from .integration import INSTANT_SECS, RUN_STEP_SECS, TIME, RunPlan, integrate_run, outputs_at
from .manoeuvres import Manoeuvre
from .wind import Wind, measured_wind, wind_load

_INPUTS, _DISTURBANCES = slice(-7, -4), slice(-4, None)  # of the excitation at the end of a row


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
    wind
        The wind; None for none.
    """

    ship: Ship
    constants: ShipConstants
    rows: FloatArray
    has_random_forcing: bool = False
    wind: Wind | None = None

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
            yaw_disturbance, (n,) each; position, (n, 2), north and east; with a random forcing or
            a wind also surge_disturbance, (n,), in m/s², and with a wind its channels.
        """
        before = acting = self._rows_before(times_secs)
        has_steps = self.has_random_forcing or self.wind is not None
        if has_steps:
            # 3 * 0.1 > 0.3: at 0.3 s the forcing is that of the step that starts there
            acting = self._rows_before(times_secs + INSTANT_SECS)
        outputs = outputs_at(
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
            "rudder": delta + delta_dot * (times_secs - self.rows[before, TIME]),
            "rpm": rpm,
            "yaw_disturbance": per_rudder * (moment + wave * np.sin(frequency * times_secs)),
        }
        if self.wind is not None:
            truth |= measured_wind(self.wind, *(truth[n] for n in ("heading", "speed", "sway")))
        return truth | {"surge_disturbance": force} if has_steps else truth

    def _rows_before(self, times_secs: FloatArray) -> TimeArray:
        return np.searchsorted(self.rows[:, TIME], times_secs, side="right") - 1


def compute_trajectory(
    vessel: Vessel,
    ordered: Manoeuvre,
    duration_secs: float,
    *,
    gusts: tuple[Gust, ...] = (),
    wave: WaveMoment | None = None,
    random_forcing: RandomForcing | None = None,
    wind: Wind | None = None,
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
    gusts, wave, random_forcing, wind
        The disturbances.
    rng
        Draws the random forcing; seeded with 0 by default.

    Raises
    ------
    UsageError
        The model diverges in this manoeuvre, or has no steady speed to start from; or the wind is
        out of range.

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
    plan = RunPlan(
        _schedule(ordered, gusts),
        *((zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (inf, 0.0, 0.0)),
        *((wave.rudder, 2 * pi / wave.period_secs) if wave else (0.0, 0.0)),
        _draw_forcing(random_forcing, duration_secs, rng or np.random.default_rng(0)),
        wind_load(wind),
        vessel.rudder_max,
        vessel.rudder_rate,
        float(duration_secs),  # of an integer the loop would be compiled anew
    )
    rows = integrate_run(ship.coefficients, constants, ship.straight_state(speed), plan)
    if not np.all(np.isfinite(rows)):
        raise UsageError(
            f"the simulation of {vessel.name} diverges in {ordered.name}: the model is unstable "
            "there; correct its coefficients or choose a gentler manoeuvre"
        )
    return Trajectory(ship, constants, rows, random_forcing is not None, wind)


def _draw_forcing(
    random_forcing: RandomForcing | None, duration_secs: float, rng: np.random.Generator
) -> FloatArray:
    """Draw the moment and the force of each step, (k, 2)."""
    if random_forcing is None:
        return np.full((1, 2), -0.0)  # added to any number, it keeps even the sign of a zero
    stds = np.array([random_forcing.rudder, random_forcing.force]) / sqrt(RUN_STEP_SECS)
    drawn: FloatArray = stds * rng.standard_normal((round(duration_secs / RUN_STEP_SECS) + 1, 2))
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
