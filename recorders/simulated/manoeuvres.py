"""What is ordered on the bridge: the standard manoeuvres, by name.

Rudder to starboard is positive. Each begins with a straight approach of `APPROACH_SECS`, and is
repeated until the duration is filled where that makes sense (ITTC 7.5-04-02-01; IMO MSC.137(76)).
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
    """From `time_secs` on: the rudder ordered, in rad, and the revolutions, in rpm."""

    time_secs: float
    rudder: float
    rpm: float


@dataclass(frozen=True)
class ZigZag:
    """Rudder to `rudder`, reversed whenever the heading is `heading` off: both in rad."""

    start_secs: float
    rudder: float
    heading: float


@dataclass(frozen=True)
class Manoeuvre:
    """Orders by the clock, and for a zig-zag by the heading from its start on."""

    name: str
    orders: tuple[Order, ...]
    zigzag: ZigZag | None = None
    initial_speed: float | None = None  # m/s; None: what the revolutions give on a straight run


def manoeuvre(
    name: str, duration_secs: float, rpm: float, rng: np.random.Generator | None = None
) -> Manoeuvre:
    """The manoeuvre of that name: `zigzag-20-20`, `turning-circle-35-port`, `spiral`, ...

    `rng` draws the orders of `pseudo-random`. Raises `UsageError` for a name nobody knows.
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
    duration_secs: float
    rpm: float
    side: float
    angles: list[float]
    rng: np.random.Generator | None

    def angle(self, usual_deg: float) -> float:
        """The angle named, or the usual one, on the side asked for; 0 < angle <= 90°."""
        angle = self.angles[0] if self.angles else usual_deg * DEG
        if not 0 < angle <= 45 * DEG:
            raise UsageError(f"a rudder angle of {angle / DEG:g}° cannot be ordered")
        return self.side * angle


def _turning_circle(name: str, setting: _Setting) -> Manoeuvre:
    hard_over = Order(APPROACH_SECS, setting.angle(35.0), setting.rpm)
    return Manoeuvre(name, (Order(0.0, 0.0, setting.rpm), hard_over))


def _zigzag(name: str, setting: _Setting) -> Manoeuvre:
    rudder, heading = setting.angle(20.0), setting.angles[1]
    if not 0 < heading <= 90 * DEG:
        raise UsageError(f"a zig-zag cannot turn at {heading / DEG:g}° of heading")
    orders = (Order(0.0, 0.0, setting.rpm),)
    return Manoeuvre(name, orders, ZigZag(APPROACH_SECS, rudder, heading))


def _pull_out(name: str, setting: _Setting) -> Manoeuvre:
    angle = setting.angle(20.0)
    return _held(name, setting, (angle, 0.0, -angle, 0.0), 150.0)


def _spiral(name: str, setting: _Setting) -> Manoeuvre:
    down = [setting.side * angle * DEG for angle in SPIRAL_DEG]
    return _held(name, setting, (*down, *down[-2:0:-1]), 120.0)


def _held(name: str, setting: _Setting, angles: tuple[float, ...], hold_secs: float) -> Manoeuvre:
    """One angle after another, over and over."""
    orders = [Order(0.0, 0.0, setting.rpm)]
    times = np.arange(APPROACH_SECS, setting.duration_secs, hold_secs)
    for i, time in enumerate(times.tolist()):
        orders.append(Order(time, angles[i % len(angles)], setting.rpm))
    return Manoeuvre(name, tuple(orders))


def _pseudo_random(name: str, setting: _Setting) -> Manoeuvre:
    """Rudder and revolutions stepped at random: what identification likes best."""
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
    """Levels drawn evenly, each held for a time drawn evenly, on whole tenths of seconds."""
    steps, time = {}, APPROACH_SECS
    while time < duration:
        steps[time] = float(rng.uniform(*level))
        time = round(time + float(rng.uniform(*hold)), 1)
    return steps


def _paper(name: str, _: _Setting) -> Manoeuvre:
    """The identification paper's own run: slow ahead, then two circles, at 100 rpm."""
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
