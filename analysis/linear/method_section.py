"""Parser of the sections ``[method]`` and ``[regulator]`` of a system file."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from analysis.design.luenberger import POLE_PATTERNS
from analysis.design.observability import ComplexArray
from shiplog.types import FloatArray

from .file_section import FileSection
from .methods import (
    CascadeMethod,
    KalmanMethod,
    Method,
    PlacedMethod,
    QualityMethod,
    TickMethod,
)
from .system import RegulatorWeights

GAINS = ("time-varying", "steady-state")


def parse_method(top: FileSection, states: Sequence[str]) -> Method:
    """Parse ``[method]``; the Kalman filter by default."""
    if "method" not in top:
        return KalmanMethod()
    section = top.section("method")
    name = section.text("name", choices=tuple(METHODS))
    if name not in METHODS:  # refused already; which keys it has is not known
        return KalmanMethod()
    method = METHODS[name](section, states)
    section.finish()
    return method


def parse_regulator(
    top: FileSection, states: Sequence[str], inputs: Sequence[str]
) -> RegulatorWeights | None:
    """Parse ``[regulator]``; None where the file has none."""
    if "regulator" not in top:
        return None
    section = top.section("regulator")
    P, R = (
        _diagonal(section.by_name("P", states, least=0.0), states),
        _diagonal(section.by_name("R", inputs, least=0.0), inputs),
    )
    if not inputs:
        section.errors.append("[regulator] needs [inputs.NAME]")
    elif not np.diag(R).all():
        section.errors.append(f"regulator.R must be positive for each of {', '.join(inputs)}")
    weights = RegulatorWeights(
        P, R,
        _diagonal(section.by_name("G", states, least=0.0), states),
        section.number("shift", 0.0, least=0.0),
        section.count("cycles", 1),
    )  # fmt: skip
    section.finish()
    return weights


def _kalman(section: FileSection, _: Sequence[str]) -> Method:
    return KalmanMethod(section.text("gain", GAINS[0], GAINS) == "steady-state")


def _quality(section: FileSection, states: Sequence[str]) -> Method:
    G = _diagonal(section.by_name("G", states, least=0.0), states)
    if isinstance(section.table.get("shift"), list):
        shifts = section.numbers("shift") if "shift" in section else np.zeros(0)
        if len(shifts) != 2:
            section.errors.append("method.shift must be one number, or two with method.border")
            return QualityMethod(0.0, G)
        c1, c2 = shifts.tolist()
        border = section.number("border", positive=True)
        return QualityMethod((c1, c2), G, border, section.count("cycles", 1))
    shift = section.number("shift", 0.0, least=0.0)
    return QualityMethod(shift, G, None, section.count("cycles", 1))


def _cycles(section: FileSection, states: Sequence[str]) -> Method:
    section.count("cycles", least=1)
    return _quality(section, states)


def _cascade(section: FileSection, _: Sequence[str]) -> Method:
    return CascadeMethod(
        section.count("stages", 2),
        section.number("correlation_secs", positive=True),
        section.number("noise_factor", 1.0, positive=True),
    )


def _luenberger(section: FileSection, _: Sequence[str]) -> Method:
    pattern = section.text("pattern", "butterworth", tuple(POLE_PATTERNS))
    if isinstance(section.table.get("frequency"), list):
        frequencies = section.numbers("frequency") if "frequency" in section else np.zeros(0)
        return PlacedMethod(pattern, frequencies.tolist())
    return PlacedMethod(pattern, section.number("frequency", positive=True))


def _multi_level(section: FileSection, _: Sequence[str]) -> Method:
    return PlacedMethod(_poles(section))


def _per_tick(section: FileSection, _: Sequence[str]) -> Method:
    return TickMethod(_poles(section))


def _reduced_order(section: FileSection, _: Sequence[str]) -> Method:
    return TickMethod(_poles(section), reduced=True)


METHODS: Mapping[str, Callable[[FileSection, Sequence[str]], Method]] = {
    "kalman": _kalman,
    "quality": _quality,
    "cycles": _cycles,
    "cascade": _cascade,
    "luenberger": _luenberger,
    "multi-level": _multi_level,
    "per-tick": _per_tick,
    "reduced-order": _reduced_order,
}


def _poles(section: FileSection) -> ComplexArray:
    """Read poles: real numbers, and pairs [real, imaginary], each of which gives two poles."""
    if "poles" not in section:
        section.lacks("poles")
        return -np.ones(1, np.complex128)
    poles: list[complex] = []
    given = section.table["poles"]
    for each in given if isinstance(given, list) else [given]:
        parts = each if isinstance(each, list) else [each]
        if not all(isinstance(part, int | float) for part in parts) or len(parts) not in (1, 2):
            section.errors.append("method.poles must be real numbers or pairs [real, imaginary]")
            return -np.ones(1, np.complex128)
        if parts[0] >= 0:
            section.errors.append(f"method.poles must have negative real parts, got {parts[0]:g}")
        pole = complex(*parts)
        poles += [pole, pole.conjugate()] if pole.imag else [pole]
    return np.array(poles, np.complex128)


def _diagonal(values: Mapping[str, float], names: Sequence[str]) -> FloatArray:
    return np.diag([values.get(name, 0.0) for name in names])
