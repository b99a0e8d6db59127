"""The conditions of a trial as IMO's form asks for them; what is not recorded stays a blank line.

Source: IMO MSC/Circ.1053, "Explanatory notes to the standards for ship manoeuvrability", 2002,
appendices with the forms of the trial data.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, degrees, hypot, isfinite, pi

from analysis.report.display import number_text
from analysis.trial.trial_analysis import TrialConditions
from shiplog.units import UNITS

KNOT = UNITS["kn"][1]  # m/s


@dataclass(frozen=True)
class ConditionRow:
    """A line of the form.

    Attributes
    ----------
    label
        What is asked for.
    text
        The answer; empty where not recorded, to be filled in by hand.
    """

    label: str
    text: str


@dataclass(frozen=True)
class ConditionGroup:
    """Lines of the form under one heading."""

    title: str
    rows: tuple[ConditionRow, ...]


def condition_groups(conditions: Sequence[TrialConditions]) -> tuple[ConditionGroup, ...]:
    """Return the lines of the form, for one log or for several.

    Where logs differ, each text is followed by the numbers of the logs that it holds for.
    """
    return tuple(
        ConditionGroup(
            title,
            tuple(
                ConditionRow(label, _joined([text_of(each) for each in conditions]))
                for label, text_of in lines
            ),
        )
        for title, lines in FORM
    )


def _joined(texts: Sequence[str]) -> str:
    """Join the texts of several logs; one text where all are alike."""
    if len(set(texts)) == 1:
        return texts[0]
    numbers: dict[str, list[str]] = {}
    for number, text in enumerate(texts, start=1):
        numbers.setdefault(text or "not recorded", []).append(str(number))
    return "; ".join(
        f"{text} (log{'s' if len(logs) > 1 else ''} {', '.join(logs)})"
        for text, logs in numbers.items()
    )


def _stated(*names: str) -> Callable[[TrialConditions], str]:
    """Return a line that the log states, in one or several conditions."""

    def text_of(conditions: TrialConditions) -> str:
        return ", ".join(conditions.stated[name] for name in names if name in conditions.stated)

    return text_of


def _number(conditions: TrialConditions, name: str) -> float:
    """Return the number with which a stated condition begins; NaN where there is none."""
    found = re.match(r"-?\d+(?:\.\d+)?", conditions.stated.get(name, ""))
    return float(found[0]) if found else float("nan")


def _length(conditions: TrialConditions) -> str:
    return f"{conditions.length:g} m" if isfinite(conditions.length) else ""


def _test_speed(conditions: TrialConditions) -> str:
    if not isfinite(conditions.test_speed):
        return ""
    speed = conditions.test_speed
    return f"{speed / KNOT:.2f} kn = {speed:.2f} m/s"


def _length_over_speed(conditions: TrialConditions) -> str:
    ratio = conditions.length_over_speed
    return f"{ratio:.1f} s" if isfinite(ratio) else ""


def _mean_draught(conditions: TrialConditions) -> float:
    if "draught" in conditions.stated:
        return _number(conditions, "draught")
    return (_number(conditions, "draught_forward") + _number(conditions, "draught_aft")) / 2


def _mean_draught_text(conditions: TrialConditions) -> str:
    draught = _mean_draught(conditions)
    return f"{draught:.4g} m" if isfinite(draught) else ""


def _propeller_turning(conditions: TrialConditions) -> str:
    turning = conditions.stated.get("propeller_turning", "")
    return f"{turning}-handed" if turning else ""


def _length_over_breadth(conditions: TrialConditions) -> str:
    return _ratio(conditions.length, _number(conditions, "breadth"))


def _breadth_over_draught(conditions: TrialConditions) -> str:
    return _ratio(_number(conditions, "breadth"), _mean_draught(conditions))


def _depth_over_draught(conditions: TrialConditions) -> str:
    return _ratio(_number(conditions, "water_depth"), _mean_draught(conditions))


def _rudder_area_share(conditions: TrialConditions) -> str:
    area = conditions.length * _mean_draught(conditions)
    return _ratio(_number(conditions, "rudder_area"), area, digits=4)


def _ratio(numerator: float, denominator: float, digits: int = 3) -> str:
    return f"{numerator / denominator:.{digits}g}" if numerator / (denominator or 1) > 0 else ""


def _trim(conditions: TrialConditions) -> str:
    if "trim" in conditions.stated:
        return f"{conditions.stated['trim']} by the stern"
    trim = _number(conditions, "draught_aft") - _number(conditions, "draught_forward")
    return f"{trim:.4g} m by the stern" if isfinite(trim) else ""


def _wind(conditions: TrialConditions) -> str:
    if isfinite(conditions.wind_speed):
        text = f"{conditions.wind_speed:.1f} m/s"
        if isfinite(conditions.wind_direction):
            text += f" from {degrees(conditions.wind_direction) % 360:.0f}°"
        return f"{text} (mean of the log)"
    speed, direction = (
        conditions.stated.get(f"wind_{each}", "") for each in ("speed", "direction")
    )
    return f"{speed} from {direction}" if speed and direction else speed


def _waves(conditions: TrialConditions) -> str:
    height = conditions.stated.get("wave_height", "")
    direction = conditions.stated.get("wave_direction", "")
    return f"{height} from {direction}" if height and direction else height


def _current(conditions: TrialConditions) -> str:
    current = conditions.current
    if current is not None:
        speed, towards = hypot(current.north, current.east), atan2(current.east, current.north)
        std = number_text(2 * current.std, current.std)
        return (
            f"{number_text(speed, current.std)} ± {std} m/s towards "
            f"{degrees(towards % (2 * pi)):.0f}° ({current.method})"
        )
    speed_text = conditions.stated.get("current_speed", "")
    direction = conditions.stated.get("current_direction", "")
    return f"{speed_text} towards {direction}" if speed_text and direction else speed_text


Line = tuple[str, Callable[[TrialConditions], str]]
FORM: tuple[tuple[str, tuple[Line, ...]], ...] = (
    (
        "Ship",
        (
            ("Ship", lambda each: each.ship),
            ("Type of ship", _stated("ship_type")),
            ("Length between perpendiculars L", _length),
            ("Breadth B", _stated("breadth")),
            ("Block coefficient CB", _stated("block_coefficient")),
            ("L/B", _length_over_breadth),
            ("B/T", _breadth_over_draught),
            ("Rudder: type", _stated("rudder_type")),
            ("Rudder: number", _stated("rudders")),
            ("Rudder: total area", _stated("rudder_area")),
            ("Rudder: area / (L·T)", _rudder_area_share),
            ("Rudder: aspect ratio", _stated("rudder_aspect_ratio")),
            ("Propeller: type", _stated("propeller_type")),
            ("Propeller: number", _stated("propellers")),
            ("Propeller: diameter", _stated("propeller_diameter")),
            ("Propeller: pitch / diameter", _stated("propeller_pitch_ratio")),
            ("Propeller: turning ahead", _propeller_turning),
            ("Engine", _stated("engine")),
        ),
    ),
    (
        "Trial",
        (
            ("Place", _stated("place")),
            ("Loading", _stated("loading")),
            ("Displacement", _stated("displacement")),
            ("Draught forward", _stated("draught_forward")),
            ("Draught aft", _stated("draught_aft")),
            ("Mean draught T", _mean_draught_text),
            ("Trim", _trim),
            ("Test speed V", _test_speed),
            ("V is", lambda each: each.test_speed_origin),
            ("L/V", _length_over_speed),
            ("Water depth h", _stated("water_depth")),
            ("h/T", _depth_over_draught),
            ("Wind", _wind),
            ("Beaufort", _stated("beaufort")),
            ("Sea state", _stated("sea_state")),
            ("Waves", _waves),
            ("Current", _current),
            ("Remarks", _stated("remarks")),
        ),
    ),
)
