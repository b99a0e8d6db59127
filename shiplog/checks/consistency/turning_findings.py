"""Conclusions about senses and units of yaw rate, heading, rudder and fixes, drawn together."""

from collections.abc import Iterator, Mapping
from itertools import product
from math import log, prod, radians

from .findings import Finding
from .turning_ratio import TurningRatio
from .unit_factors import HEADING_UNITS, YAW_RATE_UNITS, in_words, misread_units

MIN_FACTOR = 1.07  # between yaw rate and heading
MIN_COURSE_FACTOR = 1.6  # of the course, which differs from the heading by the drift
# the cost of each channel's having the wrong sense; fixes are rarely mirrored
COSTS = {"yaw_rate": 1.0, "heading": 1.0, "rudder": 0.95, "position": 1.6}
# between the turns of yaw rate and heading: right channels have at least 0.99, rudder and heading
# of a zig-zag at most 0.7
MAX_FOREIGN_CORRELATION = 0.75
MIN_TURNS = radians(3.0)  # standard deviation of a heading's turns that is more than noise
AMBIGUITY = 1.1  # difference of the costs below which two explanations are stated

Pair = tuple[str, str]


def sense_explanations(senses: Mapping[Pair, int]) -> list[tuple[str, ...]]:
    """Return the sets of channels with reversed sense that explain all pairs, the likeliest first.

    Parameters
    ----------
    senses
        For each pair of channels +1 where they agree and -1 where they contradict each other.

    Returns
    -------
    list of tuple of str
        The explanations; more than one where the costs (`COSTS`) are similar. Empty where no set
        explains all pairs.

    Examples
    --------
    >>> sense_explanations({("yaw_rate", "heading"): -1, ("rudder", "yaw_rate"): -1})[0]
    ('yaw_rate',)
    """
    names = sorted({name for pair in senses for name in pair})
    fitting = []
    for signs in product((1, -1), repeat=len(names)):
        sense = dict(zip(names, signs, strict=True))
        if all(prod(sense[name] for name in pair) == sign for pair, sign in senses.items()):
            reversed_names = tuple(name for name in names if sense[name] < 0)
            fitting.append((sum(COSTS[name] for name in reversed_names), reversed_names))
    fitting.sort()
    limit = AMBIGUITY if fitting and "position" not in names else 0.5
    return [names for cost, names in fitting if cost < fitting[0][0] + limit and fitting[0][1]]


def sense_findings(explanations: list[tuple[str, ...]], topics: Mapping[str, str]) -> list[Finding]:
    """Report the channels whose sense is likely reversed, with the line of the layout to change."""
    if not explanations:
        return []
    first, *others = explanations
    remedies = {name: f"sign = -1 (or 1 where it is -1) of [{name}]" for name in topics}
    remedies["position"] = "north and east (latitude and longitude) exchanged"
    texts = {
        "yaw_rate": "its sign is reversed, the yaw rate increases to port and must to starboard",
        "heading": "its sense is reversed, the heading increases to port (counter-clockwise)",
        "rudder": "its sign is reversed, a positive rudder turns the bow to port",
        "position": "mirrored: the course over ground turns opposite to the ship; "
        "likely north and east, or latitude and longitude, are swapped",
    }
    if first == ("position",):  # as well the ship's channels may all be mirrored
        others = [tuple(n for n in ("yaw_rate", "heading", "rudder") if n in topics), *others]
    alternative = " or ".join(" and ".join(each) for each in others)
    alternative = f", or else with {alternative} reversed instead" if others else ""
    corrected = "this corrected" if len(first) == 1 else f"{' and '.join(first)} corrected"
    return [
        Finding("sign", name, f"{topics[name]}: {texts[name]} (with {corrected}, all channels "
                f"agree{alternative}); change in the layout: {remedies[name]}")
        for name in first
    ]  # fmt: skip


def unit_findings(
    ratios: Mapping[Pair, TurningRatio], topics: Mapping[str, str]
) -> Iterator[Finding]:
    """Report a wrong unit of yaw rate or heading; the course of the fixes decides between them."""
    pair = ratios.get(("yaw_rate", "heading"))
    by_course = {name: ratios.get((name, "position")) for name in ("yaw_rate", "heading")}
    if pair is None:
        yield from _units_by_course(by_course, topics)
    elif _differs(pair, MIN_FACTOR):
        yield _unit_by_pair(pair, by_course, topics)


def _unit_by_pair(
    pair: TurningRatio, by_course: Mapping[str, TurningRatio | None], topics: Mapping[str, str]
) -> Finding:
    """Report the wrong unit of a yaw rate and a heading that turn differently."""
    factor = 1 / abs(pair.ratio)
    units = {
        "yaw_rate": misread_units(factor, YAW_RATE_UNITS, 0.15),
        "heading": misread_units(1 / factor, HEADING_UNITS, 0.05),
    }
    contradicted = {
        name: ratio is not None and _differs(ratio, MIN_COURSE_FACTOR)
        for name, ratio in by_course.items()
    }
    heading_wrong = contradicted["heading"] or not units["yaw_rate"]
    if contradicted["yaw_rate"] or not units["heading"]:
        heading_wrong = False
    likely, other = ("heading", "yaw_rate") if heading_wrong else ("yaw_rate", "heading")
    cause = in_words(units[likely]) or "a wrong scale"
    remedy = f'[{likely}] unit = "{units[likely][0][0]}"' if units[likely] else "the scale"
    if units[other] and not any(by_course.values()):
        cause += f"; or else {other}: {in_words(units[other])}"
    error = pair.error * factor / abs(pair.ratio)
    return Finding(
        "unit",
        likely,
        f"{topics[likely]}: the integrated yaw rate is {factor:.3g} (± {2 * error:.2g}) times the "
        f"change of the heading; likely {cause}; change in the layout: {remedy}",
    )


def _units_by_course(
    by_course: Mapping[str, TurningRatio | None], topics: Mapping[str, str]
) -> Iterator[Finding]:
    """Report wrong units of a yaw rate or a heading that turns unlike the course of the fixes."""
    units = {"yaw_rate": YAW_RATE_UNITS, "heading": HEADING_UNITS}
    for name, ratio in by_course.items():
        if ratio is None or not _differs(ratio, MIN_COURSE_FACTOR):
            continue
        matches = misread_units(1 / ratio.ratio, units[name], 0.4)
        remedy = f'[{name}] unit = "{matches[0][0]}"' if matches else "its unit"
        yield Finding(
            "unit",
            name,
            f"{topics[name]}: turns {abs(1 / ratio.ratio):.3g} times as much as the course of "
            f"the fixes; likely {in_words(matches) or 'a wrong unit'}; change in the layout: "
            f"{remedy}",
        )


def column_findings(pair: TurningRatio | None, topics: Mapping[str, str]) -> Iterator[Finding]:
    """Report a yaw rate and a heading that do not turn alike, whatever their units and signs.

    Parameters
    ----------
    pair
        The turns of the heading over those of the yaw rate; None where either does not turn.
    topics
        The topic of each channel, by name.
    """
    if pair is None or pair.turns < MIN_TURNS:
        return
    if abs(pair.correlation) < MAX_FOREIGN_CORRELATION:
        yield Finding(
            "column",
            "yaw_rate",
            f"{topics['yaw_rate']}: does not turn as {topics['heading']} does (correlation "
            f"{pair.correlation:.2f}); likely one of them is another quantity, or is faulty for "
            "much of the log; change in the layout: column of [yaw_rate] or of [heading]",
        )


def _differs(ratio: TurningRatio, factor: float) -> bool:
    """Whether a ratio differs from 1 by more than a factor, and significantly."""
    difference = abs(log(abs(ratio.ratio)))
    return difference > log(factor) and difference > 6 * ratio.error / abs(ratio.ratio)
