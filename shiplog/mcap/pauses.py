"""Pauses of all channels at once: a pause of the recorder, or its clock set forward."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, pi, remainder

import numpy as np

from shiplog.geodesy import LocalFrame, positions_of
from shiplog.types import Channel, TimeArray

from .clock_steps import MAX_INTERVAL_SPREAD, sampling_interval
from .forward_steps import MIN_FORWARD_NS, MIN_PAUSE_INTERVALS

MAX_PAUSES = 64  # of a log, the longest ones, that are reported
INTERVAL_SAMPLES = 4096  # of each channel, for its sampling interval
MIN_STEADY_SAMPLES = 8  # of a channel with a sampling interval
MAX_LIMIT_NS = 30 * 10**9  # of a longer gap, the interval of the slowest channels is not asked
MAX_NOISE_METRES = 10.0  # of the distance between two fixes
MAX_NOISE_DEG = 3.0  # of the difference between two headings
MIN_EVIDENCE_METRES = 50.0  # that the ship makes in a pause, to show by its fixes if it was one
_HOUR_NS = 3600 * 10**9
_SECOND_NS = 1e9
_MOTION = ("position", "heading", "yaw_rate", "speed")

_Key = tuple[str, tuple[str, ...]]


@dataclass(frozen=True)
class _Sample:
    """One sample of a channel, with its times in ns."""

    name: str
    fields: tuple[str, ...]
    received_ns: int
    measured_ns: int
    values: tuple[float, ...]


@dataclass
class _Pause:
    """A gap in the times of reception of all channels, and the samples beside it by channel."""

    start_ns: int
    end_ns: int
    before: Mapping[_Key, _Sample]
    after: dict[_Key, _Sample] = field(default_factory=dict)

    @property
    def measured_span(self) -> tuple[int, int]:
        """The last measured time before and the first one after the pause, ns."""
        return (
            max(sample.measured_ns for sample in self.before.values()),
            min(sample.measured_ns for sample in self.after.values()),
        )

    def is_common(self, limit: float) -> bool:
        """Whether it is longer than a limit, and two channels have samples that near to it."""
        first, last = self.measured_span
        beside = [
            key
            for key, sample in self.before.items()
            if key in self.after
            and self.start_ns - sample.received_ns <= limit
            and self.after[key].received_ns - self.end_ns <= limit
        ]
        return min(last - first, self.end_ns - self.start_ns) > limit and len(beside) > 1


@dataclass
class Pauses:
    """The pauses of a log so far; where it is cut to chunks changes nothing.

    A step forward of a recorder's clock cannot be distinguished from a pause by times alone. The
    motion of the ship shows how much time has passed.
    """

    _start_ns: int | None = None
    _latest_ns: int = 0
    _last: dict[_Key, _Sample] = field(default_factory=dict)
    _first_times: dict[_Key, TimeArray] = field(default_factory=dict)
    _found: list[_Pause] = field(default_factory=list)

    def add(self, channels: Iterable[Channel]) -> None:
        """Find the pauses in the next samples, which are sorted by reception."""
        channels = [channel for channel in channels if len(channel)]
        if not channels:
            return
        times = np.concatenate([channel.received_ns for channel in channels])
        times.sort(kind="stable")
        if self._start_ns is None:
            self._start_ns = self._latest_ns = int(times[0])
        latest = np.maximum.accumulate(np.concatenate([[self._latest_ns], times]))
        gaps = times - latest[:-1]
        rows = np.flatnonzero(gaps > MIN_FORWARD_NS)
        for row in rows[np.argsort(-gaps[rows], kind="stable")[:MAX_PAUSES]]:
            end_ns = int(times[row])
            self._found.append(_Pause(int(latest[row]), end_ns, self._before(channels, end_ns)))
        for pause in self._found:
            for channel in channels:
                row = int(np.searchsorted(channel.received_ns, pause.end_ns))
                if row < len(channel):
                    pause.after.setdefault(channel.key, _sample(channel, row))
        self._found.sort(key=lambda pause: (pause.start_ns - pause.end_ns, pause.start_ns))
        del self._found[MAX_PAUSES:]
        self._latest_ns = int(latest[-1])
        for channel in channels:
            self._last[channel.key] = _sample(channel, -1)
            first = self._first_times.get(channel.key, channel.received_ns[:0])
            if len(first) < INTERVAL_SAMPLES:
                more = channel.received_ns[: INTERVAL_SAMPLES - len(first)]
                self._first_times[channel.key] = np.concatenate([first, more])

    def warnings(self) -> list[str]:
        """Report the pauses so far, with what the motion of the ship shows about them."""
        intervals = self._steady_intervals()
        if len(intervals) < 2 or self._start_ns is None:
            return []
        limit = min(
            MIN_PAUSE_INTERVALS * intervals[-1],
            max(MIN_PAUSE_INTERVALS * intervals[1], MAX_LIMIT_NS),
        )
        texts = []
        for pause in sorted(self._found, key=lambda pause: pause.start_ns):
            first, last = pause.measured_span
            if pause.is_common(limit):
                size = last - first - intervals[0]
                start = (pause.start_ns - self._start_ns) / _SECOND_NS
                texts.append(
                    f"times: all channels have no samples for {size / _SECOND_NS:.1f} s, "
                    f"{start:.1f} s after the start; {_cause(pause, size)}"
                )
        return texts

    def _before(self, channels: Sequence[Channel], end_ns: int) -> dict[_Key, _Sample]:
        """Return the last sample of each channel before a time of reception."""
        samples = dict(self._last)
        for channel in channels:
            row = int(np.searchsorted(channel.received_ns, end_ns))
            if row:
                samples[channel.key] = _sample(channel, row - 1)
        return samples

    def _steady_intervals(self) -> list[float]:
        """Return the sampling intervals of the channels of steady rate, the shortest first, ns."""
        intervals = []
        for times in self._first_times.values():
            interval, spread = sampling_interval(times)
            if len(times) > MIN_STEADY_SAMPLES and spread < MAX_INTERVAL_SPREAD * interval:
                intervals.append(interval)
        return sorted(intervals)


def _sample(channel: Channel, row: int) -> _Sample:
    values = np.atleast_1d(channel.values[row]).tolist() if channel.name in _MOTION else ()
    received, measured = int(channel.received_ns[row]), int(channel.measured_ns[row])
    return _Sample(channel.name, channel.fields, received, measured, tuple(values))


def _cause(pause: _Pause, size: float) -> str:
    """State what a pause of a size in ns can be due to, and how to proceed."""
    hours = round(size / _HOUR_NS)
    is_whole = hours > 0 and abs(size - hours * _HOUR_NS) < MIN_FORWARD_NS
    whole = ", a whole number of hours as after a change of the time zone" if is_whole else ""
    remedy = (
        "times were not changed; if the clock was set, evaluate the parts before and after "
        "separately"
    )
    moved = _motion(pause)
    if moved is None:
        return f"the recorder paused, or its clock was set forward{whole}: {remedy}"
    distance, speed, has_passed = moved
    if has_passed:
        return f"the recorder paused, as the ship moved {distance:.0f} m meanwhile"
    return (
        f"as the ship, at {speed:.1f} m/s, moved only {distance:.0f} m and kept its heading, the "
        f"clock of the recorder was probably set forward{whole}, less likely it paused: {remedy}"
    )


def _motion(pause: _Pause) -> tuple[float, float, bool] | None:
    """Return the distance made in a pause, the speed, and whether time has passed in it.

    None where the fixes do not show it: the ship lies still, or is in between, or has no fixes.
    """
    both = {
        key: (sample, pause.after[key])
        for key, sample in pause.before.items()
        if key in pause.after
        and np.all(np.isfinite([*sample.values[:2], *pause.after[key].values[:2]]))
    }
    named = {one.name: (one, other) for one, other in reversed(both.values())}
    if "position" not in named or "speed" not in named:
        return None
    one, other = named["position"]
    distance = _distance(one, other)
    speed = float(np.mean([abs(sample.values[0]) for sample in named["speed"]]))
    secs = (other.measured_ns - one.measured_ns) / _SECOND_NS
    first, last = pause.measured_span
    rest = max(secs - (last - first) / _SECOND_NS, 0.0)  # of the interval between the fixes
    still = MAX_NOISE_METRES + speed * 2 * (rest + 1.0)
    way = speed * secs
    if way < MIN_EVIDENCE_METRES + 5 * still or not 0.0 < distance < 1.5 * way:
        return None
    if distance > 2 * still + 0.3 * way:
        return distance, speed, True
    return (distance, speed, False) if distance < still and _kept_heading(named) else None


def _distance(one: _Sample, other: _Sample) -> float:
    """Return the distance between two positions of one kind, m."""
    positions = positions_of(one.fields, np.array([one.values, other.values]))
    frame = LocalFrame.at_first(positions)
    if frame is None:
        return 0.0
    north, east = frame.north_east(positions)[1]
    return hypot(north, east)


def _kept_heading(named: Mapping[str, tuple[_Sample, _Sample]]) -> bool:
    """Whether the heading after a pause is the one before, but for a turn of some seconds."""
    if "heading" not in named:
        return False
    change = abs(remainder(named["heading"][1].values[0] - named["heading"][0].values[0], 2 * pi))
    turn = max((abs(s.values[0]) for s in named.get("yaw_rate", ())), default=0.0)
    return bool(change < np.radians(MAX_NOISE_DEG) + 3.0 * turn)
