"""Numbers of a report as texts: units people use, and the digits that their uncertainty allows."""

from math import floor, isfinite, log10

from analysis.manoeuvres.trial_index import TrialIndex
from analysis.report.display import decimals

NOT_KNOWN = "–"
DIGITS = 3  # significant ones, of a number without uncertainty


def number_text(value: float, std: float) -> str:
    """Write a number with the digits that its standard uncertainty allows.

    Parameters
    ----------
    value
        NaN gives a dash.
    std
        In the same unit; where NaN or 0, three significant digits are written.

    Examples
    --------
    >>> number_text(999.273, 8.1), number_text(15.114, float("nan")), number_text(0.0, 0.0)
    ('999.3', '15.1', '0')
    """
    if not isfinite(value):
        return NOT_KNOWN
    if isfinite(std) and std > 0:
        return f"{value:.{decimals(std)}f}"
    if value == 0:
        return "0"
    return f"{value:.{max(DIGITS - 1 - floor(log10(abs(value))), 0)}f}"


def value_text(index: TrialIndex) -> str:
    """Write the value of an index with its unit."""
    text = number_text(index.value * index.display_factor, index.std * index.display_factor)
    return with_unit(text, index.display_unit)


def interval_text(index: TrialIndex) -> str:
    """Write the 95 % interval of an index; a dash where it is not known."""
    if not (isfinite(index.low) and isfinite(index.high)):
        return NOT_KNOWN
    factor = index.display_factor
    low, high = (number_text(each * factor, index.std * factor) for each in (index.low, index.high))
    return with_unit(f"{low} to {high}", index.display_unit)


def length_text(index: TrialIndex) -> str:
    """Write a distance in ship lengths; empty where it is none or the length is unknown."""
    if not isfinite(index.in_lengths):
        return ""
    return f"{number_text(index.in_lengths, index.std * index.in_lengths / index.value)} L"


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
