"""Parser of system files; reports all errors of a file at once."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import tf2ss

from analysis.design.augmentation import Plant
from shiplog.errors import SystemFileError, UsageError
from shiplog.toml_text import list_errors, parse_toml, read_toml_text
from shiplog.types import FloatArray
from shiplog.units import UNITS, did_you_mean

from .disturbance_sections import parse_disturbance, parse_shaped
from .file_section import FileSection
from .method_section import parse_method, parse_regulator
from .plant_form import PlantForm
from .plants import BUILT_IN
from .system import ChannelBinding, Linearisation, Linearise, LinearSystem

KIND = "system file"


def load_system(path: str | os.PathLike[str]) -> LinearSystem:
    """Load a system file.

    Raises
    ------
    SystemFileError
        The file cannot be read or has errors; the message lists all of them.
    """
    return parse_system(read_toml_text(path, KIND, SystemFileError), os.fspath(path))


def parse_system(text: str, where: str) -> LinearSystem:
    """Parse the text of a system file.

    Parameters
    ----------
    text
        TOML; docs/linear_systems.md describes the keys.
    where
        Name of the file, for messages, and for files that it names.

    Raises
    ------
    SystemFileError
        The text has errors; the message lists all of them.

    Examples
    --------
    >>> parse_system("plant.model = 'rol'", "roll.toml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    shiplog.errors.SystemFileError: ... plant.model must be one of ... did you mean 'roll'?...
    """
    errors: list[str] = []
    top = FileSection(parse_toml(text, where, KIND, SystemFileError), "", errors)
    try:
        system = _system(top, Path(where))
    except UsageError as error:  # of a matrix function
        errors.append(str(error))
    top.finish()
    if errors:
        raise SystemFileError(list_errors(list(dict.fromkeys(errors)), KIND, where))
    return system


def _system(top: FileSection, where: Path) -> LinearSystem:
    form = _plant(top.section("plant"), where.parent)
    outputs, inputs = _bindings(top, "outputs"), _bindings(top, "inputs")
    if not outputs:
        top.errors.append("[outputs.NAME] is missing: name the channels that are measured")
    schedule = _schedule(top, form)
    form = _bound(form, outputs, inputs, top.errors)
    states, sensors = tuple(form.states), tuple(each.name for each in outputs)
    names = tuple(each.name for each in inputs)
    disturbances = [
        parse_disturbance(each, states, names, sensors) for each in top.items("disturbance")
    ]
    shaped = [parse_shaped(each, states, sensors) for each in top.items("coloured")]
    extra = [each.name for each in disturbances] + [each.name for each in shaped]
    _require_different([*states, *extra], top.errors)
    initial = top.section("initial")
    known = [*states, *(d.name for d in disturbances)]
    x0, stds = initial.by_name("state", known), initial.by_name("std", known, least=0.0)
    initial.finish()
    return LinearSystem(
        name=top.text("name", where.stem),
        plant=Plant(form.A, form.B, _given(form.C), states, sensors),
        D=_given(form.D),
        units=tuple(form.states.values()),
        inputs=inputs,
        outputs=outputs,
        W=_process_noise(top.section("noise"), form),
        method=parse_method(top, states),
        disturbances=tuple(disturbances),
        shaped=tuple(shaped),
        initial=x0,
        initial_std=stds,
        schedule=schedule,
        linearise=form.linearise,
        tick_secs=_optional(top, "tick_secs"),
        step_secs=_optional(top, "step_secs"),
        regulator=parse_regulator(top, states, names),
        zero_inputs=tuple(name for name in form.inputs or () if name not in names),
        file=os.fspath(where),
    )


def _given(matrix: FloatArray | None) -> FloatArray:
    return np.zeros((1, 1)) if matrix is None else matrix


def _optional(section: FileSection, key: str) -> float | None:
    return section.number(key, positive=True) if key in section else None


def _plant(section: FileSection, folder: Path) -> PlantForm:
    """Parse ``[plant]``."""
    form = _plant_form(section, folder)
    section.finish()
    return form


def _plant_form(section: FileSection, folder: Path) -> PlantForm:
    """Parse a model by name, a transfer function, or matrices."""
    if "model" in section:
        name = section.text("model", choices=tuple(BUILT_IN))
        if name in BUILT_IN:
            return BUILT_IN[name](section, folder)
    elif "num" in section or "den" in section:
        num, den = section.numbers("num"), section.numbers("den")
        if len(num) and 1 < len(den) >= len(num) and den[0]:
            A, B, C, D = tf2ss(num, den)
            states = {f"x{k}": "1" for k in range(1, len(A) + 1)}
            return PlantForm(A, B, states, C=C, D=D)
        section.errors.append("plant.den must be longer than 1 and not shorter than plant.num")
    else:
        return _matrices(section)
    return PlantForm(np.zeros((1, 1)), np.zeros((1, 0)), {"x": "1"})


def _matrices(section: FileSection) -> PlantForm:
    states = section.texts("states")
    A = section.matrix("A", None, None)
    if "A" not in section or (A is not None and A.shape[0] != A.shape[1]):
        section.errors.append("[plant] needs a square A, or num and den, or model")
    # of a matrix that is refused no further errors follow
    refused = {"A"} if A is None or A.shape[0] != A.shape[1] else set()
    if A is None or refused:
        A = np.zeros((len(states) or 1,) * 2)
    n = len(A)
    rows = n if states or not refused else None
    B, C = section.matrix("B", rows, None), section.matrix("C", None, rows)
    refused |= {key for key, M in (("B", B), ("C", C)) if key in section and M is None}
    B = np.zeros((n, 0)) if B is None or len(B) != n else B
    C = None if C is None or C.shape[1] != n else C
    D = section.matrix("D", None if C is None else len(C), None if refused else B.shape[1])
    states = states or {f"x{k}": "1" for k in range(1, n + 1)}
    if len(states) != n:
        section.errors.append(f"plant.states has {len(states)} names, A has {n} rows")
        states = {f"x{k}": "1" for k in range(1, n + 1)}
    G = section.matrix("G", rows, None)
    refused |= {"G"} if "G" in section and G is None else set()
    G = None if G is None or len(G) != n else G
    return PlantForm(A, B, states, C=C, D=D, G=G, refused=frozenset(refused))


def _bindings(top: FileSection, key: str) -> tuple[ChannelBinding, ...]:
    """Parse the sections that bind outputs, inputs or scheduling signals to channels."""
    return tuple(
        _binding(name, section, has_std=key == "outputs")
        for name, section in top.sections(key).items()
    )


def _binding(name: str, section: FileSection, *, has_std: bool = False) -> ChannelBinding:
    unit = section.text("unit") if "unit" in section else None
    if unit is not None and unit not in UNITS:
        hint = did_you_mean(unit, UNITS).replace(";", ",")
        section.errors.append(f"{section.name('unit')} = {unit!r} is not known{hint}")
    scale = section.number("scale", 1.0)
    if scale == 0:
        section.errors.append(f"{section.name('scale')} must not be 0")
    binding = ChannelBinding(
        name, section.text("channel", name), unit, section.number("offset", 0.0), scale,
        section.number("std", positive=True) if has_std and "std" in section else None,
    )  # fmt: skip
    section.finish()
    return binding


def _schedule(top: FileSection, form: PlantForm) -> tuple[ChannelBinding, ...]:
    """Bind the scheduling signals of a plant; by default each is the channel of its name."""
    sections = top.sections("schedule")
    for name in sections:
        if name not in form.schedule:
            known = ", ".join(form.schedule) or "none"
            top.errors.append(f"schedule.{name} is not a signal of the plant; it has {known}")
    bindings = tuple(
        _binding(name, sections[name]) if name in sections else ChannelBinding(name, name, unit)
        for name, unit in form.schedule.items()
    )
    _require_units(bindings, form.schedule, "schedule", top.errors)
    return bindings


def _require_units(
    bindings: Sequence[ChannelBinding], units: Mapping[str, str], key: str, errors: list[str]
) -> None:
    """Refuse a signal in another unit than its plant has, unless it has a scale."""
    errors += [
        f"{key}.{each.name}.unit is {each.unit}, the plant takes {units[each.name]}; omit the unit,"
        " or give the scale from it"
        for each in bindings
        if each.unit and each.scale == 1.0 and each.name in units
        if UNITS.get(each.unit, UNITS[units[each.name]]) != UNITS[units[each.name]]
    ]


def _bound(
    form: PlantForm,
    outputs: Sequence[ChannelBinding],
    inputs: Sequence[ChannelBinding],
    errors: list[str],
) -> PlantForm:
    """Return the plant with one row of C for each output and one column of B for each input."""
    states, n = list(form.states), len(form.A)
    C, B, D, linearise = form.C, form.B, form.D, form.linearise
    if form.refused & {"A", "C"}:
        C = np.zeros((len(outputs) or 1, n))
    elif C is None:
        C = np.zeros((len(outputs) or 1, n))
        for row, output in zip(C, outputs, strict=False):
            if output.name in states:
                row[states.index(output.name)] = 1.0
            else:
                hint = did_you_mean(output.name, states).replace(";", ",")
                errors.append(
                    f"outputs.{output.name} is no state of the plant{hint} (without C each output"
                    f" is one of {', '.join(states)})"
                )
    elif len(C) != len(outputs):
        errors.append(f"C has {len(C)} rows, but there are {len(outputs)} [outputs.NAME]")
        C = np.zeros((len(outputs) or 1, n))
    if form.inputs is not None:
        known = list(form.inputs)
        errors += [
            f"inputs.{each.name} is no input of the plant; it has {', '.join(known)}"
            for each in inputs
            if each.name not in known
        ]
        _require_units(inputs, form.inputs, "inputs", errors)
        chosen = [known.index(each.name) for each in inputs if each.name in known]
        B, linearise = B[:, chosen], _with_inputs(linearise, chosen)
    elif form.refused & {"A", "B"}:
        B = np.zeros((n, len(inputs)))
    elif B.shape[1] != len(inputs):
        errors.append(f"B has {B.shape[1]} columns, but there are {len(inputs)} [inputs.NAME]")
        B = np.zeros((n, len(inputs)))
    fits = D is not None and D.shape == (len(C), B.shape[1])
    return PlantForm(
        form.A, B, form.states, form.inputs, C, D if fits else np.zeros((len(C), B.shape[1])),
        form.G, form.schedule, linearise, form.refused,
    )  # fmt: skip


def _with_inputs(linearise: Linearise | None, chosen: list[int]) -> Linearise | None:
    """Return the linearisation of a plant with some of its inputs."""
    if linearise is None:
        return None

    def chosen_inputs(x: FloatArray, at: FloatArray) -> Linearisation:
        found = linearise(x, at)
        return found._replace(B=found.B[:, chosen])

    return chosen_inputs


def _process_noise(section: FileSection, form: PlantForm) -> FloatArray:
    """Parse ``[noise]``: the intensity (n, n) by state, or Q for the columns of G."""
    W = _intensity(section, form)
    section.finish()
    return W


def _intensity(section: FileSection, form: PlantForm) -> FloatArray:
    states, n = list(form.states), len(form.A)
    by_state = section.by_name("process", states, least=0.0)
    W = np.diag([by_state.get(name, 0.0) for name in states])
    if "Q" not in section or form.refused & {"A", "G"}:
        return W
    G = np.eye(n) if form.G is None else form.G
    diagonal = section.table["Q"]
    is_list = isinstance(diagonal, list) and not any(isinstance(q, list) for q in diagonal)
    Q = np.diag(section.numbers("Q")) if is_list else section.matrix("Q", None, None)
    if Q is None or len(Q) != G.shape[1] or Q.shape != Q.T.shape:
        section.errors.append(f"noise.Q must have {G.shape[1]} intensities, one for each noise")
        return W
    if not np.allclose(Q, Q.T) or np.linalg.eigvalsh(Q)[0] < -1e-10 * np.abs(Q).max():
        section.errors.append("noise.Q must be symmetric and positive semidefinite")
    return W + G @ Q @ G.T


def _require_different(names: Sequence[str], errors: list[str]) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        errors.append(f"the name {', '.join(map(repr, repeated))} is used more than once")
