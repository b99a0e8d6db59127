"""The disturbance observer: forces on the ship that its model does not contain.

The plant is augmented with exosystems of a disturbance of known kind (constant, ramp, wave) and
unknown size, and the poles of the estimation error are placed. Yaw and surge are designed
separately; together the placement would couple them.

Source: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", eqs (3), (4).
"""

from collections.abc import Mapping
from math import inf, pi

import numpy as np

from analysis.filters.noise_model import NoiseModel
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.errors import UsageError
from shiplog.ships.paper import PAPER_INPUTS, Coefficients, yaw_stiffness
from shiplog.types import Signals
from shiplog.vessel.settings import (
    DisturbanceSettings,
    number_error,
    parse_settings,
    settings_dict,
)

from .disturbances import (
    DISTURBANCE_UNITS,
    RUDDER_MAX,
    Disturbance,
    DisturbanceCollector,
    DisturbanceSummary,
)
from .loop import initial_state, make_ship_observer, observe_chunk, surge_plant, yaw_plant
from .observer_design import ForceModel, Sampling, force_observer

DEFAULT_SETTINGS = DisturbanceSettings()
MAX_POLE_TIMES_INTERVAL = 10.0  # beyond it the observer forgets a sample by the next one
# wave frequency times sampling interval: towards Nyquist's π the error due to noise has no bound
MAX_WAVE_TIMES_INTERVAL = 0.9 * pi
MAX_DISTURBANCE = 1e6  # in SI units: a larger estimate means that the observer has diverged


class ForceObserver:
    """Estimates a yaw moment and a surge force, chunk by chunk.

    Where nothing is measured, a constant is held, a ramp continues for a while (see
    `force_observer`) and a wave continues its oscillation. Where the chunks are cut changes no
    result.

    Parameters
    ----------
    model
        Coefficients of the paper's model.
    noise
        The measurement noise, for the standard deviations of the summaries.
    stats
        Statistics of the signals; they give the yaw rate and the speed at which the poles are
        placed, the sampling intervals and the initial state.
    settings
        The kinds of disturbance, the pattern of the poles and their frequencies.
    wave_frequency
        Frequency of the wave, rad/s; required where a wave is one of the kinds.
    rudder_max
        The ship's largest rudder angle, rad, for `excess_share`.

    Raises
    ------
    UsageError
        For invalid settings, a missing wave frequency, a wave too fast for the samples or too slow
        to be separated from the slow part, and for a model that is not finite.
    """

    def __init__(
        self,
        model: Coefficients,
        noise: NoiseModel,
        stats: SignalStats,
        settings: DisturbanceSettings = DEFAULT_SETTINGS,
        wave_frequency: float | None = None,
        *,
        rudder_max: float = RUDDER_MAX,
    ) -> None:
        self._model = model
        models = force_models(settings, wave_frequency, stats)
        stiffness = yaw_stiffness(model, stats.yaw_rate_rms)
        yaw = force_observer(yaw_plant(model, stiffness), *models["yaw"])
        surge = force_observer(surge_plant(model, stats.median_speed), *models["surge"])
        forces = yaw.force, surge.force
        self._observer = make_ship_observer(model, stiffness, *forces, *models["yaw"])
        self._state = initial_state(self._observer, stats)
        self._stds: dict[str, float] = {}
        settling: dict[str, float] = {}
        for name in DISTURBANCE_UNITS:
            if name.endswith("wind"):  # a state of the filter alone
                continue
            output, design = (1, surge) if name.startswith("surge") else (0, yaw)
            if name.endswith("wave") and models[name.removesuffix("_wave")][0].wave is None:
                continue
            std = design.stds[int(name.endswith("wave"))]
            self._stds[name] = float(std * noise.measurement_std[output])
            settling[name] = design.settling_secs
        self._collector = DisturbanceCollector(model, stats, settling, rudder_max=rudder_max)

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Disturbance:
        """Estimate the disturbances of the next chunk.

        Parameters
        ----------
        chunk
            Yaw rate and speed, NaN where not measured, and the inputs, held throughout.
        following
            The inputs, rad and 1/min, at the instant after the chunk.
        """
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        rows, self._state = observe_chunk(
            self._model, self._observer, self._state, chunk["yaw_rate"], chunk["speed"], delta, n,
            chunk.dt_secs,
        )  # fmt: skip
        rows[~(np.abs(rows) < MAX_DISTURBANCE)] = np.nan
        v, *forces = rows
        names = ("yaw", "yaw_wave", "surge", "surge_wave")
        estimated = {
            name: force for name, force in zip(names, forces, strict=True) if name in self._stds
        }
        return self._collector.add(estimated, v, chunk["rpm"])

    @property
    def excess_share(self) -> float:
        """Share of the instants at which the yaw disturbance exceeds the largest rudder angle."""
        return self._collector.excess_share

    def result(self) -> dict[str, DisturbanceSummary]:
        """Return the summaries of yaw, rudder, surge and the waves estimated, over all chunks."""
        return self._collector.result(self._stds)


def observe_disturbance(
    signals: Signals,
    model: Coefficients,
    noise: NoiseModel,
    settings: DisturbanceSettings = DEFAULT_SETTINGS,
    wave_frequency: float | None = None,
) -> tuple[Disturbance, dict[str, DisturbanceSummary]]:
    """Estimate the disturbances of signals that are in memory as a whole.

    Parameters
    ----------
    signals
        Yaw rate, speed, rudder and revolutions on one clock, with the inputs held.
    model, noise, settings, wave_frequency
        As for `ForceObserver`.

    Returns
    -------
    disturbance : Disturbance
        The time series.
    summaries : dict[str, DisturbanceSummary]
        The summary of each of them.
    """
    stats = signal_stats(signals, model)
    observer = ForceObserver(model, noise, stats, settings, wave_frequency)
    disturbance = observer.step(signals, last_inputs(signals))
    return disturbance, observer.result()


def force_models(
    settings: DisturbanceSettings, wave_frequency: float | None, stats: SignalStats
) -> dict[str, tuple[ForceModel, Sampling]]:
    """Return the force model and the sampling of ``"yaw"`` and of ``"surge"``.

    A wave too fast for the samples of one of the two is estimated in the other alone.

    Raises
    ------
    UsageError
        For invalid settings, and where the samples do not determine the disturbance.
    """
    errors: list[str] = []
    parse_settings(DisturbanceSettings, settings_dict(settings), errors)
    if errors:
        raise UsageError("; ".join(errors))
    degree = 1 if "ramp" in settings.models else 0 if "constant" in settings.models else None
    wave = _checked_wave(wave_frequency) if "wave" in settings.models else None
    too_slow = _too_slow_sensors(wave, stats) if wave is not None else ()
    models = {}
    frequencies = {"yaw": settings.yaw_frequency, "surge": settings.surge_frequency}
    for output, (name, frequency) in enumerate(frequencies.items()):
        interval = float(stats.interval_secs[output])
        longest = float(stats.gap_steps[output]) * stats.dt_secs
        model = ForceModel(degree, wave, settings.spectrum, frequency)
        if name in too_slow and len(too_slow) < len(frequencies):
            model = ForceModel(degree or 0, None, settings.spectrum, frequency)
        _require_determined(name, model, interval)
        models[name] = model, Sampling(interval, longest, stats.dt_secs)
    return models


def wave_frequency_warnings(wave_frequency: float, stats: SignalStats) -> list[str]:
    """Warn where no wave is estimated because the samples are too far apart for its frequency."""
    return [
        f"no wave is estimated in {name}: its samples, {secs:.3g} s apart, are too slow for a wave "
        f"of {wave_frequency:.3g} rad/s"
        for name, secs in zip(("yaw", "surge"), stats.interval_secs, strict=True)
        if name in _too_slow_sensors(wave_frequency, stats)
    ]


def _too_slow_sensors(wave: float, stats: SignalStats) -> tuple[str, ...]:
    """Return which of yaw and surge are sampled too slowly for a wave, rad/s."""
    names = zip(("yaw", "surge"), stats.interval_secs, strict=True)
    return tuple(name for name, interval in names if wave * interval >= MAX_WAVE_TIMES_INTERVAL)


def _checked_wave(frequency: float | None) -> float:
    """Return the frequency of the wave, rad/s; raise `UsageError` if missing or invalid."""
    if frequency is None:
        raise UsageError(
            "disturbance.models has a wave without a frequency; set disturbance.wave_frequency,"
            " rad/s, or remove 'wave'"
        )
    error = number_error("disturbance.wave_frequency", frequency, -inf, inf, positive=True)
    if error:
        raise UsageError(error)
    return float(frequency)


def _require_determined(name: str, model: ForceModel, interval: float) -> None:
    """Raise `UsageError` if samples `interval` s apart do not determine the force model."""
    wave, slow = model.wave, model.frequency
    if slow * interval >= MAX_POLE_TIMES_INTERVAL:
        raise UsageError(
            f"disturbance.{name}_frequency of {slow:.3g} rad/s is too high for samples every"
            f" {interval:.3g} s; lower it below {MAX_POLE_TIMES_INTERVAL / interval:.3g}"
        )
    remedy = "or remove 'wave' from disturbance.models"
    if wave is not None and wave * interval >= MAX_WAVE_TIMES_INTERVAL:
        raise UsageError(
            f"samples of {name} every {interval:.3g} s are too slow for a wave of {wave:.3g} rad/s;"
            f" lower disturbance.wave_frequency below {MAX_WAVE_TIMES_INTERVAL / interval:.3g},"
            f" {remedy}"
        )
    if wave is not None and model.degree is not None and wave <= slow:
        raise UsageError(
            f"in {name} a wave of {wave:.3g} rad/s cannot be separated from the slow part, followed"
            f" at {slow:.3g} rad/s; lower disturbance.{name}_frequency, raise"
            f" disturbance.wave_frequency, {remedy}"
        )
