"""Conditions of a trial from the hull of the vessel file, and a hull from stated conditions."""

from collections.abc import Mapping
from math import nan

from shiplog.vessel.hull import MOST, Hull, parse_hull
from shiplog.vessel.vessel import Vessel

CONDITION_PREFIX = "condition."  # of metadata
DRAUGHTS = ("draught", "draught_forward", "draught_aft")
FULLNESS = ("block_coefficient", "displacement")


def stated_conditions(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the conditions that the metadata of a log state, by name.

    Examples
    --------
    >>> stated_conditions({"condition.draught_aft": "8.5 m", "source": "bridge"})
    {'draught_aft': '8.5 m'}
    """
    return {
        key.removeprefix(CONDITION_PREFIX): text
        for key, text in metadata.items()
        if key.startswith(CONDITION_PREFIX)
    }


def with_hull_conditions(stated: Mapping[str, str], vessel: Vessel | None) -> dict[str, str]:
    """Complete the conditions that a log states with those of the vessel file.

    What the log states precedes. Of the draughts, and of block coefficient and displacement, all
    are the log's or all are the file's: they belong to one loading.

    Parameters
    ----------
    stated
        Conditions by name, as the log's metadata state them, such as ``{"breadth": "32 m"}``.
    vessel
        The vessel; None where nothing is known of the ship.

    Returns
    -------
    dict of str
        The conditions; a number is followed by its unit.

    Examples
    --------
    >>> from shiplog.vessel.hull import Hull
    >>> with_hull_conditions({"draught": "9 m"}, Vessel("", None, hull=Hull(32.0, 10.0)))
    {'breadth': '32 m', 'draught': '9 m'}
    """
    if vessel is None:
        return dict(stated)
    hull = vessel.hull
    values: dict[str, tuple[float | str | None, str]] = {
        "breadth": (hull.breadth, "m"),
        "draught": (hull.draught, "m"),
        "draught_forward": (hull.draught_forward, "m"),
        "draught_aft": (hull.draught_aft, "m"),
        "block_coefficient": (_rounded(hull.fullness(vessel.length)), ""),
        "displacement": (hull.displacement, "t"),
        "rudder_area": (hull.rudder_area, "m2"),
        "rudder_aspect_ratio": (_rounded(hull.aspect_ratio), ""),
        "propeller_diameter": (hull.propeller_diameter, "m"),
        "propeller_pitch_ratio": (hull.propeller_pitch_ratio, ""),
        "propeller_turning": (hull.propeller_turning, ""),
    }
    for group in (DRAUGHTS, FULLNESS):
        if any(name in stated for name in group):
            for name in group:
                del values[name]
    texts = {name: _text(value, unit) for name, (value, unit) in values.items()}
    return {name: text for name, text in texts.items() if text} | dict(stated)


def hull_of_conditions(stated: Mapping[str, str], length: float | None) -> Hull:
    """Return the hull that a log states in its conditions.

    Parameters
    ----------
    stated
        Conditions by name, such as ``{"breadth": "32 m"}``.
    length
        Length between perpendiculars, m; None where unknown.

    Returns
    -------
    Hull
        Without any dimension where those stated contradict each other.

    Examples
    --------
    >>> hull_of_conditions({"breadth": "32 m", "loading": "ballast"}, 200.0).breadth
    32.0
    """
    numbers = {name: stated_number(stated, name) for name in MOST if name in stated}
    if "block_coefficient" in numbers:
        numbers.pop("displacement", None)
    known = {name: value for name, value in numbers.items() if value > 0}
    if not {"draught_forward", "draught_aft"} <= known.keys():
        known = {name: value for name, value in known.items() if name not in DRAUGHTS}
    return parse_hull(known, length, []) or Hull()


def stated_number(stated: Mapping[str, str], name: str) -> float:
    """Return the number at the beginning of a stated condition; NaN where there is none.

    Examples
    --------
    >>> stated_number({"draught_aft": "8.5 m"}, "draught_aft")
    8.5
    """
    try:
        return float(stated.get(name, "").split(" ")[0])
    except ValueError:
        return nan


def _text(value: float | str | None, unit: str) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return f"{value:.10g} {unit}".strip()


def _rounded(value: float | None) -> float | None:
    """Round a computed ratio to four places, as far as the dimensions justify."""
    return None if value is None else round(value, 4)
