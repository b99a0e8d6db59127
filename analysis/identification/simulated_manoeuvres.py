"""Standard manoeuvres simulated with ship models: turning circles and zig-zags."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from analysis.identification.fit.output_error import DEFAULT_LENGTH, OutputError
from analysis.identification.fit.segment import Segment, initial_level
from analysis.manoeuvres.turning_circle import TurningCircle, turning_circle
from shiplog.ships import Model, Scale
from shiplog.ships.motion import InputPath
from shiplog.types import FloatArray
from shiplog.vessel.vessel import Vessel

from .prediction import dead_reckoning, manoeuvre_motion

STEPS_PER_LENGTH = 40  # of the integration, in the time of sailing a ship length
CIRCLE_LENGTHS = 40.0  # sailed at the approach speed: a circle of a slow ship is complete
LEG_LENGTHS = 15.0  # the longest leg of a zig-zag
RATE_SECS = 2.0  # over which a rate of the rudder is taken
FASTEST_SHARE = 0.97  # of the rates: a few per cent of a zig-zag are reversals
LEAST_RATE = radians(0.5)  # per second
HARD_OVER = radians(35.0)
LEGS = 4  # of a zig-zag: from the first order to after the third reversal


@dataclass(frozen=True)
class Approach:
    """The straight run before a manoeuvre.

    Attributes
    ----------
    length
        Of the ship, m, by which durations and steps are chosen.
    speed, rpm
        m/s, and revolutions.
    rudder_rate
        Of the steering gear, rad/s.
    length_given
        Whether the length is that of the ship; otherwise one is assumed, and no limit of the norm
        can be computed from it.
    """

    length: float
    speed: float
    rpm: float
    rudder_rate: float
    length_given: bool = True

    @property
    def length_secs(self) -> float:
        """The time in which a ship length is sailed, s."""
        return self.length / self.speed


def approach_of(segments: Sequence[Segment], vessel: Vessel | None) -> Approach:
    """Return the approach of recorded runs.

    The rate of the steering gear is that of the vessel file, or else the one that the runs show.
    """
    given = vessel.length if vessel else None
    if vessel and "rate" in vessel.gear_given:
        rate = vessel.rudder_rate
    else:
        rate = max(_rudder_rate(segment) for segment in segments)
    return Approach(
        given or DEFAULT_LENGTH, initial_level(segments, "speed"), initial_level(segments, "rpm"),
        rate, length_given=bool(given),
    )  # fmt: skip


def _rudder_rate(segment: Segment) -> float:
    """Return the rate at which the rudder moves from one order to the next, rad/s."""
    every = max(1, round(RATE_SECS / segment.dt_secs))
    rudder = segment.signals["rudder"][::every]
    rates = np.abs(np.diff(rudder)) / (every * segment.dt_secs)
    return max(float(np.quantile(rates, FASTEST_SHARE)), LEAST_RATE)


@dataclass(frozen=True, eq=False)
class ShipDraws:
    """k ships of one model, drawn from what is known of its parameters.

    Attributes
    ----------
    model
        The model.
    scale
        The units of its equations.
    approach
        The straight run before each manoeuvre.
    parameters
        (k, p).
    rudder_zeros
        (k,) added to the rudder, rad.
    """

    model: Model
    scale: Scale
    approach: Approach
    parameters: FloatArray
    rudder_zeros: FloatArray

    def __len__(self) -> int:
        """Return the number of ships."""
        return len(self.parameters)

    @property
    def straight(self) -> FloatArray:
        """(k, s) the states on a straight course at the approach speed."""
        speed = self.approach.speed / self.scale.of_channel("speed")
        state = [speed * (value.channel == "speed") for value in self.model.state]
        return np.tile(state, (len(self), 1))

    @property
    def step_secs(self) -> float:
        """The step of a simulation, s."""
        return self.approach.length_secs / STEPS_PER_LENGTH


def best_estimate(fit: OutputError, approach: Approach) -> ShipDraws:
    """Return the one ship of a fit's estimates, with the rudder zero that its runs share."""
    zero = fit.problem.rudder_zero(fit.minimum.unknowns)
    return ShipDraws(
        fit.problem.model, fit.problem.scale, approach, fit.parameters[None], np.array([zero])
    )


def turns_hard_over(fit: OutputError, approach: Approach) -> bool:
    """Return whether a fitted ship turns steadily with the rudder hard over to either side.

    One whose simulation diverges or goes astern in the turn does not.
    """
    ship = best_estimate(fit, approach)
    circles = [simulate_circles(ship, side * HARD_OVER)[0] for side in (1, -1)]
    return all(np.isfinite(circle.steady_speed) for circle in circles)


def simulate_circles(ships: ShipDraws, rudder: float) -> list[TurningCircle]:
    """Simulate turning circles from a straight course, one for each ship.

    Parameters
    ----------
    ships
        The ships.
    rudder
        The rudder order, rad, positive to starboard.

    Returns
    -------
    list of TurningCircle
        Where a simulation diverges or goes astern, what it had not reached by then is NaN.
    """
    count = round(CIRCLE_LENGTHS * STEPS_PER_LENGTH)
    path, angles = _order_path(ships, 0.0, rudder, count)
    outputs, _ = ships.model.simulate_many(
        ships.parameters, ships.straight, path, count + 1,
        offsets=ships.rudder_zeros, scale=ships.scale,
    )  # fmt: skip
    return [_circle(each, angles, ships.step_secs) for each in outputs]


def _circle(outputs: FloatArray, rudder: FloatArray, dt: float) -> TurningCircle:
    sound = np.isfinite(outputs[:, 0]) & (outputs[:, 1] > 0)
    count = len(outputs) if sound.all() else int(np.argmin(sound))
    sailed = outputs[:count]
    motion = manoeuvre_motion(sailed, dead_reckoning(sailed, dt))
    circle = turning_circle(motion, rudder[:count], dt, approach=0.0)
    if count == len(outputs):
        return circle
    nan = float("nan")
    return replace(
        circle, steady_yaw_rate=nan, steady_speed=nan, steady_diameter=nan, drift_angle=nan
    )


@dataclass(frozen=True)
class SimulatedZigzag:
    """A simulated zig-zag.

    Attributes
    ----------
    overshoots
        The angles beyond the switch heading after the first, second and further reversals, rad;
        NaN where the ship does not come back.
    initial_turning_secs, initial_turning_distance
        From the first order to the switch heading, s and m.
    """

    overshoots: tuple[float, ...]
    initial_turning_secs: float
    initial_turning_distance: float


def simulate_zigzags(ships: ShipDraws, rudder: float, switch: float) -> list[SimulatedZigzag]:
    """Simulate zig-zags from a straight course, the rudder controlled by the simulated heading.

    Parameters
    ----------
    ships
        The ships.
    rudder
        The first rudder order, rad, positive to starboard; the others alternate.
    switch
        The change of heading at which the rudder is reversed, rad, positive.
    """
    return [_zigzag(_one(ships, i), rudder, switch) for i in range(len(ships))]


def _one(ships: ShipDraws, i: int) -> ShipDraws:
    part = slice(i, i + 1)
    return replace(ships, parameters=ships.parameters[part], rudder_zeros=ships.rudder_zeros[part])


@dataclass(frozen=True, eq=False)
class _Leg:
    """A leg of a zig-zag: from one order to the next.

    Attributes
    ----------
    state
        (1, s) at its start.
    rudder, order
        The rudder angle at its start, and the angle ordered, rad.
    """

    state: FloatArray
    rudder: float
    order: float


def _zigzag(ship: ShipDraws, rudder: float, switch: float) -> SimulatedZigzag:
    leg = _Leg(ship.straight, 0.0, rudder)
    overshoots = [np.nan] * (LEGS - 1)
    outputs, crossing = _sail(ship, leg, switch)
    speed = np.hypot(outputs[:, 1], np.nan_to_num(outputs[:, 2]))
    travelled = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2)) * ship.step_secs
    distance = float(np.interp(crossing, np.arange(len(outputs)), travelled))
    first_secs = crossing * ship.step_secs
    for number in range(LEGS - 1):
        if not np.isfinite(crossing):
            break
        leg = _next_leg(ship, leg, crossing)
        outputs, crossing = _sail(ship, leg, switch)
        if np.isfinite(crossing):
            # the heading swings on to the other side before it comes back
            swung = -np.sign(leg.order) * outputs[: int(crossing) + 2, 3]
            overshoots[number] = float(np.max(swung)) - switch
    return SimulatedZigzag(tuple(overshoots), first_secs, distance)


def _sail(ship: ShipDraws, leg: _Leg, switch: float) -> tuple[FloatArray, float]:
    """Simulate a leg; return its outputs, (n, 4), and the sample at which the heading switches."""
    count = round(LEG_LENGTHS * STEPS_PER_LENGTH)
    path, _ = _order_path(ship, leg.rudder, leg.order, count)
    outputs, _ = ship.model.simulate_many(
        ship.parameters, leg.state, path, count + 1, offsets=ship.rudder_zeros, scale=ship.scale
    )
    excess = np.sign(leg.order) * outputs[0, :, 3] - switch
    over = np.flatnonzero(excess >= 0)
    if not len(over) or over[0] == 0:
        return outputs[0], np.nan
    k = int(over[0])
    return outputs[0], k - 1 + float(excess[k - 1] / (excess[k - 1] - excess[k]))


def _next_leg(ship: ShipDraws, leg: _Leg, sample: float) -> _Leg:
    """Return the leg that begins after a fractional number of samples of this one."""
    whole = int(sample)
    path, angles = _order_path(ship, leg.rudder, leg.order, whole + 1)
    secs = path.secs.copy()
    secs[-1] *= max(sample - whole, 1e-6)
    _, end = ship.model.simulate_many(
        ship.parameters, leg.state, path._replace(secs=secs), whole + 2,
        offsets=ship.rudder_zeros, scale=ship.scale,
    )  # fmt: skip
    rudder = float(np.interp(sample, np.arange(len(angles)), angles))
    return _Leg(end, rudder, -leg.order)


def _order_path(
    ships: ShipDraws, rudder: float, order: float, count: int
) -> tuple[InputPath, FloatArray]:
    """Return the path of a rudder that moves to an angle and is held, and its samples, (count+1,).

    The rudder is linear from sample to sample.
    """
    dt = ships.step_secs
    moved = ships.approach.rudder_rate * dt * np.arange(count + 1)
    angles = rudder + np.clip(order - rudder, -moved, moved)
    path = InputPath(
        np.full(count, dt), angles[:-1].copy(), np.diff(angles) / dt,
        np.full(count, ships.approach.rpm), np.arange(1, count + 1), np.ones(count, np.int64),
    )  # fmt: skip
    return path, angles
