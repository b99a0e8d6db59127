"""Yaw rate from a heading: the slope of a straight line through a few consecutive samples.

For samples at equal intervals this is the filter of Savitzky and Golay of order 1 and 2; the times
of a ship's network are not equal, so that the line is fitted to the times as they are.

References
----------
A. Savitzky, M. J. E. Golay, "Smoothing and differentiation of data by simplified least squares
procedures", 1964.
"""

from dataclasses import dataclass
from math import degrees, pi, radians, sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from shiplog.errors import LogError
from shiplog.types import Channel, FloatArray, TimeArray, concatenate_channels

TARGET_NOISE = radians(
    0.02
)  # rad/s, that of a usual gyro; a longer window would only cost bandwidth
MAX_WINDOW_SECS = 10.0  # of the order of a ship's time to begin to turn
MAX_NOISE_SAMPLES = 1_000_000  # from which the noise of the heading is estimated
_MAX_WINDOW_STRETCH = 1.5  # of the usual duration of a window; a longer one has a gap in it
_ROWS_AT_ONCE = 1 << 14


@dataclass(frozen=True)
class HeadingRate:
    """How a yaw rate is computed from a heading, and how good it is.

    Attributes
    ----------
    samples
        The number of samples to which each line is fitted; odd.
    interval_secs
        The usual interval between them, s.
    heading_noise
        The standard deviation of the noise of the heading, rad.
    """

    samples: int
    interval_secs: float
    heading_noise: float

    @property
    def window_secs(self) -> float:
        """The duration of the window, s."""
        return (self.samples - 1) * self.interval_secs

    @property
    def noise(self) -> float:
        """The standard deviation of the noise of the yaw rate, rad/s, for white noise."""
        return self.heading_noise / (self.interval_secs * _slope_gain(self.samples))

    @property
    def bandwidth_hz(self) -> float:
        """The frequency at which the yaw rate is attenuated by 3 dB, Hz.

        The response of the slope of a line over T is 3 (sin x - x cos x) / x³ with x = π f T; it is
        1/√2 at x = 1.815. The samples of a sum stand for an interval each.
        """
        return 1.815 / (pi * self.samples * self.interval_secs)

    def __str__(self) -> str:
        """Describe the noise and the bandwidth in words."""
        return (
            f"noise {degrees(self.noise):.2g} deg/s, bandwidth {self.bandwidth_hz:.2g} Hz: the "
            f"slope over {self.samples} samples, {self.window_secs:.3g} s"
        )


def choose_heading_rate(headings: FloatArray, interval_secs: float, topic: str) -> HeadingRate:
    """Choose the shortest window whose noise is that of a gyro, up to `MAX_WINDOW_SECS`.

    Parameters
    ----------
    headings
        (n,) measured headings, rad, in the order of time.
    interval_secs
        Their usual interval, s.
    topic
        The topic, for messages.

    Raises
    ------
    LogError
        There are too few headings, or they are too far apart.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> print(choose_heading_rate(radians(0.01) * rng.normal(size=5000), 0.2, "/heading/HE"))
    noise 0.016 deg/s, bandwidth 0.58 Hz: the slope over 5 samples, 0.8 s
    """
    if len(headings) < 5 or not 0 < 2 * interval_secs <= MAX_WINDOW_SECS:
        raise LogError(
            f"no yaw rate can be derived from {topic}: it has {len(headings)} samples, one each "
            f"{interval_secs:.3g} s; at least 5, of at most {MAX_WINDOW_SECS / 2:g} s, are needed"
        )
    rate = HeadingRate(
        5 if 4 * interval_secs <= MAX_WINDOW_SECS else 3, interval_secs, noise_of_heading(headings)
    )
    while rate.noise > TARGET_NOISE and rate.window_secs + 2 * interval_secs <= MAX_WINDOW_SECS:
        rate = HeadingRate(rate.samples + 2, interval_secs, rate.heading_noise)
    return rate


def noise_of_heading(headings: FloatArray) -> float:
    """Estimate the standard deviation of the noise of a heading, rad.

    Third differences remove the ship's turning; the largest hundredth of them, at gaps and spikes,
    is limited. The noise is at least that of the rounding, where all headings are multiples of one
    step.

    Parameters
    ----------
    headings
        (n,) at least 4 measured headings, rad.
    """
    unwrapped = np.unwrap(headings[:MAX_NOISE_SAMPLES])
    third = np.abs(np.diff(unwrapped, 3))
    limited = np.minimum(third, np.quantile(third, 0.99))
    noise = sqrt(float(np.mean(limited**2)) / 20)  # 1² + 3² + 3² + 1²
    steps = np.abs(np.diff(unwrapped))
    steps = steps[steps > 1e-9]  # rad; smaller ones are rounding of floats
    if not len(steps):
        return noise
    multiples = steps / steps.min()
    is_rounded = np.mean(np.abs(multiples - np.round(multiples)) < 0.05) > 0.95
    return max(noise, float(steps.min()) / sqrt(12)) if is_rounded else noise


class HeadingDifferentiator:
    """Yaw rates of a heading that comes in parts; where it is cut changes no result.

    Parameters
    ----------
    rate
        How they are computed.
    """

    def __init__(self, rate: HeadingRate) -> None:
        self._rate = rate
        self._last: list[Channel] = []  # valid samples whose windows are not complete

    def step(self, heading: Channel) -> tuple[TimeArray, TimeArray, FloatArray]:
        """Add the next part of the heading.

        Parameters
        ----------
        heading
            Its samples; NaN means not measured.

        Returns
        -------
        measured_ns, received_ns, values
            (m,) times, and yaw rates in rad/s: measured in the middle of each window, known with
            its last sample. Windows with a gap in them are omitted.
        """
        valid = heading.take(np.flatnonzero(np.isfinite(heading.values)))
        joined = concatenate_channels([*self._last, valid])
        size = self._rate.samples
        self._last = [joined.part(max(0, len(joined) - size + 1), len(joined))]
        windows = max(0, len(joined) - size + 1)
        rates = np.empty(windows)
        for start in range(0, windows, _ROWS_AT_ONCE):
            stop = min(start + _ROWS_AT_ONCE, windows)
            rates[start:stop] = self._slopes(joined.part(start, stop + size - 1))
        known = np.flatnonzero(np.isfinite(rates))
        middle = size // 2
        return (
            joined.measured_ns[known + middle],
            joined.received_ns[known + size - 1],
            rates[known],
        )

    def _slopes(self, heading: Channel) -> FloatArray:
        """Return the slope of each window, rad/s; NaN with a gap or without a duration."""
        size = self._rate.samples
        times = sliding_window_view(heading.measured_ns, size)
        angles = sliding_window_view(heading.values, size)
        secs = (times - times[:, :1]) * 1e-9
        longest = _MAX_WINDOW_STRETCH * self._rate.window_secs
        usable = (secs[:, -1] > 0) & (secs[:, -1] <= longest)
        secs = secs - secs.mean(axis=1, keepdims=True)
        turned = np.remainder(angles - angles[:, size // 2, None] + pi, 2 * pi) - pi
        spread = np.where(usable, (secs * secs).sum(axis=1), np.nan)
        slopes: FloatArray = (secs * turned).sum(axis=1) / spread
        return slopes


def _slope_gain(samples: int) -> float:
    """Return the root of the sum of squared distances from the middle of a window, in intervals."""
    return sqrt(samples * (samples**2 - 1) / 12)
