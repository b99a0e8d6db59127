"""Standard manoeuvres by name, as orders of rudder and revolutions.

Rudder to starboard is positive. Each begins with a straight approach of `APPROACH_SECS` (except
the paper's run), and pull-out and spiral are repeated until the duration is filled.

References
----------
ITTC Recommended Procedure 7.5-04-02-01, full scale manoeuvring trials.

IMO Resolution MSC.137(76), standards for ship manoeuvrability.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from shiplog.errors import UsageError
from shiplog.units import did_you_mean

DEG = pi / 180
APPROACH_SECS = 10.0
SPIRAL_DEG = (15.0, 10.0, 5.0, 3.0, 1.0, 0.0, -1.0, -3.0, -5.0, -10.0, -15.0)


@dataclass(frozen=True)
class Order:
    """An order, valid from a time on.

    Attributes
    ----------
    time_secs
        The time from the start, s.
    rudder
        The ordered rudder, rad.
    rpm
        The propeller's revolutions, rpm.
    """

    time_secs: float
    rudder: float
    rpm: float


@dataclass(frozen=True)
class ZigZag:
    """A zig-zag: the rudder is reversed whenever the heading has changed far enough.

    Attributes
    ----------
    start_secs
        When the first rudder is ordered, s.
    rudder
        The first rudder, rad; negative to port.
    heading
        The change of heading from the approach at which the rudder is reversed, rad.
    """

    start_secs: float
    rudder: float
    heading: float


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre: orders by time, and for a zig-zag by the heading from its start on.

    Attributes
    ----------
    name
        The name it was asked for by.
    orders
        The orders, the first at time zero.
    zigzag
        The zig-zag, which replaces the rudder of the orders from its start on.
    initial_speed
        The speed at the start, m/s; None for the steady speed at the first order's revolutions.
    """

    name: str
    orders: tuple[Order, ...]
    zigzag: ZigZag | None = None
    initial_speed: float | None = None


def manoeuvre(
    name: str, duration_secs: float, rpm: float, rng: np.random.Generator | None = None
) -> Manoeuvre:
    """Make the manoeuvre of a name, such as ``zigzag-20-20`` or ``turning-circle-35-port``.

    Parameters
    ----------
    name
        One of `EXAMPLES`, or such a name with other angles in degrees or ``-port`` at its end.
    duration_secs
        The length of the run, s.
    rpm
        The propeller's revolutions on the approach, rpm.
    rng
        Draws the orders of ``pseudo-random``; seeded with 0 by default.

    Raises
    ------
    UsageError
        The name is unknown, or an angle is out of range.

    Examples
    --------
    >>> manoeuvre("zigzag-10-10", 600.0, 80.0).zigzag
    ZigZag(start_secs=10.0, rudder=0.17453292519943295, heading=0.17453292519943295)
    """
    for pattern, build in _BUILDERS.items():
        if match := re.fullmatch(pattern, name):
            angles = [float(angle) * DEG for angle in match.groups() if angle is not None]
            side = -1.0 if name.endswith("-port") else 1.0
            return build(name, _Setting(duration_secs, rpm, side, angles, rng))
    raise UsageError(
        f"unknown manoeuvre {name!r}{did_you_mean(name, EXAMPLES)}; known are {', '.join(EXAMPLES)}"
    )


EXAMPLES = (
    "turning-circle",
    "turning-circle-20",
    "zigzag-20-20",
    "zigzag-10-10",
    "pull-out",
    "spiral",
    "pseudo-random",
    "paper",
)


@dataclass(frozen=True)
class _Setting:
    """What the orders of a manoeuvre depend on."""

    duration_secs: float
    rpm: float
    side: float
    angles: list[float]
    rng: np.random.Generator | None

    def angle(self, default_deg: float) -> float:
        """Return the rudder angle of the name, or the default, in rad, negative to port."""
        angle = self.angles[0] if self.angles else default_deg * DEG
        if not 0 < angle <= 45 * DEG:
            raise UsageError(
                f"a rudder angle of {angle / DEG:g}° cannot be ordered; it must be above 0 and at "
                "most 45°"
            )
        return self.side * angle


def _turning_circle(name: str, setting: _Setting) -> Manoeuvre:
    hard_over = Order(APPROACH_SECS, setting.angle(35.0), setting.rpm)
    return Manoeuvre(name, (Order(0.0, 0.0, setting.rpm), hard_over))


def _zigzag(name: str, setting: _Setting) -> Manoeuvre:
    rudder, heading = setting.angle(20.0), setting.angles[1]
    if not 0 < heading <= 90 * DEG:
        raise UsageError(
            f"a zig-zag cannot reverse at {heading / DEG:g}° of heading; it must be above 0 and at "
            "most 90°"
        )
    orders = (Order(0.0, 0.0, setting.rpm),)
    return Manoeuvre(name, orders, ZigZag(APPROACH_SECS, rudder, heading))


def _pull_out(name: str, setting: _Setting) -> Manoeuvre:
    angle = setting.angle(20.0)
    return _held(name, setting, (angle, 0.0, -angle, 0.0), 150.0)


def _spiral(name: str, setting: _Setting) -> Manoeuvre:
    down = [setting.side * angle * DEG for angle in SPIRAL_DEG]
    return _held(name, setting, (*down, *down[-2:0:-1]), 120.0)


def _held(name: str, setting: _Setting, angles: tuple[float, ...], hold_secs: float) -> Manoeuvre:
    """Order one angle after another, repeatedly."""
    orders = [Order(0.0, 0.0, setting.rpm)]
    times = np.arange(APPROACH_SECS, setting.duration_secs, hold_secs)
    for i, time in enumerate(times.tolist()):
        orders.append(Order(time, angles[i % len(angles)], setting.rpm))
    return Manoeuvre(name, tuple(orders))


def _pseudo_random(name: str, setting: _Setting) -> Manoeuvre:
    """Order random steps of rudder and revolutions, the best excitation for identification."""
    rng = setting.rng or np.random.default_rng(0)
    rudder_steps = _steps(rng, setting.duration_secs, (20.0, 60.0), (-20 * DEG, 20 * DEG))
    rpm_steps = _steps(
        rng, setting.duration_secs, (60.0, 180.0), (0.7 * setting.rpm, 1.2 * setting.rpm)
    )
    orders, rudder, rpm = [Order(0.0, 0.0, setting.rpm)], 0.0, setting.rpm
    for time in sorted({*rudder_steps, *rpm_steps}):
        rudder, rpm = rudder_steps.get(time, rudder), rpm_steps.get(time, rpm)
        orders.append(Order(time, rudder, rpm))
    return Manoeuvre(name, tuple(orders))


def _steps(
    rng: np.random.Generator,
    duration: float,
    hold: tuple[float, float],
    level: tuple[float, float],
) -> dict[float, float]:
    """Draw uniform levels, each held for a uniform time, rounded to tenths of seconds."""
    steps, time = {}, APPROACH_SECS
    while time < duration:
        steps[time] = float(rng.uniform(*level))
        time = round(time + float(rng.uniform(*hold)), 1)
    return steps


def _paper(name: str, _: _Setting) -> Manoeuvre:
    """Order the identification paper's run: from slow speed two circles, at 100 rpm."""
    orders = (Order(0.0, 20 * DEG, 100.0), Order(200.0, -20 * DEG, 100.0))
    return Manoeuvre(name, orders, initial_speed=2.0)


_NUMBER = r"(\d+(?:\.\d+)?)"
_BUILDERS: dict[str, Callable[[str, _Setting], Manoeuvre]] = {
    rf"turning-circle(?:-{_NUMBER})?(?:-port)?": _turning_circle,
    rf"zigzag-{_NUMBER}-{_NUMBER}(?:-port)?": _zigzag,
    rf"pull-out(?:-{_NUMBER})?(?:-port)?": _pull_out,
    r"spiral(?:-port)?": _spiral,
    r"pseudo-random": _pseudo_random,
    r"paper": _paper,
}
