"""Fields of messages as channels: units, senses, and angles from axes and orientations."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shiplog.layouts.layout import ROLES
from shiplog.layouts.mcap_layout import QUATERNION, FieldChannel
from shiplog.types import FloatArray
from shiplog.units import GEOGRAPHIC, UNITS, conversion_factor

MIN_NORM, MAX_NORM = 0.9, 1.1  # of a quaternion; others are no orientation
MIN_COURSE_SPEED = 0.05  # m/s: a slower ship has no course
QUATERNION_PARTS = ("x", "y", "z", "w")


@dataclass(frozen=True, eq=False)
class ConvertedFields:
    """Values of a channel in SI units, with its sign convention.

    Attributes
    ----------
    name, unit, components
        Name, unit and names of the components of the channel.
    values
        (n, k); NaN where not measured.
    """

    name: str
    unit: str
    components: tuple[str, ...]
    values: FloatArray


def read_paths(channel: FieldChannel) -> tuple[str, ...]:
    """Return the paths of the numbers that a channel is computed from.

    Those of a quaternion are its four parts.
    """
    if channel.units[0] == QUATERNION:
        return tuple(f"{channel.paths[0]}.{part}" for part in QUATERNION_PARTS)
    return channel.paths


def convert_fields(channel: FieldChannel, raw: FloatArray) -> Iterator[ConvertedFields]:
    """Convert fields to the channels they give.

    Parameters
    ----------
    channel
        Their description.
    raw
        (n, m) numbers of the m paths of `read_paths`; NaN where absent.
    """
    if channel.units[0] == QUATERNION:
        angle = orientation_angle(channel.name, raw, channel.axes)
        yield ConvertedFields(channel.name, "rad", (), angle[:, None])
        return
    values = raw * np.array(_factors(channel))
    if channel.name == "velocity":
        yield from _speed_and_course(values)
        return
    if channel.axes == "enu":
        values = _from_north(values)
    if channel.components == GEOGRAPHIC[:2]:
        values = np.column_stack([values, np.full(len(values), np.nan)])
    if channel.name == "position":
        geographic = set(channel.components) <= set(GEOGRAPHIC)
        unit, components = ("deg", GEOGRAPHIC) if geographic else ("m", channel.components)
        yield ConvertedFields("position", unit, components, values)
        return
    yield ConvertedFields(channel.name, si_unit(channel), (), values)


def si_unit(channel: FieldChannel) -> str:
    """Return the SI unit of a scalar channel; of an unknown quantity that of its own unit."""
    if channel.name in ROLES:
        return ROLES[channel.name]
    unit = channel.units[0]
    return UNITS[unit][0] if unit in UNITS else unit


def orientation_angle(name: str, quaternions: FloatArray, axes: str) -> FloatArray:
    """Return an angle of the ship from quaternions that rotate its body to the axes.

    Parameters
    ----------
    name
        ``heading``, ``roll`` or ``pitch``.
    quaternions
        (n, 4): x, y, z, w. One that is no unit quaternion, within a tenth, was not measured.
    axes
        ``enu``: east, north, up, with a body forward, left, up (REP 103 of ROS); ``ned``: north,
        east, down, with a body forward, starboard, down.

    Returns
    -------
    angle
        (n,) rad, with the sign convention of the channel; NaN where not measured.

    Examples
    --------
    >>> quarter = np.sqrt(0.5)  # bow to the north in ENU: turned by 90 deg from east
    >>> angle = orientation_angle("heading", np.array([[0.0, 0.0, quarter, quarter]]), "enu")
    >>> bool(np.isclose(angle[0], 0) | np.isclose(angle[0], 2 * np.pi))
    True
    """
    norm = np.sqrt((quaternions**2).sum(axis=1, keepdims=True))
    norm[~((norm > MIN_NORM) & (norm < MAX_NORM))] = np.nan
    x, y, z, w = (quaternions / norm).T
    if name == "roll":  # about the axis forward, the same in both
        roll: FloatArray = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        return roll
    if name == "pitch":  # about the axis to port in ENU: bow down is positive there
        pitch: FloatArray = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
        return -pitch if axes == "enu" else pitch
    yaw: FloatArray = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return _from_north(yaw) if axes == "enu" else yaw % (2 * np.pi)


def _from_north(angle: FloatArray) -> FloatArray:
    """Return an angle counter-clockwise from east as one clockwise from north, rad."""
    from_north: FloatArray = (np.pi / 2 - angle) % (2 * np.pi)
    return from_north


def _factors(channel: FieldChannel) -> list[float]:
    """Return the factor of each field to the SI unit and the sign of its channel."""
    factors = []
    for number, (unit, sign) in enumerate(zip(channel.units, channel.signs, strict=True)):
        component = channel.components[number] if channel.components else ""
        if component in GEOGRAPHIC[:2]:
            factors.append(sign * conversion_factor(unit, "deg"))
            continue
        scale = UNITS[unit][1] if unit in UNITS else 1.0
        factors.append(sign * scale)
    return factors


def _speed_and_course(velocity: FloatArray) -> Iterator[ConvertedFields]:
    """Yield speed and course over the ground from the velocity north and east, (n, 2) m/s."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course = np.arctan2(velocity[:, 1], velocity[:, 0]) % (2 * np.pi)
    course[speed < MIN_COURSE_SPEED] = np.nan
    yield ConvertedFields("speed_over_ground", "m/s", (), speed[:, None])
    yield ConvertedFields("course_over_ground", "rad", (), course[:, None])
