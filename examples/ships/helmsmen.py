"""Helmsmen of sea trials beside `Steering`: programmes of the rudder, new courses, yaw rates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot, inf, radians

from .sea_trial import Steering

MAX_HELM = radians(25.0)  # with which a ship is steered to a yaw rate
COURSE_CHANGE_HELM = radians(8.5)  # with which a ship is steered to a new course


@dataclass(frozen=True)
class Programme:
    """A helmsman who keeps the course, then holds the angles of a programme.

    Each step is a time, s, and the rudder angle from then on, rad, from the neutral one.
    """

    approach: Steering
    steps: Sequence[tuple[float, float]]

    def __call__(self, time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        """Return the rudder ordered."""
        angles = [angle for start, angle in self.steps if start <= time]
        if not angles:
            return self.approach(time, heading, yaw_rate, rudder)
        return self.approach.ship.neutral + angles[-1]


@dataclass
class TurnOnce:
    """A helmsman who turns with one angle until the heading has changed, and steadies the ship."""

    approach: Steering
    until: float  # change of heading, rad
    turned: float = inf  # s, when it has changed

    def __call__(self, time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        """Return the rudder ordered."""
        change = self.approach.side * (heading - self.approach.course)
        if time >= self.approach.execute and change >= self.until:
            self.turned = min(time, self.turned)
        if time < self.turned:
            return self.approach(time, heading, yaw_rate, rudder)
        course = self.approach.course + self.approach.side * self.until
        return steered_to(course, self.approach, heading, yaw_rate)


@dataclass(frozen=True)
class NewCourse:
    """A helmsman who keeps the course of the approach, and from `execute` on another one, rad."""

    approach: Steering
    course: float

    def __call__(self, time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        """Return the rudder ordered."""
        if time < self.approach.execute:
            return self.approach(time, heading, yaw_rate, rudder)
        return steered_to(self.course, self.approach, heading, yaw_rate)


def steered_to(course: float, approach: Steering, heading: float, yaw_rate: float) -> float:
    """Return the rudder that brings a ship to a course with small helm, rad."""
    keep = -0.5 * (heading - course) - 15.0 * yaw_rate
    return approach.ship.neutral + max(-COURSE_CHANGE_HELM, min(COURSE_CHANGE_HELM, keep))


@dataclass
class RateKeeper:
    """A helmsman who steers the ship to one yaw rate after another, as in a reverse spiral.

    Each step is a time, s, and the yaw rate from then on, rad/s. A proportional and integral
    controller moves the rudder; with `weave` a helmsman is imitated whose rudder keeps moving
    about the angle needed, rad.
    """

    approach: Steering
    steps: Sequence[tuple[float, float]]
    weave: Callable[[float], float] = lambda _time: 0.0
    integral: float = field(default=0.0, init=False)
    last: float = field(default=-inf, init=False)

    def __call__(self, time: float, heading: float, yaw_rate: float, rudder: float) -> float:
        """Return the rudder ordered."""
        rates = [rate for start, rate in self.steps if start <= time]
        ship = self.approach.ship
        if not rates:
            return self.approach(time, heading, yaw_rate, rudder)
        pace = ship.length / hypot(ship.speed, 0.1)
        step = min(time - self.last, 1.0)
        self.last = time
        error = rates[-1] - yaw_rate
        limited = abs(rudder - ship.neutral) >= MAX_HELM and error * rudder > 0
        self.integral += 0.0 if limited else error * step
        order = 2.0 * pace * error + self.integral
        return ship.neutral + max(-MAX_HELM, min(MAX_HELM, order)) + self.weave(time)
