"""Sensor errors as states of the filter: the choice of those that the log determines.

What cannot be distinguished is found by Hautus's test on the linearised ship; a request for it is
refused, with the measurement that would resolve it.
"""

from dataclasses import dataclass, replace
from math import radians

import numpy as np

from analysis.design.augmentation import DisturbanceInput, Exosystem, Plant
from analysis.design.distinguishability import Ambiguity, ambiguities
from analysis.design.placement import format_mode
from analysis.disturbance.observer import force_models
from analysis.filters.noise_model import FURTHER_OUTPUTS, NO_FURTHER, ForceNoise, FurtherModel
from analysis.signals.signal_stats import MAX_NOISE_DEVIATION, STD_PER_MAD, SignalStats
from shiplog.errors import UsageError
from shiplog.ships.paper import Coefficients, yaw_stiffness
from shiplog.vessel.settings import SENSOR_ERRORS, DisturbanceSettings, FilterSettings

from .heading_errors import heading_errors
from .position_errors import position_noise

MIN_HEADING_STD = radians(0.001)
MIN_POSITION_STD = 0.5  # m
MIN_SAMPLES = 20  # of a heading or a position, to be used
# 1 - R² of the headings, as of a half circle: the sway of a zig-zag lags behind its yaw rate, which
# looks like a smaller speed on a current
MIN_COURSE_VARIANCE = 0.5
MIN_SPEED_VARIATION = 0.05  # standard deviation of the speed over its median
SLOW = ("constant", "ramp")


@dataclass(frozen=True)
class Evidence:
    """What a log has by which sensor errors differ from disturbances.

    Attributes
    ----------
    heading, position
        Whether these are measured.
    turned
        Whether the course changes enough to separate the current from an error of the speed log;
        else positions are not used.
    speed_varies
        Whether the speed varies enough to separate a bias from an error of scale.
    """

    heading: bool
    position: bool
    turned: bool
    speed_varies: bool

    @property
    def has_track(self) -> bool:
        """Whether positions are measurements of the filter."""
        return self.position and self.turned


@dataclass(frozen=True, eq=False)
class _Ship:
    """The ship, the motion about which it is linearised, and the disturbances estimated."""

    model: Coefficients
    stats: SignalStats
    disturbance: DisturbanceSettings

    @property
    def slow(self) -> Exosystem | None:
        """The slow part of a disturbance; None where there is none."""
        models = self.disturbance.models
        return Exosystem.polynomial(int("ramp" in models)) if set(models) & set(SLOW) else None


REMEDIES = {
    "heading": "a heading",
    "position": "positions",
    "turned": "a turn of half a circle",
    "speed_varies": "several speeds",
}


NEEDED = {"gyro": ("heading",), "log": ("position", "turned")}  # for auto to select an error


def evidence_of(stats: SignalStats) -> Evidence:
    """Return the evidence in the first part of a trial."""
    samples = {
        name: stats.head[name][np.isfinite(stats.head[name])]
        for name in ("compass", "north")
        if name in stats.head
    }
    heading = len(samples.get("compass", ())) >= MIN_SAMPLES
    resultant = abs(np.mean(np.exp(1j * samples["compass"]))) if heading else 1.0
    return Evidence(
        heading=heading,
        position=heading and len(samples.get("north", ())) >= MIN_SAMPLES,
        turned=bool(1 - resultant**2 > MIN_COURSE_VARIANCE),
        speed_varies=bool(stats.std[1] > MIN_SPEED_VARIATION * abs(stats.median_speed)),
    )


def _choose_sensors(
    requested: tuple[str, ...],
    evidence: Evidence,
    ship: _Ship,
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Choose the sensor errors to estimate.

    Parameters
    ----------
    requested
        Some of `SENSOR_ERRORS`, or ``auto``.
    evidence
        What the log has.
    ship
        The ship.

    Returns
    -------
    sensors
        Those to estimate.
    omitted
        Of ``auto``, the others, each with the reason.

    Raises
    ------
    UsageError
        One that was requested by name cannot be distinguished from another error or a disturbance.
    """
    named = tuple(name for name in SENSOR_ERRORS if name in requested)
    found = _ambiguities(named, evidence, ship)
    if found:
        raise UsageError(f"filter.sensor_bias: {_described(found[0], named, evidence, ship)}")
    if "auto" not in requested:
        return named, {}
    chosen, omitted = named, {}
    for name, flags in NEEDED.items():
        if name in chosen:
            continue
        candidate = tuple(each for each in SENSOR_ERRORS if each in (*chosen, name))
        found = _ambiguities(candidate, evidence, ship)
        missing = [flag for flag in flags if not getattr(evidence, flag)]
        if missing:
            omitted[name] = f"it needs {' and '.join(REMEDIES[flag] for flag in missing)}"
        elif found:
            omitted[name] = _described(found[0], candidate, evidence, ship)
        else:
            chosen = candidate
    return chosen, omitted


def sensor_model(
    settings: FilterSettings,
    model: Coefficients,
    stats: SignalStats,
    disturbance: DisturbanceSettings,
) -> tuple[FurtherModel, dict[str, str]]:
    """Return the sensor errors and measurements that are added to a filter, and those omitted.

    Raises
    ------
    UsageError
        A sensor error that was requested by name cannot be distinguished from another one or from
        a disturbance.
    """
    if not settings.sensors:
        return NO_FURTHER, {}
    evidence = evidence_of(stats)
    ship = _Ship(model, stats, disturbance)
    sensors, omitted = _choose_sensors(settings.sensors, evidence, ship)
    outputs = FURTHER_OUTPUTS[: 3 if evidence.has_track else int(evidence.heading)]
    stds = [_output_std(stats, settings, name) for name in outputs]
    heading_error = None
    if outputs and settings.heading_std is None:
        stds[0], heading_error = heading_errors(stats, stds[0])
    return FurtherModel(outputs, tuple(stds), sensors, heading_error=heading_error), omitted


def _output_std(stats: SignalStats, settings: FilterSettings, output: str) -> float:
    """Return the noise of a heading or position: stated, or from the third differences.

    Third differences do not show the slow errors of a compass or a receiver: hence a least value,
    and for positions the noise of their means over some seconds.
    """
    is_heading = output == FURTHER_OUTPUTS[0]
    stated = settings.heading_std if is_heading else settings.position_std
    if stated is not None:
        return stated
    values = stats.head[output]
    thirds = np.diff(values[np.isfinite(values)], 3) / np.sqrt(20.0)
    limit = MAX_NOISE_DEVIATION * STD_PER_MAD * float(np.median(np.abs(thirds)))
    kept = thirds[np.abs(thirds) <= limit] if limit > 0 else thirds
    std = float(np.sqrt(np.mean(kept**2)))
    if is_heading:
        return max(std, MIN_HEADING_STD)
    return position_noise(stats, output, max(std, MIN_POSITION_STD))


def with_forces(
    further: FurtherModel, disturbance: DisturbanceSettings, stats: SignalStats
) -> FurtherModel:
    """Return the further states with the disturbances, of the observer's kinds and frequencies."""
    models = force_models(disturbance, disturbance.wave_frequency, stats)
    yaw, surge = (
        ForceNoise(force.degree, force.frequency, force.wave)
        for force, _ in (models["yaw"], models["surge"])
    )
    return replace(further, yaw=yaw, surge=surge)


def _ambiguities(
    sensors: tuple[str, ...],
    evidence: Evidence,
    ship: _Ship,
) -> tuple[Ambiguity, ...]:
    """Return what cannot be distinguished in yaw and in surge."""
    yaw = _yaw_ambiguities(sensors, evidence, ship)
    return (*yaw, *_surge_ambiguities(sensors, evidence, ship))


def _yaw_ambiguities(
    sensors: tuple[str, ...],
    evidence: Evidence,
    ship: _Ship,
) -> tuple[Ambiguity, ...]:
    """Linearise yaw rate, yaw acceleration and heading."""
    states = ("yaw rate", "yaw acceleration", "heading")
    A = np.zeros((3, 3))
    A[0, 1], A[2, 0] = 1.0, 1.0
    A[1, :2] = yaw_stiffness(ship.model, ship.stats.yaw_rate_rms), ship.model.a
    measured = ("yaw rate", "heading") if evidence.heading else ("yaw rate",)
    size = 3 if evidence.heading else 2
    C = np.eye(3)[[0, 2] if evidence.heading else [0]][:, :size]
    constant = Exosystem.polynomial(0)
    inputs = []
    if "gyro" in sensors:
        inputs.append(DisturbanceInput("gyro bias", constant, on_sensor={"yaw rate": 1.0}))
    if "rudder" in sensors:
        inputs.append(DisturbanceInput("rudder zero", constant, {states[1]: 1.0}))
    if "compass" in sensors and not evidence.has_track:
        if not evidence.heading:
            inputs.append(DisturbanceInput("compass bias", constant))
        else:
            inputs.append(DisturbanceInput("compass bias", constant, on_sensor={"heading": 1.0}))
    if not inputs:
        return ()
    if ship.slow is not None:
        inputs.append(DisturbanceInput("constant yaw moment", ship.slow, {states[1]: 1.0}))
    plant = Plant(A[:size, :size], np.zeros((size, 1)), C, states[:size], measured)
    return ambiguities(plant, inputs)


def _surge_ambiguities(
    sensors: tuple[str, ...],
    evidence: Evidence,
    ship: _Ship,
) -> tuple[Ambiguity, ...]:
    """Linearise the speed and the distance over ground, which the current changes too."""
    A = np.array([[2 * ship.model.g * ship.stats.median_speed, 0.0], [1.0, 0.0]])
    measured = ("speed", "distance") if evidence.has_track else ("speed",)
    size = len(measured)
    constant = Exosystem.polynomial(0)
    inputs = []
    if "log" in sensors:
        inputs.append(DisturbanceInput("speed log bias", constant, on_sensor={"speed": 1.0}))
    if "log_scale" in sensors and not ("log" in sensors and evidence.speed_varies):
        inputs.append(DisturbanceInput("speed log scale", constant, on_sensor={"speed": 1.0}))
    if not inputs:
        return ()
    if ship.slow is not None:
        inputs.append(DisturbanceInput("constant surge force", ship.slow, {"speed": 1.0}))
    plant = Plant(
        A[:size, :size], np.zeros((size, 1)), np.eye(size), ("speed", "distance")[:size], measured
    )
    return ambiguities(plant, inputs)


def _described(
    ambiguity: Ambiguity,
    sensors: tuple[str, ...],
    evidence: Evidence,
    ship: _Ship,
) -> str:
    """Describe an ambiguity, and what would resolve it, in one line."""
    names = ambiguity.disturbances
    cures = []
    better = evidence
    for name, words in REMEDIES.items():
        if getattr(better, name):
            continue
        better = replace(better, **{name: True})
        cures.append(words)
        remaining = _ambiguities(sensors, better, ship)
        if not any(each.disturbances == names for each in remaining):
            break
    else:
        cures = []
    remedies = [f"it needs {' and '.join(cures)}"] if cures else []
    if any(name.startswith("constant") for name in names):
        remedies.append('set disturbance.models to ["wave"]')
    remedies.append("remove one of them" if len(names) > 1 else "remove it")
    verb = "cannot be distinguished" if len(names) > 1 else "cannot be seen"
    mode = format_mode(ambiguity.mode)
    return f"{' and '.join(names)} {verb} at the mode {mode} 1/s; {', or '.join(remedies)}"
