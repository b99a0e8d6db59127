"""Numbers of a report as texts: units people use, and the digits that their uncertainty allows."""

from math import ceil, floor, isfinite, nan

from analysis.manoeuvres.trial_index import TrialIndex
from analysis.report.display import NOT_KNOWN, number_text

# the most decimals that an index is written with: finer ones are below any sensor of a ship
MAX_DECIMALS = {"m": 1, "s": 2, "°": 2, "°/s": 4, "kn": 3, "m/s": 3, "rpm": 2, "L": 3}
OTHER_DECIMALS = 4


def index_text(index: TrialIndex, value: float) -> str:
    """Write a value of an index's unit, such as its own by another start rule, in display units."""
    factor, unit = index.display_factor, index.display_unit
    return with_unit(number_text(value * factor, index.std * factor, _most_decimals(unit)), unit)


def value_text(index: TrialIndex) -> str:
    """Write the value of an index with its unit."""
    return index_text(index, index.value)


def interval_text(index: TrialIndex) -> str:
    """Write the 95 % interval of an index; a dash where it is not known.

    One that is narrower than its last decimal is rounded outwards, so that it has a width.
    """
    if not (isfinite(index.low) and isfinite(index.high)):
        return NOT_KNOWN
    factor, most = index.display_factor, _most_decimals(index.display_unit)
    ends, std = (index.low * factor, index.high * factor), index.std * factor
    low, high = (number_text(end, std, most) for end in ends)
    if low == high and ends[0] < ends[1]:
        scale = 10.0**most
        outer = (floor(ends[0] * scale) / scale, ceil(ends[1] * scale) / scale)
        low, high = (number_text(end, std, most) for end in outer)
    return with_unit(f"{low} to {high}", index.display_unit)


def half_width_text(index: TrialIndex) -> str:
    """Write an index with half the width of its 95 % interval, at least its last decimal."""
    factor, most = index.display_factor, _most_decimals(index.display_unit)
    std = index.std * factor
    half = (index.high - index.low) / 2 * factor
    if half > 0:
        half = max(half, 10.0**-most)
    text = number_text(index.value * factor, std, most)
    if isfinite(half):
        text += f" ± {number_text(half, std, most)}"
    return with_unit(text, index.display_unit)


def std_text(index: TrialIndex, std: float) -> str:
    """Write a standard uncertainty of an index with two digits.

    One that is smaller than what the value is written with is given as below that.
    """
    factor, unit = index.display_factor, index.display_unit
    most = _most_decimals(unit)
    shown, least = std * factor, 10.0**-most
    if 0 < shown < least:
        return f"< {with_unit(f'{least:g}', unit)}"
    return with_unit(number_text(shown, shown, most), unit)


def length_text(index: TrialIndex) -> str:
    """Write a distance in ship lengths; empty where it is none or the length is unknown."""
    if not isfinite(index.in_lengths):
        return ""
    std = index.std * index.in_lengths / index.value if index.value else nan
    return f"{number_text(index.in_lengths, std, MAX_DECIMALS['L'])} L"


def with_unit(text: str, unit: str) -> str:
    """Append a unit; the degree follows the number directly.

    Examples
    --------
    >>> with_unit("9.39", "°"), with_unit("999", "m"), with_unit("2", "1")
    ('9.39°', '999 m', '2')
    """
    if unit == "1" or text == NOT_KNOWN:
        return text
    return f"{text}{unit}" if unit == "°" else f"{text} {unit}"


def percent_text(probability: float) -> str:
    """Write a probability in per cent, never as certain.

    Examples
    --------
    >>> percent_text(0.9999), percent_text(0.423), percent_text(0.0), percent_text(float("nan"))
    ('> 99.9 %', '42 %', '< 0.1 %', '–')
    """
    if not isfinite(probability):
        return NOT_KNOWN
    if probability > 0.999:
        return "> 99.9 %"
    if probability < 0.001:
        return "< 0.1 %"
    return f"{probability * 100:.{1 if probability > 0.99 or probability < 0.01 else 0}f} %"


def _most_decimals(unit: str) -> int:
    return MAX_DECIMALS.get(unit, OTHER_DECIMALS)
