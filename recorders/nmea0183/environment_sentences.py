"""Sentences of wind, depth and water temperature."""

from .sentence_values import Fields, Values, is_valid, measured, number_at, signed, text_at
from .steering_sentences import DEG, KMH, KNOT

_SPEED_UNITS = {"N": KNOT, "K": KMH, "M": 1.0, "S": 0.44704}  # S: statute miles/h
_VWR_SPEEDS = ((2, KNOT), (4, 1.0), (6, KMH))  # fields and units
_FOOT, _FATHOM = 0.3048, 1.8288


def wind_angle_and_speed(fields: Fields) -> Values:
    """``MWV,x.x,R,x.x,N,A``: angle from the bow in deg, speed, unit, status.

    With R it is the apparent wind, with T the true one; the angle is from the bow in both.
    """
    reference, valid = text_at(fields, 1), is_valid(fields, 4)
    angle, speed = number_at(fields, 0), number_at(fields, 2)
    factor = 1.0 if speed is None else _speed_factor(text_at(fields, 3))
    if reference == "R":
        return _apparent(angle, speed, factor, valid=valid)
    if reference == "T":
        return (
            *measured("true_wind_angle", angle, DEG, valid=valid),
            *measured("wind_speed", speed, factor, valid=valid, suffix="MWV"),
        )
    if angle is None and speed is None:
        return ()
    raise ValueError(reference)


def relative_wind(fields: Fields) -> Values:
    """``VWR,x.x,L,x.x,N,x.x,M,x.x,K``: angle to the left or right of the bow in deg, speed."""
    angle = signed(number_at(fields, 0), text_at(fields, 1), "R", "L")
    speed, factor = _speed(fields, _VWR_SPEEDS)
    return _apparent(angle, speed, factor, valid=True, suffix="VWR")


def true_relative_wind(fields: Fields) -> Values:
    """``VWT,x.x,L,x.x,N,x.x,M,x.x,K``: as ``VWR``, of the true wind."""
    angle = signed(number_at(fields, 0), text_at(fields, 1), "R", "L")
    return (
        *measured("true_wind_angle", angle, DEG, suffix="VWT"),
        *measured("wind_speed", *_speed(fields, _VWR_SPEEDS), suffix="VWT"),
    )


def wind_direction(fields: Fields) -> Values:
    """``MWD,x.x,T,x.x,M,x.x,N,x.x,M``: directions it blows from in deg, speed in knots, m/s."""
    return (
        *measured("wind_direction", number_at(fields, 0), DEG),
        *measured("wind_speed", *_speed(fields, ((4, KNOT), (6, 1.0)))),
    )


def _apparent(
    angle: float | None, speed: float | None, factor: float, *, valid: bool, suffix: str = ""
) -> Values:
    return (
        *measured("apparent_wind_angle", angle, DEG, valid=valid, suffix=suffix),
        *measured("apparent_wind_speed", speed, factor, valid=valid, suffix=suffix),
    )


def _speed_factor(unit: str) -> float:
    if unit not in _SPEED_UNITS:
        raise ValueError(unit)
    return _SPEED_UNITS[unit]


def _speed(fields: Fields, units: tuple[tuple[int, float], ...]) -> tuple[float | None, float]:
    """Return the number of the first of several fields that is filled, and its factor."""
    for index, factor in units:
        number = number_at(fields, index)
        if number is not None:
            return number, factor
    return None, 1.0


def depth_below_transducer(fields: Fields) -> Values:
    """``DBT,x.x,f,x.x,M,x.x,F``: depth below the transducer in ft, m, fathoms."""
    return measured("depth", *_depth(fields), suffix="below_transducer")


def depth_below_surface(fields: Fields) -> Values:
    """``DBS,x.x,f,x.x,M,x.x,F``: depth below the surface in ft, m, fathoms."""
    return measured("depth", *_depth(fields))


def depth_below_keel(fields: Fields) -> Values:
    """``DBK,x.x,f,x.x,M,x.x,F``: depth below the keel in ft, m, fathoms."""
    return measured("depth", *_depth(fields), suffix="below_keel")


def depth(fields: Fields) -> Values:
    """``DPT,x.x,x.x,x.x``: depth below the transducer, offset in m, range.

    A positive offset is the distance from the transducer to the surface, a negative one that to the
    keel.
    """
    below, offset = number_at(fields, 0), number_at(fields, 1)
    if below is None or not offset:
        return measured("depth", below, suffix="below_transducer")
    return measured("depth", below + offset, suffix="" if offset > 0 else "below_keel")


def _depth(fields: Fields) -> tuple[float | None, float]:
    return _speed(fields, ((2, 1.0), (0, _FOOT), (4, _FATHOM)))


def water_temperature(fields: Fields) -> Values:
    """``MTW,x.x,C``: water temperature in °C."""
    if text_at(fields, 1) not in ("C", ""):
        raise ValueError(fields[1])
    return measured("water_temperature", number_at(fields, 0))


ENVIRONMENT = {
    "MWV": wind_angle_and_speed,
    "VWR": relative_wind,
    "VWT": true_relative_wind,
    "MWD": wind_direction,
    "DBT": depth_below_transducer,
    "DBS": depth_below_surface,
    "DBK": depth_below_keel,
    "DPT": depth,
    "MTW": water_temperature,
}
"""The decoder of each of these sentences, by formatter."""
