"""Sentences of transducers (XDR) and of a motion reference unit (PSXN)."""

from collections.abc import Callable

from .sentence_values import Fields, Value, Values, measured, number_at, text_at
from .steering_sentences import DEG, PERCENT

_ANGLES = {"roll": "roll", "pitch": "pitch", "ptch": "pitch", "heel": "heel"}
_AIR, _WATER = ("air", "outside", "ambient"), ("water", "sea")
_ZERO_CELSIUS = 273.15  # K
_BAR = 1e5  # Pa
_INVALID = "2"  # quality of PSXN,20: 0 normal, 1 reduced, 2 invalid


def transducers(fields: Fields) -> Values:
    """``XDR,a,x.x,a,c--c,...``: type, value, unit and name of each transducer.

    The names are the maker's own. Roll and heel are positive with the starboard side down, pitch
    with the bow up, heave upwards.
    """
    return _transducers(fields, _by_name)


def weather_transducers(fields: Fields) -> Values:
    """``WIXDR``: as `transducers`; a temperature or pressure without a name is that of the air."""
    return _transducers(fields, lambda name: _by_name(name or "air"))


def _transducers(fields: Fields, temperature_channel: Callable[[str], str | None]) -> Values:
    values: list[Value] = []
    for first in range(0, len(fields) - 2, 4):
        kind, unit = text_at(fields, first), text_at(fields, first + 2)
        name = text_at(fields, first + 3).lower()
        number = number_at(fields, first + 1)
        if kind == "A":
            values += _angle(number, unit, name)
        elif kind == "D" and unit == "M" and "heave" in name:
            values += measured("heave", number)
        elif kind == "C" and (channel := temperature_channel(name)):
            values += measured(channel, _celsius(number, unit))
        elif kind == "P" and (temperature_channel(name) == "air_temperature" or "baro" in name):
            values += measured("air_pressure", number, _pascal(unit))
        elif kind == "H" and unit == "P":
            values += measured("humidity", number, PERCENT)
    return tuple(values)


def _angle(number: float | None, unit: str, name: str) -> Values:
    for part, channel in _ANGLES.items():
        if part in name:
            if unit != "D":
                raise ValueError(unit)
            return measured(channel, number, DEG)
    return ()


def _by_name(name: str) -> str | None:
    """Return the channel of a temperature, by the name of its transducer."""
    if any(word in name for word in _WATER):
        return "water_temperature"
    return "air_temperature" if any(word in name for word in _AIR) else None


def _celsius(number: float | None, unit: str) -> float | None:
    """Convert a temperature in C, K or F.

    Raises
    ------
    ValueError
        The unit is another one.
    """
    if unit not in ("C", "K", "F"):
        raise ValueError(unit)
    if number is None or unit == "C":
        return number
    return number - _ZERO_CELSIUS if unit == "K" else (number - 32) / 1.8


def _pascal(unit: str) -> float:
    if unit not in ("B", "P"):
        raise ValueError(unit)
    return _BAR if unit == "B" else 1.0


class MotionUnit:
    """Decoder of ``PSXN``, the sentences of Seapath: qualities (20) and motion (23).

    The qualities apply to the motion sentences that follow.
    """

    def __init__(self) -> None:
        self._heading_is_valid = self._attitude_is_valid = True

    def decode(self, fields: Fields) -> Values:
        """``PSXN,20,horizontal,height,heading,attitude`` and ``PSXN,23,roll,pitch,heading,heave``.

        Roll is positive with the port side up, pitch with the bow up, heave downwards; in deg, m.
        """
        if text_at(fields, 0) == "20":
            self._heading_is_valid = text_at(fields, 3) != _INVALID
            self._attitude_is_valid = text_at(fields, 4) != _INVALID
        if text_at(fields, 0) != "23":
            return ()
        attitude, heading = self._attitude_is_valid, self._heading_is_valid
        return (
            *measured("roll", number_at(fields, 1), DEG, valid=attitude),
            *measured("pitch", number_at(fields, 2), DEG, valid=attitude),
            *measured("heading", number_at(fields, 3), DEG, valid=heading),
            *measured("heave", number_at(fields, 4), -1.0, valid=attitude),
        )


TRANSDUCERS = {"XDR": transducers, "WIXDR": weather_transducers}
"""The decoder of each of these sentences, by formatter, or by talker and formatter."""
