"""The simulated ship that a vessel file describes."""

from shiplog.ships import ship_model
from shiplog.ships.model import SI
from shiplog.ships.under_way import Ship

from .vessel import Vessel


def ship_from_vessel(vessel: Vessel) -> Ship:
    """Make the ship of a vessel file for simulation.

    It has the model of `[model]` if the file has this section, otherwise the identification
    paper's model with the coefficients of `[yaw]`, `[surge]` and `[rudder]`.

    Examples
    --------
    >>> import shiplog
    >>> vessel, _ = shiplog.load_vessel("table1")
    >>> ship_from_vessel(vessel).model.name
    'burylin'
    """
    section = vessel.model
    if section is None:
        return Ship(ship_model("burylin"), vessel.paper_coefficients, SI)
    model = ship_model(section.name)
    scale = model.scale(section.length, section.speed, section.rpm)
    return Ship(model, model.coefficients(section.parameters), scale)
