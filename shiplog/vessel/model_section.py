"""`[model]` of a vessel file: one of the ladder's models, for simulation, and its scale."""

from dataclasses import dataclass
from math import inf

from shiplog.units import did_you_mean

from .settings import number_error

PAPERS = ("burylin", "burylin-tied")  # stand in sections of their own
SCALE = {"speed": (0.0, 50.0), "rpm": (0.0, 3000.0)}  # of the straight run, each positive


@dataclass(frozen=True)
class ModelSection:
    """A model of `shiplog.ships` with its parameters, in the units of its equations."""

    name: str
    parameters: tuple[float, ...]  # in the model's order
    length: float  # m: the scale, with the straight run's
    speed: float  # m/s
    rpm: float


def model_section(table: object, length: float | None, faults: list[str]) -> ModelSection | None:
    """What a `[model]` says of a ship of that length; what is wrong with it goes to `faults`."""
    from shiplog.ships import model_names, ship_model  # noqa: PLC0415 - they bring numba

    if not isinstance(table, dict):
        faults.append("[model] must be a section")
        return None
    name, ladder = table.get("name"), [each for each in model_names() if each not in PAPERS]
    if name in PAPERS:
        faults.append(f"model.name = {name!r}: it stands in [yaw], [surge] and [rudder]")
        return None
    if name not in ladder:
        near = did_you_mean(name, ladder) if isinstance(name, str) else ""
        got = f"got {name!r}{near.replace(';', ',')}" if "name" in table else "but [model] has none"
        faults.append(f"model.name must be one of {', '.join(ladder)}, {got}")
        return None
    model = ship_model(str(name))
    limits = SCALE | {p.name: (p.lowest, p.highest) for p in model.parameters}
    found: dict[str, float] = {}
    for key, value in table.items():
        if key in limits:
            fault = number_error(f"model.{key}", value, *limits[key], positive=key in SCALE)
            faults += [fault] if fault else []
            found[key] = float(value) if not fault else inf
        elif key != "name":
            near = did_you_mean(key, ["name", *limits]).replace(";", ",")
            faults.append(f"unknown key 'model.{key}'{near}")
    missing = [key for key in limits if key not in found]
    if missing:
        faults.append(f"[model] lacks {', '.join(missing)}")
    if length is None:
        faults.append(f"length is missing: {name} is written without dimensions, in ship's lengths")
    if missing or length is None:
        return None
    parameters = tuple(found[each] for each in model.names)
    return ModelSection(model.name, parameters, length, found["speed"], found["rpm"])
