"""Conditions of a trial: what the forms of MSC/Circ.1053 ask for and no sensor sends."""

from collections.abc import Mapping
from dataclasses import dataclass

MAX_TRIM_ERROR = 0.1  # m: draughts are read to a few centimetres


@dataclass(frozen=True)
class Condition:
    """One entry of the section ``[conditions]`` of a trial file.

    Attributes
    ----------
    unit
        The unit of a number; empty for a text or a number without unit.
    lowest, highest
        The limits of a number; None for a text.
    """

    unit: str = ""
    lowest: float | None = None
    highest: float | None = None

    @property
    def is_number(self) -> bool:
        """Whether the value is a number."""
        return self.lowest is not None


CONDITIONS: Mapping[str, Condition] = {
    "ship_type": Condition(),
    "test_speed": Condition("m/s", 0.0, 50.0),  # V of L/V: of the approach
    "loading": Condition(),  # such as "full load" or "ballast"
    "place": Condition(),
    "remarks": Condition(),
    "draught_forward": Condition("m", 0.0, 40.0),
    "draught_aft": Condition("m", 0.0, 40.0),
    "trim": Condition("m", -20.0, 20.0),  # by the stern
    "displacement": Condition("t", 0.0, 1e6),
    "length_pp": Condition("m", 0.0, 500.0),
    "breadth": Condition("m", 0.0, 100.0),
    "block_coefficient": Condition("", 0.0, 1.0),
    "rudder_type": Condition(),
    "rudder_area": Condition("m2", 0.0, 300.0),
    "rudders": Condition("", 0.0, 8.0),
    "propeller_type": Condition(),
    "propellers": Condition("", 0.0, 8.0),
    "engine": Condition(),
    "water_depth": Condition("m", 0.0, 12_000.0),
    "wind_speed": Condition("m/s", 0.0, 80.0),
    "wind_direction": Condition("deg", 0.0, 360.0),  # from which it blows
    "beaufort": Condition("", 0.0, 12.0),
    "sea_state": Condition("", 0.0, 9.0),
    "wave_height": Condition("m", 0.0, 30.0),
    "wave_direction": Condition("deg", 0.0, 360.0),
    "current_speed": Condition("m/s", 0.0, 10.0),
    "current_direction": Condition("deg", 0.0, 360.0),  # towards which it flows
}


def trim_contradiction(values: Mapping[str, float | str]) -> str:
    """Return that the trim contradicts the draughts; an empty text where it does not.

    Examples
    --------
    >>> trim_contradiction({"draught_forward": 8.0, "draught_aft": 8.5, "trim": -0.5})
    'trim -0.5 m contradicts the draughts, whose difference aft minus forward is 0.5 m'
    """
    known = [values.get(name) for name in ("trim", "draught_aft", "draught_forward")]
    numbers = [float(value) for value in known if isinstance(value, int | float)]
    if len(numbers) < len(known):
        return ""
    trim, aft, forward = numbers
    if abs(trim - (aft - forward)) <= MAX_TRIM_ERROR:
        return ""
    return (
        f"trim {trim:g} m contradicts the draughts, whose difference aft minus forward is "
        f"{aft - forward:.4g} m"
    )


def condition_metadata(values: Mapping[str, float | str]) -> dict[str, str]:
    """Return the conditions as metadata of a log, each with its unit.

    Examples
    --------
    >>> condition_metadata({"draught_aft": 8.5, "loading": "ballast"})
    {'condition.draught_aft': '8.5 m', 'condition.loading': 'ballast'}
    """
    return {
        f"condition.{name}": f"{value:.10g} {CONDITIONS[name].unit}".strip()
        if isinstance(value, int | float)
        else value
        for name, value in values.items()
    }
