"""Simulated motion of a ship of any model in SI: inputs, disturbances and position.

One Runge-Kutta step of order four serves every model, in real numbers; with the paper's model it
gives the equations of `shiplog.ships.paper` to the last bit.

A yaw moment as a disturbance is given as the rudder angle that turns the ship as much on its
straight approach. It adds to the rates of the state what that rudder adds there, the mean of both
sides, so that the speed is not reduced. In a model with sway it also pushes the ship sideways, as a
rudder does.
"""

from dataclasses import dataclass
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np

from shiplog.compiled import compiled, compiled_in_caller
from shiplog.types import FloatArray

from .model import Model, Scale
from .motion import Forcing, observed, state_rates
from .paper import Coefficients
from .paper import steady_speed as papers_steady_speed

MIN_STEADY_SPEED, MAX_STEADY_SPEED = 1e-6, 1e3  # in a model's unit of speed
BISECTIONS = 100

CoefficientTuple = tuple[float, ...]  # a model's `kind` of real numbers


class Excitation(NamedTuple):
    """Inputs and disturbances of a ship from one instant until one of them changes.

    Attributes
    ----------
    delta, delta_dot
        The rudder at that instant, rad, and its rate, rad/s.
    n
        The propeller's revolutions, rpm.
    moment
        A constant yaw moment, as the rudder that turns the ship as much, rad.
    wave, wave_frequency
        The amplitude of a sinusoidal yaw moment, rad of rudder, and its frequency, rad/s.
    force
        A surge force over the ship's mass: what it adds to the rate of the speed, m/s².
    """

    delta: float
    delta_dot: float
    n: float
    moment: float
    wave: float
    wave_frequency: float
    force: float


class ShipConstants(NamedTuple):
    """What compiled code needs of a ship besides its coefficients.

    Attributes
    ----------
    secs, speed, rpm
        The units of its equations: s, m/s and rpm.
    ahead
        The index of the speed in its state.
    per_rudder
        (s,) what a yaw moment of one rad of rudder adds to the rates of its state.
    """

    secs: float
    speed: float
    rpm: float
    ahead: int
    per_rudder: FloatArray


@dataclass(frozen=True, eq=False)
class Ship:
    """A model with its coefficients and the units of its equations.

    Its state is the model's, followed by the position north and east in metres, (s + 2,).

    Attributes
    ----------
    model
        The ship model.
    coefficients
        The coefficients of its equations, a ``model.kind`` of real numbers.
    scale
        The units of its equations.
    """

    model: Model
    coefficients: CoefficientTuple
    scale: Scale

    def straight_state(self, speed: float) -> FloatArray:
        """Return the state, (s + 2,), of a straight run north at a speed in m/s."""
        x = np.zeros(len(self.model.state) + 2)
        x[self._at("speed")] = speed / self.scale.speed
        return x

    def constants(self, speed: float, rpm: float) -> ShipConstants:
        """Compute what compiled code needs of a ship whose approach is at a speed, m/s, and rpm."""
        count, ahead = len(self.model.state), self._at("speed")
        constants = ShipConstants(
            self.scale.secs, self.scale.speed, self.scale.rpm, ahead, np.zeros(count)
        )
        starboard, port = (
            rates_si(
                self.coefficients,
                constants,
                self.straight_state(speed),
                straight_run(rpm, delta),
                0.0,
                0.0,
            )
            for delta in (1.0, -1.0)
        )
        return constants._replace(per_rudder=(starboard - port)[:count] / 2)

    def moment_per_rudder(self, constants: ShipConstants) -> tuple[float, str]:
        """Return what one rad of rudder as a yaw moment adds to the equation of yaw, and the unit.

        The unit is rad/s³ in an equation of second order in the yaw rate, rad/s² in one of first.
        """
        names, yaw = [value.name for value in self.model.state], self.yaw
        acceleration = f"{names[yaw]}_dot"
        if acceleration not in names:
            return float(constants.per_rudder[yaw] / self.scale.secs), "rad/s²"
        return float(constants.per_rudder[names.index(acceleration)] / self.scale.secs**2), "rad/s³"

    def steady_speed(self, rpm: float) -> float:
        """Compute the steady speed ahead, m/s, of a straight run at given revolutions; 0 if none.

        In closed form for the paper's model, else the zero of the surge equation, by bisection.

        Examples
        --------
        >>> from shiplog import load_vessel
        >>> from shiplog.vessel.ship import ship_from_vessel
        >>> round(ship_from_vessel(load_vessel("table1")[0]).steady_speed(80.0), 2)
        10.33
        """
        if isinstance(self.coefficients, Coefficients):
            return papers_steady_speed(self.coefficients, rpm)
        constants, ahead = self.constants(self.scale.speed, rpm), self._at("speed")

        def accelerates(nu: float) -> bool:
            x = self.straight_state(nu * self.scale.speed)
            return bool(
                rates_si(self.coefficients, constants, x, straight_run(rpm), 0.0, 0.0)[ahead] > 0
            )

        low, high = MIN_STEADY_SPEED, MAX_STEADY_SPEED
        if not accelerates(low) or accelerates(high):
            return 0.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (middle, high) if accelerates(middle) else (low, middle)
        return high * self.scale.speed

    @property
    def yaw(self) -> int:
        """The index of the yaw rate in the state."""
        return self._at("yaw_rate")

    def _at(self, channel: str) -> int:
        return [value.channel for value in self.model.state].index(channel)


def straight_run(rpm: float, delta: float = 0.0) -> Excitation:
    """Return the excitation of constant revolutions, rpm, and a constant rudder, rad."""
    return Excitation(float(delta), 0.0, float(rpm), 0.0, 0.0, 0.0, 0.0)


@compiled
def rates_si(
    c: CoefficientTuple,
    constants: ShipConstants,
    x: FloatArray,
    u: Excitation,
    t: float,
    after: float,
) -> FloatArray:
    """Compute the rates of the state per s, (s + 2,), `after` seconds from the instant `t`."""
    rates = np.empty_like(x)
    write_rates_si(c, constants, x, u, t, after, rates)
    return rates


@compiled_in_caller
def write_rates_si(
    c: CoefficientTuple,
    constants: ShipConstants,
    x: FloatArray,
    u: Excitation,
    t: float,
    after: float,
    rates: FloatArray,
) -> None:
    """Compute them as `rates_si` does, into `rates`."""
    delta = u.delta + u.delta_dot * after
    moment = u.moment + u.wave * sin(u.wave_frequency * (t + after))
    own = state_rates(c, x, Forcing(delta, u.delta_dot * constants.secs, u.n / constants.rpm))
    secs, per_rudder = constants.secs, constants.per_rudder
    for i in range(len(own)):
        rates[i] = own[i] / secs + per_rudder[i] * moment
    rates[constants.ahead] += u.force / constants.speed
    _, ahead, sway, heading = observed_real(c, x)
    rates[len(own)] = constants.speed * (ahead * cos(heading) - sway * sin(heading))
    rates[len(own) + 1] = constants.speed * (ahead * sin(heading) + sway * cos(heading))


@compiled_in_caller
def runge_kutta_step(
    c: CoefficientTuple,
    constants: ShipConstants,
    x: FloatArray,
    u: Excitation,
    t: float,
    h: float,
    work: FloatArray,
) -> FloatArray:
    """Integrate the state over `h` seconds from `t`, without a knot of the rudder between.

    `work` is scratch memory of shape (3, s + 2). The result is its first row, valid until the next
    step.
    """
    after: FloatArray = work[0]
    between, rates = work[1], work[2]
    write_rates_si(c, constants, x, u, t, 0.0, rates)
    for i in range(len(x)):
        after[i] = x[i] + h / 6 * rates[i]
        between[i] = x[i] + h / 2 * rates[i]
    write_rates_si(c, constants, between, u, t, h / 2, rates)
    for i in range(len(x)):
        after[i] += h / 3 * rates[i]
        between[i] = x[i] + h / 2 * rates[i]
    write_rates_si(c, constants, between, u, t, h / 2, rates)
    for i in range(len(x)):
        after[i] += h / 3 * rates[i]
        between[i] = x[i] + h * rates[i]
    write_rates_si(c, constants, between, u, t, h, rates)
    for i in range(len(x)):
        after[i] += h / 6 * rates[i]
    return after


@compiled_in_caller
def observed_real(c: CoefficientTuple, x: FloatArray) -> tuple[float, float, float, float]:
    """Compute the real outputs of a real state, in the units of the equations."""
    values: tuple[Any, Any, Any, Any] = observed(c, x)  # real, of a real state
    return values


@compiled_in_caller
def outputs_si(
    c: CoefficientTuple,
    constants: ShipConstants,
    x: FloatArray,
    rates: FloatArray,
    yaw: int,
) -> tuple[float, float, float, float, float, float, float]:
    """Compute yaw rate and acceleration, speed ahead, sway, heading, north and east, in SI."""
    rho, ahead, sway, heading = observed_real(c, x)
    acceleration = rates[yaw] / constants.secs
    north, east = x[-2], x[-1]
    ahead, sway = ahead * constants.speed, sway * constants.speed
    return rho / constants.secs, acceleration, ahead, sway, heading, north, east
