"""Models of a ship, from the simplest to the richest: one file each, one interface for all.

A new one states its equations for a NamedTuple of its own (`motion.equations`,
`motion.observations`), gives `motion.sail` for it a compiled home, and says in a `Model` what its
parameters and its state are. It is then simulated, identified and compared like the others.
"""

from importlib import import_module

from shiplog.errors import UsageError
from shiplog.units import did_you_mean

from .model import Model, Parameter, Scale, StateValue

__all__ = ["LADDER", "Model", "Parameter", "Scale", "StateValue", "ship_model"]

_HOMES = {
    "nomoto": ("nomoto", "NOMOTO"),
    "norrbin": ("nomoto", "NORRBIN"),
    "burylin": ("burylin", "BURYLIN"),
    "burylin-tied": ("burylin", "BURYLIN_TIED"),
    "slipstream": ("slipstream", "SLIPSTREAM"),
    "drift-lag": ("drift_lag", "DRIFT_LAG"),
    "three-dof": ("three_dof", "THREE_DOF"),
}
LADDER = tuple(_HOMES)


def ship_model(name: str) -> Model:
    """The model of that name, of `LADDER`.

    Raises `UsageError` for a name nobody knows.
    """
    if name not in _HOMES:
        raise UsageError(
            f"no ship model is called {name!r}{did_you_mean(name, LADDER)}; "
            f"there are {', '.join(LADDER)}"
        )
    module, constant = _HOMES[name]
    model: Model = getattr(import_module(f".{module}", __package__), constant)
    return model
