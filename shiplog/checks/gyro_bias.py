"""Whether the yaw rate agrees with the heading: a gyro that is off shows in the long run."""

from collections.abc import Callable

import numpy as np

from shiplog.types import Channel, FloatArray, Log
from shiplog.units import conversion_factor

from .channel_stats import ChannelStats, LogStats
from .interpolate import Interpolator, valid_samples
from .log_stats import compute_log_stats

BLOCKS = 8  # of a record, each telling the bias for itself
SIGNIFICANT = 4.0  # standard errors
LEAST_DRIFT = np.radians(1.0)  # rad over the record: less does not matter


def gyro_bias_warning(log: Log) -> str | None:
    """A sentence if the integrated yaw rate drifts away from the heading, else None.

    The bias is the mean over blocks of the record of the integral's gain on the heading, its error
    their scatter; blocks with a gap in either channel are left out. None where a channel is
    missing, or too little of it is whole.
    """
    watch = GyroBiasCheck(compute_log_stats(log))
    for chunk in log.chunks():
        watch.add(chunk)
    return watch.result()


class GyroBiasCheck:
    """Looks at yaw rate and heading as they come, and gives `gyro_bias_warning`'s answer.

    `found` is the log_stats of the log that comes.
    """

    def __init__(self, found: LogStats) -> None:
        self._duration_secs = found.duration_secs
        self._turned: _Turning | None = None
        gyro, compass = found.get("yaw_rate"), found.get("heading")
        if gyro is None or compass is None or min(gyro.valid, compass.valid) < 4 * BLOCKS:
            return
        start = max(gyro.valid_span_ns[0], compass.valid_span_ns[0])
        end = min(gyro.valid_span_ns[1], compass.valid_span_ns[1])
        self._edges = np.linspace(0.0, (end - start) * 1e-9, BLOCKS + 1)
        self._turned = _Turning(gyro, self._edges, start, _integrated)
        self._headed = _Turning(compass, self._edges, start, _unwrapped)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Take the next samples."""
        if self._turned:
            self._turned.add(chunk)
            self._headed.add(chunk)

    def result(self) -> str | None:
        """What there is to say, once all samples were added."""
        if not self._turned:
            return None
        whole = self._turned.whole & self._headed.whole
        turned, headed = self._turned.result(), self._headed.result()
        biases, contrary = (
            (np.diff(turned + sign * headed) / np.diff(self._edges))[whole] for sign in (-1, 1)
        )
        if len(biases) < BLOCKS // 2:
            return None
        if np.std(contrary) < 0.1 * np.std(biases):
            topic = self._headed.channel.topic
            return f"{topic}: counts to port; turn the heading's sign in the layout"
        bias = float(np.mean(biases))
        error = float(np.std(biases, ddof=1)) / np.sqrt(len(biases))
        if abs(bias) < SIGNIFICANT * error or abs(bias) * self._duration_secs < LEAST_DRIFT:
            return None
        per_second, its_error = (x * conversion_factor("rad/s", "deg/s") for x in (bias, error))
        return (
            f"{self._turned.channel.topic}: off by {per_second:+.4f} ± {2 * its_error:.4f} deg/s "
            "against the heading; a bias passes for a yaw moment and spoils b1, b2, b3 and e"
        )


class _Turning:
    """How far the ship turned until each edge, by one channel, and the blocks it has no gap in."""

    def __init__(
        self,
        channel: ChannelStats,
        edges: FloatArray,
        origin_ns: int,
        turns: Callable[[FloatArray, FloatArray], FloatArray],
    ) -> None:
        self.channel = channel
        self.whole = np.ones(len(edges) - 1, bool)
        self._edges, self._origin, self._turns = edges, origin_ns, turns
        self._probe, self._turned = Interpolator(edges), 0.0
        self._last: tuple[FloatArray, FloatArray] = (np.zeros(0), np.zeros(0))

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Take the next samples."""
        channel = self.channel.select(chunk)
        if channel is None or not len(channel):
            return
        new = valid_samples(channel, self._origin)
        times, values = (np.concatenate(pair) for pair in zip(self._last, new, strict=True))
        self._last = times[-1:], values[-1:]
        if len(times) < 2:
            return
        turned = np.cumsum(np.concatenate(([self._turned], self._turns(times, values))))
        self._turned = float(turned[-1])
        self._probe.add(times, turned)
        for i in np.flatnonzero(np.diff(times) > self.channel.gap_threshold_secs):
            first, last = np.searchsorted(self._edges, times[i : i + 2]) - 1
            self.whole[max(first, 0) : last + 1] = False

    def result(self) -> FloatArray:
        """Radians at the edges, (n,), from some direction on."""
        return self._probe.result()


def _integrated(times: FloatArray, rates: FloatArray) -> FloatArray:
    return np.diff(times) * (rates[1:] + rates[:-1]) / 2


def _unwrapped(_: FloatArray, headings: FloatArray) -> FloatArray:
    return np.asarray((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
