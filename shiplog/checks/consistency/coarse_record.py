"""The channels of a log on one coarse clock, gathered chunk by chunk, for comparisons."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_on_clock import ChannelOnClock, Transform, Unwrapped
from shiplog.checks.channel_stats import ChannelStats, LogStats
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
        self._channels: dict[str, ChannelOnClock] = {}
        start, end = stats.span_ns
        span = (end - start) * 1e-9
        step_secs = max(min(MIN_STEP_SECS, span / MIN_INSTANTS), span / MAX_INSTANTS)
        self.dt_secs = step_secs if span > 0 else 0.0
        at = np.arange(int(span / self.dt_secs) + 1) * self.dt_secs if span > 0 else np.zeros(1)
        self._count = len(at)
        for name in COMPARED_CHANNELS:
            channel = stats.get(name)
            if channel is not None and channel.valid >= (1 if channel.hold else MIN_SAMPLES):
                self._channels[name] = ChannelOnClock(channel, at, start, _transform(channel))

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        for channel in self._channels.values():
            channel.add(chunk)

    def result(self) -> CoarseSignals:
        """Return the channels at all instants, once all samples were added."""
        values = {name: self._values(name) for name in COMPARED_CHANNELS}
        frame = self._channels["position"].frame if "position" in self._channels else None
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
            topics={name: each.stats.topic for name, each in self._channels.items()},
            datum=frame.datum if frame is not None and frame.geographic else None,
        )

    def _values(self, name: str) -> FloatArray:
        """Return the values of a channel, (n, k); all NaN where it is not compared."""
        channel = self._channels.get(name)
        if channel is None:
            return np.full((self._count, 2 if name == "position" else 1), np.nan)
        return np.where(channel.after_gap[:, None], np.nan, channel.result())


class Integrated:
    """The integral of a rate by the trapezoidal rule, from samples that come in chunks.

    Examples
    --------
    >>> integrated = Integrated()
    >>> integrated(np.array([0.0, 2.0]), np.array([[1.0], [3.0]])).ravel().tolist()
    [0.0, 4.0]
    """

    def __init__(self) -> None:
        self._last: tuple[FloatArray, FloatArray] | None = None
        self._sum: FloatArray = np.zeros(1)

    def __call__(self, times: FloatArray, rates: FloatArray) -> FloatArray:
        """Return the integral at the next times, (m, 1), from zero at the first one."""
        last_time, last_rate = self._last or (times[:1], rates[:1])
        dt, rate = np.diff(times, prepend=last_time), np.concatenate((last_rate, rates))
        steps = dt[:, None] * (rate[1:] + rate[:-1]) / 2
        integral = np.cumsum(np.concatenate((self._sum[None], steps)), axis=0)[1:]
        self._last, self._sum = (times[-1:], rates[-1:]), integral[-1]
        return np.asarray(integral)


def _transform(stats: ChannelStats) -> Transform | None:
    """Return what makes an angle without jumps of a channel; None for the values themselves."""
    if stats.name == "yaw_rate":
        return Integrated()
    return Unwrapped(_full_turn(*stats.value_range)) if stats.name == "heading" else None


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
