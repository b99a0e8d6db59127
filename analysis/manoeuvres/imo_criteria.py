"""Criteria of IMO Resolution MSC.137(76), and the probability that an index meets its limit.

Source: IMO Resolution MSC.137(76), "Standards for ship manoeuvrability", 2002, section 5.3.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import erf, isfinite, radians, sqrt

from .sailed_manoeuvre import ManoeuvreKind
from .trial_index import Criterion

NORM = "IMO MSC.137(76)"
HARD_OVER = radians(32.0)  # a turning circle of 35° or the largest angle
LIKE_ANGLE = radians(2.5)  # from 10° or 20°: the zig-zag of the norm
SLOW, FAST = 30.0, 10.0  # s, L/V at which the limits of the zig-zag 10/10 change


@dataclass(frozen=True)
class CriterionRule:
    """One criterion of the norm: the index it limits, and in which manoeuvre.

    Attributes
    ----------
    name
        As the page shows it.
    index
        The name of the index.
    paragraph
        Of the norm.
    """

    name: str
    index: str
    paragraph: str


RULES = (
    CriterionRule("advance", "advance", f"{NORM}, 5.3.1"),
    CriterionRule("tactical diameter", "tactical diameter", f"{NORM}, 5.3.1"),
    CriterionRule("initial turning", "initial turning distance", f"{NORM}, 5.3.2"),
    CriterionRule("10/10 zig-zag, first overshoot", "overshoot 1", f"{NORM}, 5.3.3.1"),
    CriterionRule("10/10 zig-zag, second overshoot", "overshoot 2", f"{NORM}, 5.3.3.2"),
    CriterionRule("20/20 zig-zag, first overshoot", "overshoot 1", f"{NORM}, 5.3.3.3"),
    CriterionRule("stopping, track reach", "track reach", f"{NORM}, 5.3.4"),
)


def limit(rule: CriterionRule, length: float, test_speed: float) -> tuple[float, str]:
    """Return the limit of a criterion and its text.

    Parameters
    ----------
    rule
        One of `RULES`.
    length
        Between perpendiculars, m; NaN where unknown.
    test_speed
        V of the norm, m/s.

    Returns
    -------
    limit
        In m or rad; NaN where length or speed are unknown.
    text
        Such as ``4.5 L``.

    Examples
    --------
    >>> value, text = limit(RULES[3], length=160.0, test_speed=8.0)
    >>> round(value / radians(1.0), 6), text
    (15.0, '5° + 0.5° · (L/V)/s, here 15.0°')
    """
    lengths = {"advance": 4.5, "tactical diameter": 5.0, "initial turning": 2.5}
    lengths["stopping, track reach"] = 15.0
    if rule.name in lengths:
        return lengths[rule.name] * length, f"{lengths[rule.name]:g} L"
    if rule.name.startswith("20/20"):
        return radians(25.0), "25°"
    ratio = length / test_speed if test_speed > 0 else float("nan")
    first = "first" in rule.name
    low, high = (10.0, 20.0) if first else (25.0, 40.0)
    offset, slope = (5.0, 0.5) if first else (17.5, 0.75)
    if ratio < FAST:
        return radians(low), f"{low:g}°"
    if ratio >= SLOW:
        return radians(high), f"{high:g}°"
    value = offset + slope * ratio
    here = f", here {value:.1f}°" if isfinite(value) else ""
    return radians(value), f"{offset:g}° + {slope:g}° · (L/V)/s{here}"


def applies(
    rule: CriterionRule, kind: ManoeuvreKind, rudder: float, switch: float, *, astern: bool
) -> bool:
    """Return whether a criterion applies to a manoeuvre.

    Parameters
    ----------
    rule
        One of `RULES`.
    kind
        Of the manoeuvre.
    rudder, switch
        Rudder angle and switch heading, rad.
    astern
        Whether the propeller drives astern, in a stopping manoeuvre.
    """
    if rule.index in ("advance", "tactical diameter"):
        return kind is ManoeuvreKind.TURNING_CIRCLE and abs(rudder) >= HARD_OVER
    if rule.index == "track reach":
        return kind is ManoeuvreKind.STOPPING and astern
    ten = abs(abs(rudder) - radians(10.0)) <= LIKE_ANGLE
    if rule.index == "initial turning distance":
        is_10 = kind is not ManoeuvreKind.ZIGZAG or abs(switch - radians(10.0)) < radians(0.5)
        return ten and is_10 and kind in INITIAL_TURNING_KINDS
    angle = radians(20.0 if rule.name.startswith("20/20") else 10.0)
    return (
        kind is ManoeuvreKind.ZIGZAG
        and abs(abs(rudder) - angle) <= LIKE_ANGLE
        and abs(switch - angle) < radians(0.5)
    )


INITIAL_TURNING_KINDS = (
    ManoeuvreKind.INITIAL_TURNING, ManoeuvreKind.ZIGZAG, ManoeuvreKind.TURNING_CIRCLE,
)  # fmt: skip


def criterion_of(
    name: str,
    kind: ManoeuvreKind,
    angles: tuple[float, float],
    ship: Mapping[str, float],
    *,
    astern: bool,
) -> Criterion | None:
    """Return the criterion on an index of a manoeuvre; None where the norm has none.

    Parameters
    ----------
    name
        Of the index.
    kind
        Of the manoeuvre.
    angles
        Rudder angle and switch heading, rad.
    ship
        ``length``, m, and ``test_speed``, m/s.
    astern
        As in `applies`.
    """
    for rule in RULES:
        if rule.index == name and applies(rule, kind, *angles, astern=astern):
            value, text = limit(rule, ship["length"], ship["test_speed"])
            return Criterion(rule.name, value, text, rule.paragraph) if isfinite(value) else None
    return None


def probability_below(limit: float, value: float, std: float) -> float:
    """Return the probability that a quantity of normal distribution is at most a limit.

    Examples
    --------
    >>> round(probability_below(10.0, 8.0, 1.0), 3)
    0.977
    """
    if std <= 0:
        return float(value <= limit)
    return (1.0 + erf((limit - value) / (std * sqrt(2.0)))) / 2.0
