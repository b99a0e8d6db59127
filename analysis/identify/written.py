"""An identified ship as a vessel file, for `record simulate` and `replay`."""

from collections.abc import Iterator
from math import degrees

import numpy as np

from shiplog.errors import LogError, UsageError
from shiplog.ship import COEFFICIENT_UNITS, YAW_COEFFICIENTS, Coefficients

from .identified import AUTO, WRITABLE, IdentifiedShip
from .trial import usual

SECTIONS = {"yaw": YAW_COEFFICIENTS, "surge": ("f", "g", "h")}


def require_writable(model: str | None) -> None:
    """Refuse a model that a vessel file cannot hold, before any work."""
    if model not in (*WRITABLE, AUTO, None):
        raise UsageError(
            f"a vessel file holds the paper's model, which simulation and filters are built on, "
            f"and not {model}; identify {' or '.join(WRITABLE)} for it, or leave out -o"
        )


def vessel_toml(found: IdentifiedShip) -> str:
    """The text of the vessel file, each value with its 95 % interval or a caution.

    Raises `LogError` where the model is none a vessel file can hold, or where the logs tell nothing
    of the yaw or nothing of the surge.
    """
    if found.model.name not in WRITABLE:
        raise LogError(
            f"a vessel file holds the paper's model, and not {found.model.name}; "
            f"identify {' or '.join(WRITABLE)} for it"
        )
    for section, names in SECTIONS.items():
        if not set(names) & {*found.told, *_tied(found)}:
            raise LogError(
                f"nothing of the {section} is identifiable from these logs, and a vessel file "
                "would hold numbers nobody knows; give a log of a zig-zag as well"
            )
    return "\n".join(_lines(found)) + "\n"


def _tied(found: IdentifiedShip) -> tuple[str, ...]:
    """Coefficients that follow from others the logs tell."""
    return ("b1", "e") if "d" in found.told and found.model.name == "burylin-tied" else ()


def _lines(found: IdentifiedShip) -> Iterator[str]:
    ship, trials = found.vessel, found.fit.problem.trials
    logs = ", ".join(dict.fromkeys(trial.name for trial in trials))
    values = found.model.expand(found.fit.parameters.astype(np.complex128))
    c = Coefficients(*(float(np.real(value)) for value in values))
    name = f"{ship.name if ship else 'ship'}, identified"
    yield f"# {found.model.title}, identified from {logs}"
    yield f"name = {_quoted(name)}"
    if ship is not None and ship.length is not None:
        yield f"length = {ship.length!r}"
    yield f"approach_rpm = {round(usual(trials, 'rpm'), 3)!r}"
    yield 'angle_unit = "rad"'
    remarks = _remarks(found)
    for section, names in SECTIONS.items():
        yield f"\n[{section}]"
        for key in names:
            yield f"{key} = {getattr(c, key)!r}  # {COEFFICIENT_UNITS[key]}{remarks[key]}"
    yield "\n[rudder]"
    for key in ("alpha1", "alpha2", "alpha3"):
        yield f"{key} = {getattr(c, key)!r}  # {COEFFICIENT_UNITS[key]}, not identified"
    if ship is not None:
        yield f"max = {ship.rudder_max!r}  # rad, {degrees(ship.rudder_max):.4g}°"
        yield f"rate = {ship.rudder_rate!r}  # rad/s"


def _remarks(found: IdentifiedShip) -> dict[str, str]:
    """By coefficient of the equations: how sure it is."""
    half = dict(zip(found.uncertainty.names, 1.96 * found.uncertainty.std, strict=True))
    remarks = {}
    for name in Coefficients._fields:
        if name in found.told:
            remarks[name] = f", ± {half[name]:.2g} (95 %)"
        elif name in found.uncertainty.vague:
            remarks[name] = ", NOT IDENTIFIABLE from these logs: a value that fits them, no more"
        elif name in ("b1", "e") and found.model.name == "burylin-tied":
            remarks[name] = ", tied: b1 = -d" if name == "b1" else ", tied: e = T3 d"
        else:
            remarks[name] = ", stated as known"
    return remarks


def _quoted(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return (
        '"' + "".join(character if character.isprintable() else " " for character in escaped) + '"'
    )
