"""The disturbance observer: what acted on the ship that the model does not know.

Plant and exosystems are augmented with a disturbance of a known kind - constant, ramp, wave - and
unknown size, and the error's poles placed. Yaw and surge are designed each for itself; together the
placement would couple them. Source: "Algorithm of ship course control system watcher for assessing
disturbances and noise measurements", eqs (3), (4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, inf, pi, sqrt

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
    disturbance_settings,
    number_error,
    settings_dict,
)

from .loop import initial_state, make_ship_observer, observe_chunk, surge_plant, yaw_plant
from .observer_design import ForceModel, Sampling, force_observer

DISTURBANCE_UNITS = {  # in SI, as people read it, and the factor from the one to the other
    "yaw": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "rudder": ("rad", "deg", degrees(1)),
    "surge": ("m/s²", "mm/s²", 1e3),
    "yaw_wave": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "surge_wave": ("m/s²", "mm/s²", 1e3),
}
CONSTANT = DisturbanceSettings()
FASTEST = 10.0  # poles times interval: beyond it a sample is forgotten by the next
QUICKEST_WAVE = 0.9 * pi  # frequency times interval: near Nyquist's the noise in it has no bound
LOST = 1e6  # in SI: what an observer says that has lost the ship


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Specific disturbances on the signals' clock: what they add to the equations of motion.

    `yaw` and `surge` are the slow part, constant or ramp, and zero where neither was asked for; the
    waves are beside it, and None where they were not.
    """

    yaw: FloatArray  # (n,) rad/s^3, added to w''
    surge: FloatArray  # (n,) m/s^2, added to v'
    rudder: FloatArray  # (n,) rad: the rudder that would do, at the speed then, what `yaw` does
    yaw_wave: FloatArray | None = None  # (n,) rad/s^3
    surge_wave: FloatArray | None = None  # (n,) m/s^2


@dataclass(frozen=True)
class DisturbanceSummary:
    """A disturbance over a trial, its first transient left out.

    The standard deviation is what sensor noise leaves once an observer has settled, the ship
    turning as she usually did; an error of the model counts as a disturbance. That of a wave is of
    its value, and where the wave is well above it of its amplitude.
    """

    unit: str
    mean: float
    rms: float
    min: float
    max: float
    at_end: float  # the mean over the settling time at the end
    noise_std: float  # NaN where no rudder would do it
    settling_secs: float  # before it what is seen is the observer's own transient

    @property
    def amplitude(self) -> float:
        """Of a wave: that of a sinusoid of its variance, less what sensor noise has of this."""
        left = self.rms**2 - self.mean**2 - self.noise_std**2
        return np.nan if np.isnan(left) else sqrt(2 * max(left, 0.0))


class ForceObserver:
    """Observes a yaw moment and a surge force in chunks, each of the kinds that `settings` names.

    `wave_frequency`, rad/s, is needed where a wave is one of them. Where nothing is measured, a
    constant is held, a ramp goes on for a while (`design.force_observer`), a wave turns on. The
    inputs must be known throughout.

    Raises `UsageError` for settings that are none, a wave of no frequency, or one that is too quick
    for a sensor or too slow to be told from the slow part, and for a model that is not finite.
    """

    def __init__(
        self,
        model: Coefficients,
        noise: NoiseModel,
        stats: SignalStats,
        settings: DisturbanceSettings = CONSTANT,
        wave_frequency: float | None = None,
    ) -> None:
        self._model = model
        wanted = force_models(settings, wave_frequency, stats)
        turning = yaw_stiffness(model, stats.yaw_rate_rms)
        yaw = force_observer(yaw_plant(model, turning), *wanted["yaw"])
        surge = force_observer(surge_plant(model, stats.median_speed), *wanted["surge"])
        forces = yaw.force, surge.force
        self._observer = make_ship_observer(model, turning, *forces, *wanted["yaw"])
        self._state = initial_state(self._observer, stats)
        # a ship without way has a rudder that does nothing: its angle is then not a number
        self._least_steering = 1e-3 * abs(model.d) * stats.max_rudder_effect
        self._steering = Quantiles()
        self._stds: dict[str, float] = {}
        self._courses: dict[str, _SummaryCollector] = {}
        names = ("yaw", "rudder", "surge", "yaw_wave", "surge_wave")
        for name in names:
            output, design = (1, surge) if name.startswith("surge") else (0, yaw)
            if name.endswith("wave") and wanted[name.removesuffix("_wave")][0].wave is None:
                continue
            std = design.stds[int(name.endswith("wave"))]
            self._stds[name] = float(std * noise.measurement_std[output])
            watch = _SummaryCollector(design.settling_secs, stats.count, stats.dt_secs)
            self._courses[name] = watch

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Disturbance:
        """Observe the next chunk; `following` are the inputs at the instant after it."""
        delta, n = (np.append(chunk[name], following[name]) for name in PAPER_INPUTS)
        rows, self._state = observe_chunk(
            self._model, self._observer, self._state, chunk["yaw_rate"], chunk["speed"], delta, n,
            chunk.dt_secs,
        )  # fmt: skip
        rows[~(np.abs(rows) < LOST)] = np.nan
        v, yaw, yaw_wave, surge, surge_wave = rows
        steering = self._model.d * rudder_effects(self._model, v, chunk["rpm"])
        self._steering.add(np.abs(steering))
        works = np.abs(steering) > self._least_steering
        with np.errstate(divide="ignore", invalid="ignore"):
            rudder = np.where(works, yaw / steering, np.nan)
        found = Disturbance(
            yaw,
            surge,
            rudder,
            yaw_wave if "yaw_wave" in self._courses else None,
            surge_wave if "surge_wave" in self._courses else None,
        )
        for name, watch in self._courses.items():
            watch.add(getattr(found, name))
        return found

    def result(self) -> dict[str, DisturbanceSummary]:
        """What was observed, once all was: `yaw`, `rudder`, `surge`, and the waves asked for."""
        usual = self._steering.median()
        stds = self._stds | {"rudder": self._stds["yaw"] / usual if usual > 0 else np.nan}
        return {
            name: watch.result(stds[name], DISTURBANCE_UNITS[name][0])
            for name, watch in self._courses.items()
        }


def observe_disturbance(
    signals: Signals,
    model: Coefficients,
    noise: NoiseModel,
    settings: DisturbanceSettings = CONSTANT,
    wave_frequency: float | None = None,
) -> tuple[Disturbance, dict[str, DisturbanceSummary]]:
    """The disturbance in signals that are all there, and what comes of it; as `ForceObserver`."""
    observing = ForceObserver(model, noise, signal_stats(signals, model), settings, wave_frequency)
    found = observing.step(signals, last_inputs(signals))
    return found, observing.result()


class _SummaryCollector:
    """Looks at one disturbance as it is observed."""

    def __init__(self, settling_secs: float, count: int, dt: float) -> None:
        self._settling_secs = settling_secs
        settling = int(settling_secs / dt)
        self._skipped = settling if count > 2 * settling else 0
        self._tail = max(settling, 1)
        self._settled = Moments()
        self._last: FloatArray = np.zeros(0)

    def add(self, values: FloatArray) -> None:
        """Take the next values."""
        values = np.where(np.isfinite(values), values, np.nan)
        self._settled.add(values[self._skipped :])
        self._skipped = max(self._skipped - len(values), 0)
        self._last = np.concatenate((self._last, values))[-self._tail :]

    def result(self, std: float, unit: str) -> DisturbanceSummary:
        """What all of them come to."""
        settled, last = self._settled, self._last[np.isfinite(self._last)]
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
    """What is to be observed in `yaw` and in `surge`, and of what samples.

    Raises `UsageError` for settings that are none, and for what those samples do not tell.
    """
    faults: list[str] = []
    disturbance_settings(settings_dict(settings), faults)
    if faults:
        raise UsageError("; ".join(faults))
    degree = 1 if "ramp" in settings.models else 0 if "constant" in settings.models else None
    wave = _wave(wave_frequency) if "wave" in settings.models else None
    blind = _blind(wave, stats) if wave is not None else ()
    wanted = {}
    frequencies = {"yaw": settings.yaw_frequency, "surge": settings.surge_frequency}
    for output, (name, frequency) in enumerate(frequencies.items()):
        interval = float(stats.interval_secs[output])
        longest = float(stats.gap_steps[output]) * stats.dt_secs
        model = ForceModel(degree, wave, settings.spectrum, frequency)
        if name in blind and len(blind) < len(frequencies):
            model = ForceModel(degree or 0, None, settings.spectrum, frequency)
        _require_told(name, model, interval)
        wanted[name] = model, Sampling(interval, longest, stats.dt_secs)
    return wanted


def wave_frequency_warnings(wave_frequency: float, stats: SignalStats) -> list[str]:
    """Where a wave is not observed because the sensor is too slow for it, in words."""
    return [
        f"no wave is observed in {name}: samples every {secs:.3g} s show none of "
        f"{wave_frequency:.3g} rad/s"
        for name, secs in zip(("yaw", "surge"), stats.interval_secs, strict=True)
        if name in _blind(wave_frequency, stats)
    ]


def _blind(wave: float, stats: SignalStats) -> tuple[str, ...]:
    """Of yaw and surge, whose samples do not show a wave."""
    names = zip(("yaw", "surge"), stats.interval_secs, strict=True)
    return tuple(name for name, interval in names if wave * interval >= QUICKEST_WAVE)


def _wave(frequency: float | None) -> float:
    if frequency is None:
        raise UsageError(
            "disturbance.models has a wave whose frequency nobody knows; give"
            " disturbance.wave_frequency, rad/s, or leave 'wave' out"
        )
    fault = number_error("disturbance.wave_frequency", frequency, -inf, inf, positive=True)
    if fault:
        raise UsageError(fault)
    return float(frequency)


def _require_told(name: str, model: ForceModel, interval: float) -> None:
    """Refuse what the samples of yaw or surge, so many seconds apart, do not tell."""
    wave, slow = model.wave, model.frequency
    if slow * interval >= FASTEST:
        raise UsageError(
            f"disturbance.{name}_frequency of {slow:.3g} rad/s is beyond samples every"
            f" {interval:.3g} s; lower it below {FASTEST / interval:.3g}"
        )
    without = "or leave 'wave' out of disturbance.models"
    if wave is not None and wave * interval >= QUICKEST_WAVE:
        raise UsageError(
            f"{name} measured every {interval:.3g} s shows no wave of {wave:.3g} rad/s; lower"
            f" disturbance.wave_frequency below {QUICKEST_WAVE / interval:.3g}, {without}"
        )
    if wave is not None and model.degree is not None and wave <= slow:
        raise UsageError(
            f"in {name} a wave of {wave:.3g} rad/s is not told from what is slow, followed at"
            f" {slow:.3g}; lower disturbance.{name}_frequency, {without}"
        )
