"""Sentences of the ship's motion and steering: rate of turn, rudder, revolutions, log, compass."""

from math import radians

from shiplog.units import conversion_factor

from .sentence_values import Fields, Values, is_valid, measured, number_at, signed, text_at

DEG = radians(1)
DEG_PER_MIN = conversion_factor("deg/min", "rad/s")
KNOT = conversion_factor("kn", "m/s")
KMH = conversion_factor("km/h", "m/s")
PERCENT = 0.01


def rate_of_turn(fields: Fields) -> Values:
    """``ROT,x.x,A``: rate in deg/min, negative where the bow turns to port; status."""
    return measured("yaw_rate", number_at(fields, 0), DEG_PER_MIN, valid=is_valid(fields, 1))


def rudder_angle(fields: Fields) -> Values:
    """``RSA,x.x,A,x.x,A``: starboard or single rudder, status; port rudder, status; in deg.

    A negative angle turns the bow to port.
    """
    return _two_rudders("rudder", fields)


def rudder_order(fields: Fields) -> Values:
    """``ROR,x.x,A,x.x,A,a``: the orders to the rudders, as the angles of ``RSA``."""
    return _two_rudders("rudder_order", fields)


def _two_rudders(channel: str, fields: Fields) -> Values:
    return (
        *measured(channel, number_at(fields, 0), DEG, valid=is_valid(fields, 1)),
        *measured(channel, number_at(fields, 2), DEG, valid=is_valid(fields, 3), suffix="port"),
    )


def steering_order(fields: Fields) -> Values:
    """``HTC,A,x.x,a,...`` and ``HTD``: override, commanded rudder in deg, L or R, and modes."""
    order = signed(number_at(fields, 1), text_at(fields, 2), "R", "L")
    return measured("rudder_order", order, DEG)


def revolutions(fields: Fields) -> Values:
    """``RPM,S,n,x.x,x.x,A``: shaft or engine, its number, 1/min, pitch in % (negative astern)."""
    kind, number = text_at(fields, 0), text_at(fields, 1)
    if kind not in ("S", "E") or (number and not (number.isdecimal() and len(number) < 4)):
        raise ValueError(kind)
    suffix = ("shaft" if kind == "S" else "engine") + (number.lstrip("0") or "0")
    valid = is_valid(fields, 4)
    return (
        *measured("rpm", number_at(fields, 2), valid=valid, suffix=suffix),
        *measured("propeller_pitch", number_at(fields, 3), PERCENT, valid=valid, suffix=suffix),
    )


def water_speed_and_heading(fields: Fields) -> Values:
    """``VHW,x.x,T,x.x,M,x.x,N,x.x,K``: headings in deg, speed through the water in knots, km/h."""
    knots, kmh = number_at(fields, 4), number_at(fields, 6)
    return (
        *measured("heading", number_at(fields, 0), DEG, suffix="VHW"),
        *measured("magnetic_heading", number_at(fields, 2), DEG, suffix="VHW"),
        *measured("speed", kmh if knots is None else knots, KMH if knots is None else KNOT),
    )


def dual_speed(fields: Fields) -> Values:
    """``VBW,x.x,x.x,A,x.x,x.x,A,...``: speeds ahead and to starboard in knots, water and ground.

    The speed over ground is the length of the vector, where both of its components are given.
    """
    water_is_valid, ground_is_valid = is_valid(fields, 2), is_valid(fields, 5)
    ahead, starboard = number_at(fields, 3), number_at(fields, 4)
    ground = None if ahead is None or starboard is None else abs(complex(ahead, starboard))
    return (
        *measured("speed", number_at(fields, 0), KNOT, valid=water_is_valid, suffix="VBW"),
        *measured("sway", number_at(fields, 1), KNOT, valid=water_is_valid, suffix="VBW"),
        *measured("speed_over_ground", ground, KNOT, valid=ground_is_valid, suffix="VBW"),
    )


def true_heading(fields: Fields) -> Values:
    """``HDT,x.x,T``: heading in deg."""
    return measured("heading", number_at(fields, 0), DEG)


def true_heading_and_status(fields: Fields) -> Values:
    """``THS,x.x,a``: heading in deg; A measured, E estimated, M manual, S simulated, V invalid."""
    return measured("heading", number_at(fields, 0), DEG, valid=is_valid(fields, 1, "AE"))


def magnetic_sensor(fields: Fields) -> Values:
    """``HDG,x.x,x.x,a,x.x,a``: compass, deviation E or W, variation E or W, in deg.

    Magnetic is the compass with the deviation, east positive; true is magnetic with the variation.
    A true heading is derived only where the variation is given, as a source of its own.
    """
    compass = number_at(fields, 0)
    deviation = signed(number_at(fields, 1), text_at(fields, 2), "E", "W")
    variation = signed(number_at(fields, 3), text_at(fields, 4), "E", "W")
    magnetic = None if compass is None else (compass + (deviation or 0.0)) % 360
    true = None if magnetic is None or variation is None else (magnetic + variation) % 360
    return (
        *measured("magnetic_heading", magnetic, DEG),
        *measured("magnetic_variation", variation, DEG),
        *measured("heading", true, DEG, suffix="HDG"),
    )


def magnetic_heading(fields: Fields) -> Values:
    """``HDM,x.x,M``: magnetic heading in deg."""
    return measured("magnetic_heading", number_at(fields, 0), DEG, suffix="HDM")


STEERING = {
    "ROT": rate_of_turn,
    "RSA": rudder_angle,
    "ROR": rudder_order,
    "HTC": steering_order,
    "HTD": steering_order,
    "RPM": revolutions,
    "VHW": water_speed_and_heading,
    "VBW": dual_speed,
    "HDT": true_heading,
    "THS": true_heading_and_status,
    "HDG": magnetic_sensor,
    "HDM": magnetic_heading,
}
"""The decoder of each of these sentences, by formatter."""
