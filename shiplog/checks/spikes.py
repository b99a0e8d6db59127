"""Spikes: single samples that leave the course of a channel and return to it at once."""

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from shiplog.types import Channel, FloatArray, TimeArray

from .quantiles import Quantiles

# quantities that the inertia of a ship, a shaft or a rudder keeps from jumping
SMOOTH_QUANTITIES = (
    "yaw_rate", "speed", "rudder", "rpm", "heading", "sway", "speed_over_ground",
)  # fmt: skip
NEIGHBOURS = 3  # samples before and after, with which one is compared
REACH = 20  # samples before and after, which show the noise at a spike
MARGIN = NEIGHBOURS + REACH
MIN_SAMPLES = 100  # fewer do not show the noise
MAX_INTERVAL_SECS = 2.0  # between samples; in a longer one, a ship may move and return
MAX_WINDOW_INTERVALS = 2.0  # mean interval among the neighbours over the channel's own
# An excess is a spike from these on:
MIN_RANGES = 3.0  # times the range of the neighbours,
MIN_STDS = 8.0  # times the standard deviation of the noise among the samples in reach,
NOISE_QUANTILE, MIN_NOISE_RATIO = 0.98, 5.0  # times this quantile of all excesses,
MIN_DIGITS = 5.0  # times the last digit (of a constant channel, which does not show its digits,
MIN_CONSTANT_SIZE = 0.2  # times its value),
MIN_SIZE = 0.02  # times the channel's ordinary size, unless it is an angle that wraps,
MAX_RUDDER_RATE = radians(5.0)  # rad/s, times the interval, for a rudder
MAX_SPIKES = 1 << 16  # of one channel; of more, the largest
MAX_VALUES = 1 << 16  # from which quantiles are taken
BLOCK = 1 << 13  # samples compared at once, which the processor's cache holds


@dataclass(frozen=True, eq=False)
class SpikeStats:
    """The spikes of a channel.

    Attributes
    ----------
    times_ns
        (k,) instants of measurement, ns since 1970, in ascending order.
    values
        (k,) values, in the channel's unit.
    largest
        The largest distance of a spike from its neighbours, in the channel's unit.
    """

    times_ns: TimeArray
    values: FloatArray
    largest: float

    def __len__(self) -> int:
        """Return the number of spikes."""
        return len(self.times_ns)

    def among(self, channel: Channel) -> NDArray[np.bool_]:
        """Return which samples of a part of the channel are spikes, (n,)."""
        found = np.zeros(len(channel), bool)
        nearest = np.searchsorted(self.times_ns, channel.measured_ns)
        nearest = np.minimum(nearest, len(self) - 1)
        at = np.flatnonzero(self.times_ns[nearest] == channel.measured_ns)
        spikes = set(zip(self.times_ns.tolist(), self.values.tolist(), strict=True))
        samples = zip(channel.measured_ns[at].tolist(), channel.values[at].tolist(), strict=True)
        found[at] = [sample in spikes for sample in samples]
        return found


class SpikeSearch:
    """Search for spikes in a channel that comes chunk by chunk; where it is cut changes nothing.

    The excess of a sample is its distance from the range of the three samples before it and the
    three after it, of which the highest and the lowest do not count: so that a second spike among
    them, or a spike of two samples, hides nothing. A step, a ramp and a resolved peak have no
    excess beyond the range of their own neighbourhood, which a spike must exceed several times, as
    it must exceed the noise of the channel, about it and in general, and its last digit. The first
    three samples of a channel and the last three are not judged.

    Parameters
    ----------
    circular
        Whether values are angles in rad that may wrap.

    References
    ----------
    R. K. Pearson, Y. Neuvo, J. Astola and M. Gabbouj, "Generalized Hampel filters", EURASIP Journal
    on Advances in Signal Processing (2016): the order statistics of a moving window as the
    reference for an outlier.

    Examples
    --------
    >>> values = np.sin(np.arange(300) / 20)
    >>> values[100] += 3.0
    >>> search = SpikeSearch()
    >>> search.add(np.arange(300) * 10**8, values)
    >>> search.result(0.1).times_ns // 10**8
    array([100])
    """

    def __init__(self, *, circular: bool = False) -> None:
        self._circular = circular
        self._times: TimeArray = np.zeros(0, np.int64)  # the last samples, not all judged
        self._values: FloatArray = np.zeros(0)
        self._excesses, self._sizes = Quantiles(MAX_VALUES), Quantiles(MAX_VALUES)
        self._digit, self._begun = np.inf, False
        self._candidates = [np.zeros(0, _CANDIDATE)]

    def add(self, times_ns: TimeArray, values: FloatArray) -> None:
        """Add the next valid samples, (n,) ns since 1970 and (n,) in the channel's unit."""
        self._sizes.add(np.abs(values))
        times = np.concatenate((self._times, times_ns))
        values = np.concatenate((self._values, values))
        self._times, self._values = times[-2 * MARGIN :], values[-2 * MARGIN :]
        for first in range(0, len(values) - 2 * MARGIN, BLOCK):
            block = slice(first, first + BLOCK + 2 * MARGIN)
            self._add_block(times[block], values[block])
        self._keep_largest()

    def _add_block(self, times: TimeArray, values: FloatArray, *, last: bool = False) -> None:
        """Judge the samples that have all in reach among these, or are the first or the last."""
        low, high = _neighbourhood(values, circular=self._circular)
        spread, excess = high - low, np.maximum(np.maximum(-high, low), 0.0)
        judged = slice(REACH if self._begun else 0, len(excess) - (0 if last else REACH))
        self._begun = True
        self._excesses.add(excess[judged])
        least = float(spread.min())
        least = least or float(np.min(spread, where=spread > 0, initial=np.inf))
        self._digit = min(self._digit, least)
        at = judged.start + np.flatnonzero(excess[judged] > MIN_RANGES * spread[judged])
        at = at[excess[at] > MIN_STDS * self._noise_std(values, at)]
        candidates = np.zeros(len(at), _CANDIDATE)
        candidates["time_ns"] = times[at + NEIGHBOURS]
        candidates["value"] = values[at + NEIGHBOURS]
        candidates["excess"] = excess[at]
        candidates["window_ns"] = times[at + 2 * NEIGHBOURS] - times[at]
        self._candidates.append(candidates)

    def _noise_std(self, values: FloatArray, at: NDArray[np.intp]) -> FloatArray:
        """Return the standard deviation of the noise in reach of some samples, (m,).

        It is the larger of those before and after the sample, in case the noise rises or falls
        there. Third differences do not contain the ship's motion; their variance in white noise is
        20.
        """
        samples = NEIGHBOURS + at[:, None]
        starts = np.clip(samples - REACH, 0, len(values) - 2 * REACH - 1)
        around = values[starts + np.arange(2 * REACH + 1)]
        around = _difference(around, values[samples], circular=self._circular)
        sides = np.stack((around[:, :REACH], around[:, REACH + 1 :]))
        differences = np.abs(np.diff(sides, 3, axis=2))
        return np.asarray(1.4826 * np.median(differences, axis=2).max(axis=0) / np.sqrt(20))

    def result(self, interval_secs: float, *, rudder: bool = False) -> SpikeStats | None:
        """Return the spikes, or None; to be called once, after all samples.

        Parameters
        ----------
        interval_secs
            Median interval between the samples, s.
        rudder
            Whether the channel is the angle of a rudder.
        """
        if len(self._values) == 2 * MARGIN:
            self._add_block(self._times, self._values, last=True)
            self._keep_largest()
        enough = len(self._excesses.values) >= MIN_SAMPLES
        (candidates,) = self._candidates
        if not (len(candidates) and enough and 0 < interval_secs <= MAX_INTERVAL_SECS):
            return None
        least = max(self._least(), MAX_RUDDER_RATE * interval_secs if rudder else 0.0)
        longest_ns = MAX_WINDOW_INTERVALS * 2 * NEIGHBOURS * interval_secs * 1e9
        found = candidates[(candidates["excess"] > least) & (candidates["window_ns"] < longest_ns)]
        if not len(found):
            return None
        found = found[np.argsort(found["time_ns"], kind="stable")]
        return SpikeStats(found["time_ns"], found["value"], float(found["excess"].max()))

    def _least(self) -> float:
        """Return the excess that noise, digits and the size of the values allow; inf without any.

        A channel that is constant at zero shows none of these.
        """
        noise, size = (
            float(np.quantile(each.values, NOISE_QUANTILE))
            for each in (self._excesses, self._sizes)
        )
        if np.isinf(self._digit):
            return MIN_CONSTANT_SIZE * size if size else np.inf
        least_size = 0.0 if self._circular else MIN_SIZE * size
        return max(MIN_NOISE_RATIO * noise, MIN_DIGITS * self._digit, least_size)

    def _keep_largest(self) -> None:
        """Keep the candidates with the largest excesses, of equal ones the first."""
        candidates = np.concatenate(self._candidates)
        if len(candidates) > MAX_SPIKES:
            order = np.argsort(-candidates["excess"], kind="stable")[:MAX_SPIKES]
            candidates = candidates[np.sort(order)]
        self._candidates = [candidates]


_CANDIDATE = np.dtype(
    [("time_ns", np.int64), ("value", float), ("excess", float), ("window_ns", np.int64)]
)


def _difference(values: FloatArray, sample: FloatArray, *, circular: bool) -> FloatArray:
    """Return values relative to a sample, on the circle where they are angles that wrap."""
    difference: FloatArray = values - sample
    if circular:
        difference = np.remainder(difference + np.pi, 2 * np.pi) - np.pi
    return difference


def _neighbourhood(values: FloatArray, *, circular: bool) -> tuple[FloatArray, FloatArray]:
    """Return the second lowest and the second highest of each sample's neighbours.

    Parameters
    ----------
    values
        (n + 2 `NEIGHBOURS`,) of which the first and the last have not all their neighbours.
    circular
        Whether differences are taken on the circle.

    Returns
    -------
    tuple of ndarray
        (n,) each, relative to the sample.
    """
    count = len(values) - 2 * NEIGHBOURS
    sample = values[NEIGHBOURS : NEIGHBOURS + count]
    lowest, low = np.full((2, count), np.inf)
    highest, high = np.full((2, count), -np.inf)
    for shift in range(2 * NEIGHBOURS + 1):
        if shift != NEIGHBOURS:
            difference = _difference(values[shift : shift + count], sample, circular=circular)
            np.minimum(low, np.maximum(lowest, difference), out=low)
            np.minimum(lowest, difference, out=lowest)
            np.maximum(high, np.minimum(highest, difference), out=high)
            np.maximum(highest, difference, out=highest)
    return low, high
