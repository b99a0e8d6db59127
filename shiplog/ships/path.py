"""What a ship was given, from samples: steps on which the rudder moves evenly."""

from itertools import pairwise
from math import ceil, floor

import numpy as np

from shiplog.types import FloatArray, Signals

from .motion import InputPath

LONGEST_SECS = 2.0  # of a step: the fastest thing in a ship takes several
JOINED_SECS = 0.5  # of a step over several samples: what lies between its ends is interpolated
STRAIGHT = 1e-6  # of the greatest slope: two that differ by less are one line

_Step = tuple[int, int, float, float, float]  # first interval, samples, length, rudder, its slope


def input_path(signals: Signals) -> InputPath:
    """The path of a rudder and of revolutions that are known at every instant.

    Between samples the rudder moves evenly, the revolutions stay. Where the rudder goes in
    straight lines, as an ideal gear's does, its knots are put back to where the lines meet: left on
    the samples they bias what is fitted to clean data by per cents. Intervals of one line are
    joined to one step, as long as it stays short.
    """
    dt, delta, rpm = signals.dt_secs, signals["rudder"], signals["rpm"]
    knots = _knots(delta, dt)
    rows: list[_Step] = []
    k = 0
    for end in _joined(delta, rpm, dt, set(knots)):
        rows += _interval(k, end - k, float(delta[k]), float(delta[end]), knots.get(k), dt)
        k = end
    first, count = (np.array([row[i] for row in rows], np.int64) for i in (0, 1))
    secs, begins, slopes = (np.array([row[i] for row in rows]) for i in (2, 3, 4))
    return InputPath(
        secs, begins, slopes, rpm[first], np.where(count > 0, first + count, -1), count
    )


def path_part(path: InputPath, start: int, stop: int) -> InputPath:
    """The steps from `start` to before `stop`, samples counted from the one they begin at."""
    cut, before = slice(start, stop), path.sample[:start]
    first = int(before.max(initial=0))
    sample = np.where(path.sample[cut] >= 0, path.sample[cut] - first, -1)
    return InputPath(
        path.secs[cut], path.delta[cut], path.delta_dot[cut], path.rpm[cut], sample,
        path.samples[cut],
    )  # fmt: skip


def _joined(delta: FloatArray, rpm: FloatArray, dt: float, knots: set[int]) -> list[int]:
    """Where the steps end, by the number of the sample."""
    slope = np.diff(delta) / dt
    tolerance = STRAIGHT * np.abs(slope).max(initial=0.0)
    bends = np.flatnonzero((np.abs(np.diff(slope)) > tolerance) | (np.diff(rpm[:-1]) != 0)) + 1
    edges = {0, len(slope), *bends.tolist(), *knots, *(k + 1 for k in knots)}
    corners = sorted(edges)
    longest = max(1, floor(JOINED_SECS / dt + 1e-9))
    ends = []
    for start, stop in pairwise(corners):
        ends += [*range(start + longest, stop, longest), stop]
    return ends


def _interval(
    k: int, count: int, begin: float, end: float, knot: tuple[float, float] | None, dt: float
) -> list[_Step]:
    """The steps of some intervals of one line, or of one with a knot in it."""
    if knot is None:
        return _straight(k, count, begin, end, dt * count)
    after, there = knot
    return [*_straight(k, 0, begin, there, after), *_straight(k, 1, there, end, dt - after)]


def _straight(k: int, count: int, begin: float, end: float, secs: float) -> list[_Step]:
    """The steps of a straight line, at whose end there are samples, or none."""
    parts = max(1, ceil(secs / LONGEST_SECS))
    slope, length = (end - begin) / secs, secs / parts
    return [
        (k, count if i == parts - 1 else 0, length, begin + slope * length * i, slope)
        for i in range(parts)
    ]


def _knots(delta: FloatArray, dt: float) -> dict[int, tuple[float, float]]:
    """By interval: how long after its beginning two lines meet in it, and at which rudder."""
    slope = np.diff(delta) / dt
    if len(slope) < 5:
        return {}
    before, into = slope[:-4], slope[1:-3]
    within, out, beyond = slope[2:-2], slope[3:-1], slope[4:]
    tolerance = STRAIGHT * np.abs(slope).max()
    straight = (np.abs(into - before) < tolerance) & (np.abs(beyond - out) < tolerance)
    bends = (np.minimum(into, out) + tolerance < within) & (
        within < np.maximum(into, out) - tolerance
    )
    found = {}
    for k in (np.flatnonzero(straight & bends) + 2).tolist():
        first, last = float(slope[k - 1]), float(slope[k + 1])
        after = (float(delta[k + 1] - delta[k]) - last * dt) / (first - last)
        found[k] = (after, float(delta[k]) + first * after)
    return found
