"""Inputs of a run from samples, as steps on which the rudder moves at a constant rate."""

from itertools import pairwise
from math import ceil, floor

import numpy as np

from shiplog.types import FloatArray, Signals

from .motion import InputPath

MAX_STEP_SECS = 2.0  # a ship's fastest motion takes several
MAX_JOINED_SECS = 0.5  # of a step over several samples, between whose ends is interpolated
SLOPE_TOLERANCE = 1e-6  # of the greatest slope: two that differ by less are one line

_Step = tuple[int, int, float, float, float]  # first interval, samples, length, rudder, its slope


def input_path(signals: Signals) -> InputPath:
    """Make the steps of a run from its rudder and revolutions.

    Between samples the rudder is linear and the revolutions are constant. Where the rudder moves in
    straight lines, as an ideal steering gear's does, its knots are placed where the lines
    intersect: knots on the samples would bias a fit to clean data by per cents. Intervals of one
    line are joined to one step of at most `MAX_JOINED_SECS`.

    Parameters
    ----------
    signals
        Signals with the channels ``rudder`` and ``rpm``, without NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from shiplog import Signals
    >>> ramp = {"rudder": np.array([0.0, 0.1, 0.2]), "rpm": np.full(3, 80.0)}
    >>> input_path(Signals(0, 1.0, ramp)).delta_dot.round(3).tolist()
    [0.1, 0.1]
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
    """Return the steps `start` to `stop`, exclusive; samples are counted from their first."""
    cut, before = slice(start, stop), path.sample[:start]
    first = int(before.max(initial=0))
    sample = np.where(path.sample[cut] >= 0, path.sample[cut] - first, -1)
    return InputPath(
        path.secs[cut], path.delta[cut], path.delta_dot[cut], path.rpm[cut], sample,
        path.samples[cut],
    )  # fmt: skip


def _joined(delta: FloatArray, rpm: FloatArray, dt: float, knots: set[int]) -> list[int]:
    """List the samples at which steps end."""
    slope = np.diff(delta) / dt
    tolerance = SLOPE_TOLERANCE * np.abs(slope).max(initial=0.0)
    bends = np.flatnonzero((np.abs(np.diff(slope)) > tolerance) | (np.diff(rpm[:-1]) != 0)) + 1
    edges = {0, len(slope), *bends.tolist(), *knots, *(k + 1 for k in knots)}
    corners = sorted(edges)
    longest = max(1, floor(MAX_JOINED_SECS / dt + 1e-9))
    ends = []
    for start, stop in pairwise(corners):
        ends += [*range(start + longest, stop, longest), stop]
    return ends


def _interval(
    k: int, count: int, begin: float, end: float, knot: tuple[float, float] | None, dt: float
) -> list[_Step]:
    """Make the steps of some intervals of one line, or of one interval with a knot in it."""
    if knot is None:
        return _straight(k, count, begin, end, dt * count)
    after, angle = knot
    return [*_straight(k, 0, begin, angle, after), *_straight(k, 1, angle, end, dt - after)]


def _straight(k: int, count: int, begin: float, end: float, secs: float) -> list[_Step]:
    """Make the steps of a straight line; `count` samples lie in it."""
    parts = max(1, ceil(secs / MAX_STEP_SECS))
    slope, length = (end - begin) / secs, secs / parts
    return [
        (k, count if i == parts - 1 else 0, length, begin + slope * length * i, slope)
        for i in range(parts)
    ]


def _knots(delta: FloatArray, dt: float) -> dict[int, tuple[float, float]]:
    """Map an interval to the intersection of two lines in it: time after its start, rudder."""
    slope = np.diff(delta) / dt
    if len(slope) < 5:
        return {}
    before, into = slope[:-4], slope[1:-3]
    within, out, beyond = slope[2:-2], slope[3:-1], slope[4:]
    tolerance = SLOPE_TOLERANCE * np.abs(slope).max()
    straight = (np.abs(into - before) < tolerance) & (np.abs(beyond - out) < tolerance)
    bends = (np.minimum(into, out) + tolerance < within) & (
        within < np.maximum(into, out) - tolerance
    )
    knots = {}
    for k in (np.flatnonzero(straight & bends) + 2).tolist():
        first, last = float(slope[k - 1]), float(slope[k + 1])
        after = (float(delta[k + 1] - delta[k]) - last * dt) / (first - last)
        knots[k] = (after, float(delta[k]) + first * after)
    return knots
