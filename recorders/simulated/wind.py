"""Simulated wind: what it does to a ship, and what an anemometer on board measures.

The wind is steady and uniform; the ship feels it relative to her own motion. Its yaw moment is
proportional to V² sin 2γ and V² sin γ, and its surge force is that beyond still air, to which the
ship model's own resistance belongs.
"""

from dataclasses import dataclass
from math import cos, isfinite, radians, sin
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.errors import UsageError
from shiplog.types import FloatArray

REFERENCE_WIND = 10.0  # m/s
MAX_WIND = 100.0  # m/s
APPARENT_WIND = ("apparent_wind_speed", "apparent_wind_angle")
WIND_SENSORS = (*APPARENT_WIND, "wind_speed", "wind_direction", "true_wind_angle")


@dataclass(frozen=True)
class Wind:
    """A steady wind, and how a ship answers to it.

    Attributes
    ----------
    speed
        Its speed over the water, m/s.
    direction
        Where it blows from, clockwise from north, rad.
    oblique, beam
        The rudder that turns the ship as much at the approach speed as a relative wind of
        `REFERENCE_WIND` from 45° to starboard of ahead, by the term in sin 2γ, and from abeam, by
        the term in sin γ, rad. By default the bow falls off from an oblique wind, and a
        superstructure aft turns it into a beam wind.
    drag
        The surge force of a head wind over the ship's mass and the square of its speed, 1/m.

    References
    ----------
    The size of the defaults: Blendermann, "Parameter identification of wind loads on ships",
    J. Wind Eng. Ind. Aerodyn. 51, 1994, for a ship of 200 m.
    """

    speed: float
    direction: float
    oblique: float = radians(-1.0)
    beam: float = radians(0.5)
    drag: float = 1e-5


class WindLoad(NamedTuple):
    """What compiled code needs of a wind: see `Wind`.

    Attributes
    ----------
    acts
        Whether there is a wind.
    north, east
        The velocity from which it blows, m/s.
    oblique, beam
        Rudder, rad, over the square of the relative wind, m²/s².
    drag
        1/m.
    """

    acts: bool
    north: float
    east: float
    oblique: float
    beam: float
    drag: float


CALM = WindLoad(False, 0.0, 0.0, 0.0, 0.0, 0.0)


def wind_load(wind: Wind | None) -> WindLoad:
    """Return what compiled code needs of a wind; `CALM` for none.

    Raises
    ------
    UsageError
        The wind is too strong, or a number is negative or not finite.
    """
    if wind is None:
        return CALM
    if not 0 <= wind.speed <= MAX_WIND or not isfinite(wind.direction):
        raise UsageError(
            f"a wind must have 0 to {MAX_WIND:g} m/s and a finite direction, got {wind.speed:g} m/s"
            f" from {np.degrees(wind.direction):g}°"
        )
    per_square = 1 / REFERENCE_WIND**2
    return WindLoad(
        True,
        wind.speed * cos(wind.direction),
        wind.speed * sin(wind.direction),
        wind.oblique * per_square,
        wind.beam * per_square,
        wind.drag,
    )


@compiled
def wind_on_ship(wind: WindLoad, heading: float, ahead: float, sway: float) -> tuple[float, float]:
    """Compute the yaw moment, rad of rudder, and the surge force, m/s², of the wind.

    Parameters
    ----------
    wind
        The wind.
    heading
        The ship's heading, rad.
    ahead, sway
        Her velocity ahead and to starboard, m/s.
    """
    # where the relative wind blows from, as a velocity: V cos γ ahead and V sin γ to starboard
    a = wind.north * cos(heading) + wind.east * sin(heading) + ahead
    s = wind.east * cos(heading) - wind.north * sin(heading) + sway
    speed = (a * a + s * s) ** 0.5
    moment = wind.oblique * 2 * a * s + wind.beam * speed * s
    return moment, wind.drag * (ahead * abs(ahead) - speed * a)


def measured_wind(
    wind: Wind, heading: FloatArray, ahead: FloatArray, sway: FloatArray
) -> dict[str, FloatArray]:
    """Return the true values of all `WIND_SENSORS`, (n,) by channel.

    Parameters
    ----------
    wind
        The wind.
    heading, ahead, sway
        (n,): the ship's motion as in `wind_on_ship`.

    Examples
    --------
    >>> still = np.zeros(1)
    >>> wind = measured_wind(Wind(5.0, 0.0), still, np.array([3.0]), still)
    >>> wind["apparent_wind_speed"].tolist(), wind["apparent_wind_angle"].tolist()
    ([8.0], [0.0])
    """
    angle = wind.direction - heading
    a, s = wind.speed * np.cos(angle) + ahead, wind.speed * np.sin(angle) + sway
    return {
        "apparent_wind_speed": np.hypot(a, s),
        "apparent_wind_angle": np.arctan2(s, a),
        "wind_speed": np.full(len(heading), wind.speed),
        "wind_direction": np.full(len(heading), wind.direction % (2 * np.pi)),
        "true_wind_angle": np.arctan2(np.sin(angle), np.cos(angle)),
    }
