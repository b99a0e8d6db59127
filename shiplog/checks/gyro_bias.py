"""Check of the yaw rate against the heading: a biased gyro drifts away from the compass."""

from collections.abc import Callable

import numpy as np

from shiplog.types import Channel, FloatArray, Log
from shiplog.units import conversion_factor

from .channel_stats import ChannelStats, LogStats
from .interpolate import Interpolator, valid_samples
from .log_stats import compute_log_stats

BLOCKS = 8  # stretches of a record, each of which gives an estimate of the bias
SIGNIFICANT_ERRORS = 4.0  # standard errors by which a bias must differ from zero
MIN_DRIFT = np.radians(1.0)  # rad over the whole record: a smaller drift does not matter


def gyro_bias_warning(log: Log) -> str | None:
    """Warn if the integrated yaw rate drifts away from the heading.

    The record is divided into blocks. In each, the bias is the difference between the integral of
    the yaw rate and the change of the heading, over the block's length. The estimate is the mean
    over the blocks, its standard error follows from their scatter. Blocks with a gap in either
    channel are left out.

    Returns
    -------
    str or None
        One line with the bias, its effect and the remedy. None where the two agree, where a
        channel is missing, or where too few blocks are complete.
    """
    check = GyroBiasCheck(compute_log_stats(log))
    for chunk in log.chunks():
        check.add(chunk)
    return check.result()


class GyroBiasCheck:
    """The check of `gyro_bias_warning` for a log that comes chunk by chunk.

    Parameters
    ----------
    stats
        Statistics of the whole log.
    """

    def __init__(self, stats: LogStats) -> None:
        self._duration_secs = stats.duration_secs
        self._gyro: _HeadingChange | None = None
        gyro, compass = stats.get("yaw_rate"), stats.get("heading")
        if gyro is None or compass is None or min(gyro.valid, compass.valid) < 4 * BLOCKS:
            return
        start = max(gyro.valid_span_ns[0], compass.valid_span_ns[0])
        end = min(gyro.valid_span_ns[1], compass.valid_span_ns[1])
        self._edges = np.linspace(0.0, (end - start) * 1e-9, BLOCKS + 1)
        self._gyro = _HeadingChange(gyro, self._edges, start, _integrated)
        self._compass = _HeadingChange(compass, self._edges, start, _unwrapped)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        if self._gyro:
            self._gyro.add(chunk)
            self._compass.add(chunk)

    def result(self) -> str | None:
        """Return the warning, or None, once all samples were added."""
        if not self._gyro:
            return None
        complete = self._gyro.complete & self._compass.complete
        difference = self._gyro.result() - self._compass.result()
        biases = (np.diff(difference) / np.diff(self._edges))[complete]
        if len(biases) < BLOCKS // 2:
            return None
        bias = float(np.mean(biases))
        error = float(np.std(biases, ddof=1)) / np.sqrt(len(biases))
        drift = abs(bias) * self._duration_secs
        if abs(bias) < SIGNIFICANT_ERRORS * error or drift < MIN_DRIFT:
            return None
        bias_deg, error_deg = (x * conversion_factor("rad/s", "deg/s") for x in (bias, error))
        return (
            f"{self._gyro.channel.topic}: bias of {bias_deg:+.4f} ± {2 * error_deg:.4f} deg/s "
            "against the heading; a bias acts like a yaw moment and distorts b1, b2, b3 and e: "
            "calibrate the gyro or subtract the bias"
        )


class _HeadingChange:
    """Heading change up to the edge of each block, as one channel measures it.

    `complete` marks the blocks in which the channel has no gap.
    """

    def __init__(
        self,
        channel: ChannelStats,
        edges: FloatArray,
        origin_ns: int,
        changes: Callable[[FloatArray, FloatArray], FloatArray],
    ) -> None:
        self.channel = channel
        self.complete = np.ones(len(edges) - 1, bool)
        self._edges, self._origin, self._changes = edges, origin_ns, changes
        self._interpolator, self._turned = Interpolator(edges), 0.0
        self._last: tuple[FloatArray, FloatArray] = (np.zeros(0), np.zeros(0))

    def add(self, chunk: tuple[Channel, ...]) -> None:
        channel = self.channel.select(chunk)
        if channel is None or not len(channel):
            return
        new = valid_samples(channel, self._origin)
        times, values = (np.concatenate(pair) for pair in zip(self._last, new, strict=True))
        self._last = times[-1:], values[-1:]
        if len(times) < 2:
            return
        turned = np.cumsum(np.concatenate(([self._turned], self._changes(times, values))))
        self._turned = float(turned[-1])
        self._interpolator.add(times, turned)
        for i in np.flatnonzero(np.diff(times) > self.channel.gap_threshold_secs):
            first, last = np.searchsorted(self._edges, times[i : i + 2]) - 1
            self.complete[max(first, 0) : last + 1] = False

    def result(self) -> FloatArray:
        """Heading at the edges in rad, (n,), relative to an arbitrary direction."""
        return self._interpolator.result()


def _integrated(times: FloatArray, rates: FloatArray) -> FloatArray:
    """Heading change between samples of the yaw rate, rad, by the trapezoidal rule."""
    return np.diff(times) * (rates[1:] + rates[:-1]) / 2


def _unwrapped(_: FloatArray, headings: FloatArray) -> FloatArray:
    """Heading change between samples of the heading, rad, within half a turn."""
    return np.asarray((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
