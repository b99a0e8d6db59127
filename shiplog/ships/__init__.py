"""Ship models: parameters, state and equations, one module each, all with the same interface.

`ship_model` finds a model by its name, `model_names` lists them. An installed package adds one by
an entry point of the group ``shiplog.ship_models`` (docs/how_to_add_a_ship_model.md). This folder
must not import vessel files, logs, recorders or estimators.
"""

from typing import TYPE_CHECKING, Any

from shiplog.errors import ShiplogError
from shiplog.extensions import extension_names, load_extension

if TYPE_CHECKING:
    from .model import Model, Parameter, Scale, StateValue

__all__ = [
    "Model",
    "Parameter",
    "Scale",
    "StateValue",
    "loadable_models",
    "model_names",
    "ship_model",
]

GROUP = "shiplog.ship_models"


def model_names() -> tuple[str, ...]:
    """List the names of the installed ship models, in alphabetical order, importing none.

    Examples
    --------
    >>> {"burylin", "nomoto", "three-dof"} <= set(model_names())  # packages may add others
    True
    """
    return extension_names(GROUP)


def ship_model(name: str) -> "Model":
    """Load the ship model of a name.

    Raises
    ------
    UsageError
        No installed package has a ship model of that name.
    ShiplogError
        The package that declares it cannot be imported; the message names it.

    Examples
    --------
    >>> ship_model("nomoto").names
    ('a', 'k', 'f', 'g', 'h')
    """
    from .model import Model  # noqa: PLC0415 - the names are listed without numba

    return load_extension(GROUP, name, Model, "ship model")


def loadable_models() -> tuple[tuple["Model", ...], tuple[str, ...]]:
    """Load every installed ship model.

    Returns
    -------
    models
        From the fewest free parameters to the most.
    warnings
        One line for each model that cannot be loaded; it names the package.
    """
    models, warnings = [], []
    for name in model_names():
        try:
            models.append(ship_model(name))
        except ShiplogError as error:
            warnings.append(str(error))
    models.sort(key=lambda model: sum(not parameter.fixed for parameter in model.parameters))
    return tuple(models), tuple(warnings)


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Import the classes on their first use: they need numba, the list of names does not."""
    if name in {"Model", "Parameter", "Scale", "StateValue"}:
        from shiplog.ships import model  # noqa: PLC0415

        return getattr(model, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
