"""Messages of NMEA 2000 that hold a channel: what each of them measures.

The numbers are those of canboat's database in SI units; None means not available. A sensor that
sends one quantity in two messages has two topics, apart by `Reading.part`, because their times,
resolutions and filters differ.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from .canboat_library import FrameError

Fields = Mapping[str, int | float | None]
Fix = tuple[float, float, float]

DAY_SECS = 86400
KELVIN = 273.15  # 0 °C in K
_NAN = float("nan")
_OUTSIDE = 1  # code of the outside air in the messages of the environment
_SEA = 0


class Reading(NamedTuple):
    """A value of one channel.

    Attributes
    ----------
    channel
        Its name in the catalogue.
    value
        The value in the catalogue's unit; of a position latitude and longitude in deg and altitude
        in m (NaN where unknown); None where it is not available.
    part
        What keeps it apart from the same channel of the same address in another message: the
        number of a second rudder or engine, or the name of the message.
    """

    channel: str
    value: float | Fix | None
    part: str = ""


def _heading(f: Fields) -> list[Reading]:
    channel = {0: "heading", 1: "magnetic_heading"}.get(_code(f["reference"]))
    return [Reading(channel, f["heading"])] if channel else []


def _rudder(f: Fields) -> list[Reading]:
    """Rudder: positive turns the bow to starboard, as in RSA of NMEA 0183.

    `directionOrder` is the direction of the movement, not the sign of the angle: in a recording of
    an autopilot, "to starboard" stands where the order is greater than the position.
    """
    part = _instance(f)
    return [Reading("rudder", f["position"], part), Reading("rudder_order", f["angleOrder"], part)]


def _engine(f: Fields) -> list[Reading]:
    return [Reading("rpm", _scaled(f["speed"], 60.0), _instance(f))]


def _speed(f: Fields) -> list[Reading]:
    if _code(f.get("speedDirection")) not in (0, 15, -1):
        raise FrameError("speed with a direction, whose meaning is not published")
    ground = Reading("speed_over_ground", f["speedGroundReferenced"], "log")
    return [Reading("speed", f["speedWaterReferenced"]), ground]


def _attitude(f: Fields) -> list[Reading]:
    """Pitch and roll; the yaw is no heading: its reference is not stated."""
    return [Reading("pitch", f["pitch"]), Reading("roll", f["roll"])]


def _fix(f: Fields, altitude: float | None = None) -> Fix | None:
    latitude, longitude = f["latitude"], f["longitude"]
    if latitude is None or longitude is None:
        return None
    if abs(latitude) > 90 or abs(longitude) > 180:
        raise FrameError("position outside of the globe")
    return latitude, longitude, _NAN if altitude is None else altitude


def _gnss(f: Fields) -> list[Reading]:
    method = _code(f["method"])
    fix = _fix(f, f["altitude"]) if method > 0 else None  # 0: no fix
    return [
        Reading("position", fix, "gnss"),
        Reading("gnss_time", _instant(f), "gnss"),
        Reading("fix_quality", method if 0 <= method < 9 else None),
        Reading("satellites", f["numberOfSvs"]),
        Reading("hdop", f["hdop"]),
    ]


def _course(f: Fields) -> list[Reading]:
    speed = Reading("speed_over_ground", f["sog"])
    true = _code(f["cogReference"]) == 0
    return [speed, Reading("course_over_ground", f["cog"])] if true else [speed]


def _wind(f: Fields) -> list[Reading]:
    """Wind from north, apparent, or true relative to the bow: over ground or through the water."""
    known = {
        0: ("wind_speed", "wind_direction", ""),
        2: ("apparent_wind_speed", "apparent_wind_angle", ""),
        3: ("wind_speed", "true_wind_angle", "ground"),
        4: ("wind_speed", "true_wind_angle", "water"),
    }.get(_code(f["reference"]))
    if known is None:
        return []
    speed, angle, part = known
    return [Reading(speed, f["windSpeed"], part), Reading(angle, f["windAngle"], part)]


def _depth(f: Fields) -> list[Reading]:
    """Depth below the transducer; with an offset, below the surface (positive) or the keel."""
    depth, offset = f["depth"], f["offset"]
    if depth is None or not offset:
        return [Reading("depth", depth)]
    return [Reading("depth", depth + offset, "surface" if offset > 0 else "keel")]


def _system_time(f: Fields) -> list[Reading]:
    by_satellite = _code(f["source"]) in (0, 1)  # GPS, GLONASS; the others are local clocks
    return [Reading("gnss_time", _instant(f))] if by_satellite else []


def _environment(f: Fields) -> list[Reading]:
    """Temperature and humidity of water or outside air, and the pressure of the air."""
    source = _code(f["temperatureSource"])
    channel = {_SEA: "water_temperature", _OUTSIDE: "air_temperature"}.get(source)
    readings = [Reading("air_pressure", f["atmosphericPressure"], "environment")]
    if channel:
        readings.append(Reading(channel, _celsius(f["temperature"]), "environment"))
    if _code(f["humiditySource"]) == _OUTSIDE:
        readings.append(Reading("humidity", f["humidity"], "environment"))
    return readings


def _temperature(kelvin: str) -> Callable[[Fields], list[Reading]]:
    def readings(f: Fields) -> list[Reading]:
        source = _code(f["source"])
        channel = {_SEA: "water_temperature", _OUTSIDE: "air_temperature"}.get(source)
        return [Reading(channel, _celsius(f[kelvin]), _instance(f))] if channel else []

    return readings


def _weather(f: Fields) -> list[Reading]:
    return [
        Reading("water_temperature", _celsius(f["waterTemperature"]), "weather"),
        Reading("air_temperature", _celsius(f["outsideAmbientAirTemperature"]), "weather"),
        Reading("air_pressure", f["atmosphericPressure"], "weather"),
    ]


def _humidity(f: Fields) -> list[Reading]:
    outside = _code(f["source"]) == _OUTSIDE
    return [Reading("humidity", f["actualHumidity"], _instance(f))] if outside else []


def _pressure(f: Fields) -> list[Reading]:
    atmospheric = _code(f["source"]) == 0
    return [Reading("air_pressure", f["pressure"], _instance(f))] if atmospheric else []


# ---- conversions


def _code(value: float | None) -> int:
    """Return the code of an enumeration, or -1 where it is not available."""
    return -1 if value is None else int(value)


def _instance(f: Fields) -> str:
    """Return the number of the rudder, engine or sensor; empty for the first and an unknown one."""
    instance = _code(f["instance"])
    return str(instance) if 0 < instance < 252 else ""  # 252 and above are reserved


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _celsius(kelvin: float | None) -> float | None:
    return None if kelvin is None else kelvin - KELVIN


def _instant(f: Fields) -> float | None:
    """Return date and time as seconds since 1970-01-01 UTC."""
    days, secs = f["date"], f["time"]
    return None if days is None or secs is None else days * DAY_SECS + secs


READINGS: Mapping[int, Callable[[Fields], list[Reading]]] = {
    126992: _system_time,
    127245: _rudder,
    127250: _heading,
    127251: lambda f: [Reading("yaw_rate", f["rate"])],
    127252: lambda f: [Reading("heave", f["heave"])],
    127257: _attitude,
    127258: lambda f: [Reading("magnetic_variation", f["variation"])],
    127488: _engine,
    128259: _speed,
    128267: _depth,
    129025: lambda f: [Reading("position", _fix(f))],
    129026: _course,
    129029: _gnss,
    129033: lambda f: [Reading("gnss_time", _instant(f), "date")],
    130306: _wind,
    130310: _weather,
    130311: _environment,
    130312: _temperature("actualTemperature"),
    130313: _humidity,
    130314: _pressure,
    130316: _temperature("temperature"),
}
"""What is read from each PGN; a message that has none of its channels gives an empty list."""
