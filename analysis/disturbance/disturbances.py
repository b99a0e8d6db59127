"""Disturbances on the signals' clock, and their summaries over a trial.

They come from the disturbance observer (`observer`) or are states of the filter (`filter_forces`).
"""

from dataclasses import dataclass
from math import degrees, radians, sqrt

import numpy as np

from analysis.signals.moments import Moments
from analysis.signals.signal_stats import SignalStats
from shiplog.checks.quantiles import Quantiles
from shiplog.ships.paper import Coefficients, rudder_effects
from shiplog.types import FloatArray

RUDDER_MAX = radians(35)  # of most ships; used where the steering gear is not known
MIN_EFFECT_SHARE = 0.3  # of the rudder's largest effect: below it an angle is not counted
# of each disturbance: the SI unit, the unit displayed, and the factor from the first to the second
DISTURBANCE_UNITS = {
    "yaw": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "rudder": ("rad", "deg", degrees(1)),
    "surge": ("m/s²", "mm/s²", 1e3),
    "yaw_wave": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "surge_wave": ("m/s²", "mm/s²", 1e3),
    "yaw_wind": ("rad/s³", "0.001 deg/s³", degrees(1) * 1e3),
    "surge_wind": ("m/s²", "mm/s²", 1e3),
}


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Estimated disturbances on the signals' clock, as terms of the equations of motion.

    NaN where the observer has diverged.

    Attributes
    ----------
    yaw
        Slow part (constant or ramp) of the yaw disturbance, rad/s³, (n,): a term of w''. Zero where
        neither a constant nor a ramp is estimated, or where the log is likelier without one.
    surge
        Slow part of the surge disturbance, m/s², (n,): a term of v'. Zero as for `yaw`.
    rudder
        The rudder angle, rad, (n,), that would have the effect of `yaw` at the estimated speed; NaN
        where the rudder has practically no effect.
    yaw_wave, surge_wave
        The waves, rad/s³ and m/s², (n,); None where none is estimated.
    stds
        (n, 2): standard deviations of `yaw` and `surge`, rad/s³ and m/s²; None from the observer,
        of which only that of its noise is known (`DisturbanceSummary.noise_std`). NaN where the
        slow part is none of the filter's states.
    yaw_wind, surge_wind
        The moment and the force of the wind, rad/s³ and m/s², (n,); None where none is estimated.
    """

    yaw: FloatArray
    surge: FloatArray
    rudder: FloatArray
    yaw_wave: FloatArray | None = None
    surge_wave: FloatArray | None = None
    stds: FloatArray | None = None
    yaw_wind: FloatArray | None = None
    surge_wind: FloatArray | None = None

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
        for the rudder where the rudder has no effect. Of a disturbance that is a state of the
        filter: the rms of its standard deviation; NaN where the filter has no such state.
    settling_secs
        Duration of the first transient, s, which is not counted in a trial more than twice as long;
        of a smoothed disturbance, which has none, the time over which `at_end` is the mean.
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


class DisturbanceCollector:
    """Completes disturbances by the equivalent rudder, and collects their summaries, in chunks.

    Parameters
    ----------
    model
        Coefficients of the paper's model.
    stats
        Statistics of the signals.
    settling_secs
        The duration of the first transient of each disturbance, by the names of
        `DISTURBANCE_UNITS`; ``rudder`` is that of ``yaw``.
    rudder_max
        The ship's largest rudder angle, rad, for `excess_share`.
    has_transient
        Whether there is a first transient, which does not count.
    """

    def __init__(
        self,
        model: Coefficients,
        stats: SignalStats,
        settling_secs: dict[str, float],
        *,
        rudder_max: float = RUDDER_MAX,
        has_transient: bool = True,
    ) -> None:
        self._model, self._rudder_max = model, rudder_max
        # at almost no speed and thrust the rudder has no effect, and the equivalent angle is NaN
        self._min_rudder_effect = 1e-3 * abs(model.d) * stats.max_rudder_effect
        self._least_counted_effect = MIN_EFFECT_SHARE * abs(model.d) * stats.max_rudder_effect
        self._unsettled = int(settling_secs["yaw"] / stats.dt_secs) if has_transient else 0
        self._counted = self._excessive = 0
        self._rudder_effects = Quantiles()
        self._summaries = {
            name: _SummaryCollector(
                settling_secs[name], stats.count, stats.dt_secs, has_transient=has_transient
            )
            for name in DISTURBANCE_UNITS
            if name in settling_secs
        }

    def add(
        self,
        forces: dict[str, FloatArray],
        speed: FloatArray,
        rpm: FloatArray,
        stds: FloatArray | None = None,
    ) -> Disturbance:
        """Complete and count the disturbances of the next chunk.

        Parameters
        ----------
        forces
            (n,) of ``yaw``, ``surge``, and of waves and wind as far as they are estimated, rad/s³
            and m/s².
        speed, rpm
            (n,) the speed, m/s, and the revolutions.
        stds
            (n, 2): standard deviations of yaw and surge, where they are known.
        """
        effect = self._model.d * rudder_effects(self._model, speed, rpm)
        self._rudder_effects.add(np.abs(effect))
        effective = np.abs(effect) > self._min_rudder_effect
        with np.errstate(divide="ignore", invalid="ignore"):
            rudder = np.where(effective, forces["yaw"] / effect, np.nan)
        self._count_excess(rudder, np.abs(effect))
        disturbance = Disturbance(
            forces["yaw"],
            forces["surge"],
            rudder,
            forces.get("yaw_wave"),
            forces.get("surge_wave"),
            stds,
            forces.get("yaw_wind"),
            forces.get("surge_wind"),
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

    def result(self, stds: dict[str, float]) -> dict[str, DisturbanceSummary]:
        """Return the summaries over all chunks, with the standard deviation of each disturbance."""
        effect = self._rudder_effects.median()
        stds = stds | {"rudder": stds["yaw"] / effect if effect > 0 else np.nan}
        return {
            name: collector.result(stds[name], DISTURBANCE_UNITS[name][0])
            for name, collector in self._summaries.items()
        }


class _SummaryCollector:
    """Collects the summary of one disturbance from its chunks."""

    def __init__(self, settling_secs: float, count: int, dt: float, *, has_transient: bool) -> None:
        self._settling_secs = settling_secs
        settling = int(settling_secs / dt)
        self._skipped = settling if has_transient and count > 2 * settling else 0
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
