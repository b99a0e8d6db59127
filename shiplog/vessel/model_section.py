"""The `[model]` section of a vessel file: a ship model for simulation, and its scale."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from shiplog.toml_text import unknown_key
from shiplog.units import did_you_mean

from .settings import number_error

if TYPE_CHECKING:  # it brings numba; only verbs that compute need it
    from shiplog.ships import Model

PAPER_MODELS = ("burylin", "burylin-tied")  # given by [yaw], [surge] and [rudder] instead
SCALE_LIMITS = {"speed": (0.0, 50.0), "rpm": (0.0, 3000.0)}  # m/s and rpm, both positive


@dataclass(frozen=True)
class ModelSection:
    """A ship model by name, with its parameters and the scale of its units.

    Attributes
    ----------
    name
        Name of the model, as in `shiplog.ships.model_names`.
    parameters
        Its parameters without dimensions, in the model's order.
    length
        Length of the ship between perpendiculars, m.
    speed, rpm
        Speed in m/s and revolutions of the straight run to which the parameters refer.
    """

    name: str
    parameters: tuple[float, ...]
    length: float
    speed: float
    rpm: float


def parse_model_section(
    table: object, length: float | None, errors: list[str]
) -> ModelSection | None:
    """Parse a `[model]` section.

    Parameters
    ----------
    table
        The value of `model` in the file.
    length
        Length of the ship in m; None where the file has none.
    errors
        Messages are appended for everything that is wrong.

    Returns
    -------
    ModelSection or None
        None where anything is missing.

    Raises
    ------
    ShiplogError
        The package of the model cannot be imported.
    """
    if not isinstance(table, dict):
        errors.append("[model] must be a section")
        return None
    model = _model(table, errors)
    if model is None:
        return None
    limits = SCALE_LIMITS | {p.name: (p.lowest, p.highest) for p in model.parameters}
    values = _numbers(table, limits, errors)
    missing = [key for key in limits if key not in values]
    if missing:
        errors.append(f"[model] lacks {', '.join(missing)}")
    if length is None:
        errors.append(
            f"length is missing: the parameters of {model.name} are without dimensions and refer "
            "to the ship's length"
        )
    if missing or length is None:
        return None
    parameters = tuple(values[name] for name in model.names)
    return ModelSection(model.name, parameters, length, values["speed"], values["rpm"])


def _model(table: Mapping[str, Any], errors: list[str]) -> "Model | None":
    """Load the model that the section names."""
    from shiplog.ships import model_names, ship_model  # noqa: PLC0415 - see above

    name = table.get("name")
    names = [each for each in model_names() if each not in PAPER_MODELS]
    if name in PAPER_MODELS:
        errors.append(
            f"model.name = {name!r} is not allowed, this model is given by [yaw], [surge] and "
            "[rudder]"
        )
        return None
    if name not in names:
        near = did_you_mean(name, names) if isinstance(name, str) else ""
        got = f"got {name!r}{near.replace(';', ',')}" if "name" in table else "but [model] has none"
        errors.append(f"model.name must be one of {', '.join(names)}, {got}")
        return None
    return ship_model(str(name))


def _numbers(
    table: Mapping[str, Any], limits: Mapping[str, tuple[float, float]], errors: list[str]
) -> dict[str, float]:
    """Parse the numbers of the section; one with an error becomes inf, so it is not missing."""
    values: dict[str, float] = {}
    for key, value in table.items():
        if key in limits:
            error = number_error(f"model.{key}", value, *limits[key], positive=key in SCALE_LIMITS)
            errors += [error] if error else []
            values[key] = float(value) if not error else inf
        elif key != "name":
            errors.append(unknown_key(key, ["name", *limits], section="model"))
    return values
