"""A ship: its coefficients, steering gear, simulation model and replay settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import pi
from typing import TYPE_CHECKING

from shiplog.errors import UsageError, VesselError

from .hull import Hull
from .model_section import ModelSection
from .settings import (
    DisturbanceSettings,
    FilterSettings,
    IdentifierSettings,
    number_error,
    parse_settings,
    settings_dict,
)

if TYPE_CHECKING:  # it brings numba; only verbs that compute need it
    from shiplog.ships.paper import Coefficients

MAX_LENGTH = 1000.0  # m
SECTIONS = ("filter", "disturbance", "identifier")  # of settings, in a vessel file


@dataclass(frozen=True)
class Vessel:
    """A ship as its vessel file describes it.

    Attributes
    ----------
    name
        Name of the ship.
    coefficients
        Coefficients of the identification paper's model, in SI units and radians, on which the
        filters are built; None where the file does not give them.
    length
        Length between perpendiculars, m.
    approach_rpm
        Revolutions at which a simulated trial begins.
    rudder_max
        Largest rudder angle, rad.
    rudder_rate
        Rate of the steering gear, rad/s.
    gear_given
        Keys of the steering gear that the file gives, ``max`` and ``rate``; the others have their
        defaults.
    compass_error
        Standard uncertainty of the compass in a change of heading, rad; None where the file does
        not give it.
    filter, disturbance, identifier
        Settings of a replay.
    angle_unit
        Unit of the angles in the file, "deg" or "rad"; here all angles are in radians.
    model
        Ship model of a simulation, where it is not the paper's.
    hull
        Main dimensions of hull, rudder and propeller.
    """

    name: str
    coefficients: "Coefficients | None"
    length: float | None = None
    approach_rpm: float = 80.0
    rudder_max: float = 35 * pi / 180
    rudder_rate: float = 2.5 * pi / 180
    gear_given: tuple[str, ...] = ()
    compass_error: float | None = None
    filter: FilterSettings = field(default_factory=FilterSettings)
    disturbance: DisturbanceSettings = field(default_factory=DisturbanceSettings)
    identifier: IdentifierSettings = field(default_factory=IdentifierSettings)
    angle_unit: str = "rad"
    model: ModelSection | None = None
    hull: Hull = field(default_factory=Hull)

    @property
    def paper_coefficients(self) -> "Coefficients":
        """Coefficients of the identification paper's model.

        Raises
        ------
        VesselError
            The vessel file does not give them.
        """
        if self.coefficients is None:
            raise VesselError(
                "the vessel file lacks the coefficients of the paper's model; add [yaw], [surge] "
                f"and alpha1, alpha2, alpha3 of [rudder]: {self.name or 'unnamed ship'}"
            )
        return self.coefficients


def with_length(vessel: Vessel | None, length: float | None) -> Vessel | None:
    """Return the vessel with the length given, which takes precedence over its own.

    Parameters
    ----------
    vessel
        The vessel; None where nothing but the length is known.
    length
        Length between perpendiculars, m; None leaves the vessel as it is.

    Raises
    ------
    UsageError
        The length is not a number above 0 and up to `MAX_LENGTH`.

    Examples
    --------
    >>> with_length(None, 320.0).length
    320.0
    """
    if length is None:
        return vessel
    error = number_error("length", length, 0.0, MAX_LENGTH, positive=True)
    if error:
        raise UsageError(f"{error}; give the length between perpendiculars in metres")
    return replace(vessel or Vessel("", None), length=float(length))


def with_settings(vessel: Vessel, settings: Mapping[str, object]) -> Vessel:
    """Return the vessel with some of its replay settings replaced.

    Parameters
    ----------
    vessel
        The vessel.
    settings
        Values by section and key, such as ``{"filter.kind": "extended"}``. The keys are those of
        `[filter]`, `[disturbance]` and `[identifier]`; the value "auto" restores the default, but
        for ``filter.sensor_bias``, which has a choice of that name.

    Raises
    ------
    UsageError
        A setting is unknown or has a wrong value; the message lists all of them.

    Examples
    --------
    >>> import shiplog
    >>> vessel, _ = shiplog.load_vessel("table1")
    >>> with_settings(vessel, {"filter.gate": 4.0}).filter.gate
    4.0
    """
    if not settings:
        return vessel
    errors: list[str] = []
    tables = {section: settings_dict(getattr(vessel, section)) for section in SECTIONS}
    for name, value in settings.items():
        section, _, key = name.partition(".")
        if name == "filter.sensor_bias" and isinstance(value, str):
            tables[section][key] = [word.strip() for word in value.split(",")]
        elif section in tables and value == "auto":
            tables[section].pop(key, None)
        elif section in tables:
            tables[section][key] = value
        else:
            prefixes = ", ".join(f"{section}." for section in SECTIONS)
            errors.append(f"unknown setting {name!r}, it must begin with one of {prefixes}")
    filtering = parse_settings(FilterSettings, tables["filter"], errors)
    observing = parse_settings(DisturbanceSettings, tables["disturbance"], errors)
    identifying = parse_settings(IdentifierSettings, tables["identifier"], errors)
    if errors:
        raise UsageError(f"wrong settings: {'; '.join(errors)}")
    return replace(vessel, filter=filtering, disturbance=observing, identifier=identifying)
