"""Dimensions of a hull, its rudder and its propeller relative to the ship's length."""

from dataclasses import dataclass


@dataclass(frozen=True)
class HullForm:
    """Dimensionless dimensions of a ship; None where unknown.

    Attributes
    ----------
    breadth, draught
        Over the length between perpendiculars.
    block_coefficient
        Displaced volume over length, breadth and draught.
    rudder_area
        Over length times draught.
    rudder_aspect_ratio
        Height squared over area of a rudder.
    rudder_height
        Over the length; of a single rudder.
    propeller_diameter
        Over the length.
    """

    breadth: float | None = None
    draught: float | None = None
    block_coefficient: float | None = None
    rudder_area: float | None = None
    rudder_aspect_ratio: float | None = None
    rudder_height: float | None = None
    propeller_diameter: float | None = None
