"""Statistics of resampled signals: noise levels, sampling intervals, extremes."""

from dataclasses import dataclass

import numpy as np

from shiplog import Signals
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.checks.quantiles import Quantiles
from shiplog.ships.paper import PAPER_OUTPUTS, Coefficients, rudder_effects
from shiplog.types import FloatArray, concatenate_signals

from .moments import Moments

# instants: enough to judge how well a model fits, and little of a long log
HEAD_COUNT = 50_000
MAX_NOISE_DEVIATION = 8.0  # third differences beyond it, in robust standard deviations, are spikes
STD_PER_MAD = 1.4826  # of a normal distribution: standard deviation / median absolute deviation


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
        """Median time from sample to sample of yaw rate and speed, s, (2,)."""
        return self.intervals * self.dt_secs

    @property
    def gap_steps(self) -> FloatArray:
        """Number of instants without a sample beyond which there is a gap, (2,)."""
        return np.array([gap_threshold_secs(s) / self.dt_secs for s in self.interval_secs])


class SignalStatsCollector:
    """Collects `SignalStats` from signals that come in chunks.

    Where the chunks are cut changes no result.

    Parameters
    ----------
    model
        Coefficients of the paper's model; only the alphas, for the rudder effect, are used.

    Attributes
    ----------
    max_speed
        Largest absolute speed so far, m/s.
    """

    def __init__(self, model: Coefficients) -> None:
        self._model = model
        self._outputs = {name: _OutputStatsCollector() for name in PAPER_OUTPUTS}
        self._speed, self._rpm = Quantiles(), Quantiles()
        self.max_speed = self._max_rudder_effect = 0.0
        self._heads: list[Signals] = []
        self._count, self._dt = 0, 1.0

    def add(self, chunk: Signals) -> None:
        """Add the next chunk of signals, with the inputs held."""
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
        """Return the statistics of all chunks added."""
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
    """Compute the statistics of signals that are in memory as a whole.

    Parameters
    ----------
    signals
        Yaw rate, speed, rudder and revolutions on one clock, with the inputs held.
    model
        Coefficients of the paper's model; only the alphas, for the rudder effect, are used.

    Returns
    -------
    SignalStats
        The statistics; the same as `SignalStatsCollector` computes from chunks.
    """
    collector = SignalStatsCollector(model)
    collector.add(signals)
    return collector.result()


class _OutputStatsCollector:
    """Collects the statistics of one output, yaw rate or speed."""

    def __init__(self) -> None:
        self.moments, self.noise, self.first = Moments(), NoiseLevel(), np.nan
        self._intervals, self._last, self._count = Quantiles(), -1, 0

    def add(self, values: FloatArray) -> None:
        """Add the next values, NaN where not measured."""
        at = np.flatnonzero(np.isfinite(values))
        self.moments.add(values)
        if len(at):
            measured = values[at]
            self.noise.add(measured)
            numbers = at + self._count
            if self._last < 0:
                self.first = float(measured[0])
                self._intervals.add(np.diff(numbers).astype(float))
            else:
                self._intervals.add(np.diff(numbers, prepend=self._last).astype(float))
            self._last = int(numbers[-1])
        self._count += len(values)

    def interval(self) -> float:
        """Return the median number of instants from sample to sample, or 1 without two samples."""
        return self._intervals.median() if len(self._intervals.values) else 1.0


def noise_level(values: FloatArray) -> float:
    """Estimate the standard deviation of a signal's white noise from its third differences.

    Differencing removes the slow motion of the ship: white noise of variance s² has third
    differences of variance (1 + 9 + 9 + 1) s² = 20 s². Differences beyond `MAX_NOISE_DEVIATION`
    robust standard deviations (1.4826 times the median absolute deviation) are spikes and are
    excluded. A signal recorded with few digits has at least the noise of its rounding, step / √12.

    Parameters
    ----------
    values
        The signal, (n,), NaN where not measured.

    Returns
    -------
    float
        The standard deviation, in the signal's unit; NaN for fewer than four measured values.
    """
    level = NoiseLevel()
    level.add(values[np.isfinite(values)])
    return level.result()


class NoiseLevel:
    """Estimates the white noise of measured values that come in chunks, as `noise_level` does."""

    def __init__(self) -> None:
        self._last: FloatArray = np.zeros(0)
        self._moments = Moments()
        self._thirds, self._min_step = Quantiles(), np.inf

    def add(self, measured: FloatArray) -> None:
        """Add the next measured values, (n,), none of them NaN."""
        self._moments.add(measured)
        new = np.concatenate((self._last[-1:], measured))
        steps = np.abs(np.diff(new))
        self._min_step = min(self._min_step, float(np.min(steps[steps > 0], initial=np.inf)))
        joined = np.concatenate((self._last, measured))
        # white noise of variance s² has third differences of variance 20 s²
        self._thirds.add(np.diff(joined, 3) / np.sqrt(20.0))
        self._last = joined[-3:]

    def result(self) -> float:
        """Return the standard deviation of the noise in all values added."""
        thirds = self._thirds.values
        if not len(thirds):
            return np.nan
        robust_std = STD_PER_MAD * float(np.median(np.abs(thirds)))
        limit = MAX_NOISE_DEVIATION * robust_std
        kept = thirds[np.abs(thirds) <= limit] if robust_std > 0 else thirds
        std = self._moments.std
        rounding = self._min_step / np.sqrt(12.0) if np.isfinite(self._min_step) else 0.0
        floor = max(1e-6 * std, 1e-12)
        return max(float(np.sqrt(np.mean(kept**2))), min(rounding, std), floor)
