"""Channel catalogue and unit conversion.

All values in shiplog are in SI units and radians, except `rpm`, which is kept in revolutions per
minute as usual in the field. Units are converted only where a file of another program is read and
where a number is shown to a person.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from difflib import get_close_matches
from math import inf, pi

from .errors import UsageError

_YEAR_10000_SECS = 253_402_300_800  # since 1970

UNITS: dict[str, tuple[str, float]] = {
    # name: (SI unit, factor to convert to it)
    "1": ("1", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "m": ("m", 1.0),
    "km": ("m", 1000.0),
    "ft": ("m", 0.3048),
    "nmi": ("m", 1852.0),
    "m/s": ("m/s", 1.0),
    "km/h": ("m/s", 1 / 3.6),
    "kn": ("m/s", 1852 / 3600),
    "ft/s": ("m/s", 0.3048),
    "cm/s": ("m/s", 0.01),
    "rad": ("rad", 1.0),
    "deg": ("rad", pi / 180),
    "grad": ("rad", pi / 200),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", pi / 180),
    "deg/min": ("rad/s", pi / 180 / 60),
    "rad/min": ("rad/s", 1 / 60),
    "rpm": ("rpm", 1.0),
    "rev/s": ("rpm", 60.0),
    "Hz": ("rpm", 60.0),
    "%": ("1", 0.01),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "MN": ("N", 1e6),
    "Nm": ("Nm", 1.0),
    "kNm": ("Nm", 1e3),
    "MNm": ("Nm", 1e6),
    "N·m": ("Nm", 1.0),
    "kN·m": ("Nm", 1e3),
    "MN·m": ("Nm", 1e6),
    "N.m": ("Nm", 1.0),
    "kN.m": ("Nm", 1e3),
    "MN.m": ("Nm", 1e6),
    "W": ("W", 1.0),
    "kW": ("W", 1e3),
    "MW": ("W", 1e6),
    "hp": ("W", 735.49875),  # metric
    "Pa": ("Pa", 1.0),
    "kPa": ("Pa", 1e3),
    "hPa": ("Pa", 100.0),
    "bar": ("Pa", 1e5),
    "mbar": ("Pa", 100.0),
    "degC": ("degC", 1.0),
    "d": ("s", 86400.0),
    "cm": ("m", 0.01),
    "mm": ("m", 0.001),
    "m/s2": ("m/s2", 1.0),
    "g": ("m/s2", 9.80665),
}

# units in which people are shown a quantity that is not in the catalogue
DISPLAY_UNITS = {"rad": "deg", "rad/s": "deg/s", "W": "kW", "N": "kN", "Nm": "kNm"}
GEOGRAPHIC = ("latitude", "longitude", "altitude")  # deg, deg, m: components of a `position`


@dataclass(frozen=True)
class ChannelKind:
    """The meaning of a channel name, whichever sensor the channel comes from.

    Attributes
    ----------
    name
        The name of the channel.
    unit
        The unit of its values in shiplog.
    positive
        The sign convention in words; for wind, what is measured.
    display_unit
        The unit in which it is shown to people.
    lowest, highest
        The physically possible range, in `unit`; values outside it are measurement errors.
    circular
        Whether it is an angle that wraps at a full turn.
    commanded
        Whether it is an input of the ship, which acts between its samples too.
    """

    name: str
    unit: str
    positive: str
    display_unit: str
    lowest: float = -inf
    highest: float = inf
    circular: bool = False
    commanded: bool = False


CATALOGUE: dict[str, ChannelKind] = {
    kind.name: kind
    for kind in (
        ChannelKind("yaw_rate", "rad/s", "bow to starboard", "deg/s", -1.0, 1.0),
        ChannelKind("speed", "m/s", "ahead through the water", "kn", -30.0, 50.0),
        ChannelKind(
            "rudder", "rad", "turns the bow to starboard", "deg", -1.6, 1.6, commanded=True
        ),
        ChannelKind("rpm", "rpm", "drives ahead", "rpm", -3000.0, 3000.0, commanded=True),
        ChannelKind("heading", "rad", "clockwise from north", "deg", -1e3, 1e3, circular=True),
        ChannelKind("sway", "m/s", "to starboard through the water", "kn", -30.0, 30.0),
        ChannelKind("position", "m", "north and east of a local origin", "m"),
        ChannelKind("wind_speed", "m/s", "true wind", "kn", 0.0, 120.0),
        ChannelKind(
            "wind_direction",
            "rad",
            "true wind blows from, clockwise from north",
            "deg",
            -7.0,
            7.0,
            circular=True,
        ),
        ChannelKind(
            "course_over_ground", "rad", "clockwise from north", "deg", -7.0, 7.0, circular=True
        ),
        ChannelKind("speed_over_ground", "m/s", "along the course", "kn", 0.0, 50.0),
        ChannelKind("rudder_order", "rad", "turns the bow to starboard", "deg", -1.6, 1.6),
        ChannelKind("heel", "rad", "starboard side down, steady", "deg", -1.6, 1.6),
        ChannelKind("roll", "rad", "starboard side down", "deg", -3.2, 3.2),
        ChannelKind("pitch", "rad", "bow up", "deg", -1.6, 1.6),
        ChannelKind("roll_rate", "rad/s", "starboard side downwards", "deg/s", -3.0, 3.0),
        ChannelKind("pitch_rate", "rad/s", "bow upwards", "deg/s", -3.0, 3.0),
        ChannelKind("power", "W", "delivered to the shaft", "kW", -2e8, 2e8),
        ChannelKind("torque", "Nm", "drives ahead", "kNm", -5e7, 5e7),
        ChannelKind("thrust", "N", "ahead", "kN", -5e7, 5e7),
        ChannelKind("propeller_pitch", "1", "drives ahead, as a share of full pitch", "%", -2, 2),
        ChannelKind("draught", "m", "downwards from the waterline to the keel", "m", 0.0, 40.0),
        ChannelKind("depth", "m", "downwards to the sea bed", "m", 0.0, 12000.0),
        ChannelKind("wave_height", "m", "from trough to crest", "m", 0.0, 40.0),
        ChannelKind("apparent_wind_speed", "m/s", "wind relative to the ship", "kn", 0.0, 150.0),
        ChannelKind(
            "apparent_wind_angle",
            "rad",
            "wind relative to the ship blows from, from ahead to starboard",
            "deg",
            -7.0,
            7.0,
            circular=True,
        ),
        ChannelKind(
            "true_wind_angle",
            "rad",
            "true wind blows from, from ahead to starboard",
            "deg",
            -7.0,
            7.0,
            circular=True,
        ),
        ChannelKind(
            "magnetic_heading",
            "rad",
            "clockwise from magnetic north",
            "deg",
            -1e3,
            1e3,
            circular=True,
        ),
        ChannelKind("magnetic_variation", "rad", "magnetic north east of true", "deg", -3.2, 3.2),
        ChannelKind("heading_order", "rad", "clockwise from north", "deg", -7, 7, circular=True),
        ChannelKind("leeway", "rad", "drifts to starboard through the water", "deg", -1.6, 1.6),
        ChannelKind("heave", "m", "upwards", "m", -40.0, 40.0),
        ChannelKind("gnss_time", "s", "since 1970-01-01 UTC, as the receiver sent it", "s", 0.0),
        ChannelKind("fix_quality", "1", "0 no fix, 1 GNSS, 2 differential, 4 RTK", "1", 0.0, 15.0),
        ChannelKind("satellites", "1", "number used for the fix", "1", 0.0, 200.0),
        ChannelKind("hdop", "1", "horizontal dilution of precision", "1", 0.0, 100.0),
        ChannelKind("air_temperature", "degC", "warmer", "degC", -90.0, 70.0),
        ChannelKind("water_temperature", "degC", "warmer", "degC", -5.0, 60.0),
        ChannelKind("air_pressure", "Pa", "absolute, not gauge", "hPa", 5e4, 1.2e5),
        ChannelKind("humidity", "1", "relative, as a share of saturation", "%", 0.0, 1.05),
    )
}


def channel_kind(name: str) -> ChannelKind:
    """Return the catalogue entry of a channel name.

    Raises
    ------
    UsageError
        The name is not in the catalogue.

    Examples
    --------
    >>> channel_kind("rudder").positive
    'turns the bow to starboard'
    """
    try:
        return CATALOGUE[name]
    except KeyError:
        raise UsageError(
            f"no channel is called {name!r}{did_you_mean(name, CATALOGUE)}; "
            f"the catalogue has {', '.join(CATALOGUE)}"
        ) from None


def conversion_factor(unit: str, to: str) -> float:
    """Return the number by which a value in `unit` is multiplied to have it in the unit `to`.

    Raises
    ------
    UsageError
        One of the units is unknown, or they do not measure the same quantity.

    Examples
    --------
    >>> conversion_factor("min", "s")
    60.0
    """
    for name in (unit, to):
        if name not in UNITS:
            raise UsageError(
                f"unknown unit {name!r}{did_you_mean(name, UNITS)}; known are {', '.join(UNITS)}"
            )
    (base, to_base), (other_base, to_other) = UNITS[unit], UNITS[to]
    if base != other_base:
        raise UsageError(
            f"cannot convert {unit!r} to {to!r}: their SI units are {base} and {other_base}"
        )
    return to_base / to_other


def display_conversion(name: str, unit: str) -> tuple[str, float]:
    """Return the unit in which a channel is shown to people, and the factor to that unit.

    Parameters
    ----------
    name
        The channel's name; one that is not in the catalogue is shown in its own unit, or degrees
        and thousands of it.
    unit
        The unit of its values.

    Examples
    --------
    >>> display_conversion("power", "W")
    ('kW', 0.001)
    >>> display_conversion("fuel_flow", "kg/h")
    ('kg/h', 1.0)
    """
    kind = CATALOGUE.get(name)
    if kind is not None and unit in UNITS and UNITS[unit][0] == kind.unit:
        shown = kind.display_unit
    else:
        shown = DISPLAY_UNITS.get(unit, unit)
    return shown, conversion_factor(unit, shown) if shown != unit else 1.0


def utc_text(secs: float) -> str:
    """Return a time in s since 1970-01-01 UTC as date and time of day.

    A time after the year 9999, or before 1970, stays a number.

    Examples
    --------
    >>> utc_text(1406851200.0)
    '2014-08-01 00:00:00'
    """
    if not 0 <= secs < _YEAR_10000_SECS:
        return f"{secs:.4g} s"
    return f"{datetime.fromtimestamp(int(secs), UTC):%Y-%m-%d %H:%M:%S}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a hint for an error message, or an empty string where no known name is similar.

    Examples
    --------
    >>> did_you_mean("ruder", ["rudder", "rpm"])
    "; did you mean 'rudder'?"
    """
    near = get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""
