"""Signals of a trial on a uniform clock, as the analysis of manoeuvres takes them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray

NOISE_DIFFERENCE_GAIN = np.sqrt(20.0)  # std of third differences of white noise of unit std
MAD_TO_STD = 1.4826  # of a normal distribution
MIN_NOISE_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class TrialSignals:
    """Signals of a trial at n instants; NaN where not measured.

    Attributes
    ----------
    dt_secs
        Step of the clock, s.
    rudder, rudder_order
        (n,) angle of the rudder, and the angle ordered, positive to starboard, rad.
    heading
        (n,) rad, continuous.
    yaw_rate
        (n,) rad/s.
    speed, sway
        (n,) ahead and to starboard through the water, m/s.
    positions
        (n, 2) north and east over the ground, m.
    rpm
        (n,) propeller revolutions, per minute.
    power
        (n,) delivered to the shaft, W.
    intervals
        Sampling interval of each channel, s, by its name.
    noise
        Standard deviation of the white noise of one sample, by the name of the channel, SI.
    heading_step
        Step in which the heading was recorded, rad; 0 where it is not known.
    events
        Marked events: time from the first instant, s, and text.
    """

    dt_secs: float
    rudder: FloatArray
    heading: FloatArray
    yaw_rate: FloatArray
    speed: FloatArray
    sway: FloatArray
    positions: FloatArray
    rudder_order: FloatArray
    rpm: FloatArray
    power: FloatArray
    intervals: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    heading_step: float = 0.0
    events: tuple[tuple[float, str], ...] = ()

    def __len__(self) -> int:
        """Return the number of instants."""
        return len(self.rudder)

    def has(self, name: str) -> bool:
        """Whether a quantity was measured at two instants or more."""
        return bool(np.isfinite(_rows(getattr(self, name))).sum() > 1)

    def interval(self, name: str) -> float:
        """Sampling interval of a channel, s; the clock's step where it is unknown or shorter."""
        return max(self.dt_secs, self.intervals.get(name, self.dt_secs))

    def part(self, first: int, end: int) -> "TrialSignals":
        """Return the signals at the instants `first` to `end` - 1, with the events there."""
        dt, cut = self.dt_secs, slice(first, end)
        events = tuple(
            (time - first * dt, text) for time, text in self.events if first <= time / dt <= end
        )
        arrays = {name: getattr(self, name)[cut] for name in SIGNAL_NAMES}
        return replace(self, events=events, **arrays)


SIGNAL_NAMES = (
    "rudder", "heading", "yaw_rate", "speed", "sway", "positions", "rudder_order", "rpm", "power",
)  # fmt: skip


def _rows(values: FloatArray) -> FloatArray:
    return values if values.ndim == 1 else values[:, 0]


def noise_std(values: FloatArray) -> float:
    """Estimate the white noise of a channel from its third differences.

    A smooth motion is cancelled by them; the median of their size ignores manoeuvres and spikes.
    The step of a coarsely printed channel counts as noise.

    Parameters
    ----------
    values
        (n,) evenly spaced samples, NaN where not measured.

    Returns
    -------
    float
        In the unit of the values; 0 where there are fewer than `MIN_NOISE_SAMPLES`.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> round(noise_std(np.sin(np.arange(5000) / 50) + rng.normal(0, 0.1, 5000)), 2)
    0.1
    """
    known = values[np.isfinite(values)]
    if len(known) < MIN_NOISE_SAMPLES:
        return 0.0
    size = float(np.median(np.abs(np.diff(known, 3)))) * MAD_TO_STD / NOISE_DIFFERENCE_GAIN
    return float(max(size, printed_step(known) / np.sqrt(12.0)))


def printed_step(values: FloatArray) -> float:
    """Return the step in which a channel was recorded: its smallest change between samples.

    Parameters
    ----------
    values
        (n,) samples without NaN.

    Returns
    -------
    float
        In the unit of the values; 0 where they do not change.

    Examples
    --------
    >>> import numpy as np
    >>> round(printed_step(np.array([10.0, 10.0, 10.5, 11.5])), 6)
    0.5
    """
    steps = np.abs(np.diff(values))
    moving = steps[steps > 1e-12 * max(1.0, float(np.max(np.abs(values), initial=0.0)))]
    return float(np.min(moving)) if len(moving) else 0.0


def interpolated(values: FloatArray) -> FloatArray:
    """Interpolate values (n,) or (n, k) over NaN and hold them beyond the ends.

    Columns without two values stay as they are.
    """
    if values.ndim > 1:
        return np.column_stack([interpolated(column) for column in values.T])
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 2 or len(known) == len(values):
        return values
    return np.interp(np.arange(len(values)), known, values[known])


def filled_signals(signals: TrialSignals) -> TrialSignals:
    """Interpolate gaps, and derive heading and yaw rate from each other where one is missing.

    A heading from the yaw rate begins at 0 and drifts with the bias of the gyro.
    """
    values: dict[str, Any] = {name: interpolated(getattr(signals, name)) for name in SIGNAL_NAMES}
    dt = signals.dt_secs
    if not signals.has("heading") and signals.has("yaw_rate"):
        rate = values["yaw_rate"]
        values["heading"] = np.append(0.0, np.cumsum((rate[1:] + rate[:-1]) / 2)) * dt
    if not signals.has("yaw_rate") and signals.has("heading"):
        values["yaw_rate"] = slope(values["heading"], dt, max(2.0, signals.interval("heading")))
    if not signals.has("rudder"):
        values["rudder"] = values["rudder_order"]
    return replace(signals, **values)


def slope(values: FloatArray, dt: float, half_secs: float) -> FloatArray:
    """Return the central difference quotient over `half_secs` to either side, (n,) per s."""
    if len(values) < 3:
        return np.zeros(len(values))
    behind, ahead = chord_ends(len(values), dt, half_secs)
    rates: FloatArray = (values[ahead] - values[behind]) / ((ahead - behind) * dt)
    return rates


def chord_ends(
    count: int, dt: float, half_secs: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the samples `half_secs` before and after each of at least three, (n,) both.

    At the ends of the signals the chord between them is shorter, and its centre is another sample.
    """
    k = max(1, min(round(half_secs / dt), (count - 1) // 2))
    samples = np.arange(count)
    return np.maximum(samples - k, 0), np.minimum(samples + k, count - 1)


def longest_gap(values: FloatArray, dt: float) -> float:
    """Return the longest stretch of NaN in values (n,), s."""
    missing = ~np.isfinite(values)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], missing.astype(np.int8), [0]))))
    return float(np.max(edges[1::2] - edges[::2])) * dt if len(edges) else 0.0
