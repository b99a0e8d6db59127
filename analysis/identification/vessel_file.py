"""An identified ship as a vessel file, for `record simulate` and `replay`.

What is sailed is the model that was identified. What is filtered by is the paper's, which filters
and observers are built on: where another was identified, that one is fitted beside it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import pi

import numpy as np

from shiplog.errors import LogError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model, ship_model
from shiplog.ships.paper import COEFFICIENT_UNITS, YAW_COEFFICIENTS, Coefficients, rudder_effect
from shiplog.vessel.model_section import PAPER_MODELS
from shiplog.vessel.vessel import Vessel

from .identify import ALPHAS, IdentifiedShip
from .output_error import USUAL_LENGTH, OutputError, output_error
from .segment import initial_level
from .uncertainty import ECHO, UNIDENTIFIABLE, Uncertainty, uncertainty

SECTIONS = {"yaw": YAW_COEFFICIENTS, "surge": ("f", "g", "h")}
ANGLES = {"b2": 1, "b3": 2, "f": 2}  # how often an angle stands in their denominators
PER_UNIT = {"rad": 1.0, "deg": 180 / pi}  # of such a unit to the radian
SURGE = ("f", "f1", "f2", "g", "h", "p", "xvr", "x4", "xd")  # of any model; the others turn her

WITH_PAPERS = ("", "# What `replay` filters by: the paper's model, fitted to the same logs.")
WITHOUT_PAPERS = (
    "",
    "# The paper's model, by which `replay` filters, cannot be identified from these logs:",
    "# `replay` fits a first one to each log.",
)


def vessel_toml(found: IdentifiedShip, on_progress: ProgressCallback = no_progress) -> str:
    """The text of the vessel file, each value with its 95 % interval or a caution.

    Raises `LogError` where nobody knows anything of the yaw or of the surge: the logs tell nothing
    of it, and not all of it is believed before any.
    """
    for part in _untold(found.model, found.uncertainty):
        raise LogError(
            f"nothing of the {part} is identifiable from these logs, and a vessel file "
            "would hold numbers nobody knows; give a log of a zig-zag as well"
        )
    if found.model.name in PAPER_MODELS:
        own = [*_head(found), *_paper(found.fit, found.uncertainty, _angle_unit(found.vessel))]
        return _text([*own, *_rudder(found.vessel, found.fit)])
    own = [*_head(found), *_model(found)]
    on_progress("fit the paper's model beside it")
    paper = _beside(found)
    if paper is None:
        return _text([*own, *WITHOUT_PAPERS, *_rudder(found.vessel)])
    return _text(
        [
            *own,
            *WITH_PAPERS,
            *_paper(*paper, _angle_unit(found.vessel)),
            *_rudder(found.vessel, paper[0]),
        ]
    )


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _untold(model: Model, found: Uncertainty) -> Iterator[str]:
    """Whether nothing is known of her yaw, of her surge.

    By the noise alone: a model that is not the ship has wider intervals, and may be near enough.
    """
    told = (found.coloured <= UNIDENTIFIABLE * np.abs(found.values)) & (found.prior_share <= ECHO)
    for part in ("yaw", "surge"):
        own = np.array([(name in SURGE) == (part == "surge") for name in found.names], bool)
        priors = [model.parameter(name).prior_std for name in np.array(found.names)[own]]
        if not (told[own].any() or np.isfinite(priors).all()):
            yield part


def _beside(found: IdentifiedShip) -> tuple[OutputError, Uncertainty] | None:
    """The paper's model fitted to the same logs; None where it runs away or is no ship's.

    It is not hers, so that no value of it need be told: it is as near as filters come. But its
    second order has nothing to hold on to in a ship of the first: a pole that the rudder never
    shows may lie anywhere, and a rudder that acts to the contrary side with it.
    """
    segments = found.fit.problem.segments
    fits = [c.fit for c in found.candidates if c.model.name == "burylin" and c.fit is not None]
    known = found.vessel.coefficients if found.vessel is not None else None
    try:
        fit = fits[0] if fits else output_error(
            segments, ship_model("burylin"),
            fixed={name: getattr(known, name) for name in ALPHAS} if known is not None else {},
        )  # fmt: skip
    except LogError:
        return None
    told, c = uncertainty(fit), _coefficients(fit)
    works = (
        rudder_effect(c, initial_level(segments, "speed"), initial_level(segments, "rpm")) * c.d
        > 0
        > c.a
    )
    return (fit, told) if works else None


def _head(found: IdentifiedShip) -> Iterator[str]:
    ship, segments = found.vessel, found.fit.problem.segments
    logs = ", ".join(dict.fromkeys(segment.name for segment in segments))
    name = f"{ship.name if ship else 'ship'}, identified"
    yield f"# {found.model.title}, identified from {logs}"
    yield f"name = {_quoted(name)}"
    if ship is not None and ship.length is not None:
        yield f"length = {ship.length!r}"
    elif found.model.dimensionless:
        yield f"length = {USUAL_LENGTH!r}  # m, ASSUMED, for nobody gave it: the scale of [model]"
    yield f"approach_rpm = {round(initial_level(segments, 'rpm'), 3)!r}"
    yield f'angle_unit = "{_angle_unit(ship)}"'


def _angle_unit(ship: Vessel | None) -> str:
    """Her own file's: the paper's noise, too, is told in it."""
    return ship.angle_unit if ship is not None else "deg"


def _model(found: IdentifiedShip) -> Iterator[str]:
    scale, remark = found.fit.problem.scale, _remarks(found.uncertainty)
    yield "\n# what `record simulate` sails"
    yield "[model]"
    yield f"name = {_quoted(found.model.name)}"
    yield f"speed = {scale.speed!r}  # m/s: with the length and rpm, the units of the equations"
    yield f"rpm = {scale.rpm!r}"
    for name, value in found.coefficients.items():
        yield f"{name} = {value!r}  # {remark(name)}"


def _paper(fit: OutputError, told: Uncertainty, unit: str) -> Iterator[str]:
    per = {key: PER_UNIT[unit] ** power for key, power in ANGLES.items()}
    c = _coefficients(fit)
    remark = _remarks(told, per, tied=fit.problem.model.name == "burylin-tied")
    for section, names in SECTIONS.items():
        yield f"\n[{section}]"
        for key in names:
            value = getattr(c, key) / per.get(key, 1.0)
            in_file = COEFFICIENT_UNITS[key].replace("rad", unit)
            yield f"{key} = {value!r}  # {in_file}, {remark(key)}"


def _rudder(ship: Vessel | None, paper: OutputError | None = None) -> Iterator[str]:
    yield "\n[rudder]"
    alphas = {} if paper is None else {key: getattr(_coefficients(paper), key) for key in ALPHAS}
    for key, value in alphas.items():
        yield f"{key} = {value!r}  # {COEFFICIENT_UNITS[key]}, not identified"
    if ship is not None:
        per = PER_UNIT[ship.angle_unit]
        yield f"max = {ship.rudder_max * per!r}  # {ship.angle_unit}"
        yield f"rate = {ship.rudder_rate * per!r}  # {ship.angle_unit}/s"


def _coefficients(fit: OutputError) -> Coefficients:
    found: Coefficients = fit.problem.model.coefficients(fit.parameters)
    return found


def _remarks(
    found: Uncertainty, per: Mapping[str, float] | None = None, *, tied: bool = False
) -> Callable[[str], str]:
    """How sure a parameter of a fit is, by its name; `per` what each is divided by."""
    half = dict(zip(found.names, 1.96 * found.std, strict=True))
    echo = dict(zip(found.names, found.prior_share > ECHO, strict=True))

    def remark(name: str) -> str:
        if name in found.unidentifiable:
            known = "believed before, for the most" if echo[name] else "a value that fits them"
            return f"NOT IDENTIFIABLE from these logs: {known}"
        if name in half:
            return f"± {half[name] / (per or {}).get(name, 1.0):.2g} (95 %)"
        if tied and name in ("b1", "e"):
            return "tied: b1 = -d" if name == "b1" else "tied: e = T3 d"
        return "stated as known"

    return remark


def _quoted(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return (
        '"' + "".join(character if character.isprintable() else " " for character in escaped) + '"'
    )
