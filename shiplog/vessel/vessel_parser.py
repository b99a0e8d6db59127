"""Parser of vessel files; reports all errors of a file at once."""

import os
from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shiplog.errors import VesselError
from shiplog.toml_text import list_errors, parse_toml, read_toml_text, unknown_key
from shiplog.units import did_you_mean

from .hull import Hull, parse_hull
from .model_section import parse_model_section
from .presets import PRESETS
from .settings import (
    DisturbanceSettings,
    FilterSettings,
    IdentifierSettings,
    number_error,
    parse_settings,
)
from .vessel import SECTIONS, Vessel

if TYPE_CHECKING:  # it brings numba; only verbs that compute need it
    from shiplog.ships.paper import Coefficients

KIND = "vessel file"
TEXT_KEYS = ("name", "angle_unit")
TIME_CONSTANTS = ("T1", "T2", "T3", "c2", "c3")
PRODUCTS = ("a", "b1", "b2", "b3", "d", "e")
ALPHAS = ("alpha1", "alpha2", "alpha3")
SURGE_KEYS = ("f", "g", "h")
GEAR_KEYS = ("max", "rate")
POSITIVE_KEYS = {"T1", "T2", "approach_rpm", "length", "max", "rate"}

ANY = (-inf, inf)
# section -> key -> (lowest, highest) of the value; "" is the top level
LIMITS: dict[str, dict[str, tuple[float, float]]] = {
    "": {"length": (0.0, 1000.0), "approach_rpm": (0.0, 3000.0)},
    "yaw": dict.fromkeys((*TIME_CONSTANTS, *PRODUCTS), ANY)
    | {"T1": (1e-3, 1e6), "T2": (1e-3, 1e6)},
    "rudder": dict.fromkeys(ALPHAS, ANY) | {"max": (0.0, inf), "rate": (0.0, inf)},
    "surge": dict.fromkeys(SURGE_KEYS, ANY),
    "compass": {"error_deg": (0.0, 5.0)},
}

Numbers = Mapping[str, Mapping[str, float]]  # by section and key


def load_vessel(preset_or_path: str | os.PathLike[str]) -> tuple[Vessel, str]:
    """Load a vessel from a preset or from a file.

    Parameters
    ----------
    preset_or_path
        `table1`, `table1-rad` or the path of a vessel file.

    Returns
    -------
    vessel
        The vessel.
    text
        The text of its file, which a log can carry.

    Raises
    ------
    VesselError
        The file cannot be read or has errors; the message lists all of them.

    Examples
    --------
    >>> vessel, text = load_vessel("table1")
    >>> vessel.name
    "Burylin's Table 1, angles in degrees"
    """
    name = os.fspath(preset_or_path)
    if name in PRESETS:
        return parse_vessel(PRESETS[name], name), PRESETS[name]
    hint = did_you_mean(name, PRESETS)
    missing = f"no {KIND} and no preset{hint}; presets are {', '.join(PRESETS)}"
    text = read_toml_text(name, KIND, VesselError, missing)
    return parse_vessel(text, name), text


def parse_vessel(text: str, where: str) -> Vessel:
    """Parse the text of a vessel file.

    Parameters
    ----------
    text
        TOML; docs/vessel.md describes the keys.
    where
        Name of the file, for messages.

    Raises
    ------
    VesselError
        The text has errors; the message lists all of them.

    Examples
    --------
    >>> parse_vessel("[yaw]", "ship.toml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    shiplog.errors.VesselError: 3 errors in the vessel file: [yaw] lacks T1, T2, T3, c2, c3; ...
    """
    table = parse_toml(text, where, KIND, VesselError)
    if not table:
        raise VesselError(
            f"the vessel file is empty; give what is known, such as length = 320: {where}"
        )
    errors: list[str] = []
    model_table, hull_table = table.pop("model", None), table.pop("hull", {})
    sections = {key: _section(key, table.pop(key, {}), errors) for key in SECTIONS}
    filtering = parse_settings(FilterSettings, sections["filter"], errors)
    observing = parse_settings(DisturbanceSettings, sections["disturbance"], errors)
    identifying = parse_settings(IdentifierSettings, sections["identifier"], errors)
    numbers = _numbers(table, errors)
    # a length with an error is nan: it must not be reported as missing, too
    length = numbers[""].get("length", nan if "length" in table else None)
    model = None if model_table is None else parse_model_section(model_table, length, errors)
    hull = parse_hull(hull_table, numbers[""].get("length"), errors)
    has_paper_model = _has_paper_model(table)
    if has_paper_model:
        _require(numbers, _yaw_keys(numbers["yaw"], errors), errors)
    angle_unit = _angle_unit(table, numbers, errors)
    if errors:
        raise VesselError(list_errors(errors, KIND, where))
    per_rad = 180 / pi if angle_unit == "deg" else 1.0
    coefficients = _coefficients(numbers, per_rad) if has_paper_model else None
    vessel = _vessel(str(table.get("name", Path(where).stem)), coefficients, numbers, per_rad)
    return replace(
        vessel,
        filter=filtering,
        disturbance=observing,
        identifier=identifying,
        angle_unit=angle_unit,
        model=model,
        hull=hull or Hull(),
    )


def _section(name: str, section: object, errors: list[str]) -> Mapping[str, object]:
    if isinstance(section, dict):
        return section
    errors.append(f"[{name}] must be a section")
    return {}


def _numbers(table: Mapping[str, Any], errors: list[str]) -> dict[str, dict[str, float]]:
    """Parse every number of the file, by section and key; "" is the top level."""
    numbers: dict[str, dict[str, float]] = {section: {} for section in LIMITS}
    for key, value in table.items():
        if key in LIMITS and key:
            if isinstance(value, dict):
                for inner, number in value.items():
                    _parse_number(key, inner, number, numbers[key], errors)
            else:
                errors.append(f"[{key}] must be a section")
        elif key not in TEXT_KEYS:
            _parse_number("", key, value, numbers[""], errors)
    return numbers


def _parse_number(
    section: str, key: str, value: object, numbers: dict[str, float], errors: list[str]
) -> None:
    """Add one number of a section to `numbers`."""
    label = f"{section}.{key}" if section else key
    if key not in LIMITS[section]:
        sections = (*TEXT_KEYS, *filter(None, LIMITS), *SECTIONS, "model", "hull")
        allowed = [*LIMITS[section], *(() if section else sections)]
        errors.append(unknown_key(key, allowed, section=section))
        return
    error = number_error(label, value, *LIMITS[section][key], positive=key in POSITIVE_KEYS)
    if error:
        errors.append(error)
    else:
        numbers[key] = float(value)  # type: ignore[arg-type]


def _angle_unit(table: Mapping[str, Any], numbers: Numbers, errors: list[str]) -> str:
    """Parse the texts of the file; return the unit of its angles."""
    errors += [
        f"{key} must be a string" for key in TEXT_KEYS if not isinstance(table.get(key, ""), str)
    ]
    angle_unit = table.get("angle_unit", "rad")
    if angle_unit not in ("deg", "rad"):
        errors.append(f"angle_unit must be 'deg' or 'rad', got {angle_unit!r}")
    rudder_max = numbers["rudder"].get("max", 0.0)
    if angle_unit == "rad" and rudder_max > pi / 2:
        errors.append(
            f"rudder.max = {rudder_max:g} rad is more than a right angle; "
            "is angle_unit = 'deg' meant?"
        )
    return str(angle_unit)


def _has_paper_model(table: Mapping[str, Any]) -> bool:
    """Whether a file gives any part of the paper's model; the steering gear is not part of it."""
    rudder = table.get("rudder", {})
    has_alphas = isinstance(rudder, dict) and any(key in rudder for key in ALPHAS)
    return "yaw" in table or "surge" in table or has_alphas


def _yaw_keys(yaw: Mapping[str, float], errors: list[str]) -> tuple[str, ...]:
    """Keys that [yaw] must have: the paper's time constants or the products, never a mixture."""
    times, products = set(TIME_CONSTANTS) & set(yaw), set(PRODUCTS) & set(yaw)
    if times and products:
        errors.append(
            f"[yaw] mixes time constants ({', '.join(sorted(times))}) "
            f"with products ({', '.join(sorted(products))}); give one or the other"
        )
    return PRODUCTS if products else TIME_CONSTANTS


def _require(numbers: Numbers, yaw_keys: tuple[str, ...], errors: list[str]) -> None:
    """Report missing coefficients, but not those that have an error already."""
    reported = " ".join(errors)
    for section, keys in (("yaw", yaw_keys), ("rudder", ALPHAS), ("surge", SURGE_KEYS)):
        missing = [
            key
            for key in keys
            if key not in numbers[section] and f"{section}.{key} " not in reported
        ]
        if missing:
            errors.append(f"[{section}] lacks {', '.join(missing)}")


def _coefficients(numbers: Numbers, per_rad: float) -> "Coefficients":
    """Coefficients in radians; `per_rad` is the number of the file's angle units in a radian."""
    from shiplog.ships.paper import Coefficients  # noqa: PLC0415 - see above

    yaw, rudder, surge = (numbers[s] for s in ("yaw", "rudder", "surge"))
    if "T1" in yaw:
        d = 1 / (yaw["T1"] * yaw["T2"])
        a, b1, e = -(yaw["T1"] + yaw["T2"]) * d, -d, yaw["T3"] * d
        b2, b3 = -yaw["c2"] * d, -yaw["c3"] * d
    else:
        a, b1, b2, b3, d, e = (yaw[key] for key in PRODUCTS)
    return Coefficients(
        a=a,
        b1=b1,
        b2=b2 * per_rad,
        b3=b3 * per_rad**2,
        d=d,
        e=e,
        f=surge["f"] * per_rad**2,
        g=surge["g"],
        h=surge["h"],
        alpha1=rudder["alpha1"],
        alpha2=rudder["alpha2"],
        alpha3=rudder["alpha3"],
    )


def _vessel(
    name: str, coefficients: "Coefficients | None", numbers: Numbers, per_rad: float
) -> Vessel:
    """Vessel with its steering gear, and without its settings."""
    rudder, top, defaults = numbers["rudder"], numbers[""], Vessel(name, coefficients)
    compass = numbers["compass"]
    return Vessel(
        name,
        coefficients,
        length=top.get("length"),
        approach_rpm=top.get("approach_rpm", defaults.approach_rpm),
        rudder_max=rudder["max"] / per_rad if "max" in rudder else defaults.rudder_max,
        rudder_rate=rudder["rate"] / per_rad if "rate" in rudder else defaults.rudder_rate,
        gear_given=tuple(key for key in GEAR_KEYS if key in rudder),
        compass_error=radians(compass["error_deg"]) if "error_deg" in compass else None,
    )
