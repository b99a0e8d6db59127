"""Factors by which a channel is wrong where its unit was misread, and the units that fit."""

from math import log, pi

YAW_RATE_UNITS = {
    "rad/s": 1.0, "deg/s": pi / 180, "deg/min": pi / 180 / 60, "rad/min": 1 / 60,
}  # fmt: skip
SPEED_UNITS = {"m/s": 1.0, "kn": 1852 / 3600, "km/h": 1 / 3.6, "ft/s": 0.3048, "cm/s": 0.01}
HEADING_UNITS = {"rad": 1.0, "deg": pi / 180, "grad": pi / 200}
LENGTH_UNITS = {"m": 1.0, "ft": 0.3048, "km": 1000.0, "nmi": 1852.0}
GEOGRAPHIC_UNITS = {
    "deg": 1.0, "rad": 180 / pi, "minutes of arc, such as ddmm.mmmm,": 1 / 60,
    "degrees and minutes printed as dd.mmmm": 1 / 0.6,
}  # fmt: skip
# units of which one is in each pair
COMMON_UNITS = {"rad/s", "deg/s", "deg/min", "m/s", "kn", "km/h", "rad", "deg", "m"}
READ_UNITS = COMMON_UNITS | set(SPEED_UNITS)  # that a layout may state wrongly


def misread_units(
    factor: float, units: dict[str, float], tolerance: float
) -> list[tuple[str, str]]:
    """Return the pairs (actual unit, unit read) that explain a factor, the best first.

    Parameters
    ----------
    factor
        The value read over the actual one; its sign does not matter.
    units
        Units with their factors to SI.
    tolerance
        Relative difference that is accepted; pairs worse than the best by more than a quarter of
        it are not returned.

    Examples
    --------
    >>> misread_units(60.0, YAW_RATE_UNITS, 0.1)
    [('deg/min', 'deg/s'), ('rad/min', 'rad/s')]
    """
    if not factor:
        return []
    matches = []
    for actual, actual_si in units.items():
        for read, read_si in units.items():
            difference = abs(log(abs(factor) * actual_si / read_si))
            possible = read in READ_UNITS and COMMON_UNITS & {actual, read}
            if actual != read and possible and difference < tolerance:
                matches.append((round(difference, 6), actual.startswith("rad/m"), actual, read))
    matches.sort()
    limit = matches[0][0] + tolerance / 4 if matches else 0.0
    return [(actual, read) for difference, _, actual, read in matches if difference <= limit]


def in_words(pairs: list[tuple[str, str]]) -> str:
    """Return the pairs as the end of a sentence, such as ``deg/min read as deg/s``.

    Examples
    --------
    >>> in_words([("kn", "m/s")])
    'kn read as m/s'
    """
    return " or ".join(f"{actual} read as {read}" for actual, read in pairs[:3])
