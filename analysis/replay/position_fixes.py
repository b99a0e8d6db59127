"""Position fixes of a log, interpolated at the instants of signals."""

from collections.abc import Iterable
from math import radians

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, gap_threshold_secs
from shiplog.geodesy import LocalFrame, positions_of
from shiplog.types import Channel, FloatArray, Signals, TimeArray, concatenate_channels


class PositionFixes:
    """The usable fixes of a log, gathered chunk by chunk.

    Parameters
    ----------
    stats
        Statistics of the position channel; None where there is none.
    """

    def __init__(self, stats: ChannelStats | None) -> None:
        self._stats = stats
        self._parts: list[Channel] = []

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        part = self._stats.select(chunk) if self._stats is not None else None
        if part is not None:
            self._parts.append(part)

    def at_samples(self, parts: Iterable[Signals]) -> tuple[FloatArray | None, ...]:
        """Interpolate the fixes at the instants of signals.

        Parameters
        ----------
        parts
            Stretches of the log, each with n samples.

        Returns
        -------
        tuple
            For each stretch north and east of the first fix, (n, 2) m; NaN inside a gap and beyond
            the ends. None for a log with fewer than two fixes.
        """
        measured_ns, north_east = self.north_east()
        return tuple(_interpolated(measured_ns, north_east, each) for each in parts)

    def north_east(self) -> tuple[TimeArray, FloatArray]:
        """Return the times of the fixes, (n,) ns, and their north and east, (n, 2) m."""
        none = np.zeros(0, np.int64), np.zeros((0, 2))
        if not self._parts:
            return none
        channel = concatenate_channels(self._parts)
        positions = positions_of(channel.fields, channel.values)
        frame, measured = LocalFrame.at_first(positions), positions.measured
        if frame is None:
            return none
        return channel.measured_ns[measured], frame.north_east(positions)[measured]

    def latitude(self) -> float:
        """Return the latitude of the first fix, rad; 0 where fixes are local or there is none."""
        if not self._parts:
            return 0.0
        channel = concatenate_channels(self._parts)
        frame = LocalFrame.at_first(positions_of(channel.fields, channel.values))
        return radians(frame.datum[0]) if frame is not None and frame.geographic else 0.0


def _interpolated(
    measured_ns: TimeArray, north_east: FloatArray, signals: Signals
) -> FloatArray | None:
    """Interpolate fixes at the instants of signals, (n, 2) m; None with fewer than two fixes.

    Inside a gap they are NaN, as beyond the ends.
    """
    secs = (measured_ns - signals.start_ns) * 1e-9
    if len(secs) < 2:
        return None
    time = signals.time_secs
    intervals = np.diff(secs)
    longest = gap_threshold_secs(float(np.median(intervals)))
    after = np.clip(np.searchsorted(secs, time), 1, len(intervals))
    in_gap = (intervals[after - 1] > longest) & (secs[after] != time)
    columns = [np.interp(time, secs, column, np.nan, np.nan) for column in north_east.T]
    return np.where(in_gap[:, None], np.nan, np.column_stack(columns))
