"""Parser of the sections ``[[disturbance]]`` and ``[[coloured]]`` of a system file."""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.design.augmentation import Exosystem
from analysis.design.shaping import TransferFunction

from .file_section import FileSection
from .spectra import RATIONAL, SPECTRA, ShapedNoise
from .system import SystemDisturbance

DISTURBANCE_MODELS = ("constant", "ramp", "polynomial", "exponential", "harmonic")


def parse_disturbance(
    section: FileSection, states: Sequence[str], inputs: Sequence[str], sensors: Sequence[str]
) -> SystemDisturbance:
    """Parse a ``[[disturbance]]``."""
    name = section.text("name")
    exosystem = _exosystem(section)
    found = SystemDisturbance(
        name,
        exosystem,
        section.by_name("on_state", states),
        section.by_name("on_input", inputs),
        section.by_name("on_sensor", sensors),
        section.number("intensity", 0.0, least=0.0),
        section.text("unit", "1"),
    )
    if not (found.on_state or found.on_input or found.on_sensor):
        section.errors.append(
            f"{section.label} acts on nothing: give on_state, on_input or on_sensor"
        )
    section.finish()
    return found


def _exosystem(section: FileSection) -> Exosystem:
    model = section.text("model", choices=DISTURBANCE_MODELS)
    if model == "harmonic":
        frequency = section.number("frequency", positive=True)
        return Exosystem.harmonic(frequency if frequency > 0 else 1.0)
    if model == "exponential":
        rate, degree = section.number("rate"), section.count("degree", 0, least=0)
        return Exosystem.exponential(rate if np.isfinite(rate) else 0.0, degree)
    degrees = {"polynomial": section.count("degree", least=0)} if model == "polynomial" else {}
    return Exosystem.polynomial(degrees.get(model, int(model == "ramp")))


def parse_shaped(
    section: FileSection, states: Sequence[str], sensors: Sequence[str]
) -> ShapedNoise:
    """Parse a ``[[coloured]]``."""
    name, unit = section.text("name"), section.text("unit", "1")
    spectrum = section.text("spectrum", choices=(*SPECTRA, RATIONAL))
    parameters, rational = _spectrum_parameters(section, spectrum)
    on_state = section.by_name("on_state", states)
    on_sensor = section.by_name("on_sensor", sensors)
    if bool(on_state) == bool(on_sensor):
        section.errors.append(f"{section.label} needs on_state or on_sensor, not both")
    fit = section.names("fit", parameters)
    section.finish()
    return ShapedNoise(name, spectrum, parameters, on_state, on_sensor, fit, rational, unit)


def _spectrum_parameters(
    section: FileSection, spectrum: str
) -> tuple[Mapping[str, float], TransferFunction | None]:
    if spectrum in SPECTRA:
        defaults = SPECTRA[spectrum].parameters
        return {
            key: section.number(key, default, positive=True) for key, default in defaults.items()
        }, None
    num, den = section.numbers("num"), section.numbers("den")
    stable = len(den) > 1 and den[0] and np.roots(den).real.max(initial=-np.inf) < 0
    if not stable or not 0 < len(num) < len(den):
        section.errors.append(
            f"{section.label} needs num and den of a stable filter with fewer zeros than poles"
        )
        num, den = np.ones(1), np.ones(2)
    std = {"std": section.number("std", positive=True)} if "std" in section else {}
    return std, TransferFunction(num / den[0], den / den[0])
