"""Paths of Signal K that are channels; its values are in SI units, with revolutions in Hz.

The signs are those of the catalogue: a rudder angle to starboard, a rate of turn to starboard and a
roll to starboard are positive (Signal K specification, keys of ``vessels``).
"""

import re
from collections.abc import Mapping
from typing import NamedTuple

KELVIN = 273.15  # 0 °C in K


class Target(NamedTuple):
    """The channel of a path.

    Attributes
    ----------
    channel
        Its name in the catalogue.
    factor, offset
        The value in the catalogue's unit is that of Signal K times `factor` plus `offset`.
    part
        Added to the source, where one source sends the same quantity by several paths.
    """

    channel: str
    factor: float = 1.0
    offset: float = 0.0
    part: str = ""


TARGETS: Mapping[str, Target] = {
    "navigation.headingTrue": Target("heading"),
    "navigation.headingMagnetic": Target("magnetic_heading"),
    "navigation.magneticVariation": Target("magnetic_variation"),
    "navigation.rateOfTurn": Target("yaw_rate"),
    "navigation.speedThroughWater": Target("speed"),
    "navigation.speedOverGround": Target("speed_over_ground"),
    "navigation.courseOverGroundTrue": Target("course_over_ground"),
    "navigation.attitude.roll": Target("roll"),
    "navigation.attitude.pitch": Target("pitch"),
    "navigation.gnss.satellites": Target("satellites"),
    "navigation.gnss.horizontalDilution": Target("hdop"),
    "steering.rudderAngle": Target("rudder"),
    "steering.rudderAngleTarget": Target("rudder_order"),
    "environment.wind.angleApparent": Target("apparent_wind_angle"),
    "environment.wind.speedApparent": Target("apparent_wind_speed"),
    "environment.wind.directionTrue": Target("wind_direction"),
    "environment.wind.speedOverGround": Target("wind_speed"),
    "environment.wind.speedTrue": Target("wind_speed", part="water"),
    "environment.wind.angleTrueGround": Target("true_wind_angle", part="ground"),
    "environment.wind.angleTrueWater": Target("true_wind_angle", part="water"),
    "environment.depth.belowTransducer": Target("depth"),
    "environment.depth.belowSurface": Target("depth", part="surface"),
    "environment.depth.belowKeel": Target("depth", part="keel"),
    "environment.outside.temperature": Target("air_temperature", offset=-KELVIN),
    "environment.outside.pressure": Target("air_pressure"),
    "environment.outside.relativeHumidity": Target("humidity"),
    "environment.outside.humidity": Target("humidity", part="outside"),
    "environment.water.temperature": Target("water_temperature", offset=-KELVIN),
}
OF_RECEIVERS = (
    "navigation.position",
    "navigation.speedOverGround",
    "navigation.courseOverGroundTrue",
    "navigation.gnss.satellites",
    "navigation.gnss.horizontalDilution",
)
"""What a GNSS receiver measures: a source of Signal K can be a gateway with other sensors, too."""

_REVOLUTIONS = re.compile(r"propulsion\.([A-Za-z0-9_-]{1,32})\.revolutions")


def find_target(path: str) -> Target | None:
    """Return the channel of a path, or None where it has none.

    Examples
    --------
    >>> find_target("propulsion.port.revolutions")
    Target(channel='rpm', factor=60.0, offset=0.0, part='port')
    """
    if match := _REVOLUTIONS.fullmatch(path):
        return Target("rpm", factor=60.0, part=match[1])
    return TARGETS.get(path)
