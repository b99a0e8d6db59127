"""Vessel file of an identified ship, for simulation and replay.

`[model]` holds the identified model, which simulations use. `[yaw]`, `[surge]` and `[rudder]` hold
the paper's model, on which filters and observers are designed: where another model was identified,
the paper's is fitted to the same logs as well.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import pi

import numpy as np

from analysis.identification.fit.drift import DRIFT_REMEDY, DRIFT_UNKNOWN, drift_is_unknown
from analysis.identification.fit.output_error import DEFAULT_LENGTH, OutputError, output_error
from analysis.identification.fit.segment import initial_level
from analysis.identification.fit.uncertainty import (
    MAX_PRIOR_SHARE,
    MAX_RELATIVE_STD,
    Uncertainty,
    uncertainty,
)
from shiplog.errors import LogError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships import Model, ship_model
from shiplog.ships.paper import COEFFICIENT_UNITS, YAW_COEFFICIENTS, Coefficients, rudder_effect
from shiplog.toml_output import toml_string
from shiplog.vessel.hull import hull_dict
from shiplog.vessel.model_section import PAPER_MODELS
from shiplog.vessel.vessel import Vessel

from .advice import RUDDER_PARAMETERS
from .fixed_parameters import fixed_values
from .identified_ship import IdentifiedShip

SECTIONS = {"yaw": YAW_COEFFICIENTS, "surge": ("f", "g", "h")}
ANGLE_POWERS = {"b2": 1, "b3": 2, "f": 2}  # power of the angle in the unit's denominator
PER_RADIAN = {"rad": 1.0, "deg": 180 / pi}
# of the surge equations of all models; the other parameters are of the yaw and sway equations
SURGE_PARAMETERS = ("f", "f1", "f2", "g", "h", "p", "xvr", "x4", "xd")
NOT_CONVERGED = "NOT CONVERGED: the value of the last iteration"

PAPER_MODEL_COMMENT = (
    "",
    "# The paper's model, fitted to the same logs; `shiplog replay` designs its filters on it.",
)
NO_PAPER_MODEL_COMMENT = (
    "",
    "# `shiplog replay` designs its filters on the paper's model. It cannot be identified from",
    "# these logs: a preliminary one is fitted to each log that is replayed.",
)


def vessel_toml(ship: IdentifiedShip, on_progress: ProgressCallback = no_progress) -> str:
    """Write the vessel file of an identified ship.

    Parameters
    ----------
    ship
        The result of `identify`.
    on_progress
        Given a step where the paper's model is fitted as well, which takes as long as a fit.

    Returns
    -------
    text
        TOML; the comment of each value is its 95 % interval or a caution.

    Notes
    -----
    Where an equation is not identifiable, the model is written in comments: a vessel file gives a
    whole model or none. The rest of the file is valid, and a replay fits a first model to its log.
    """
    unit, missing = _angle_unit(ship.vessel), undetermined_parts(ship)
    if missing:
        is_paper = ship.model.name in PAPER_MODELS
        paper_lines = _paper_sections(ship.fit, ship.uncertainty, unit) if is_paper else ()
        lines = _as_comments(paper_lines or _model_section(ship), missing)
        return _text([*_head(ship), *lines, *_rudder(ship.vessel)])
    if ship.model.name in PAPER_MODELS:
        own = [*_head(ship), *_paper_sections(ship.fit, ship.uncertainty, unit)]
        return _text([*own, *_rudder(ship.vessel, ship.fit)])
    own = [*_head(ship), *_model_section(ship)]
    on_progress("fit the paper's model")
    paper = _paper_model(ship)
    if paper is None:
        return _text([*own, *NO_PAPER_MODEL_COMMENT, *_rudder(ship.vessel)])
    fit, estimates = paper
    sections = [*_paper_sections(fit, estimates, unit), *_rudder(ship.vessel, fit)]
    return _text([*own, *PAPER_MODEL_COMMENT, *sections])


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _as_comments(lines: Iterable[str], missing: Iterable[str]) -> Iterator[str]:
    """Yield the lines of a model as comments, after the reason."""
    yield ""
    for part in missing:
        yield f"# MISSING: the {part} equation; none of its parameters is identifiable from these"
        yield "# logs, so that the model is given in comments only; add the log of a zig-zag."
    for line in "\n".join(lines).splitlines():
        yield f"# {line}" if line else "#"


def undetermined_parts(ship: IdentifiedShip) -> tuple[str, ...]:
    """Return "yaw" and "surge" where neither data nor priors determine any of their parameters.

    Judged by the standard deviations of the noise alone: those of a model that does not fit the
    ship are wider, but the model may still be close enough to be used.
    """
    return tuple(_undetermined(ship.model, ship.uncertainty))


def _undetermined(model: Model, estimates: Uncertainty) -> Iterator[str]:
    by_data = estimates.coloured <= MAX_RELATIVE_STD * np.abs(estimates.values)
    by_data &= estimates.prior_share <= MAX_PRIOR_SHARE
    for part in ("yaw", "surge"):
        is_surge = part == "surge"
        own = np.array([(name in SURGE_PARAMETERS) == is_surge for name in estimates.names], bool)
        priors = [model.parameter(name).prior_std for name in np.array(estimates.names)[own]]
        if not (by_data[own].any() or np.isfinite(priors).all()):
            yield part


def _paper_model(ship: IdentifiedShip) -> tuple[OutputError, Uncertainty] | None:
    """Fit the paper's model to the same logs, unless it is among the candidates already.

    It does not fit this ship exactly, so that its parameters need not be identifiable: it is as
    close as the filters' model can be. None where its simulation diverges, or where it is not a
    ship's: for a ship of first order a second pole may lie anywhere, and the rudder's effect may
    have the wrong sign.
    """
    segments = ship.fit.problem.recorded
    fits = [c.fit for c in ship.candidates if c.model.name == "burylin" and c.fit is not None]
    try:
        if fits:
            fit = fits[0]
        else:
            model = ship_model("burylin")
            fit = output_error(segments, model, fixed=fixed_values(model, {}, ship.vessel))
    except LogError:
        return None
    c = _coefficients(fit)
    effect = (
        rudder_effect(c, initial_level(segments, "speed"), initial_level(segments, "rpm")) * c.d
    )
    return (fit, uncertainty(fit)) if effect > 0 > c.a else None


def _head(ship: IdentifiedShip) -> Iterator[str]:
    """Yield the lines before the first section."""
    vessel, segments = ship.vessel, ship.fit.problem.recorded
    logs = ", ".join(dict.fromkeys(segment.name for segment in segments))
    name = f"{vessel.name if vessel else 'ship'}, identified"
    yield f"# {ship.model.title}, identified from {logs}"
    yield f"name = {toml_string(name)}"
    if vessel is not None and vessel.length is not None:
        yield f"length = {vessel.length!r}"
    elif ship.model.dimensionless:
        yield f"length = {DEFAULT_LENGTH!r}  # m, ASSUMED, as none was given: the scale of [model]"
    yield f"approach_rpm = {round(initial_level(segments, 'rpm'), 3)!r}"
    yield f'angle_unit = "{_angle_unit(vessel)}"'
    yield from _hull(vessel)


def _hull(vessel: Vessel | None) -> Iterator[str]:
    """Yield `[hull]`, where anything of it is known."""
    known = hull_dict(vessel.hull) if vessel is not None else {}
    if known:
        yield "\n[hull]"
    for key, value in known.items():
        yield f"{key} = {toml_string(value) if isinstance(value, str) else repr(value)}"


def _angle_unit(vessel: Vessel | None) -> str:
    """Return the unit of the vessel file's own angles, in which filters have their noise."""
    return vessel.angle_unit if vessel is not None else "deg"


def _model_section(ship: IdentifiedShip) -> Iterator[str]:
    """Yield `[model]`."""
    scale = ship.fit.problem.scale
    comment = _comments(ship.uncertainty, converged=ship.fit.minimum.converged)
    yield "\n# `shiplog record simulate` uses this model."
    if drift_is_unknown(ship.fit.problem):
        yield f"# Its drift is {DRIFT_UNKNOWN}:"
        yield f"# simulated sway and positions are not the ship's; {DRIFT_REMEDY}."
    yield "[model]"
    yield f"name = {toml_string(ship.model.name)}"
    yield f"speed = {scale.speed!r}  # m/s; with length and rpm, the scale of the parameters"
    yield f"rpm = {scale.rpm!r}"
    for name, value in ship.parameters.items():
        yield f"{name} = {value!r}  # {comment(name)}"


def _paper_sections(fit: OutputError, estimates: Uncertainty, unit: str) -> Iterator[str]:
    """Yield `[yaw]` and `[surge]`, with angles in `unit`."""
    divisors = {name: PER_RADIAN[unit] ** power for name, power in ANGLE_POWERS.items()}
    c = _coefficients(fit)
    tied = fit.problem.model.name == "burylin-tied"
    comment = _comments(estimates, divisors, converged=fit.minimum.converged, tied=tied)
    for section, names in SECTIONS.items():
        yield f"\n[{section}]"
        for name in names:
            value = getattr(c, name) / divisors.get(name, 1.0)
            file_unit = COEFFICIENT_UNITS[name].replace("rad", unit)
            yield f"{name} = {value!r}  # {file_unit}, {comment(name)}"


def _rudder(vessel: Vessel | None, paper: OutputError | None = None) -> Iterator[str]:
    """Yield `[rudder]`: the paper's rudder parameters and the steering gear, where known."""
    yield "\n[rudder]"
    if paper is not None:
        c = _coefficients(paper)
        for name in RUDDER_PARAMETERS:
            yield f"{name} = {getattr(c, name)!r}  # {COEFFICIENT_UNITS[name]}, fixed"
    unit = _angle_unit(vessel)
    defaults = Vessel("", None)
    for key, name, suffix in (("max", "rudder_max", ""), ("rate", "rudder_rate", "/s")):
        value = getattr(vessel or defaults, name)
        given = vessel is not None and key in vessel.gear_given
        if given or value != getattr(defaults, name):
            yield f"{key} = {value * PER_RADIAN[unit]!r}  # {unit}{suffix}"


def _coefficients(fit: OutputError) -> Coefficients:
    coefficients: Coefficients = fit.problem.model.coefficients(fit.parameters)
    return coefficients


def _comments(
    estimates: Uncertainty,
    divisors: Mapping[str, float] | None = None,
    *,
    converged: bool,
    tied: bool = False,
) -> Callable[[str], str]:
    """Return a function that comments on a parameter: its 95 % interval, or a caution.

    `divisors` are what the values are divided by; `tied` where the fit is of the tied form. Each
    value of a fit that has not converged is marked.
    """
    half = dict(zip(estimates.names, 1.96 * estimates.std, strict=True))
    prior = dict(zip(estimates.names, estimates.prior_share > MAX_PRIOR_SHARE, strict=True))

    def comment(name: str) -> str:
        return precision(name) + ("" if converged or name not in half else f"; {NOT_CONVERGED}")

    def precision(name: str) -> str:
        if name in estimates.unidentifiable:
            origin = "mostly its prior" if prior[name] else "one of many values that fit them"
            cause = (
                "without positions or sway" if name in estimates.unobserved else "from these logs"
            )
            return f"NOT IDENTIFIABLE {cause}: {origin}"
        if name in half:
            return f"± {half[name] / (divisors or {}).get(name, 1.0):.2g} (95 %)"
        if tied and name in ("b1", "e"):
            return "tied: b1 = -d" if name == "b1" else "tied: e = T3 d"
        return "fixed"

    return comment
