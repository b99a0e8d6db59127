"""The parser of vessel files, which reports all errors of a file at once."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from math import inf, nan, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shiplog.errors import VesselError
from shiplog.units import did_you_mean

from .model_section import model_section
from .presets import PRESETS
from .settings import (
    disturbance_settings,
    filter_settings,
    identifier_settings,
    number_error,
)
from .vessel import SECTIONS, Vessel

if TYPE_CHECKING:  # it brings numba; only verbs that compute need it
    from shiplog.ships.paper import Coefficients

# section -> key -> (lowest, highest) of the value; "" is the top level
_TIME_CONSTANTS = {"T1": (1e-3, 1e6), "T2": (1e-3, 1e6), "T3": (-inf, inf)}
_NONLINEAR = {"c2": (-inf, inf), "c3": (-inf, inf)}
_PRODUCTS = dict.fromkeys(("a", "b1", "b2", "b3", "d", "e"), (-inf, inf))
_KEYS: dict[str, dict[str, tuple[float, float]]] = {
    "": {"length": (0.0, 1000.0), "approach_rpm": (0.0, 3000.0)},
    "yaw": _TIME_CONSTANTS | _NONLINEAR | _PRODUCTS,
    "rudder": {
        "alpha1": (-inf, inf),
        "alpha2": (-inf, inf),
        "alpha3": (-inf, inf),
        "max": (0.0, inf),
        "rate": (0.0, inf),
    },
    "surge": dict.fromkeys(("f", "g", "h"), (-inf, inf)),
}
_ALPHAS = ("alpha1", "alpha2", "alpha3")
_TEXTS = ("name", "angle_unit")
_POSITIVE = {"T1", "T2", "approach_rpm", "length", "max", "rate"}


def load_vessel(preset_or_path: str | os.PathLike[str]) -> tuple[Vessel, str]:
    """A vessel by the name of a preset or from a file, and its text to be kept with a log.

    Raises `VesselError` with all the faults of the file at once.
    """
    name = os.fspath(preset_or_path)
    if name in PRESETS:
        return parse_vessel(PRESETS[name], name), PRESETS[name]
    path = Path(name)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise VesselError(
            f"no vessel file and no preset{did_you_mean(name, PRESETS)}; "
            f"presets are {', '.join(PRESETS)}: {path}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise VesselError(
            f"cannot read the vessel file ({reason}); name another: {path}"
        ) from error
    return parse_vessel(text, name), text


def parse_vessel(text: str, where: str) -> Vessel:
    """A vessel from the text of its file; `where` names it in errors.

    Raises `VesselError` with all the faults at once.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise VesselError(f"not a TOML file ({error}); mend that line: {where}") from error
    faults: list[str] = []
    own = table.pop("model", None)
    sections = {key: _section(key, table.pop(key, {}), faults) for key in SECTIONS}
    filtering = filter_settings(sections["filter"], faults)
    observing = disturbance_settings(sections["disturbance"], faults)
    identifying = identifier_settings(sections["identifier"], faults)
    numbers = _numbers(table, faults)
    length = numbers[""].get("length", nan if "length" in table else None)  # one fault is enough
    model = None if own is None else model_section(own, length, faults)
    is_papers = own is None or _names_papers(table)
    if is_papers:
        _require(numbers, _yaw_form(numbers["yaw"], faults), faults)
    faults += [f"{key} must be a text" for key in _TEXTS if not isinstance(table.get(key, ""), str)]
    angle_unit = table.get("angle_unit", "rad")
    if angle_unit not in ("deg", "rad"):
        faults.append(f"angle_unit must be 'deg' or 'rad', got {angle_unit!r}")
    rudder_max = numbers["rudder"].get("max", 0.0)
    if angle_unit == "rad" and rudder_max > pi / 2:
        faults.append(
            f"rudder.max = {rudder_max:g} rad is no rudder's; is angle_unit = 'deg' meant?"
        )
    if faults:
        count = f"{len(faults)} faults" if len(faults) > 1 else "one fault"
        raise VesselError(f"{count} in the vessel file: {'; '.join(faults)}: {where}")
    per_rad = 180 / pi if angle_unit == "deg" else 1.0
    coefficients = _coefficients(numbers, per_rad) if is_papers else None
    vessel = _vessel(str(table.get("name", Path(where).stem)), coefficients, numbers, per_rad)
    return replace(
        vessel,
        filter=filtering,
        disturbance=observing,
        identifier=identifying,
        angle_unit=angle_unit,
        model=model,
    )


def _section(name: str, section: object, faults: list[str]) -> Mapping[str, object]:
    if isinstance(section, dict):
        return section
    faults.append(f"[{name}] must be a section")
    return {}


def _numbers(table: Mapping[str, Any], faults: list[str]) -> dict[str, dict[str, float]]:
    """Every number of the file, section by section; what is wrong goes to `faults`."""
    numbers: dict[str, dict[str, float]] = {section: {} for section in _KEYS}
    for key, value in table.items():
        if key in _KEYS and key:
            if isinstance(value, dict):
                for inner, number in value.items():
                    _number(key, inner, number, numbers[key], faults)
            else:
                faults.append(f"[{key}] must be a section")
        elif key not in _TEXTS:
            _number("", key, value, numbers[""], faults)
    return numbers


def _number(
    section: str, key: str, value: object, into: dict[str, float], faults: list[str]
) -> None:
    label = f"{section}.{key}" if section else key
    if key not in _KEYS[section]:
        others = (*_TEXTS, *filter(None, _KEYS), *SECTIONS, "model")
        known = [*_KEYS[section], *(() if section else others)]
        faults.append(f"unknown key {label!r}{did_you_mean(key, known).replace(';', ',')}")
        return
    low, high = _KEYS[section][key]
    fault = number_error(label, value, low, high, positive=key in _POSITIVE)
    if fault:
        faults.append(fault)
    else:
        into[key] = float(value)  # type: ignore[arg-type]


def _names_papers(table: Mapping[str, Any]) -> bool:
    """Whether a file means to give the paper's model, whole or not; steering gear is none of it."""
    rudder = table.get("rudder", {})
    alphas = isinstance(rudder, dict) and any(key in rudder for key in _ALPHAS)
    return "yaw" in table or "surge" in table or alphas


def _yaw_form(yaw: Mapping[str, float], faults: list[str]) -> tuple[str, ...]:
    """Whether [yaw] gives the paper's time constants or the products; never a mixture."""
    times = {*_TIME_CONSTANTS, *_NONLINEAR} & set(yaw)
    products = set(_PRODUCTS) & set(yaw)
    if times and products:
        faults.append(
            f"[yaw] mixes time constants ({', '.join(sorted(times))}) "
            f"with products ({', '.join(sorted(products))}); give one or the other"
        )
    return tuple(_PRODUCTS) if products else (*_TIME_CONSTANTS, *_NONLINEAR)


def _require(
    numbers: Mapping[str, Mapping[str, float]], form: tuple[str, ...], faults: list[str]
) -> None:
    named = " ".join(faults)
    for section, keys in (
        ("yaw", form),
        ("rudder", _ALPHAS),
        ("surge", ("f", "g", "h")),
    ):
        missing = [k for k in keys if k not in numbers[section] and f"{section}.{k} " not in named]
        if missing:
            faults.append(f"[{section}] lacks {', '.join(missing)}")


def _coefficients(numbers: Mapping[str, Mapping[str, float]], per_rad: float) -> "Coefficients":
    from shiplog.ships.paper import Coefficients  # noqa: PLC0415 - numba, see above

    yaw, rudder, surge = (numbers[s] for s in ("yaw", "rudder", "surge"))
    if "T1" in yaw:
        d = 1 / (yaw["T1"] * yaw["T2"])
        a, b1, e = -(yaw["T1"] + yaw["T2"]) * d, -d, yaw["T3"] * d
        b2, b3 = -yaw["c2"] * d, -yaw["c3"] * d
    else:
        a, b1, b2, b3, d, e = (yaw[key] for key in _PRODUCTS)
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
    name: str,
    coefficients: "Coefficients | None",
    numbers: Mapping[str, Mapping[str, float]],
    per_rad: float,
) -> Vessel:
    rudder, top, defaults = numbers["rudder"], numbers[""], Vessel(name, coefficients)
    return Vessel(
        name,
        coefficients,
        length=top.get("length"),
        approach_rpm=top.get("approach_rpm", defaults.approach_rpm),
        rudder_max=rudder["max"] / per_rad if "max" in rudder else defaults.rudder_max,
        rudder_rate=rudder["rate"] / per_rad if "rate" in rudder else defaults.rudder_rate,
    )
