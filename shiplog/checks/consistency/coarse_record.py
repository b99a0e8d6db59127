"""The channels of a log on one coarse clock, gathered chunk by chunk, for comparisons."""

from collections.abc import Callable

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.interpolate import Interpolator
from shiplog.types import Channel, FloatArray
from shiplog.units import GEOGRAPHIC

MIN_STEP_SECS = 0.1
MIN_INSTANTS = 300  # of a log so short that its times may have a wrong unit
MAX_INSTANTS = 50_000
EARTH_RADIUS = 6_371_000.0  # m
TURN = 2 * np.pi


class CoarseRecord:
    """Yaw angle, heading, position, speed, rudder and revolutions on one clock.

    A value is NaN in a gap of its channel and where the channel has not begun or has ended. The
    memory is bounded by `MAX_INSTANTS`, whatever the length of the log.

    Parameters
    ----------
    stats
        Statistics of the whole log.

    Attributes
    ----------
    dt_secs
        Step of the clock; 0 where the log is too short.
    """

    def __init__(self, stats: LogStats) -> None:
        self._series: dict[str, _Series] = {}
        start, end = stats.span_ns
        span = (end - start) * 1e-9
        step_secs = max(min(MIN_STEP_SECS, span / MIN_INSTANTS), span / MAX_INSTANTS)
        self.dt_secs = step_secs if span > 0 else 0.0
        self._start = start
        at = np.arange(int(span / self.dt_secs) + 1) * self.dt_secs if span > 0 else np.zeros(1)
        self._count = len(at)
        for name in ("yaw_rate", "heading", "position", "speed", "rudder", "rpm"):
            channel = stats.get(name)
            if channel is not None and channel.valid > 1:
                self._series[name] = _Series(channel, at, start)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        for series in self._series.values():
            series.add(chunk)

    def values(self, name: str) -> FloatArray:
        """Return a channel at all instants, (n,); all NaN where the log does not have it.

        The yaw rate is integrated (rad) and the heading is continuous over full turns (rad).
        """
        series = self._series.get(name)
        return series.results()[0] if series else np.full(self._count, np.nan)

    @property
    def first_heading(self) -> float:
        """First valid heading, rad; 0 without one."""
        series = self._series.get("heading")
        return series.first if series else 0.0

    @property
    def is_geographic(self) -> bool:
        """Whether the positions are latitude and longitude."""
        series = self._series.get("position")
        return series is not None and series.is_geographic

    def track(self) -> tuple[FloatArray, FloatArray]:
        """Return the position north and east, each (n,) m; all NaN without positions."""
        series = self._series.get("position")
        if series is None:
            return self.values(""), self.values("")
        north, east = series.results()
        return north, east


class _Series:
    """One channel on the clock; a position has two components."""

    def __init__(self, stats: ChannelStats, at: FloatArray, start: int) -> None:
        self._stats, self._start, self._at = stats, start, at
        columns = 2 if stats.fields else 1
        gap = stats.gap_threshold_secs
        self._interpolators = [
            Interpolator(at, gap, hold=stats.hold is not None) for _ in range(columns)
        ]
        self._last: tuple[FloatArray, FloatArray] | None = None
        self._sum, self._begun, self.first = np.zeros(columns), False, 0.0
        self._changes = self._change_function()

    @property
    def is_geographic(self) -> bool:
        return self._stats.fields == GEOGRAPHIC

    def add(self, chunk: tuple[Channel, ...]) -> None:
        channel = self._stats.select(chunk)
        if channel is None or not len(channel):
            return
        rows = channel.values.reshape(len(channel), -1)[:, : len(self._interpolators)]
        valid = np.isfinite(rows).all(axis=1)
        if channel.fields == GEOGRAPHIC:
            valid &= (np.abs(rows) <= (90.0, 180.0)).all(axis=1) & rows.any(axis=1)
        rows, times = rows[valid], (channel.measured_ns[valid] - self._start) * 1e-9
        if not len(rows):
            return
        if not self._begun:
            self.first, self._begun = float(rows[0, 0]), True
        values = rows
        if self._changes:
            last_times, last_rows = self._last or (times[:1], rows[:1])
            joined = np.concatenate((last_rows, rows))
            steps = self._changes(np.concatenate((last_times, times)), joined)
            values = self._sum + np.cumsum(steps, axis=0)
            self._sum, self._last = values[-1], (times[-1:], rows[-1:])
        for interpolator, column in zip(self._interpolators, values.T, strict=True):
            interpolator.add(times, column)

    def results(self) -> tuple[FloatArray, ...]:
        first, last = ((t - self._start) * 1e-9 for t in self._stats.valid_span_ns)
        outside = (self._at < first - 1e-6) | (self._at > last + 1e-6)
        return tuple(np.where(outside, np.nan, each.result()) for each in self._interpolators)

    def _change_function(self) -> Callable[[FloatArray, FloatArray], FloatArray] | None:
        """Return the function that computes changes from sample to sample; None for values."""
        if self._stats.name == "yaw_rate":
            return _integrated
        if self._stats.name == "heading":
            full_turn = _full_turn(*self._stats.value_range)
            return lambda _, values: (
                (np.diff(values, axis=0) + full_turn / 2) % full_turn - (full_turn / 2)
            )
        return _local if self._stats.fields == GEOGRAPHIC else None


def _integrated(times: FloatArray, rates: FloatArray) -> FloatArray:
    """Change of the heading between samples of the yaw rate, by the trapezoidal rule."""
    return np.asarray(np.diff(times)[:, None] * (rates[1:] + rates[:-1]) / 2)


def _local(_: FloatArray, degrees: FloatArray) -> FloatArray:
    """Displacement north and east between fixes in degrees, m."""
    latitude, longitude = np.radians(degrees).T
    north = np.diff(latitude)
    east = (np.diff(longitude) + np.pi) % TURN - np.pi
    return EARTH_RADIUS * np.column_stack((north, east * np.cos(latitude[1:])))


def _full_turn(low: float, high: float) -> float:
    """Return the value at which a heading starts again, in the unit in which it was read.

    It is not 2 pi where the unit is wrong: rad read as deg, grad read as deg, deg read as rad.
    """
    if high - low <= np.radians(TURN) + 1e-6:
        return float(np.radians(TURN))
    if high > 2 * TURN or low < -2 * TURN:
        return 360.0
    return float(np.radians(400.0)) if high > TURN + 0.02 and low >= 0 else TURN
