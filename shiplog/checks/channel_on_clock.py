"""One channel on a clock, chunk by chunk, for the comparison of channels with each other."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from shiplog.geodesy import LocalFrame, positions_of
from shiplog.types import Channel, FloatArray, is_sorted

from .channel_stats import ChannelStats
from .interpolate import Interpolator

# from the times, (m,) s, and the values, (m, k), of the next samples, to the values interpolated
Transform = Callable[[FloatArray, FloatArray], FloatArray]
Frames = dict[tuple[str, ...], LocalFrame]


class ChannelOnClock:
    """The values of a channel at the instants of a clock, from samples that come in chunks.

    Of a position they are north and east of the first fix. A value is NaN in a gap of the channel,
    before its first sample and after its last one. A channel that is held between its samples has
    no gaps, and no end before that of the clock.

    Parameters
    ----------
    stats
        Statistics of the channel.
    at
        (n,) the instants, s, in ascending order.
    start_ns
        The time from which the instants are counted, ns since 1970.
    transform
        Computes from the samples what is interpolated, such as `Unwrapped`; called with one
        stretch of valid samples after the other. None for the samples themselves.
    frames
        The frames of positions by their fields, to which the channel's own is added: channels that
        share them have one datum.

    Attributes
    ----------
    stats
        Statistics of the channel.
    """

    def __init__(
        self,
        stats: ChannelStats,
        at: FloatArray,
        start_ns: int,
        transform: Transform | None = None,
        frames: Frames | None = None,
    ) -> None:
        self.stats, self._at, self._start_ns, self._transform = stats, at, start_ns, transform
        self._frames: Frames = {} if frames is None else frames
        self._gap_secs = stats.gap_threshold_secs  # infinite where it is held
        self._interpolators = [
            Interpolator(at, self._gap_secs, hold=stats.hold is not None)
            for _ in range(2 if stats.fields else 1)
        ]
        self._begins_after_gap = np.zeros(len(at) + 1, bool)
        self._last_secs: FloatArray | None = None

    @property
    def frame(self) -> LocalFrame | None:
        """The frame of a position; None before its first fix, and of other channels."""
        return self._frames.get(self.stats.fields)

    @property
    def after_gap(self) -> NDArray[np.bool_]:
        """Whether an instant is the first one after a gap, (n,), even if none lies in the gap."""
        return self._begins_after_gap[:-1]

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        channel = self.stats.select(chunk)
        if channel is None or not len(channel):
            return
        rows = self._rows(channel)
        valid = np.isfinite(rows).all(axis=1)
        rows, times = rows[valid], (channel.measured_ns[valid] - self._start_ns) * 1e-9
        if not len(rows):
            return
        if not is_sorted(times):
            order = np.argsort(times, kind="stable")
            rows, times = rows[order], times[order]
        last = times[:1] if self._last_secs is None else self._last_secs
        in_gap = np.diff(times, prepend=last) > self._gap_secs
        self._begins_after_gap[np.searchsorted(self._at, times[in_gap])] = True
        self._last_secs = times[-1:]
        if self._transform:
            rows = self._transform(times, rows)
        for interpolator, column in zip(self._interpolators, rows.T, strict=True):
            interpolator.add(times, column)

    def result(self) -> FloatArray:
        """Return the values at the instants, (n, k), once all samples were added."""
        first, last = ((t - self._start_ns) * 1e-9 for t in self.stats.valid_span_ns)
        end = np.inf if self.stats.hold is not None else last + 1e-6
        unknown = (self._at < first - 1e-6) | (self._at > end)
        values = np.column_stack([each.result() for each in self._interpolators])
        return np.where(unknown[:, None], np.nan, values)

    def _rows(self, channel: Channel) -> FloatArray:
        """Return the samples, (m, k); of a position north and east of the datum, m."""
        if not channel.fields:
            return channel.values[:, None]
        positions = positions_of(channel.fields, channel.values)
        frame = self.frame or LocalFrame.at_first(positions)
        if frame is None:
            return np.full((len(channel), 2), np.nan)
        self._frames[channel.fields] = frame
        return frame.north_east(positions)


class Unwrapped:
    """An angle without jumps at full turns, from samples that come in chunks; it keeps its zero.

    Parameters
    ----------
    full_turn
        The value at which the angle starts again, in its unit.

    Examples
    --------
    >>> unwrapped = Unwrapped(360.0)
    >>> unwrapped(np.zeros(3), np.array([[350.0], [358.0], [4.0]])).ravel().tolist()
    [350.0, 358.0, 364.0]
    """

    def __init__(self, full_turn: float = 2 * np.pi) -> None:
        self._half_turn = full_turn / 2
        self._last: FloatArray | None = None
        self._angle: FloatArray | None = None

    def __call__(self, _times: FloatArray, angles: FloatArray) -> FloatArray:
        """Return the next angles, (m, 1), without jumps."""
        last = angles[:1] if self._last is None else self._last
        steps = np.diff(angles, axis=0, prepend=last)
        steps = (steps + self._half_turn) % (2 * self._half_turn) - self._half_turn
        start = angles[0] if self._angle is None else self._angle
        unwrapped = np.cumsum(np.concatenate((start[None], steps)), axis=0)[1:]
        self._last, self._angle = angles[-1:], unwrapped[-1]
        return np.asarray(unwrapped)
