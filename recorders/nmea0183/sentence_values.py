"""Values in the fields of a sentence: numbers, validity and hemispheres."""

from math import isfinite, nan

Fields = tuple[bytes, ...]
"""The fields of a sentence, in printable ASCII."""

Fix = tuple[float, float, float]
"""Latitude and longitude in deg, altitude in m; NaN where not known."""


Value = tuple[str, float | Fix, str]
"""A measured value of a sentence: channel, value and suffix.

The channel is one of `shiplog.units.CATALOGUE`. The value is in its unit, or a fix; NaN where the
sender marks it as invalid. The suffix distinguishes it from other values of this channel by the
same talker: ``port`` of two rudders, or the sentence where another one is usual; else it is empty.
"""

Values = tuple[Value, ...]
"""The measured values of a sentence."""


def text_at(fields: Fields, index: int) -> str:
    """Return a field without padding; empty where the sentence is too short."""
    return fields[index].strip().decode() if index < len(fields) else ""


def number_at(fields: Fields, index: int) -> float | None:
    """Return the number in a field; None where it is empty.

    Raises
    ------
    ValueError
        The field is not a finite number.
    """
    if index >= len(fields) or not (text := fields[index]) or text.isspace():
        return None
    value = float(text)
    if not isfinite(value) or b"_" in text:
        raise ValueError(text)
    return value


def is_valid(fields: Fields, index: int, valid: str = "A") -> bool:
    """Whether a status is one of the letters for valid data.

    Sentences of old devices end before the status; a sentence without it is taken as valid.
    """
    return index >= len(fields) or fields[index].strip().decode() in valid


def measured(
    channel: str,
    number: float | None,
    factor: float = 1.0,
    *,
    valid: bool = True,
    suffix: str = "",
) -> Values:
    """Return a value in the unit of its channel; nothing where it was not measured.

    Parameters
    ----------
    channel
        The channel.
    number
        The number in the sentence.
    factor
        Converts it to the unit of the channel.
    valid
        Whether the sender marks it as valid; if not, the value is NaN.
    suffix
        The suffix of the source.

    Raises
    ------
    ValueError
        The value is too large for a number.
    """
    if number is None:
        return ()
    value = number * factor
    if not isfinite(value):
        raise ValueError(number)
    return ((channel, value if valid else nan, suffix),)


def signed(number: float | None, letter: str, positive: str, negative: str) -> float | None:
    """Return a number with the sign that a letter gives it, such as E and W of a variation.

    Raises
    ------
    ValueError
        The letter is neither of them.
    """
    if number is None:
        return None
    if letter not in (positive, negative):
        raise ValueError(letter)
    return number if letter == positive else -number
