"""Replay settings: the keys of `[filter]`, `[disturbance]` and `[identifier]` of a vessel file.

Each key is a field of a dataclass; the field's metadata has its type and its limits.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import inf, isfinite
from typing import Any, ClassVar, TypeVar

from shiplog.extensions import extension_names
from shiplog.toml_text import unknown_key
from shiplog.units import did_you_mean

FILTER_GROUP = "shiplog.filters"  # the entry points whose names `[filter] kind` accepts
ABBREVIATIONS = {"ekf": "extended", "kf": "pseudo-input"}  # for hints about unknown names
NONE = "none"  # a choice that excludes all others
DISTURBANCES = ("constant", "ramp", "wave")
WIND = "wind"
DISTURBANCE_CHOICES = (*DISTURBANCES, WIND)
SPECTRA = ("butterworth", "binomial")
SENSOR_ERRORS = ("gyro", "log", "log_scale", "rudder", "compass")
SENSOR_CHOICES = ("auto", NONE, *SENSOR_ERRORS)

MIN_WINDOW_SECS = 60.0  # length of one test function of the equations in integral form

Settings = TypeVar("Settings", "FilterSettings", "DisturbanceSettings", "IdentifierSettings")


def _flag() -> Any:  # noqa: ANN401 - as dataclasses.field
    return field(default=False, metadata={"kind": bool})


def _number(
    default: float | None = None, *, least: float = -inf, most: float = inf, positive: bool = False
) -> Any:  # noqa: ANN401
    limits = {"least": least, "most": most, "positive": positive}
    return field(default=default, metadata={"kind": float, **limits})


def _filter_names() -> tuple[str, ...]:
    return extension_names(FILTER_GROUP)


def _choice(
    of: Sequence[str] | Callable[[], Sequence[str]],
    default: str | tuple[str, ...] | None,
    *,
    several: bool = False,
) -> Any:  # noqa: ANN401
    return field(default=default, metadata={"kind": list if several else str, "of": of})


@dataclass(frozen=True)
class FilterSettings:
    """Settings of the state estimator, `[filter]`; None where the value follows from the log.

    Attributes
    ----------
    kind
        Name of the filter; None selects `pseudo-input`, or `extended` if `wave` is set.
    smooth
        Smooth the estimates backwards from the end of the log.
    gate
        Innovations larger than this many standard deviations are rejected.
    yaw_rate_std
        Standard deviation of the white noise of one sample of the yaw rate, rad/s.
    speed_std
        The same of the speed, m/s.
    process_ratio
        Intensity of the process noise over that of the measurement noise, 1/s^2: Q/R of the
        identification paper.
    as_printed
        pseudo-input only: use the paper's equations as printed, without the jumps of the yaw
        acceleration when the rudder moves.
    yaw_bandwidth, surge_bandwidth
        All filters but pseudo-input: bandwidth of the estimates in yaw and in surge, rad/s, in
        place of `process_ratio`.
    shift
        quality only: every pole lies left of minus half this value, 1/s.
    damping
        quality only: weight G of the yaw acceleration, over the intensity R of the measurement
        noise.
    yaw_decay, surge_decay
        per-tick only: minus the double pole of yaw and minus the pole of surge, 1/s.
    wave
        Separate waves in the yaw rate from the ship's own turning.
    wave_frequency, wave_damping, wave_std
        Frequency in rad/s, damping ratio, and standard deviation in rad/s of the wave model.
    sensor_bias
        Sensor errors that are states of the filter, some of `SENSOR_ERRORS`; ``auto`` selects those
        that the log determines. Heading and position are then measurements of the filter too.
    heading_std, position_std
        Standard deviation of the white noise of one sample of heading, rad, and position, m. A
        heading for which it is stated has no slow error.
    """

    SECTION: ClassVar[str] = "filter"

    kind: str | None = _choice(_filter_names, None)
    smooth: bool = _flag()
    gate: float = _number(6.0, positive=True, least=1e-6, most=1e9)
    yaw_rate_std: float | None = _number(positive=True, least=1e-7, most=1.0)
    speed_std: float | None = _number(positive=True, least=1e-4, most=100.0)
    process_ratio: float | None = _number(positive=True, least=1e-12, most=1e6)
    as_printed: bool = _flag()
    yaw_bandwidth: float | None = _number(positive=True, least=1e-6, most=1e3)
    surge_bandwidth: float | None = _number(positive=True, least=1e-6, most=1e3)
    shift: float = _number(0.1, least=0.0, most=1e3)
    damping: float = _number(0.0, least=0.0, most=1e6)
    yaw_decay: float | None = _number(positive=True, least=1e-6, most=1e3)
    surge_decay: float | None = _number(positive=True, least=1e-6, most=1e3)
    wave: bool = _flag()
    wave_frequency: float | None = _number(positive=True, least=1e-6, most=1e3)
    wave_damping: float | None = _number(positive=True, least=1e-6, most=1.0)
    wave_std: float | None = _number(positive=True, least=1e-8, most=1.0)
    sensor_bias: tuple[str, ...] | None = _choice(SENSOR_CHOICES, None, several=True)
    heading_std: float | None = _number(positive=True, least=1e-7, most=1.0)
    position_std: float | None = _number(positive=True, least=1e-4, most=1e4)

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensor errors requested, which may be ``auto``; empty for none."""
        return tuple(name for name in self.sensor_bias or () if name != NONE)

    @property
    def chosen(self) -> str:
        """Name of the filter in use; the default pseudo-input cannot model a wave."""
        return self.kind or ("extended" if self.wave else "pseudo-input")


@dataclass(frozen=True)
class DisturbanceSettings:
    """Settings of the disturbance observer, `[disturbance]`.

    Attributes
    ----------
    models
        Disturbance models of the yaw moment and the surge force: some of `DISTURBANCE_CHOICES`.
        ``wind`` needs a smoothed filter, whose states its coefficients are.
    spectrum
        Pattern of the observer's poles: one of `SPECTRA`.
    yaw_frequency, surge_frequency
        Frequency of these poles, rad/s. That of yaw is the paper's; that of surge is lower because
        surge is slower and its sensor noisier.
    wave_frequency
        Frequency of the `wave` model, rad/s; None takes the peak of the residual's spectrum.
    """

    SECTION: ClassVar[str] = "disturbance"

    models: tuple[str, ...] = _choice(DISTURBANCE_CHOICES, ("constant",), several=True)
    spectrum: str = _choice(SPECTRA, "butterworth")
    yaw_frequency: float = _number(0.05, positive=True, least=1e-6, most=1e3)
    surge_frequency: float = _number(0.02, positive=True, least=1e-6, most=1e3)
    wave_frequency: float | None = _number(positive=True, least=1e-6, most=1e3)


@dataclass(frozen=True)
class IdentifierSettings:
    """Settings of the coefficients over time, `[identifier]`.

    Attributes
    ----------
    window_secs
        Length of the windows in which the coefficients are identified, s.
    """

    SECTION: ClassVar[str] = "identifier"

    window_secs: float = _number(200.0, least=MIN_WINDOW_SECS, most=1e9)


def parse_settings(
    kind: type[Settings], table: Mapping[str, object], errors: list[str]
) -> Settings:
    """Parse a section of settings; a key with an error keeps its default.

    Whether the filter can comply with its settings is checked by the replay.

    Parameters
    ----------
    kind
        The class of the settings, such as `FilterSettings`.
    table
        Keys and values of the section.
    errors
        Messages are appended for everything that is wrong.

    Examples
    --------
    >>> errors = []
    >>> parse_settings(FilterSettings, {"kind": "extended", "gate": 0}, errors).kind, errors
    ('extended', ['filter.gate must be positive, got 0'])
    """
    allowed = {f.name: f for f in fields(kind)}
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in allowed:
            errors.append(unknown_key(key, allowed, section=kind.SECTION))
            continue
        error = _value_error(f"{kind.SECTION}.{key}", value, allowed[key].metadata)
        if error:
            errors.append(error)
        else:
            values[key] = _converted(value)
    return kind(**values)


def settings_dict(
    settings: FilterSettings | DisturbanceSettings | IdentifierSettings,
) -> dict[str, object]:
    """Return the section of a vessel file that gives these settings, without those that are None.

    Examples
    --------
    >>> settings_dict(IdentifierSettings())
    {'window_secs': 200.0}
    """
    return {key: value for key, value in asdict(settings).items() if value is not None}


def _converted(value: object) -> object:
    """Lists as tuples and whole numbers as floats."""
    if isinstance(value, list):
        return tuple(value)
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _value_error(label: str, value: object, expected: Mapping[str, Any]) -> str | None:
    """Describe what is wrong with a value; None if nothing is."""
    kind = expected["kind"]
    if kind is bool:
        return None if isinstance(value, bool) else f"{label} must be true or false, got {value!r}"
    if kind is float:
        return number_error(
            label, value, expected["least"], expected["most"], positive=expected["positive"]
        )
    allowed = expected["of"]() if callable(expected["of"]) else expected["of"]
    choices = ", ".join(allowed)
    if kind is str:
        hint = _nearest(value, allowed)
        return (
            None if value in allowed else f"{label} must be one of {choices}, got {value!r}{hint}"
        )
    return _list_error(label, value, allowed)


def _list_error(label: str, value: object, allowed: Sequence[str]) -> str | None:
    """Describe what is wrong with a list of choices; None if nothing is."""
    choices = ", ".join(allowed)
    if not isinstance(value, list | tuple) or not value:
        return f"{label} must be a list of some of {choices}, got {value!r}"
    unknown = [each for each in value if each not in allowed]
    if unknown:
        hint = _nearest(unknown[0], allowed)
        return f"{label} must be a list of some of {choices}, got {value!r}{hint}"
    if NONE in value and set(value) != {NONE}:
        others = ", ".join(each for each in value if each != NONE)
        return f"{label} has {NONE} beside {others}; remove one of them"
    return None


def _nearest(name: object, allowed: Sequence[str]) -> str:
    """Return a hint with the choice that is most like a name; empty where none is."""
    meant = str(name).lower()
    abbreviated = ABBREVIATIONS.get(meant, meant)
    return did_you_mean(abbreviated, allowed).replace(";", ",")


def number_error(
    label: str, value: object, least: float, most: float, *, positive: bool = False
) -> str | None:
    """Describe what is wrong with a number of a vessel file.

    Parameters
    ----------
    label
        Name of the key, for the message.
    value
        The value, of any type.
    least, most
        Limits of the value, inclusive.
    positive
        Whether the value must be greater than zero.

    Returns
    -------
    str or None
        The message; None where the number is right.

    Examples
    --------
    >>> number_error("filter.gate", -1.0, 0.0, 1e9)
    'filter.gate must lie between 0 and 1e+09, got -1'
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"{label} must be a number, got {value!r}"
    if not isfinite(value):
        return f"{label} must be finite, got {value}"
    if positive and value <= 0:
        return f"{label} must be positive, got {value:g}"
    if not least <= value <= most:
        return f"{label} must lie between {least:g} and {most:g}, got {value:g}"
    return None
