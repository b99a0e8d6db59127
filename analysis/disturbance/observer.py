"""The disturbance observer: forces on the ship that its model does not contain.

The plant is augmented with exosystems of a disturbance of known kind (constant, ramp, wave) and
unknown size, and the poles of the estimation error are placed. Yaw and surge are designed
separately; together the placement would couple them.

Source: "Algorithm of ship course control system watcher for assessing disturbances and noise
measurements", eqs (3), (4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, inf, pi, radians, sqrt

import numpy as np

from analysis.filters.noise_model import NoiseModel
from analysis.signals.hold import last_inputs
from analysis.signals.moments import Moments
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.checks.quantiles import Quantiles
from shiplog.errors import UsageError
from shiplog.ships.paper import PAPER_INPUTS, Coefficients, rudder_effects, yaw_stiffness
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import (
    DisturbanceSettings,
    number_error,
    parse_settings,
    settings_dict,
)

from .loop import initial_state, make_ship_observer, observe_chunk, surge_plant, yaw_plant
from .observer_design import ForceModel, Sampling, force_observer

RUDDER_MAX = radians(35)  # of most ships; used where the steering gear is not known
MIN_EFFECT_SHARE = 0.3  # of the rudder's largest effect: below it an angle is not counted
# of each disturbance: the SI unit, the unit displayed, and the factor from the first to the second
DISTURBANCE_UNITS = {
    "yaw": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "rudder": ("rad", "deg", degrees(1)),
    "surge": ("m/s²", "mm/s²", 1e3),
    "yaw_wave": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "surge_wave": ("m/s²", "mm/s²", 1e3),
}
DEFAULT_SETTINGS = DisturbanceSettings()
MAX_POLE_TIMES_INTERVAL = 10.0  # beyond it the observer forgets a sample by the next one
# wave frequency times sampling interval: towards Nyquist's π the error due to noise has no bound
MAX_WAVE_TIMES_INTERVAL = 0.9 * pi
MAX_DISTURBANCE = 1e6  # in SI units: a larger estimate means that the observer has diverged


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Estimated disturbances on the signals' clock, as terms of the equations of motion.

    NaN where the observer has diverged.

    Attributes
    ----------
    yaw
        Slow part (constant or ramp) of the yaw disturbance, rad/s³, (n,): a term of w''. Zero where
        neither a constant nor a ramp is estimated.
    surge
        Slow part of the surge disturbance, m/s², (n,): a term of v'. Zero as for `yaw`.
    rudder
        The rudder angle, rad, (n,), that would have the effect of `yaw` at the estimated speed; NaN
        where the rudder has practically no effect.
    yaw_wave, surge_wave
        The waves, rad/s³ and m/s², (n,); None where none is estimated.
    """

    yaw: FloatArray
    surge: FloatArray
    rudder: FloatArray
    yaw_wave: FloatArray | None = None
    surge_wave: FloatArray | None = None

    @property
    def is_finite(self) -> bool:
        """Whether the observer has not diverged."""
        return bool(np.isfinite(self.yaw).all() and np.isfinite(self.surge).all())


@dataclass(frozen=True)
class DisturbanceSummary:
    """Summary of one disturbance over a trial, without the observer's first transient.

    Attributes
    ----------
    unit
        SI unit of the values.
    mean, rms, min, max
        Mean, root mean square and extremes.
    at_end
        Mean over the last `settling_secs` of the trial.
    noise_std
        Standard deviation that sensor noise alone causes in an observer after its transient, at
        the trial's rms yaw rate; model errors are not included, they count as a disturbance. For a
        wave it is that of its value, and, where the wave is well above it, of its amplitude. NaN
        for the rudder where the rudder has no effect.
    settling_secs
        Duration of the first transient, s, which is not counted in a trial more than twice as long.
    """

    unit: str
    mean: float
    rms: float
    min: float
    max: float
    at_end: float
    noise_std: float
    settling_secs: float

    @property
    def amplitude(self) -> float:
        """Amplitude of a wave: that of a sinusoid of its variance, minus the variance of noise."""
        variance = self.rms**2 - self.mean**2 - self.noise_std**2
        return np.nan if np.isnan(variance) else sqrt(2 * max(variance, 0.0))


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
        self._model, self._rudder_max = model, rudder_max
        models = force_models(settings, wave_frequency, stats)
        stiffness = yaw_stiffness(model, stats.yaw_rate_rms)
        yaw = force_observer(yaw_plant(model, stiffness), *models["yaw"])
        surge = force_observer(surge_plant(model, stats.median_speed), *models["surge"])
        forces = yaw.force, surge.force
        self._observer = make_ship_observer(model, stiffness, *forces, *models["yaw"])
        self._state = initial_state(self._observer, stats)
        # at almost no speed and thrust the rudder has no effect, and the equivalent angle is NaN
        self._min_rudder_effect = 1e-3 * abs(model.d) * stats.max_rudder_effect
        self._least_counted_effect = MIN_EFFECT_SHARE * abs(model.d) * stats.max_rudder_effect
        self._unsettled = int(yaw.settling_secs / stats.dt_secs)
        self._counted = self._excessive = 0
        self._rudder_effects = Quantiles()
        self._stds: dict[str, float] = {}
        self._summaries: dict[str, _SummaryCollector] = {}
        names = ("yaw", "rudder", "surge", "yaw_wave", "surge_wave")
        for name in names:
            output, design = (1, surge) if name.startswith("surge") else (0, yaw)
            if name.endswith("wave") and models[name.removesuffix("_wave")][0].wave is None:
                continue
            std = design.stds[int(name.endswith("wave"))]
            self._stds[name] = float(std * noise.measurement_std[output])
            self._summaries[name] = _SummaryCollector(
                design.settling_secs, stats.count, stats.dt_secs
            )

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
        v, yaw, yaw_wave, surge, surge_wave = rows
        effect = self._model.d * rudder_effects(self._model, v, chunk["rpm"])
        self._rudder_effects.add(np.abs(effect))
        effective = np.abs(effect) > self._min_rudder_effect
        with np.errstate(divide="ignore", invalid="ignore"):
            rudder = np.where(effective, yaw / effect, np.nan)
        self._count_excess(rudder, np.abs(effect))
        disturbance = Disturbance(
            yaw,
            surge,
            rudder,
            yaw_wave if "yaw_wave" in self._summaries else None,
            surge_wave if "surge_wave" in self._summaries else None,
        )
        for name, collector in self._summaries.items():
            collector.add(getattr(disturbance, name))
        return disturbance

    def _count_excess(self, rudder: FloatArray, effect: FloatArray) -> None:
        """Count the instants at which the disturbance exceeds the rudder that the ship has.

        The transient at the start does not count, nor instants at which the rudder has little
        effect: there a small moment is worth much rudder.
        """
        counted = (effect > self._least_counted_effect)[self._unsettled :]
        excessive = ~(np.abs(rudder[self._unsettled :]) <= self._rudder_max)
        self._counted += int(np.sum(counted))
        self._excessive += int(np.sum(counted & excessive))
        self._unsettled = max(self._unsettled - len(rudder), 0)

    @property
    def excess_share(self) -> float:
        """Share of the instants at which the yaw disturbance exceeds the largest rudder angle."""
        return self._excessive / self._counted if self._counted else 0.0

    def result(self) -> dict[str, DisturbanceSummary]:
        """Return the summaries of yaw, rudder, surge and the waves estimated, over all chunks."""
        effect = self._rudder_effects.median()
        stds = self._stds | {"rudder": self._stds["yaw"] / effect if effect > 0 else np.nan}
        return {
            name: collector.result(stds[name], DISTURBANCE_UNITS[name][0])
            for name, collector in self._summaries.items()
        }


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


class _SummaryCollector:
    """Collects the summary of one disturbance from its chunks."""

    def __init__(self, settling_secs: float, count: int, dt: float) -> None:
        self._settling_secs = settling_secs
        settling = int(settling_secs / dt)
        self._skipped = settling if count > 2 * settling else 0
        self._tail = max(settling, 1)
        self._settled = Moments()
        self._last_values: FloatArray = np.zeros(0)

    def add(self, values: FloatArray) -> None:
        """Add the next values, (n,)."""
        values = np.where(np.isfinite(values), values, np.nan)
        self._settled.add(values[self._skipped :])
        self._skipped = max(self._skipped - len(values), 0)
        self._last_values = np.concatenate((self._last_values, values))[-self._tail :]

    def result(self, std: float, unit: str) -> DisturbanceSummary:
        """Return the summary, with the standard deviation of noise and the unit given."""
        settled, last = self._settled, self._last_values[np.isfinite(self._last_values)]
        return DisturbanceSummary(
            unit=unit,
            mean=settled.mean,
            rms=float(np.sqrt(settled.mean_square)),
            min=settled.min,
            max=settled.max,
            at_end=float(np.mean(last)) if len(last) and settled.count else np.nan,
            noise_std=std,
            settling_secs=self._settling_secs,
        )


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
