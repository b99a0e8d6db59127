"""Symbols and units of the indices by their names, and why an index has no value."""

from collections.abc import Mapping
from math import degrees

import numpy as np

from .manoeuvre_values import TRACK_INDICES, IndexCase
from .sailed_manoeuvre import ManoeuvreKind

SYMBOLS = {
    "advance": "Ad", "transfer": "Tr", "tactical diameter": "DT", "steady diameter": "D",
    "drift angle": "β", "steady yaw rate": "r", "initial turning time": "ta",
    "track reach": "ST", "head reach": "SH", "lateral deviation": "SL",
    **{f"overshoot {k}": f"ψ0{k}" for k in range(1, 10)},
    **{f"time to {angle}°": f"t{angle}" for angle in (90, 180, 270, 360)},
    **{f"speed at {angle}°": f"V{angle}" for angle in (90, 180, 270, 360)},
}  # fmt: skip
UNITS = {
    "drift angle": "rad", "heading change": "rad", "loop width": "rad", "loop height": "rad/s",
    "speed loss": "1", "power": "W",
    "revolutions": "rpm", "period": "s", "reach": "s", "transfer": "m",
    "advance": "m", "lateral deviation": "m",
}  # fmt: skip
NO_LOOP = "the rudder is neutral at one yaw rate: a course-stable ship has no loop"
UNIT_WORDS = (
    ("overshoot", "rad"), ("yaw rate", "rad/s"), ("diameter", "m"), ("distance", "m"),
    ("track reach", "m"), ("head reach", "m"), ("time", "s"), ("speed", "m/s"),
)  # fmt: skip


def index_unit(name: str) -> str:
    """Return the SI unit of an index.

    Examples
    --------
    >>> index_unit("overshoot 2"), index_unit("time to 90°"), index_unit("speed at 90°")
    ('rad', 's', 'm/s')
    """
    if name in UNITS:
        return UNITS[name]
    return next(unit for word, unit in UNIT_WORDS if word in name)


def missing_reason(name: str, missing: Mapping[str, str]) -> str:
    """Return why an index lacks its channel; empty where it does not."""
    if name in TRACK_INDICES or name == "speed by track":
        return missing.get("track", "")
    if "distance" in name:
        return missing["track"] if "track" in missing and "speed" in missing else ""
    if "speed" in name:
        return missing.get("speed", "")
    return missing.get(name, "")


def unreached_reason(name: str, case: IndexCase) -> str:
    """Return why an index whose channels are there has no value."""
    found = case.found
    turned = np.abs(case.signals.heading[case.first : found.end] - case.approach)
    most = degrees(float(np.max(turned, initial=0.0)))
    if found.kind is ManoeuvreKind.TURNING_CIRCLE:
        return f"the heading changes by {most:.0f}° with the rudder held"
    if name.startswith("overshoot"):
        return "the heading does not come back before the manoeuvre ends"
    if name in ("period", "reach"):
        return "the heading does not cross the approach heading often enough"
    if found.kind is ManoeuvreKind.STOPPING:
        return f"the speed falls to {float(np.min(case.signals.speed)):.1f} m/s, not to zero"
    if name.startswith("loop"):
        is_reverse = found.kind is ManoeuvreKind.REVERSE_SPIRAL
        return NO_LOOP if is_reverse else "the spiral was not sailed both ways"
    return f"the heading changes by {most:.1f}°"
