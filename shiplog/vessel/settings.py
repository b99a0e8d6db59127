"""How a log is replayed: `[filter]`, `[disturbance]` and `[identifier]` of a vessel file.

Each key is a field; its kind and its limits stand beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import inf, isfinite
from typing import Any, TypeVar

from shiplog.units import did_you_mean

FILTERS = ("pseudo-input", "steady-state", "quality", "per-tick", "extended")
SMOOTHED = ("pseudo-input", "extended")  # whose gain is the one that a smoother goes back from
DISTURBANCES = ("constant", "ramp", "wave")
SPECTRA = ("butterworth", "binomial")

MIN_WINDOW_SECS = 60.0  # one bump of the equations in integral form

Settings = TypeVar("Settings", "FilterSettings", "DisturbanceSettings", "IdentifierSettings")


def _flag() -> Any:  # noqa: ANN401 - as dataclasses.field
    return field(default=False, metadata={"kind": bool})


def _number(
    default: float | None = None, *, least: float = -inf, most: float = inf, positive: bool = False
) -> Any:  # noqa: ANN401
    limits = {"least": least, "most": most, "positive": positive}
    return field(default=default, metadata={"kind": float, **limits})


def _choice(
    of: Sequence[str], default: str | tuple[str, ...] | None, *, several: bool = False
) -> Any:  # noqa: ANN401
    return field(default=default, metadata={"kind": list if several else str, "of": of})


@dataclass(frozen=True)
class FilterSettings:
    """What a vessel file says of the filter; None where the log itself shall tell."""

    kind: str | None = _choice(FILTERS, None)
    smooth: bool = _flag()  # back from the end, too
    gate: float = _number(6.0, positive=True, most=1e9)  # standard deviations a sample may be off
    yaw_rate_std: float | None = _number(positive=True, most=10.0)  # rad/s, white, of one sample
    speed_std: float | None = _number(positive=True, most=100.0)  # m/s
    process_ratio: float | None = _number(positive=True, most=1e12)  # 1/s^2, the paper's Q/R
    as_printed: bool = _flag()  # pseudo-input: without the jumps that the rudder makes
    # the others: how fast the estimate follows what is measured, rad/s
    yaw_bandwidth: float | None = _number(positive=True, most=1e3)
    surge_bandwidth: float | None = _number(positive=True, most=1e3)
    # quality: every pole is left of half the shift, 1/s; its G on the yaw acceleration, over R
    shift: float = _number(0.1, least=0.0, most=1e3)
    damping: float = _number(0.0, least=0.0, most=1e6)
    # per-tick: minus the poles of yaw, a double one, and of surge, 1/s
    yaw_decay: float | None = _number(positive=True, most=1e3)
    surge_decay: float | None = _number(positive=True, most=1e3)
    wave: bool = _flag()  # waves in the yaw rate are told from the ship's own turning
    wave_frequency: float | None = _number(positive=True, most=1e3)  # rad/s
    wave_damping: float | None = _number(positive=True, most=1.0)
    wave_std: float | None = _number(positive=True, most=10.0)  # rad/s

    @property
    def chosen(self) -> str:
        """The filter's name; without one given, the paper's, which has no room for a wave."""
        return self.kind or ("extended" if self.wave else "pseudo-input")


@dataclass(frozen=True)
class DisturbanceSettings:
    """What a vessel file says of the disturbances to be observed."""

    models: tuple[str, ...] = _choice(DISTURBANCES, ("constant",), several=True)
    spectrum: str = _choice(SPECTRA, "butterworth")  # of the observer's poles
    # rad/s, of these: yaw's is the paper's; surge is slower, and its sensor noisier
    yaw_frequency: float = _number(0.05, positive=True, most=1e3)
    surge_frequency: float = _number(0.02, positive=True, most=1e3)
    wave_frequency: float | None = _number(positive=True, most=1e3)  # None: the residual tells


@dataclass(frozen=True)
class IdentifierSettings:
    """What a vessel file says of the windows in which coefficients are identified."""

    window_secs: float = _number(200.0, least=MIN_WINDOW_SECS, most=1e9)


ONLY_OF = {  # what the settings of single filters do nothing without
    "as_printed": ("pseudo-input",),
    "yaw_bandwidth": FILTERS[1:],
    "surge_bandwidth": FILTERS[1:],
    "shift": ("quality",),
    "damping": ("quality",),
    "yaw_decay": ("per-tick",),
    "surge_decay": ("per-tick",),
}


def unused_settings(filtering: FilterSettings, observing: DisturbanceSettings) -> list[str]:
    """The settings, by their names, that are not as by default and do nothing."""
    usual, names = settings_dict(FilterSettings()), []
    changed = [key for key, value in settings_dict(filtering).items() if usual.get(key) != value]
    names += [key for key in changed if filtering.chosen not in ONLY_OF.get(key, FILTERS)]
    of_wave = ("wave_frequency", "wave_damping", "wave_std")
    observes = "wave" in observing.models
    for key in of_wave if not filtering.wave else ():
        if key in changed and not (key == "wave_frequency" and observes):
            names.append(key)
    idle = [f"filter.{name}" for name in names]
    if observing.wave_frequency is not None and not observes:
        idle.append("disturbance.wave_frequency")
    return idle


def filter_settings(table: Mapping[str, object], faults: list[str]) -> FilterSettings:
    """The settings of a `[filter]` section; what is wrong with it goes to `faults`."""
    found = _parsed("filter", FilterSettings, table, faults)
    if found.wave and found.kind == "pseudo-input":
        faults.append("filter.kind = 'pseudo-input' has no room for a wave; take 'extended'")
    if found.smooth and found.chosen not in SMOOTHED:
        faults.append(
            f"filter.smooth goes back from an optimal gain, and that of {found.chosen!r} is not;"
            f" take {' or '.join(map(repr, SMOOTHED))}"
        )
    return found


def disturbance_settings(table: Mapping[str, object], faults: list[str]) -> DisturbanceSettings:
    """The settings of a `[disturbance]` section; what is wrong with it goes to `faults`."""
    return _parsed("disturbance", DisturbanceSettings, table, faults)


def identifier_settings(table: Mapping[str, object], faults: list[str]) -> IdentifierSettings:
    """The settings of an `[identifier]` section; what is wrong with it goes to `faults`."""
    return _parsed("identifier", IdentifierSettings, table, faults)


def settings_dict(
    settings: FilterSettings | DisturbanceSettings | IdentifierSettings,
) -> dict[str, object]:
    """The section that gives these settings."""
    return {key: value for key, value in asdict(settings).items() if value is not None}


def _parsed(
    section: str, kind: type[Settings], table: Mapping[str, object], faults: list[str]
) -> Settings:
    known = {f.name: f for f in fields(kind)}
    values: dict[str, Any] = {}
    for key, value in table.items():
        label = f"{section}.{key}"
        if key not in known:
            faults.append(f"unknown key {label!r}{did_you_mean(key, known).replace(';', ',')}")
            continue
        fault = _fault(label, value, known[key].metadata)
        if fault:
            faults.append(fault)
        else:
            values[key] = _plain(value)
    return kind(**values)


def _plain(value: object) -> object:
    if isinstance(value, list):
        return tuple(value)
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _fault(label: str, value: object, wanted: Mapping[str, Any]) -> str | None:
    """What is wrong with a value, if anything."""
    kind = wanted["kind"]
    if kind is bool:
        return None if isinstance(value, bool) else f"{label} must be true or false, got {value!r}"
    if kind is float:
        return number_error(
            label, value, wanted["least"], wanted["most"], positive=wanted["positive"]
        )
    among = f"{', '.join(wanted['of'])}"
    if kind is str:
        return None if value in wanted["of"] else f"{label} must be one of {among}, got {value!r}"
    several = isinstance(value, list | tuple) and value and all(v in wanted["of"] for v in value)
    return None if several else f"{label} must be a list of some of {among}, got {value!r}"


def number_error(
    label: str, value: object, least: float, most: float, *, positive: bool = False
) -> str | None:
    """What is wrong with a number of a vessel file, if anything."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"{label} must be a number, got {value!r}"
    if not isfinite(value):
        return f"{label} must be finite, got {value}"
    if positive and value <= 0:
        return f"{label} must be positive, got {value:g}"
    if not least <= value <= most:
        return f"{label} must lie between {least:g} and {most:g}, got {value:g}"
    return None
