"""Sentences of position, course and speed over ground, and time."""

from math import nan

from .sentence_values import Fields, Fix, Values, is_valid, measured, number_at, signed, text_at
from .steering_sentences import DEG, KMH, KNOT

FIX_MODES = "ADFPR"  # autonomous, differential, float, precise, real-time kinematic
_FIX_QUALITIES = ("1", "2", "3", "4", "5", "9")  # not 0 none, 6 estimated, 7 manual, 8 simulated


def fix_data(fields: Fields) -> Values:
    """``GGA,time,lat,N,lon,E,quality,satellites,hdop,altitude,M,...``."""
    quality = number_at(fields, 5)
    valid = has_fix(fields)
    return (
        *_position(fields, 1, number_at(fields, 8), valid=valid),
        *measured("fix_quality", quality),
        *measured("satellites", number_at(fields, 6)),
        *measured("hdop", number_at(fields, 7), valid=valid),
    )


def has_fix(fields: Fields) -> bool:
    """Whether the quality of ``GGA`` is that of a measured position."""
    return text_at(fields, 5) in _FIX_QUALITIES


def geographic_position(fields: Fields) -> Values:
    """``GLL,lat,N,lon,E,time,A,mode``: position, time, status."""
    valid = is_valid(fields, 5) and is_valid(fields, 6, FIX_MODES)
    return _position(fields, 0, valid=valid, suffix="GLL")


def gnss_fix(fields: Fields) -> Values:
    """``GNS,time,lat,N,lon,E,modes,satellites,hdop,altitude,...``; a mode for each system."""
    valid = has_mode(fields)
    return (
        *_position(fields, 1, number_at(fields, 8), valid=valid, suffix="GNS"),
        *measured("satellites", number_at(fields, 6), suffix="GNS"),
        *measured("hdop", number_at(fields, 7), valid=valid, suffix="GNS"),
    )


def has_mode(fields: Fields) -> bool:
    """Whether ``GNS`` has a fix of at least one system."""
    return any(mode in FIX_MODES for mode in text_at(fields, 5))


def minimum_navigation(fields: Fields) -> Values:
    """``RMC,time,A,lat,N,lon,E,knots,course,ddmmyy,variation,E,mode,status``."""
    valid = has_valid_rmc(fields)
    variation = signed(number_at(fields, 9), text_at(fields, 10) or "E", "E", "W")
    return (
        *_position(fields, 2, valid=valid, suffix="RMC"),
        *measured("speed_over_ground", number_at(fields, 6), KNOT, valid=valid, suffix="RMC"),
        *measured("course_over_ground", number_at(fields, 7), DEG, valid=valid, suffix="RMC"),
        *measured("magnetic_variation", variation, DEG, suffix="RMC"),
    )


def has_valid_rmc(fields: Fields) -> bool:
    """Whether status and mode of ``RMC`` are those of a measured position."""
    return is_valid(fields, 1) and is_valid(fields, 11, FIX_MODES)


def course_and_speed(fields: Fields) -> Values:
    """``VTG,x.x,T,x.x,M,x.x,N,x.x,K,mode``: courses in deg, speed over ground in knots, km/h."""
    valid = is_valid(fields, 8, FIX_MODES)
    knots, kmh = number_at(fields, 4), number_at(fields, 6)
    speed, factor = (kmh, KMH) if knots is None else (knots, KNOT)
    return (
        *measured("course_over_ground", number_at(fields, 0), DEG, valid=valid),
        *measured("speed_over_ground", speed, factor, valid=valid),
    )


def _position(
    fields: Fields, first: int, altitude: float | None = None, *, valid: bool, suffix: str = ""
) -> Values:
    """Return the fix in the fields ``lat,N,lon,E``; nothing where one of them is empty.

    Raises
    ------
    ValueError
        A number or a hemisphere is malformed, or out of range.
    """
    latitude = _angle(fields, first, 90, "N", "S")
    longitude = _angle(fields, first + 2, 180, "E", "W")
    if latitude is None or longitude is None:
        return ()
    fix: Fix = (latitude, longitude, nan if altitude is None else altitude)
    return (("position", fix if valid else (nan, nan, nan), suffix),)


def _angle(
    fields: Fields, index: int, highest: float, positive: str, negative: str
) -> float | None:
    """Return an angle printed as ``dddmm.mmm``, deg, with the sign of its hemisphere."""
    number = number_at(fields, index)
    if number is None:
        return None
    degrees, minutes = divmod(number, 100)
    angle = degrees + minutes / 60
    if minutes >= 60 or not 0 <= angle <= highest:
        raise ValueError(fields[index])
    return signed(angle, text_at(fields, index + 1), positive, negative)


NAVIGATION = {
    "GGA": fix_data,
    "GLL": geographic_position,
    "GNS": gnss_fix,
    "RMC": minimum_navigation,
    "VTG": course_and_speed,
}
"""The decoder of each of these sentences, by formatter."""
