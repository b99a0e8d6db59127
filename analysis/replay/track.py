"""The track of the ship, from recorded positions or by dead reckoning."""

from dataclasses import dataclass

import numpy as np

from analysis.signals.concat import concatenate
from shiplog import Channel
from shiplog.checks.channel_stats import ChannelStats
from shiplog.geodesy import LocalFrame, positions_of
from shiplog.resampling import Clock
from shiplog.types import FloatArray, Signals

MAX_COMPASS_GAP = 1 << 20  # instants; after a longer gap the yaw rate is integrated alone


@dataclass(frozen=True, eq=False)
class Track:
    """Positions relative to the first one.

    Attributes
    ----------
    time_secs
        (k,) s since the start of the signals.
    north, east
        (k,) m.
    """

    time_secs: FloatArray
    north: FloatArray
    east: FloatArray


EMPTY_TRACK = Track(np.zeros(0), np.zeros(0), np.zeros(0))


class RecordedTrack:
    """Computes the track from recorded positions, chunk by chunk.

    Parameters
    ----------
    start_ns
        The instant from which times count, ns since 1970-01-01 UTC.
    position
        The statistics of the position channel.

    Attributes
    ----------
    frame
        The local frame, whose datum is the first position; None before there is one.
    """

    def __init__(self, start_ns: int, position: ChannelStats) -> None:
        self._start_ns, self._position = start_ns, position
        self.frame: LocalFrame | None = None

    def step(self, chunk: tuple[Channel, ...]) -> Track:
        """Return the positions in a chunk of raw channels."""
        channel = self._position.select(chunk)
        if channel is None:
            return EMPTY_TRACK
        positions = positions_of(channel.fields, channel.values)
        self.frame = self.frame or LocalFrame.at_first(positions)
        if self.frame is None:
            return EMPTY_TRACK
        local, measured = self.frame.to_local(positions), positions.measured
        at = (channel.measured_ns[measured] - self._start_ns) * 1e-9
        return Track(at, local.north[measured], local.east[measured])


class Tracker:
    """Computes the track chunk by chunk, from recorded positions or else by dead reckoning.

    Dead reckoning uses heading and speed ahead. Where the log has no heading, or the compass has
    a gap, the yaw rate is integrated.

    Parameters
    ----------
    clock
        The clock of the signals.
    position
        The statistics of the position channel; None where the log has none.
    """

    def __init__(self, clock: Clock, position: ChannelStats | None) -> None:
        usable = position is not None and position.valid > 1
        self._recorded = RecordedTrack(clock.start_ns, position) if usable and position else None
        self._reckoning = _DeadReckoner(clock)
        self._fixes: list[Track] = []  # since the last step

    @property
    def origin(self) -> str:
        """How the track was obtained, in words; final once all chunks were given."""
        if self._recorded:
            return "recorded positions"
        source = "heading" if self._reckoning.by_compass else "yaw rate"
        return f"dead reckoning from {source} and speed"

    def add_raw(self, chunk: tuple[Channel, ...]) -> None:
        """Read the recorded positions from a chunk of raw channels."""
        if self._recorded:
            self._fixes.append(self._recorded.step(chunk))

    def step(self, chunk: Signals, yaw_rate: FloatArray, speed: FloatArray) -> Track:
        """Return the part of the track that has become known.

        Parameters
        ----------
        chunk
            The next signals, (n,) samples.
        yaw_rate
            (n,) rad/s, as estimated by the filter.
        speed
            (n,) m/s, as estimated by the filter.
        """
        if not self._recorded:
            return self._reckoning.step(chunk, yaw_rate, speed)
        fixes, self._fixes = self._fixes, []
        return concatenate([EMPTY_TRACK, *fixes])


class _DeadReckoner:
    """Dead reckoning in chunks; instants after the last heading wait for the next heading.

    After a gap of `MAX_COMPASS_GAP` they no longer wait: the yaw rate is integrated alone until
    there is a heading again.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock, self._compass = clock, "heading" in clock.channels
        self._waiting = np.zeros((0, 2))  # rows of the angle turned and the speed
        self._reckoned = 0  # instants so far
        self._turned, self._made_good = 0.0, np.zeros(2)  # running sums of rates and of speeds
        self._offsets = np.zeros((0, 2))  # rows of instant, heading minus the angle turned
        self._start: FloatArray | None = None

    @property
    def by_compass(self) -> bool:
        """Whether there was a heading so far."""
        return len(self._offsets) > 0

    def step(self, chunk: Signals, yaw_rate: FloatArray, speed: FloatArray) -> Track:
        """Return the track up to the last known heading."""
        dt, end = chunk.dt_secs, chunk.first + len(chunk)
        sums = np.cumsum(np.concatenate(([self._turned], yaw_rate)))[1:]
        self._turned, turned = float(sums[-1]), sums * dt
        self._waiting = np.concatenate((self._waiting, np.column_stack((turned, speed))))
        if self._compass:
            self._add_headings(chunk, turned)
        last = int(self._offsets[-1, 0]) if len(self._offsets) else -1
        waits = self._compass and end < self._clock.count and end - 1 - last <= MAX_COMPASS_GAP
        until = last + 1 if waits else end
        at = np.arange(self._reckoned, until)
        turned, speed = self._waiting[: len(at)].T
        self._waiting, self._reckoned = self._waiting[len(at) :], until
        heading = turned + np.interp(at, *self._offsets.T) if len(self._offsets) else turned
        self._offsets = self._offsets[-1:]
        steps = np.column_stack((speed * np.cos(heading), speed * np.sin(heading)))
        made_good = np.cumsum(np.vstack((self._made_good, steps)), axis=0)[1:]
        if not len(at):
            return EMPTY_TRACK
        self._made_good = made_good[-1]
        positions = made_good * dt
        self._start = positions[0] if self._start is None else self._start
        north, east = (positions - self._start).T
        return Track(at * dt, north, east)

    def _add_headings(self, chunk: Signals, turned: FloatArray) -> None:
        """Add the offset of each heading from the angle turned.

        Where two headings are further apart than `MAX_COMPASS_GAP`, the first offset is repeated
        just before the second, so that the offset is not interpolated across the gap.
        """
        known = np.flatnonzero(np.isfinite(chunk["heading"]))
        offsets = np.column_stack((known + chunk.first, chunk["heading"][known] - turned[known]))
        before = self._offsets if len(self._offsets) else np.array([[-1.0, 0.0]])
        rows = np.concatenate((before, offsets))
        before_gap = np.flatnonzero(np.diff(rows[:, 0]) > MAX_COMPASS_GAP)
        held = np.column_stack((rows[before_gap + 1, 0] - 1, rows[before_gap, 1]))
        rows = np.insert(rows, before_gap + 1, held, axis=0)
        self._offsets = rows[len(before) - len(self._offsets) :]
