"""The channels of a log on one coarse clock, gathered chunk by chunk, for comparisons."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.interpolate import Interpolator
from shiplog.geodesy.local_frame import LocalFrame
from shiplog.geodesy.positions import positions_of
from shiplog.types import Channel, FloatArray

MIN_STEP_SECS = 0.1
MIN_INSTANTS = 300  # of a log so short that its times may have a wrong unit
MAX_INSTANTS = 50_000
MIN_SAMPLES = 24  # of a channel that is compared with others
COURSE_WINDOW_SECS = 10.0  # over which the course of the fixes is measured
TURN = 2 * np.pi
COMPARED_CHANNELS = ("yaw_rate", "heading", "position", "speed", "rudder", "rpm")


@dataclass(frozen=True, eq=False)
class CoarseSignals:
    """The channels of a log on one clock; NaN where a channel is not known.

    Attributes
    ----------
    dt_secs
        Step of the clock.
    yaw
        (n,) integrated yaw rate, rad, from an arbitrary zero.
    heading
        (n,) heading without jumps at full turns, rad.
    north, east
        (n,) position of the fixes, m.
    course
        (n,) course of the fixes without jumps, rad; NaN where the ship hardly moves.
    speed, rudder, rpm
        (n,) m/s, rad and rpm.
    topics
        The topic of each channel, by name.
    datum
        Latitude and longitude of the first fix as read, deg; None where positions are local.
    """

    dt_secs: float
    yaw: FloatArray
    heading: FloatArray
    north: FloatArray
    east: FloatArray
    course: FloatArray
    speed: FloatArray
    rudder: FloatArray
    rpm: FloatArray
    topics: Mapping[str, str]
    datum: tuple[float, float] | None

    @property
    def swing(self) -> float:
        """How far the ship turned between its extreme headings, rad; 0 where it is not known."""
        known = (x[np.isfinite(x)] for x in (self.yaw, self.heading))
        return max((float(np.ptp(x)) for x in known if len(x)), default=0.0)


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
        at = np.arange(int(span / self.dt_secs) + 1) * self.dt_secs if span > 0 else np.zeros(1)
        self._count = len(at)
        for name in COMPARED_CHANNELS:
            channel = stats.get(name)
            if channel is not None and channel.valid >= (1 if channel.hold else MIN_SAMPLES):
                self._series[name] = _Series(channel, at, start)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        for series in self._series.values():
            series.add(chunk)

    def result(self) -> CoarseSignals:
        """Return the channels at all instants, once all samples were added."""
        values = {
            name: self._series[name].result() if name in self._series else self._unknown(name)
            for name in COMPARED_CHANNELS
        }
        frame = self._series["position"].frame if "position" in self._series else None
        north, east = values["position"].T
        return CoarseSignals(
            dt_secs=self.dt_secs,
            yaw=values["yaw_rate"][:, 0],
            heading=values["heading"][:, 0],
            north=north,
            east=east,
            course=_course(self.dt_secs, north, east),
            speed=values["speed"][:, 0],
            rudder=values["rudder"][:, 0],
            rpm=values["rpm"][:, 0],
            topics={name: series.stats.topic for name, series in self._series.items()},
            datum=frame.datum if frame is not None and frame.geographic else None,
        )

    def _unknown(self, name: str) -> FloatArray:
        return np.full((self._count, 2 if name == "position" else 1), np.nan)


class _Series:
    """One channel on the clock; a position has two components."""

    def __init__(self, stats: ChannelStats, at: FloatArray, start: int) -> None:
        self.stats, self._start, self._at = stats, start, at
        columns = 2 if stats.fields else 1
        self._hold = stats.hold is not None
        self._gap_secs = stats.gap_threshold_secs  # infinite where it is held
        self._interpolators = [
            Interpolator(at, self._gap_secs, hold=self._hold) for _ in range(columns)
        ]
        self._after_gap = np.zeros(len(at) + 1, bool)
        self.frame: LocalFrame | None = None
        self._last: tuple[FloatArray, FloatArray] | None = None
        self._accumulated = np.zeros(columns)
        self._changes = self._change_function()

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        channel = self.stats.select(chunk)
        if channel is None or not len(channel):
            return
        rows = self._rows(channel)
        valid = np.isfinite(rows).all(axis=1)
        rows, times = rows[valid], (channel.measured_ns[valid] - self._start) * 1e-9
        if not len(rows):
            return
        if self._last is None and self.stats.name == "heading":
            self._accumulated = rows[0]  # the heading keeps its zero
        last_times, last_rows = self._last or (times[:1], rows[:1])
        self._last = times[-1:], rows[-1:]
        joined = np.concatenate((last_times, times))
        in_gap = np.diff(joined) > self._gap_secs
        self._after_gap[np.searchsorted(self._at, times[in_gap])] = True
        if self._changes:
            steps = self._changes(joined, np.concatenate((last_rows, rows)))
            rows = self._accumulated + np.cumsum(steps, axis=0)
            self._accumulated = rows[-1]
        for interpolator, column in zip(self._interpolators, rows.T, strict=True):
            interpolator.add(times, column)

    def result(self) -> FloatArray:
        """Return the values at the instants, (n, k).

        The instant after a gap is NaN even if the gap lies between two instants. A channel that is
        held between its samples has no gaps, and no end before that of the log.
        """
        first, last = ((t - self._start) * 1e-9 for t in self.stats.valid_span_ns)
        end = np.inf if self._hold else last + 1e-6
        unknown = (self._at < first - 1e-6) | (self._at > end) | self._after_gap[:-1]
        values = np.column_stack([each.result() for each in self._interpolators])
        return np.where(unknown[:, None], np.nan, values)

    def _rows(self, channel: Channel) -> FloatArray:
        """Return the samples, (m, k); of a position north and east of the first fix."""
        if not self.stats.fields:
            return channel.values[:, None]
        positions = positions_of(channel.fields, channel.values)
        self.frame = self.frame or LocalFrame.at_first(positions)
        if self.frame is None:
            return np.full((len(channel), 2), np.nan)
        return self.frame.north_east(positions)

    def _change_function(self) -> Callable[[FloatArray, FloatArray], FloatArray] | None:
        """Return the function that computes changes from sample to sample; None for values."""
        if self.stats.name == "yaw_rate":
            return _integrated
        if self.stats.name != "heading":
            return None
        full_turn = _full_turn(*self.stats.value_range)
        return lambda _, values: (
            (np.diff(values, axis=0) + full_turn / 2) % full_turn - full_turn / 2
        )


def _integrated(times: FloatArray, rates: FloatArray) -> FloatArray:
    """Change of the heading between samples of the yaw rate, by the trapezoidal rule."""
    return np.asarray(np.diff(times)[:, None] * (rates[1:] + rates[:-1]) / 2)


def _full_turn(low: float, high: float) -> float:
    """Return the value at which a heading starts again, in the unit in which it was read.

    It is not 2 pi where the unit is wrong: rad read as deg, grad read as deg, deg read as rad.
    """
    if high - low <= np.radians(TURN) + 1e-6:
        return float(np.radians(TURN))
    if high > 2 * TURN or low < -2 * TURN:
        return 360.0
    return float(np.radians(400.0)) if high > TURN + 0.02 and low >= 0 else TURN


def _course(dt: float, north: FloatArray, east: FloatArray) -> FloatArray:
    """Return the continuous course over ground, rad, (n,); NaN where the ship hardly moves."""
    course = np.full_like(north, np.nan)
    n = max(round(COURSE_WINDOW_SECS / dt / 2), 1) if dt else 1
    if len(north) <= 4 * n:
        return course
    dn, de = north[2 * n :] - north[: -2 * n], east[2 * n :] - east[: -2 * n]
    moved = np.hypot(dn, de)
    if not np.isfinite(moved).any():
        return course
    known = moved > max(0.3 * float(np.nanmedian(moved)), 1e-3)
    angle = np.full_like(dn, np.nan)
    angle[known] = np.unwrap(np.arctan2(de[known], dn[known]))
    course[n:-n] = angle
    return course
