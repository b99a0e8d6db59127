"""What the signals of a trial usually do: what the estimators must know before they begin."""

from dataclasses import dataclass

import numpy as np

from shiplog import Signals
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.checks.quantiles import Quantiles
from shiplog.ships.paper import PAPER_OUTPUTS, Coefficients, rudder_effects
from shiplog.types import FloatArray, concatenate_signals

from .moments import Moments

HEAD_COUNT = 50_000  # samples of a long log are enough to tell how well a model fits


@dataclass(frozen=True, eq=False)
class SignalStats:
    """Statistics of resampled signals, which filters and observers need before they start.

    Arrays are of shape (2,): the yaw rate, rad/s, and the speed, m/s.

    Attributes
    ----------
    count
        Number of instants of the clock.
    dt_secs
        Time between instants, s.
    sample_counts
        Number of instants at which yaw rate and speed were measured.
    first
        The first measured values.
    std
        Standard deviations of the values about their means.
    intervals
        Median number of instants from sample to sample.
    noise_std
        Standard deviations of the white noise in the values, as in `noise_level`.
    yaw_rate_rms
        Root mean square of the yaw rate, rad/s.
    median_speed, max_speed
        Median speed and largest absolute speed, m/s.
    median_rpm
        Median of the propeller's revolutions, 1/min.
    max_rudder_effect
        Largest absolute rudder effect, as in `rudder_effects` of the paper's model.
    head
        The first `HEAD_COUNT` instants of the signals, with the inputs held.
    """

    count: int
    dt_secs: float
    sample_counts: tuple[int, int]
    first: FloatArray
    std: FloatArray
    intervals: FloatArray
    noise_std: FloatArray
    yaw_rate_rms: float
    median_speed: float
    max_speed: float
    median_rpm: float
    max_rudder_effect: float
    head: Signals

    @property
    def interval_secs(self) -> FloatArray:
        """(2,) the usual time from sample to sample."""
        return self.intervals * self.dt_secs

    @property
    def gap_steps(self) -> FloatArray:
        """(2,) instants of the clock from sample to sample of an output, beyond which is a gap."""
        return np.array([gap_threshold_secs(s) / self.dt_secs for s in self.interval_secs])


class SignalStatsCollector:
    """Looks at signals, their inputs held, as they come in chunks.

    Of `model` only the alphas are used. Source of the noise: `noise_level`.
    """

    def __init__(self, model: Coefficients) -> None:
        self._model = model
        self._outputs = {name: _OutputStatsCollector() for name in PAPER_OUTPUTS}
        self._speed, self._rpm = Quantiles(), Quantiles()
        self.max_speed = self._max_rudder_effect = 0.0  # m/s so far, and of the rudder's effect
        self._heads: list[Signals] = []
        self._count, self._dt = 0, 1.0

    def add(self, chunk: Signals) -> None:
        """Take the next signals."""
        for name, output in self._outputs.items():
            output.add(chunk[name])
        speed = chunk["speed"]
        known = np.isfinite(speed)
        self._speed.add(speed[known])
        self._rpm.add(chunk["rpm"])
        self.max_speed = max(self.max_speed, float(np.max(np.abs(speed[known]), initial=0.0)))
        effects = rudder_effects(self._model, speed[known], chunk["rpm"][known])
        self._max_rudder_effect = max(
            self._max_rudder_effect, float(np.max(np.abs(effects), initial=0.0))
        )
        if self._count < HEAD_COUNT:
            self._heads.append(chunk.part(0, HEAD_COUNT - self._count))
        self._count, self._dt = self._count + len(chunk), chunk.dt_secs

    def result(self) -> SignalStats:
        """What all that was added comes to."""
        outputs = list(self._outputs.values())
        yaw_rate = outputs[0].moments
        return SignalStats(
            count=self._count,
            dt_secs=self._dt,
            sample_counts=(outputs[0].moments.count, outputs[1].moments.count),
            first=np.array([output.first for output in outputs]),
            std=np.array([output.moments.std for output in outputs]),
            intervals=np.array([output.interval() for output in outputs]),
            noise_std=np.array([output.noise.result() for output in outputs]),
            yaw_rate_rms=float(np.sqrt(yaw_rate.mean_square)),
            median_speed=self._speed.median(),
            max_speed=self.max_speed,
            median_rpm=self._rpm.median(),
            max_rudder_effect=self._max_rudder_effect,
            head=concatenate_signals(self._heads),
        )


def signal_stats(signals: Signals, model: Coefficients) -> SignalStats:
    """What signals usually do, their inputs held; of `model` only the alphas are used."""
    gauging = SignalStatsCollector(model)
    gauging.add(signals)
    return gauging.result()


class _OutputStatsCollector:
    """Looks at one output."""

    def __init__(self) -> None:
        self.moments, self.noise, self.first = Moments(), NoiseLevel(), np.nan
        self._intervals, self._last, self._count = Quantiles(), -1, 0

    def add(self, values: FloatArray) -> None:
        """Take the next values, NaN where not measured."""
        at = np.flatnonzero(np.isfinite(values))
        self.moments.add(values)
        if len(at):
            seen = values[at]
            self.noise.add(seen)
            numbers = at + self._count
            if self._last < 0:
                self.first = float(seen[0])
                self._intervals.add(np.diff(numbers).astype(float))
            else:
                self._intervals.add(np.diff(numbers, prepend=self._last).astype(float))
            self._last = int(numbers[-1])
        self._count += len(values)

    def interval(self) -> float:
        """The median number of instants from sample to sample; 1 where there are not two."""
        return self._intervals.median() if len(self._intervals.values) else 1.0


def noise_level(values: FloatArray) -> float:
    """The standard deviation of a signal's white noise, from its third differences, (n,).

    NaN is not measured. Differences eight times the usual are spikes and not counted. A signal
    printed to few digits has at least the noise of its rounding. NaN of fewer than four values.
    """
    level = NoiseLevel()
    level.add(values[np.isfinite(values)])
    return level.result()


class NoiseLevel:
    """As `noise_level`, of measured values that come in chunks."""

    def __init__(self) -> None:
        self._last: FloatArray = np.zeros(0)
        self._moments = Moments()
        self._thirds, self._least_step = Quantiles(), np.inf

    def add(self, seen: FloatArray) -> None:
        """Take the next measured values."""
        self._moments.add(seen)
        new = np.concatenate((self._last[-1:], seen))
        steps = np.abs(np.diff(new))
        self._least_step = min(self._least_step, float(np.min(steps[steps > 0], initial=np.inf)))
        seen = np.concatenate((self._last, seen))
        # white noise of variance s^2 gives 20 s^2
        self._thirds.add(np.diff(seen, 3) / np.sqrt(20.0))
        self._last = seen[-3:]

    def result(self) -> float:
        """The standard deviation of all that was added."""
        thirds = self._thirds.values
        if not len(thirds):
            return np.nan
        usual = 1.4826 * float(np.median(np.abs(thirds)))
        kept = thirds[np.abs(thirds) <= 8 * usual] if usual > 0 else thirds
        std = self._moments.std
        rounding = self._least_step / np.sqrt(12.0) if np.isfinite(self._least_step) else 0.0
        floor = max(1e-6 * std, 1e-12)
        return max(float(np.sqrt(np.mean(kept**2))), min(rounding, std), floor)
