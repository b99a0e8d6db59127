"""A ship under way: what moves her, what pushes her off her way, and where she goes.

One Runge-Kutta step of order four for every model, in real numbers: the paper's ship moves as
`shiplog.ships.paper` has her, to the last bit. A yaw moment is given as the rudder that turns her
as much on the straight run of her approach, and changes what that rudder changes there, but for her
loss of speed, the same to either side. So it pushes a ship with a sway to the side, too, as a
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

SLOWEST, FASTEST = 1e-6, 1e3  # of a steady run, in a model's unit of speed
HALVINGS = 100

CoefficientTuple = tuple[float, ...]  # a model's `kind`, real


class Excitation(NamedTuple):
    """What acts on the ship from one instant on, until something changes."""

    delta: float  # rad, at that instant
    delta_dot: float  # rad/s
    n: float  # rpm
    moment: float  # rad: a yaw moment, as the rudder that turns her as much,
    wave: float  # rad, amplitude of a sinusoidal one
    wave_frequency: float  # rad/s
    force: float  # m/s^2: a surge force, as it stands in the equation of the speed


class ShipConstants(NamedTuple):
    """What compiled code must know of a ship beside her coefficients."""

    secs: float  # the units of her equations
    speed: float  # m/s
    rpm: float
    ahead: int  # where in her state the speed stands
    per_rudder: FloatArray  # (s,) what a moment of one rad of rudder adds to its rates


@dataclass(frozen=True, eq=False)
class Ship:
    """A model with its coefficients and the units of its equations.

    Her state is the model's, and after it the metres made good north and east, (s + 2,).
    """

    model: Model
    coefficients: CoefficientTuple
    scale: Scale

    def straight_state(self, speed: float) -> FloatArray:
        """The state of a ship that goes north at a speed, in m/s."""
        x = np.zeros(len(self.model.state) + 2)
        x[self._at("speed")] = speed / self.scale.speed
        return x

    def constants(self, speed: float, rpm: float) -> ShipConstants:
        """The hull of a ship whose approach is at that speed, in m/s, and rpm."""
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
        """A moment of one rad of rudder as her equation of yaw has it, and its unit.

        In an equation of the second order that is rad/s³, in one of the first rad/s².
        """
        names, yaw = [value.name for value in self.model.state], self.yaw
        acceleration = f"{names[yaw]}_dot"
        if acceleration not in names:
            return float(constants.per_rudder[yaw] / self.scale.secs), "rad/s²"
        return float(constants.per_rudder[names.index(acceleration)] / self.scale.secs**2), "rad/s³"

    def steady_speed(self, rpm: float) -> float:
        """The speed ahead, m/s, at which a straight run at so many revolutions settles; 0 if none.

        The paper's in closed form; of another model where nothing changes the speed, by bisection.
        """
        if isinstance(self.coefficients, Coefficients):
            return papers_steady_speed(self.coefficients, rpm)
        constants, ahead = self.constants(self.scale.speed, rpm), self._at("speed")

        def gains(nu: float) -> bool:
            x = self.straight_state(nu * self.scale.speed)
            return bool(
                rates_si(self.coefficients, constants, x, straight_run(rpm), 0.0, 0.0)[ahead] > 0
            )

        low, high = SLOWEST, FASTEST
        if not gains(low) or gains(high):
            return 0.0
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if gains(middle) else (low, middle)
        return high * self.scale.speed

    @property
    def yaw(self) -> int:
        """Where in her state the yaw rate stands."""
        return self._at("yaw_rate")

    def _at(self, channel: str) -> int:
        return [value.channel for value in self.model.state].index(channel)


def straight_run(rpm: float, delta: float = 0.0) -> Excitation:
    """Nothing that acts but the revolutions and a rudder that rests."""
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
    """How the state changes, per s, `after` seconds from the instant `t` of what acts, (s + 2,)."""
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
    """Put them into `rates`."""
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
    """The state after `h` seconds from `t`, no knot of the rudder between.

    `work` is (3, s + 2): what is returned is its first row, and holds until the next step.
    """
    after: FloatArray = work[0]
    between, rates = work[1], work[2]
    write_rates_si(c, constants, x, u, t, 0.0, rates)
    after[:] = x
    for i in range(len(x)):
        after[i] += h / 6 * rates[i]
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
    """What is observed of a state, in the units of the equations, real."""
    values: tuple[Any, Any, Any, Any] = observed(c, x)  # of a real state real
    return values


@compiled_in_caller
def outputs_si(
    c: CoefficientTuple,
    constants: ShipConstants,
    x: FloatArray,
    rates: FloatArray,
    yaw: int,
) -> tuple[float, float, float, float, float, float, float]:
    """Yaw rate and acceleration, speed ahead, sway, heading, north and east, SI."""
    rho, ahead, sway, heading = observed_real(c, x)
    acceleration = rates[yaw] / constants.secs
    north, east = x[-2], x[-1]
    ahead, sway = ahead * constants.speed, sway * constants.speed
    return rho / constants.secs, acceleration, ahead, sway, heading, north, east
