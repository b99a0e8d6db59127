"""Checks of the replay settings against the kind of filter in use."""

from shiplog.errors import UsageError
from shiplog.vessel.settings import DisturbanceSettings, FilterSettings, settings_dict

from .base import WAVE_SETTINGS, FilterKind

GENERAL_SETTINGS = ("kind", "smooth")  # no filter uses them itself


def check_filter_settings(kind: FilterKind, settings: FilterSettings) -> None:
    """Raise `UsageError` for a setting that the kind of filter cannot comply with.

    Examples
    --------
    >>> from analysis.filters.factory import filter_kind
    >>> check_filter_settings(filter_kind("extended"), FilterSettings(smooth=True))
    """
    if settings.wave and not kind.models_wave:
        raise UsageError(
            f"filter.wave needs a filter that can model a wave, and {kind.name!r} cannot;"
            " use 'extended'"
        )
    if settings.sensors and not kind.has_further_states:
        raise UsageError(
            f"filter.sensor_bias needs a filter that can have sensor errors as states, and"
            f" {kind.name!r} cannot; use 'extended' or 'pseudo-input'"
        )
    if settings.smooth and not kind.smoothable:
        raise UsageError(
            f"filter.smooth needs a filter with the optimal gain, which {kind.name!r} has not;"
            " use 'extended' or 'pseudo-input'"
        )


def unused_settings(
    kind: FilterKind, settings: FilterSettings, disturbance: DisturbanceSettings
) -> list[str]:
    """List the settings that differ from their defaults and have no effect.

    Parameters
    ----------
    kind
        The kind of filter in use.
    settings
        The settings of ``[filter]``.
    disturbance
        The settings of ``[disturbance]``, whose wave uses ``filter.wave_frequency``, too.

    Examples
    --------
    >>> from analysis.filters.factory import filter_kind
    >>> settings = FilterSettings(shift=0.2)
    >>> unused_settings(filter_kind("extended"), settings, DisturbanceSettings())
    ['filter.shift']
    """
    defaults = settings_dict(FilterSettings())
    observes_wave = "wave" in disturbance.models
    used = {*GENERAL_SETTINGS, *kind.settings}
    if not settings.wave:
        used -= set(WAVE_SETTINGS)
    if not settings.sensors:
        used -= {"heading_std", "position_std"}
    if observes_wave:
        used.add("wave_frequency")
    unused = [
        f"filter.{key}"
        for key, value in settings_dict(settings).items()
        if defaults.get(key) != value and key not in used
    ]
    if disturbance.wave_frequency is not None and not observes_wave:
        unused.append("disturbance.wave_frequency")
    return unused


def unused_setting_warnings(
    kind: FilterKind, settings: FilterSettings, disturbance: DisturbanceSettings
) -> list[str]:
    """Warn about settings without effect; at most one line."""
    names = ", ".join(unused_settings(kind, settings, disturbance))
    if not names:
        return []
    warning = (
        f"settings without effect: {names}; the filter is {kind.name!r}: remove them or choose"
        " another filter, disturbance model or filter.sensor_bias"
    )
    return [warning]
