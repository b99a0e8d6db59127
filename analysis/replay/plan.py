"""The plan of a replay: everything that must be known before the estimators start.

`plan_replay` makes two passes over the log (`passes`), then chooses the model, the noise and the
disturbances to estimate.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import sqrt

from analysis.disturbance.observer import wave_frequency_warnings
from analysis.filters.base import FilterKind
from analysis.filters.factory import filter_kind
from analysis.filters.noise_model import NoiseModel
from analysis.filters.settings_check import check_filter_settings, unused_setting_warnings
from analysis.filters.tuning import noise_of, wave_in
from analysis.regression.first_model import fit_first_model
from analysis.regression.sliding import RegressionSolution
from analysis.signals.signal_stats import SignalStats
from shiplog import Vessel
from shiplog.checks.channel_stats import LogStats
from shiplog.checks.consistency.findings import naming_contradictions
from shiplog.progress import ProgressCallback, no_progress
from shiplog.resampling import Clock
from shiplog.screening import Screening
from shiplog.types import Log
from shiplog.vessel.settings import DisturbanceSettings, FilterSettings, settings_dict
from shiplog.vessel.vessel import with_length, with_settings
from shiplog.vessel.vessel_parser import parse_vessel

from .passes import FirstPass, SecondPass, first_pass, second_pass
from .reading_options import DEFAULT_OPTIONS, ReadingOptions
from .sensor_model import sensor_model, with_forces
from .wind_choice import choose_wind
from .wind_signals import check_wind_settings

GIVEN_MODEL = "given"
ATTACHED_MODEL = "attached to the log"
FITTED_MODEL = "first model, fitted to this log"
DEFAULT_WAVE_FREQUENCY = 0.6  # rad/s, typical of a sea, where the log shows no wave


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a replay needs to know before it starts.

    A plan is plain data: it can be pickled, and several replays may use the same one.

    Attributes
    ----------
    screening
        What is used of the log, with the statistics of its channels.
    clock
        The uniform clock on which the log is replayed.
    vessel
        The vessel, with the coefficients and the settings that the replay uses.
    model_origin
        Where the coefficients came from: `GIVEN_MODEL`, `ATTACHED_MODEL` or `FITTED_MODEL`.
    filter_kind
        The kind of filter; `vessel.filter.kind` is its name.
    stats
        Statistics of the resampled signals.
    noise
        Standard deviations of the measurement noise and the process noise.
    disturbance_settings
        The vessel's, with the frequency of the wave where one is estimated.
    yaw_solution, surge_solution
        Least squares of each equation over the whole trial, without errors.
    warnings
        Problems found so far, each in a sentence.
    contradictions
        Those of the warnings by which a unit or a sign is wrong.
    omitted_sensors
        The sensor errors that the log does not determine, each with the reason, where
        ``filter.sensor_bias`` is ``auto``.
    undetermined_wind
        The terms of the wind that the log does not distinguish from the other disturbances, each
        with the reason.
    """

    screening: Screening
    clock: Clock
    vessel: Vessel
    model_origin: str
    filter_kind: FilterKind
    stats: SignalStats
    noise: NoiseModel
    disturbance_settings: DisturbanceSettings
    yaw_solution: RegressionSolution
    surge_solution: RegressionSolution
    warnings: tuple[str, ...]
    contradictions: tuple[str, ...] = ()
    omitted_sensors: Mapping[str, str] = field(default_factory=dict)
    undetermined_wind: Mapping[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The name of the log."""
        return self.log_stats.name

    @property
    def log_stats(self) -> LogStats:
        """Statistics of each channel of the log."""
        return self.screening.stats

    @property
    def model_is_fitted(self) -> bool:
        """Whether the coefficients were fitted to the log itself."""
        return self.model_origin == FITTED_MODEL


def plan_replay(
    log: Log,
    options: ReadingOptions = DEFAULT_OPTIONS,
    *,
    filter: FilterKind | str | None = None,  # noqa: A002 - as on the command line
    settings: Mapping[str, object] | None = None,
    on_progress: ProgressCallback = no_progress,
) -> Plan:
    """Make the plan of a replay, from two passes over the log.

    Parameters
    ----------
    log
        The log; one longer than memory is read in chunks.
    options
        As in `analyse`.
    filter, settings, on_progress
        As in `analyse`.

    Returns
    -------
    Plan
        The plan, for `Replay`.

    Raises
    ------
    LogError
        Where the log lacks a required channel or cannot be used as it is.
    UsageError
        Where a setting is invalid.
    """
    vessel, origin = _stated_vessel(log, options.vessel, settings or {})
    vessel = with_length(vessel, options.length) or vessel
    vessel, kind = _with_filter(vessel, filter)
    first = first_pass(log, vessel, options, on_progress)
    second = second_pass(first, vessel, on_progress, strict=options.strict)
    on_progress("choose the model", 0.0)
    with naming_contradictions(second.contradictions):
        return _plan(vessel, origin, kind, first, second)


def _plan(
    vessel: Vessel, origin: str, kind: FilterKind, first: FirstPass, second: SecondPass
) -> Plan:
    """Choose the model, the noise and the disturbances after the passes over the log."""
    warnings = [*first.log.warnings, *second.warnings]
    if vessel.coefficients is None:
        vessel, model_warnings = _with_first_model(vessel, second, first.log.name)
        origin = FITTED_MODEL
    else:
        model_warnings = _other_model_warnings(vessel)
    warnings += [*model_warnings, *unused_setting_warnings(kind, vessel.filter, vessel.disturbance)]
    design = _design(vessel, kind, first.log_stats, second.stats)
    if "gyro" in design.noise.further.sensors:  # the result states the bias that was estimated
        warnings = [warning for warning in warnings if warning not in second.gyro_warnings]
    return Plan(
        screening=first.screening,
        clock=first.clock,
        vessel=vessel,
        model_origin=origin,
        filter_kind=kind,
        stats=second.stats,
        noise=design.noise,
        disturbance_settings=design.disturbance,
        omitted_sensors=design.omitted_sensors,
        undetermined_wind=design.undetermined_wind,
        yaw_solution=second.yaw.solution(),
        surge_solution=second.surge.solution(),
        warnings=(*warnings, *design.warnings),
        contradictions=second.contradictions,
    )


def changed_settings(vessel: Vessel) -> dict[str, object]:
    """Return the settings of filter and disturbance observer that differ from their defaults.

    Examples
    --------
    >>> import shiplog
    >>> from shiplog.vessel.vessel import with_settings
    >>> vessel, _ = shiplog.load_vessel("table1")
    >>> changed_settings(with_settings(vessel, {"filter.shift": 0.2}))["filter.shift"]
    0.2
    """
    defaults = {"filter": FilterSettings(), "disturbance": DisturbanceSettings()}
    return {
        f"{section}.{key}": value
        for section, default in defaults.items()
        for key, value in settings_dict(getattr(vessel, section)).items()
        if value != getattr(default, key)
    }


def with_default_settings(plan: Plan, names: Iterable[str]) -> Plan:
    """Return a plan with some settings at their defaults, and noise and wave that follow from them.

    Parameters
    ----------
    plan
        The plan.
    names
        Such as ``filter.shift``.
    """
    vessel = with_settings(plan.vessel, dict.fromkeys(names, "auto"))
    vessel, kind = _with_filter(vessel, None)
    design = _design(vessel, kind, plan.log_stats, plan.stats)
    return replace(
        plan,
        vessel=vessel,
        filter_kind=kind,
        noise=design.noise,
        disturbance_settings=design.disturbance,
        omitted_sensors=design.omitted_sensors,
        undetermined_wind=design.undetermined_wind,
    )


def _stated_vessel(
    log: Log, given: Vessel | None, settings: Mapping[str, object]
) -> tuple[Vessel, str]:
    """Return the vessel with the settings given, and where its model came from."""
    if given is not None:
        return with_settings(given, settings), GIVEN_MODEL
    if log.vessel_toml is not None:
        attached = parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}")
        return with_settings(attached, settings), ATTACHED_MODEL
    return with_settings(Vessel("", None), settings), FITTED_MODEL


def _with_filter(vessel: Vessel, chosen: FilterKind | str | None) -> tuple[Vessel, FilterKind]:
    """Return the vessel with the filter chosen, and its kind; raise `UsageError` if it cannot be.

    A `FilterKind` need not be installed.
    """
    name = chosen or vessel.filter.chosen
    kind = name if isinstance(name, FilterKind) else filter_kind(name)
    if chosen is not None:
        vessel = replace(vessel, filter=replace(vessel.filter, kind=kind.name))
    check_filter_settings(kind, vessel.filter)
    check_wind_settings(
        vessel.filter, vessel.disturbance, has_further_states=kind.has_further_states
    )
    return vessel, kind


def _with_first_model(
    vessel: Vessel, second: SecondPass, log_name: str
) -> tuple[Vessel, list[str]]:
    """Return the vessel with a model fitted to this log, and warnings about it."""
    warnings = []
    first = fit_first_model(second.yaw, second.surge, second.stats, log_name)
    fitted, model = replace(vessel, coefficients=first.coefficients), first.paper_coefficients
    if vessel.model is None:
        fitted = replace(fitted, name=vessel.name or first.name, approach_rpm=first.approach_rpm)
    else:
        warnings.append(
            f"the vessel file has only a model {vessel.model.name!r}, but the filters use the "
            "paper's model: a first one was fitted to this log"
        )
    if not (model.a < 0 and model.g <= 0 and model.h >= 0):
        warnings.append(
            "the model fitted to this log is not that of a ship (a < 0, g <= 0 and h >= 0 "
            "expected): the ship moves too little in it"
        )
    return fitted, warnings


def _other_model_warnings(vessel: Vessel) -> list[str]:
    """Warn where the vessel file has another model beside the one that the filters use."""
    if vessel.model is None:
        return []
    text = (
        "the filters use the paper's model, [yaw] and [surge] of the vessel file, and not its "
        f"model {vessel.model.name!r}; the difference between the two counts as a disturbance"
    )
    return [text]


@dataclass(frozen=True, eq=False)
class _Design:
    """The noise and the further states of the filter, and the disturbances."""

    noise: NoiseModel
    disturbance: DisturbanceSettings
    omitted_sensors: Mapping[str, str]
    undetermined_wind: Mapping[str, str]
    warnings: tuple[str, ...]


def _design(vessel: Vessel, kind: FilterKind, log_stats: LogStats, stats: SignalStats) -> _Design:
    """Choose the sensor errors, the noise and the disturbances, in this order.

    Where the states are smoothed the disturbances are states too, and the noise is estimated with
    them; the frequency of a wave among them follows from the noise without them.
    """
    settings, model = _averaged(vessel.filter, log_stats, stats.dt_secs), vessel.paper_coefficients
    further, omitted = sensor_model(settings, model, stats, vessel.disturbance)
    has_forces = settings.smooth and kind.has_further_states
    noise, disturbance = None, vessel.disturbance
    undetermined_wind: Mapping[str, str] = {}
    wave_warnings: list[str] = []
    if not has_forces or "wave" in disturbance.models:
        noise = noise_of(stats, model, settings, kind, further)
        disturbance, wave_warnings = _disturbance_settings(vessel, kind, stats, noise)
    if noise is None or has_forces:
        wind, undetermined_wind = choose_wind(disturbance, further.sensors, stats)
        forced = replace(with_forces(further, disturbance, stats), wind=wind)
        noise = noise_of(stats, model, settings, kind, forced)
    warnings = (*_wave_warnings(settings, noise), *wave_warnings)
    return _Design(noise, disturbance, omitted, undetermined_wind, warnings)


def _wave_warnings(settings: FilterSettings, noise: NoiseModel) -> list[str]:
    """Warn where a wave was asked for, and there is none."""
    warnings = []
    if settings.wave and noise.wave is None:
        warnings.append(
            "no wave found in the residual of the yaw rate: none is separated from the ship's "
            "turning; if there are waves, set filter.wave_frequency, filter.wave_damping and "
            "filter.wave_std"
        )
    if noise.wave is not None and noise.wave.evidence < 0:
        warnings.append(
            "the wave set in [filter] is less likely than no wave: the residual of the yaw rate "
            "has no such peak"
        )
    return warnings


def _disturbance_settings(
    vessel: Vessel, kind: FilterKind, stats: SignalStats, noise: NoiseModel
) -> tuple[DisturbanceSettings, list[str]]:
    """Return the disturbance settings with the frequency of a wave, and warnings about it."""
    settings, warnings = vessel.disturbance, []
    if "wave" not in settings.models:
        return settings, []
    frequency = settings.wave_frequency or vessel.filter.wave_frequency
    if frequency is None:
        wave = noise.wave or wave_in(stats, vessel.paper_coefficients, noise, vessel.filter, kind)
        frequency = wave.frequency if wave is not None and wave.stands_out else None
    if frequency is None:
        frequency = DEFAULT_WAVE_FREQUENCY
        warnings.append(
            f"no wave found in the residual of the yaw rate: a wave of {frequency:g} rad/s, "
            "typical of the sea, is estimated; set disturbance.wave_frequency to another"
        )
    warnings += wave_frequency_warnings(frequency, stats)
    return replace(settings, wave_frequency=frequency), warnings


def _averaged(settings: FilterSettings, log_stats: LogStats, dt_secs: float) -> FilterSettings:
    """Return the settings with the noise of one sample reduced to that of an instant's mean.

    Samples of a channel that is faster than the clock are averaged.
    """
    channels = {
        "yaw_rate_std": "yaw_rate",
        "speed_std": "speed",
        "heading_std": "heading",
        "position_std": "position",
    }
    stds = {}
    for key, name in channels.items():
        std = getattr(settings, key)
        if std is not None and name in log_stats:
            together = max(1.0, dt_secs / log_stats[name].interval_secs)
            stds[key] = std / sqrt(together)
    return replace(settings, **stds)
