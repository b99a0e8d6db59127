"""The simulated ship of a vessel file."""

from shiplog.ships import ship_model
from shiplog.ships.model import SI
from shiplog.ships.under_way import Ship

from .vessel import Vessel


def ship_from_vessel(vessel: Vessel) -> Ship:
    """The ship of a vessel file: of its `[model]` if it has one, else the paper's."""
    own = vessel.model
    if own is None:
        return Ship(ship_model("burylin"), vessel.paper_coefficients, SI)
    model = ship_model(own.name)
    scale = model.scale(own.length, own.speed, own.rpm)
    return Ship(model, model.coefficients(own.parameters), scale)
