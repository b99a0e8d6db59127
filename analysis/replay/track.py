"""Where the ship went."""

from dataclasses import dataclass

import numpy as np

from analysis.signals.concat import concatenate
from shiplog import Channel
from shiplog.checks.channel_stats import ChannelStats
from shiplog.resampling import Clock
from shiplog.types import FloatArray, Signals
from shiplog.units import GEOGRAPHIC

EARTH_RADIUS = 6_371_008.8  # m, mean
BRIDGED = 1 << 20  # instants of a compass's silence; beyond, the gyro goes on from its last word


@dataclass(frozen=True, eq=False)
class Track:
    """Positions in m from the first one."""

    time_secs: FloatArray  # (k,) since the signals' start
    north: FloatArray  # (k,)
    east: FloatArray  # (k,)


NOWHERE = Track(np.zeros(0), np.zeros(0), np.zeros(0))


class Tracker:
    """Follows the ship in chunks: the positions recorded, or else dead reckoning.

    The latter is from heading and speed ahead; where there is no heading the yaw rate is
    integrated, which also bridges where the compass was silent.
    """

    def __init__(self, clock: Clock, position: ChannelStats | None) -> None:
        self._recorded = position if position is not None and position.valid > 1 else None
        self._start_ns, self._reckoning = clock.start_ns, _DeadReckoner(clock)
        self._fixes: list[Track] = []  # since the last step
        self._datum: FloatArray | None = None  # the first position

    @property
    def origin(self) -> str:
        """How the track is known, in words, once it all is."""
        if self._recorded:
            return "positions recorded"
        heading = "heading" if self._reckoning.by_compass else "yaw rate"
        return f"dead reckoning from {heading} and speed ahead"

    def add_raw(self, chunk: tuple[Channel, ...]) -> None:
        """Look at the samples themselves for the positions recorded."""
        channel = self._recorded.select(chunk) if self._recorded else None
        if channel is None:
            return
        known = np.isfinite(channel.values).all(axis=1)
        if known.any():
            at = (channel.measured_ns[known] - self._start_ns) * 1e-9
            north, east = self._in_metres(channel, channel.values[known, :2]).T
            self._fixes.append(Track(at, north, east))

    def step(self, chunk: Signals, yaw_rate: FloatArray, speed: FloatArray) -> Track:
        """The track as far as it is known by now; the filter's rates on the chunk, (n,)."""
        if not self._recorded:
            return self._reckoning.step(chunk, yaw_rate, speed)
        fixes, self._fixes = self._fixes, []
        return concatenate([NOWHERE, *fixes])

    def _in_metres(self, channel: Channel, positions: FloatArray) -> FloatArray:
        """North and east of the first position, (n, 2)."""
        if self._datum is None:
            self._datum = positions[0]
        if channel.fields != GEOGRAPHIC:
            return positions - self._datum
        per_radian = np.array([EARTH_RADIUS, EARTH_RADIUS * np.cos(np.radians(self._datum[0]))])
        return np.asarray(np.radians(positions) * per_radian - np.radians(self._datum) * per_radian)


class _DeadReckoner:
    """Dead reckoning in chunks; what follows the last heading known waits for the next.

    It does not wait for ever: after a silence of `BRIDGED` the compass is taken for lost, and the
    gyro goes on alone until there is a heading again.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock, self._compass = clock, "heading" in clock.channels
        self._waiting = np.zeros((0, 2))  # rows of how far she turned and of her speed
        self._reckoned = 0  # instants
        self._turned, self._made_good = 0.0, np.zeros(2)  # running sums of rates and of speeds
        self._off = np.zeros((0, 2))  # rows of instant, heading less what was turned until then
        self._start: FloatArray | None = None

    @property
    def by_compass(self) -> bool:
        """Whether there was a heading."""
        return len(self._off) > 0

    def step(self, chunk: Signals, yaw_rate: FloatArray, speed: FloatArray) -> Track:
        """The track as far as the heading is known by now."""
        dt, end = chunk.dt_secs, chunk.first + len(chunk)
        sums = np.cumsum(np.concatenate(([self._turned], yaw_rate)))[1:]
        self._turned, turned = float(sums[-1]), sums * dt
        self._waiting = np.concatenate((self._waiting, np.column_stack((turned, speed))))
        if self._compass:
            self._look_at_compass(chunk, turned)
        last = int(self._off[-1, 0]) if len(self._off) else -1
        waits = self._compass and end < self._clock.count and end - 1 - last <= BRIDGED
        until = last + 1 if waits else end
        at = np.arange(self._reckoned, until)
        turned, speed = self._waiting[: len(at)].T
        self._waiting, self._reckoned = self._waiting[len(at) :], until
        heading = turned + np.interp(at, *self._off.T) if len(self._off) else turned
        self._off = self._off[-1:]
        steps = np.column_stack((speed * np.cos(heading), speed * np.sin(heading)))
        made_good = np.cumsum(np.vstack((self._made_good, steps)), axis=0)[1:]
        if not len(at):
            return NOWHERE
        self._made_good = made_good[-1]
        positions = made_good * dt
        self._start = positions[0] if self._start is None else self._start
        north, east = (positions - self._start).T
        return Track(at * dt, north, east)

    def _look_at_compass(self, chunk: Signals, turned: FloatArray) -> None:
        """Add how far off each heading is from what was turned.

        Where two are further apart than is bridged, the first is said again just before the
        second, so that what lies between them is not led from one to the other.
        """
        known = np.flatnonzero(np.isfinite(chunk["heading"]))
        off = np.column_stack((known + chunk.first, chunk["heading"][known] - turned[known]))
        before = self._off if len(self._off) else np.array([[-1.0, 0.0]])
        rows = np.concatenate((before, off))
        lost = np.flatnonzero(np.diff(rows[:, 0]) > BRIDGED)
        held = np.column_stack((rows[lost + 1, 0] - 1, rows[lost, 1]))
        rows = np.insert(rows, lost + 1, held, axis=0)
        self._off = rows[len(before) - len(self._off) :]
