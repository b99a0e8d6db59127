"""Terms of the wind in the equations of motion: coefficients times known functions of the wind.

The wind's yaw moment is a coefficient times V² sin 2γ, which an oblique wind makes, and another one
times V² sin γ, which a beam wind makes; its surge force is a coefficient times u² - V² cos γ, the
force of a head wind beyond that of still air, which is part of the ship's own resistance. V and γ
are speed and angle of the wind relative to the ship, γ from ahead to starboard, and u is the ship's
speed ahead. The coefficients are states of the filter, of unknown sign.

References
----------
Isherwood, "Wind resistance of merchant ships", Trans. RINA 115, 1973; Blendermann, "Parameter
identification of wind loads on ships", J. Wind Eng. Ind. Aerodyn. 51, 1994: yaw moments of at most
0.2 ½ρ V² A L for merchant ships, in sin γ and sin 2γ nearly, A being the lateral area and L the
length. ITTC 7.5-04-01-01.1: the correction for the wind is the force beyond that of still air.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

YAW, SURGE = range(2)
# 0.2 ½ρ V² A L is about the moment of one degree of rudder, where V is the ship's speed and A a
# hundred times the rudder's area: twice that
WIND_RUDDER = radians(2.0)
WIND_RESISTANCE = 0.1  # of the ship's own, in a wind as fast as the ship: at most about that
WIND_CHANGE = 0.02  # of the standard deviation at the start: that of the change in an hour
MIN_REFERENCE_SPEED = 1.0  # m/s


@dataclass(frozen=True)
class WindTerm:
    """A term of the wind.

    Attributes
    ----------
    label
        Its name in words.
    axis
        `YAW` for a moment, `SURGE` for a force.
    unit
        The SI unit of its coefficient.
    """

    label: str
    axis: int
    unit: str


WIND_TERMS = {
    "wind_oblique": WindTerm("oblique wind, yaw", YAW, "rad/(s m²)"),
    "wind_beam": WindTerm("beam wind, yaw", YAW, "rad/(s m²)"),
    "wind_head": WindTerm("head wind, surge", SURGE, "1/m"),
}


def apparent_wind(
    speed: FloatArray, angle: FloatArray, ship_speed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return speed and angle of the wind relative to a ship, from those of the true wind.

    Parameters
    ----------
    speed
        (n,): speed of the true wind, m/s.
    angle
        (n,): from ahead to starboard, where the true wind blows from, rad.
    ship_speed
        (n,): the ship's speed ahead, m/s; its sway is not counted.

    Examples
    --------
    >>> speed, angle = apparent_wind(np.array([3.0]), np.array([np.pi / 2]), np.array([4.0]))
    >>> speed.tolist(), np.degrees(angle).round(2).tolist()
    ([5.0], [36.87])
    """
    ahead, starboard = speed * np.cos(angle) + ship_speed, speed * np.sin(angle)
    return np.hypot(ahead, starboard), np.arctan2(starboard, ahead)


def wind_regressors(
    speed: FloatArray, angle: FloatArray, ship_speed: FloatArray
) -> dict[str, FloatArray]:
    """Return what the coefficient of each term is multiplied by, m²/s², (n,) by its name.

    Parameters
    ----------
    speed, angle
        (n,): speed, m/s, and angle, rad, of the wind relative to the ship.
    ship_speed
        (n,): the ship's speed ahead, m/s.

    Examples
    --------
    >>> still = wind_regressors(np.array([5.0]), np.array([0.0]), np.array([5.0]))
    >>> {name: abs(float(values[0])) for name, values in still.items()}
    {'wind_oblique': 0.0, 'wind_beam': 0.0, 'wind_head': 0.0}
    """
    pressure = speed**2
    return {
        "wind_oblique": pressure * np.sin(2 * angle),
        "wind_beam": pressure * np.sin(angle),
        "wind_head": ship_speed * np.abs(ship_speed) - pressure * np.cos(angle),
    }


def wind_prior_std(term: WindTerm, c: Coefficients, stats: SignalStats) -> float:
    """Return the standard deviation of a coefficient before the trial, in its unit.

    It is `WIND_RUDDER` or `WIND_RESISTANCE` at the ship's median speed.
    """
    reference = max(abs(stats.median_speed), MIN_REFERENCE_SPEED)
    if term.axis == YAW:
        return float(WIND_RUDDER * abs(c.d) * stats.max_rudder_effect / reference**2)
    resistance = max(abs(c.g) * reference**2, abs(c.h * stats.median_rpm))
    return float(WIND_RESISTANCE * resistance / reference**2)
