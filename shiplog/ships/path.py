"""What a ship was given, from samples: steps on which the rudder moves evenly."""

from math import ceil

import numpy as np

from shiplog.types import FloatArray, Signals

from .motion import Path

LONGEST_SECS = 2.0  # of a step: the fastest thing in a ship takes several
STRAIGHT = 1e-6  # of the greatest slope: two that differ by less are one line


def path_of(signals: Signals) -> Path:
    """The path of a rudder and of revolutions that are known at every instant.

    Between samples the rudder moves evenly, the revolutions stay. Where the rudder goes in
    straight lines, as an ideal gear's does, its knots are put back to where the lines meet: left on
    the samples they bias what is fitted to clean data by per cents.
    """
    dt, delta = signals.dt_secs, signals["rudder"]
    knots = _knots(delta, dt)
    parts = max(1, ceil(dt / LONGEST_SECS))
    rows = [
        row
        for k in range(len(delta) - 1)
        for row in _interval(k, float(delta[k]), float(delta[k + 1]), knots.get(k), dt, parts)
    ]
    at = np.array([row[0] for row in rows], np.int64)
    secs, begins, slopes = (np.array([row[i] for row in rows]) for i in (1, 2, 3))
    ends = np.append(at[1:] != at[:-1], True)
    return Path(secs, begins, slopes, signals["rpm"][at], np.where(ends, at + 1, -1))


def _interval(
    k: int, begin: float, end: float, knot: tuple[float, float] | None, dt: float, parts: int
) -> list[tuple[int, float, float, float]]:
    """The steps of an interval: its number, and each one's length, first rudder and slope."""
    if knot is None:
        slope = (end - begin) / dt
        return [(k, dt / parts, begin + slope * dt * i / parts, slope) for i in range(parts)]
    after, there = knot
    return [
        row
        for length, first, last in ((after, begin, there), (dt - after, there, end))
        for row in _interval(k, first, last, None, length, ceil(length / LONGEST_SECS))
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
