"""Times of one channel, chunk by chunk: spans, intervals, gaps, delays, and changes over them."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shiplog.types import Channel, TimeArray

from .channel_stats import GAP_SECS, Occurrences, gap_threshold_secs
from .quantiles import Quantiles

Mask = NDArray[np.bool_]

MIN_INTERVALS = 10  # fewer do not show whether a channel is irregular
LAST_INSTANT_NS = np.iinfo(np.int64).max
NO_SPAN = (LAST_INSTANT_NS, -LAST_INSTANT_NS)


class ChannelTimeStats:
    """Accumulates the times of one channel, and the changes of a commanded one between samples.

    Attributes
    ----------
    samples, valid
        The number of samples, and of those that are valid.
    start_ns
        The time of the sample that came first.
    span_ns, valid_span_ns
        The earliest and the latest time of both; `NO_SPAN` without any.
    intervals, row_intervals
        The intervals, ns, between valid samples, and between all of them; one object until the
        first invalid sample.
    changes
        The changes of a commanded input over the intervals; None for other channels.
    duplicates
        The number of valid samples with the time of the one before.
    backward_steps, received_early
        The occurrences of decreasing times, and of samples received before being measured.
    max_delay_ns
        The longest time from measurement to reception.
    """

    def __init__(self, *, commanded: bool) -> None:
        self.samples = self.valid = self.duplicates = self.max_delay_ns = 0
        self.span_ns = self.valid_span_ns = NO_SPAN
        self.intervals = self.row_intervals = Quantiles()
        self.changes = Quantiles() if commanded else None
        self.backward_steps, self.received_early = Occurrences(), Occurrences()
        self.start_ns = self._last = self._last_valid = 0
        self._last_value = np.nan
        self._long_intervals = [np.zeros((0, 2), np.int64)]  # rows of start and length, ns

    def add(self, channel: Channel, valid: Mask) -> None:
        """Add the next samples, at least one, of which some are valid, (n,)."""
        times = channel.measured_ns
        if not self.samples:
            self.start_ns = self._last = self._last_valid = int(times[0])
        if not valid.all() and self.row_intervals is self.intervals:
            self.row_intervals = deepcopy(self.intervals)
        with_last = np.concatenate(([self._last], times)) if self.samples else times
        self._add_steps(with_last)
        self._add_intervals(channel, valid)
        self._add_delays(channel)
        self.span_ns = _extended_span(self.span_ns, times)
        self.valid_span_ns = _extended_span(self.valid_span_ns, times[valid])
        self.samples += len(times)
        self.valid += int(np.count_nonzero(valid))
        self._last = int(times[-1])
        if valid.any():
            self._last_valid = int(times[valid][-1])

    def secs(self, at_ns: int) -> float:
        """Return a time as seconds since the first sample."""
        return float(at_ns - self.start_ns) * 1e-9

    def median_interval_secs(self) -> float:
        """Return the median interval between valid samples; 0 without any."""
        return _median_secs(self.intervals)

    def median_row_interval_secs(self) -> float:
        """Return the median interval between all samples; 0 without any."""
        return _median_secs(self.row_intervals)

    def gaps(self) -> tuple[tuple[float, float], ...]:
        """Return the start and the length of each gap, s."""
        long = np.concatenate(self._long_intervals)
        long = long[long[:, 1] * 1e-9 > gap_threshold_secs(self.median_interval_secs())]
        gaps = zip((long[:, 0] - self.span_ns[0]) * 1e-9, long[:, 1] * 1e-9, strict=True)
        return tuple((float(start), float(length)) for start, length in gaps)

    def regularity(self, *, rows: bool) -> tuple[float, tuple[float, float]]:
        """Return the share of irregular intervals, and their range, s; gaps are not counted.

        An interval is irregular that differs by more than half from the median. The intervals are
        those between valid samples, or with `rows` between all.
        """
        intervals = self.row_intervals if rows else self.intervals
        typical = _median_secs(intervals)
        steps = intervals.values * 1e-9
        steps = steps[steps <= gap_threshold_secs(typical)]
        if len(steps) < MIN_INTERVALS:
            return 0.0, (typical, typical)
        low, high = np.percentile(steps, [1, 99])
        share = float(np.mean(np.abs(steps - typical) > 0.5 * typical))
        return share, (float(low), float(high))

    def _add_steps(self, times: TimeArray) -> None:
        """Add the steps between all samples, given their times and that of the one before."""
        steps = np.diff(times)
        backward = np.flatnonzero(steps < 0)
        if len(backward):
            first = int(backward[0])
            self.backward_steps = self.backward_steps.plus(
                len(backward), self.secs(int(times[first])), -float(steps[first]) * 1e-9
            )
        if self.row_intervals is not self.intervals:
            steps = np.diff(np.sort(times))
            self.row_intervals.add(steps[steps > 0].astype(float))

    def _add_intervals(self, channel: Channel, valid: Mask) -> None:
        """Add the intervals between valid samples, and the changes of an input over them."""
        times = channel.measured_ns[valid]
        if self.valid:
            times = np.concatenate(([self._last_valid], times))
        steps = np.diff(times)
        order: slice | NDArray[np.intp] = slice(None)
        if (steps < 0).any():
            order = np.argsort(times, kind="stable")
            times = times[order]
            steps = np.diff(times)
        positive = steps > 0
        self.duplicates += len(steps) - int(np.count_nonzero(positive))
        self.intervals.add(steps[positive].astype(float))
        long = np.flatnonzero(steps > GAP_SECS * 1e9)
        self._long_intervals.append(np.column_stack((times[long], steps[long])))
        values = channel.values[valid]
        if self.changes is not None and len(values):
            if self.valid:
                values = np.concatenate(([self._last_value], values))
            self.changes.add(np.abs(np.diff(values[order]))[positive])
            self._last_value = float(values[-1])

    def _add_delays(self, channel: Channel) -> None:
        lead = channel.measured_ns - channel.received_ns
        self.max_delay_ns = max(self.max_delay_ns, -int(lead.min()))
        largest_lead = float(lead.max()) * 1e-9
        if largest_lead > 0:
            extent = max(self.received_early.extent, largest_lead)
            early = lead > 0
            first_ns = int(channel.measured_ns[early.argmax()])
            more = self.received_early.plus(int(np.count_nonzero(early)), self.secs(first_ns))
            self.received_early = replace(more, extent=extent)


def _extended_span(span: tuple[int, int], times: TimeArray) -> tuple[int, int]:
    if not len(times):
        return span
    return min(span[0], int(times.min())), max(span[1], int(times.max()))


def _median_secs(intervals: Quantiles) -> float:
    """Median of intervals in ns, as s; 0 without any."""
    return intervals.median() * 1e-9 if len(intervals.values) else 0.0
