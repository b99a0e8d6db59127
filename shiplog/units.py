"""The channel catalogue, and the units at the border.

Inside shiplog everything is SI and radians, but for `rpm`, which is written as the field writes
it. Units are converted here and nowhere else, when a foreign file is read or a person is shown
a number.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from math import inf, pi

from .errors import UsageError

UNITS: dict[str, tuple[str, float]] = {
    # name: (SI unit, factor to it)
    "1": ("1", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "m": ("m", 1.0),
    "km": ("m", 1000.0),
    "ft": ("m", 0.3048),
    "nmi": ("m", 1852.0),
    "m/s": ("m/s", 1.0),
    "km/h": ("m/s", 1 / 3.6),
    "kn": ("m/s", 1852 / 3600),
    "rad": ("rad", 1.0),
    "deg": ("rad", pi / 180),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", pi / 180),
    "deg/min": ("rad/s", pi / 180 / 60),
    "rpm": ("rpm", 1.0),
    "rev/s": ("rpm", 60.0),
}

GEOGRAPHIC = ("latitude", "longitude", "altitude")  # deg, deg, m: components of a `position`


@dataclass(frozen=True)
class ChannelKind:
    """What a channel of one name means, whichever sensor it comes from."""

    name: str
    unit: str
    positive: str  # the sign convention, in words
    display_unit: str
    lowest: float = -inf  # beyond these a value is physically impossible on a ship
    highest: float = inf
    circular: bool = False  # an angle that wraps
    commanded: bool = False  # an input of the ship: it acts between its samples too


CATALOGUE: dict[str, ChannelKind] = {
    kind.name: kind
    for kind in (
        ChannelKind("yaw_rate", "rad/s", "bow to starboard", "deg/s", -1.0, 1.0),
        ChannelKind("speed", "m/s", "ahead through the water", "kn", -30.0, 50.0),
        ChannelKind(
            "rudder", "rad", "turns the bow to starboard", "deg", -1.6, 1.6, commanded=True
        ),
        ChannelKind("rpm", "rpm", "drives ahead", "rpm", -3000.0, 3000.0, commanded=True),
        ChannelKind("heading", "rad", "clockwise from north", "deg", -1e3, 1e3, circular=True),
        ChannelKind("sway", "m/s", "to starboard through the water", "kn", -30.0, 30.0),
        ChannelKind("position", "m", "north and east of a local origin", "m"),
        ChannelKind("wind_speed", "m/s", "true wind", "kn", 0.0, 120.0),
        ChannelKind(
            "wind_direction",
            "rad",
            "true wind blows from, clockwise from north",
            "deg",
            -7.0,
            7.0,
            circular=True,
        ),
    )
}


def kind_of(channel: str) -> ChannelKind:
    """The catalogue's entry for a channel.

    Raises `UsageError` for a name that is not in the catalogue.
    """
    try:
        return CATALOGUE[channel]
    except KeyError:
        raise UsageError(
            f"no channel is called {channel!r}{did_you_mean(channel, CATALOGUE)}"
        ) from None


def conversion_factor(unit: str, to: str) -> float:
    """The number to multiply a value in `unit` by to have it in `to`.

    Raises `UsageError` for a unit nobody knows, or for two that do not measure the same thing.
    """
    for name in (unit, to):
        if name not in UNITS:
            raise UsageError(
                f"unknown unit {name!r}{did_you_mean(name, UNITS)}; known are {', '.join(UNITS)}"
            )
    (base, to_base), (other_base, to_other) = UNITS[unit], UNITS[to]
    if base != other_base:
        raise UsageError(f"{unit!r} cannot be turned into {to!r}: one is in {base}, the other not")
    return to_base / to_other


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """`; did you mean 'yaw_rate'?` where a known name is near, else an empty string."""
    near = get_close_matches(name, list(known), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""
