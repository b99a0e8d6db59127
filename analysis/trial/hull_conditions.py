"""Conditions of a trial that follow from the hull of the vessel file."""

from collections.abc import Mapping

from shiplog.vessel.vessel import Vessel

DRAUGHTS = ("draught", "draught_forward", "draught_aft")
FULLNESS = ("block_coefficient", "displacement")


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
        "block_coefficient": (hull.fullness(vessel.length), ""),
        "displacement": (hull.displacement, "t"),
        "rudder_area": (hull.rudder_area, "m2"),
        "rudder_aspect_ratio": (hull.aspect_ratio, ""),
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


def _text(value: float | str | None, unit: str) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return f"{value:.4g} {unit}".strip()
