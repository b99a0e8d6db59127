"""The `[hull]` section of a vessel file: main dimensions of hull, rudder and propeller."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import sqrt
from typing import Any

from shiplog.ships.hull_form import HullForm
from shiplog.toml_text import unknown_key
from shiplog.units import did_you_mean

from .settings import number_error

SEA_WATER = 1.025  # t/m³, at 15 °C and a salinity of 35 g/kg
TURNINGS = ("right", "left")
BLOCK_LIMITS = (0.2, 1.0)

# key -> largest value; all are positive. Metres, square metres, tonnes, or without unit
MOST = {
    "breadth": 200.0,
    "draught": 50.0,
    "draught_forward": 50.0,
    "draught_aft": 50.0,
    "displacement": 1e6,
    "block_coefficient": BLOCK_LIMITS[1],
    "rudder_area": 500.0,
    "rudder_aspect_ratio": 10.0,
    "rudder_height": 50.0,
    "propeller_diameter": 20.0,
    "propeller_pitch_ratio": 3.0,
}
TURNING = "propeller_turning"


@dataclass(frozen=True)
class Hull:
    """Main dimensions of a ship; None where the vessel file does not give them.

    Attributes
    ----------
    breadth
        Breadth on the waterline, m.
    draught
        Mean draught of the trial, m.
    draught_forward, draught_aft
        Draughts at the perpendiculars, m, in place of `draught`.
    displacement
        Mass of the ship, t.
    block_coefficient
        Displaced volume over length, breadth and mean draught; in place of `displacement`.
    rudder_area
        Total movable area of the rudders, m².
    rudder_aspect_ratio
        Height squared over area of one rudder.
    rudder_height
        Height of a rudder, m; in place of `rudder_aspect_ratio`, for a single rudder.
    propeller_diameter
        Diameter, m.
    propeller_pitch_ratio
        Pitch over diameter.
    propeller_turning
        ``right`` for a propeller that turns clockwise ahead, seen from astern, or ``left``.
    """

    breadth: float | None = None
    draught: float | None = None
    draught_forward: float | None = None
    draught_aft: float | None = None
    displacement: float | None = None
    block_coefficient: float | None = None
    rudder_area: float | None = None
    rudder_aspect_ratio: float | None = None
    rudder_height: float | None = None
    propeller_diameter: float | None = None
    propeller_pitch_ratio: float | None = None
    propeller_turning: str | None = None

    @property
    def mean_draught(self) -> float | None:
        """The mean draught, m; None where unknown."""
        if self.draught_forward is None or self.draught_aft is None:
            return self.draught
        return (self.draught_forward + self.draught_aft) / 2

    @property
    def aspect_ratio(self) -> float | None:
        """The rudder's height squared over its area; None where unknown."""
        if self.rudder_height is None or self.rudder_area is None:
            return self.rudder_aspect_ratio
        return self.rudder_height**2 / self.rudder_area

    @property
    def height(self) -> float | None:
        """The height of a single rudder, m; None where unknown."""
        area, ratio = self.rudder_area, self.rudder_aspect_ratio
        return self.rudder_height if area is None or ratio is None else sqrt(area * ratio)

    def fullness(self, length: float | None) -> float | None:
        """Return the block coefficient, given or by the displacement in sea water.

        Parameters
        ----------
        length
            Length between perpendiculars, m.

        Returns
        -------
        float or None
            None where neither is given, or where a dimension is missing.

        Examples
        --------
        >>> round(Hull(breadth=32.0, draught=10.0, displacement=45_920.0).fullness(200.0), 3)
        0.7
        """
        draught = self.mean_draught
        if self.displacement is None or None in (length, self.breadth, draught):
            return self.block_coefficient
        return self.displacement / (SEA_WATER * length * self.breadth * draught)  # type: ignore[operator]

    def form(self, length: float | None) -> HullForm:
        """Return the dimensions over the length; those that need an unknown one are None.

        Parameters
        ----------
        length
            Length between perpendiculars, m.

        Examples
        --------
        >>> Hull(breadth=32.0).form(200.0).breadth
        0.16
        """
        if length is None:
            return HullForm()

        def relative(value: float | None) -> float | None:
            return None if value is None else value / length

        area, draught = self.rudder_area, self.mean_draught
        return HullForm(
            breadth=relative(self.breadth),
            draught=relative(draught),
            block_coefficient=self.fullness(length),
            rudder_area=None if area is None or draught is None else area / (length * draught),
            rudder_aspect_ratio=self.aspect_ratio,
            rudder_height=relative(self.height),
            propeller_diameter=relative(self.propeller_diameter),
        )


def parse_hull(table: object, length: float | None, errors: list[str]) -> Hull | None:
    """Parse a `[hull]` section.

    Parameters
    ----------
    table
        The value of `hull` in the file.
    length
        Length of the ship in m; None where the file has none.
    errors
        Messages are appended for everything that is wrong.

    Returns
    -------
    Hull or None
        None where the section has an error.

    Examples
    --------
    >>> errors = []
    >>> parse_hull({"breadth": 32.0, "draught": -10}, 200.0, errors), errors
    (None, ['hull.draught must be positive, got -10'])
    """
    if not isinstance(table, dict):
        errors.append("[hull] must be a section")
        return None
    found: list[str] = []
    hull = Hull(**_values(table, found))
    found = found or list(_contradictions(hull, length))
    errors += found
    return None if found else hull


def hull_dict(hull: Hull) -> dict[str, float | str]:
    """Return the section of a vessel file that gives this hull, without what is unknown.

    Examples
    --------
    >>> hull_dict(Hull(breadth=32.0))
    {'breadth': 32.0}
    """
    return {key: value for key, value in asdict(hull).items() if value is not None}


def _values(table: Mapping[str, object], errors: list[str]) -> dict[str, Any]:
    """Parse the values of the section one by one."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key in MOST:
            least = BLOCK_LIMITS[0] if key == "block_coefficient" else 0.0
            error = number_error(f"hull.{key}", value, least, MOST[key], positive=True)
            if error:
                errors.append(error)
            else:
                values[key] = float(value)  # type: ignore[arg-type]
        elif key != TURNING:
            errors.append(unknown_key(key, [*MOST, TURNING], section="hull"))
        elif value in TURNINGS:
            values[key] = value
        else:
            hint = did_you_mean(str(value), TURNINGS).replace(";", ",")
            errors.append(
                f"hull.{TURNING} must be one of {', '.join(TURNINGS)}, got {value!r}{hint}"
            )
    return values


def _contradictions(hull: Hull, length: float | None) -> list[str]:
    """Describe the values that contradict each other, or lack another one."""
    errors = []
    ends = [hull.draught_forward is not None, hull.draught_aft is not None]
    if any(ends) and (hull.draught is not None or not all(ends)):
        errors.append("[hull] must have either draught, or both draught_forward and draught_aft")
    if hull.displacement is not None and hull.block_coefficient is not None:
        errors.append("[hull] has displacement and block_coefficient; give one of them")
    if hull.rudder_height is not None and hull.rudder_aspect_ratio is not None:
        errors.append("[hull] has rudder_height and rudder_aspect_ratio; give one of them")
    if hull.rudder_height is not None and hull.rudder_area is None:
        errors.append("hull.rudder_height needs hull.rudder_area beside it")
    if length is not None and hull.breadth is not None and hull.breadth >= length:
        errors.append(
            f"hull.breadth = {hull.breadth:g} m must be less than the length, {length:g} m"
        )
    fullness = hull.fullness(length)
    if not errors and fullness is not None and not BLOCK_LIMITS[0] <= fullness <= BLOCK_LIMITS[1]:
        errors.append(
            f"hull.displacement = {hull.displacement:g} t gives a block coefficient of "
            f"{fullness:.2g}, which must lie between {BLOCK_LIMITS[0]:g} and {BLOCK_LIMITS[1]:g}; "
            "check it, the length, the breadth and the draught"
        )
    return errors
