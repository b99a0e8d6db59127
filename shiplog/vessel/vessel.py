"""`Vessel`: a ship with its model, steering gear and replay settings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import pi
from typing import TYPE_CHECKING

from shiplog.errors import UsageError, VesselError

from .model_section import ModelSection
from .settings import (
    DisturbanceSettings,
    FilterSettings,
    IdentifierSettings,
    disturbance_settings,
    filter_settings,
    identifier_settings,
    settings_dict,
    unused_settings,
)

if TYPE_CHECKING:  # ship.py brings numba; only verbs that compute need it
    from shiplog.ships.paper import Coefficients

SECTIONS = ("filter", "disturbance", "identifier")


@dataclass(frozen=True)
class Vessel:
    """A ship: its model's coefficients, its steering gear, and how its logs are filtered."""

    name: str
    coefficients: "Coefficients | None"  # the paper's; None where the file has a `[model]` alone
    length: float | None = None  # m, between perpendiculars
    approach_rpm: float = 80.0
    rudder_max: float = 35 * pi / 180  # rad
    rudder_rate: float = 2.5 * pi / 180  # rad/s
    filter: FilterSettings = field(default_factory=FilterSettings)
    disturbance: DisturbanceSettings = field(default_factory=DisturbanceSettings)
    identifier: IdentifierSettings = field(default_factory=IdentifierSettings)
    angle_unit: str = "rad"  # of its file; inside all angles are radians
    model: ModelSection | None = None  # that she is sailed by, if not by the paper's

    @property
    def paper_coefficients(self) -> "Coefficients":
        """The paper's coefficients; raises `VesselError` where the file has none."""
        if self.coefficients is None:
            raise VesselError(
                f"the vessel file has a [model] alone, and what is asked for is built on the "
                f"paper's; give [yaw], [surge] and [rudder], too: {self.name}"
            )
        return self.coefficients


def with_settings(vessel: Vessel, settings: Mapping[str, object]) -> Vessel:
    """The vessel with settings of its own replaced, such as {"filter.kind": "extended"}.

    The names are those of its file's `[filter]`, `[disturbance]` and `[identifier]`; "auto" is as
    if it stated nothing. Raises `UsageError` with all the faults at once.
    """
    if not settings:
        return vessel
    faults: list[str] = []
    tables = {section: settings_dict(getattr(vessel, section)) for section in SECTIONS}
    for name, value in settings.items():
        section, _, key = name.partition(".")
        if section in tables and value == "auto":
            tables[section].pop(key, None)
        elif section in tables:
            tables[section][key] = value
        else:
            begin = ", ".join(f"{section}." for section in SECTIONS)
            faults.append(f"unknown setting {name!r}, they begin with one of {begin}")
    filtering = filter_settings(tables["filter"], faults)
    observing = disturbance_settings(tables["disturbance"], faults)
    identifying = identifier_settings(tables["identifier"], faults)
    if faults:
        raise UsageError(f"these settings do not work: {'; '.join(faults)}")
    return replace(vessel, filter=filtering, disturbance=observing, identifier=identifying)


def unused_setting_warnings(vessel: Vessel) -> list[str]:
    """Which of a vessel's settings do nothing, in words."""
    names = ", ".join(unused_settings(vessel.filter, vessel.disturbance))
    return [f"nothing comes of {names}: filter.kind is {vessel.filter.chosen!r}"] if names else []
