"""Straight runs at constant revolutions, and the double runs of a speed trial among them."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import pi, radians

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .sailed_manoeuvre import ManoeuvreKind
from .trial_signals import TrialSignals

MIN_STRAIGHT_SECS = 240.0
MAX_HEADING_RANGE = radians(4.0)  # within `BLOCK_SECS`
MAX_RUDDER = radians(3.0)
BLOCK_SECS = 30.0
MIN_SPEED = 0.5  # m/s
MAX_SPEED_RANGE = 0.06  # of the mean, over a run
MIN_DOUBLE_SECS = 120.0
SAME_RPM = 0.03
OPPOSITE = radians(15.0)  # from reciprocal headings


def find_straight_runs(
    signals: TrialSignals, others: Sequence[FoundManoeuvre]
) -> list[FoundManoeuvre]:
    """Find straight runs outside other manoeuvres; two of reciprocal headings are speed runs.

    Parameters
    ----------
    signals
        Without NaN.
    others
        Manoeuvres that were found already.
    """
    if not np.isfinite(signals.heading).all():
        return []
    runs = [
        FoundManoeuvre(ManoeuvreKind.STRAIGHT, first, end)
        for first, end in _straight_spans(signals, others)
        if (end - first) * signals.dt_secs >= MIN_DOUBLE_SECS
    ]
    paired = {
        k
        for i, (one, other) in enumerate(pairwise(runs))
        if is_double_run(signals, one, other) and not _lies_between(one, other, others)
        for k in (i, i + 1)
    }
    long_enough = MIN_STRAIGHT_SECS / signals.dt_secs
    return [
        replace(run, kind=ManoeuvreKind.SPEED_RUN) if k in paired else run
        for k, run in enumerate(runs)
        if k in paired or run.end - run.execute >= long_enough
    ]


def is_double_run(signals: TrialSignals, one: FoundManoeuvre, other: FoundManoeuvre) -> bool:
    """Whether two straight runs are a double run: reciprocal headings, equal revolutions."""
    headings = [_mean(signals.heading, run) for run in (one, other)]
    apart = (headings[0] - headings[1]) % (2 * pi)
    if abs(apart - pi) > OPPOSITE:
        return False
    if not signals.has("rpm"):
        return True
    rpm = [_mean(signals.rpm, run) for run in (one, other)]
    return abs(rpm[0] - rpm[1]) <= SAME_RPM * max(map(abs, rpm))


def _lies_between(
    one: FoundManoeuvre, other: FoundManoeuvre, manoeuvres: Sequence[FoundManoeuvre]
) -> bool:
    """Whether a manoeuvre was sailed from the end of one run to the beginning of the other."""
    return any(one.end <= each.execute < other.execute for each in manoeuvres)


def _mean(values: FloatArray, run: FoundManoeuvre) -> float:
    return float(np.mean(values[run.execute : run.end]))


def _straight_spans(
    signals: TrialSignals, others: Sequence[FoundManoeuvre]
) -> list[tuple[int, int]]:
    """Return the longest stretches of blocks in which heading and speed are steady."""
    block = max(2, round(BLOCK_SECS / signals.dt_secs))
    free = np.ones(len(signals), bool)
    for each in others:
        free[each.execute : each.end] = False
    speed = signals.speed if signals.has("speed") else np.full(len(signals), np.nan)
    steady = []
    for first in range(0, len(signals) - block + 1, block):
        part = slice(first, first + block)
        is_moving = not np.isfinite(speed[first]) or np.median(speed[part]) > MIN_SPEED
        steady.append(
            bool(free[part].all())
            and float(np.ptp(signals.heading[part])) < MAX_HEADING_RANGE
            and (not signals.has("rudder") or _helm(signals.rudder[part]) < MAX_RUDDER)
            and is_moving
        )
    edges = np.flatnonzero(np.diff(np.concatenate(([0], np.array(steady, np.int8), [0]))))
    spans = []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        spans += _steady_speed_parts(speed, int(a) * block, int(b) * block, block)
    return [
        (first, end)
        for first, end in spans
        if np.ptp(_block_means(signals.heading[first:end], block)) < 2 * MAX_HEADING_RANGE
    ]


def _helm(rudder: FloatArray) -> float:
    return float(np.percentile(np.abs(rudder - np.median(rudder)), 90))


def _block_means(values: FloatArray, block: int) -> FloatArray:
    whole = max(1, len(values) // block)
    return np.array([np.mean(each) for each in np.array_split(values, whole)])


def _steady_speed_parts(
    speed: FloatArray, first: int, end: int, block: int
) -> list[tuple[int, int]]:
    """Return the last part of a stretch over which the speed is steady, block by block."""
    if end - first < 2 * block or not np.isfinite(speed[first]):
        return [(first, end)] if end > first else []
    means = _block_means(speed[first:end], block)
    start = len(means) - 1
    while start > 0:
        tail = means[start - 1 :]
        if np.ptp(tail) > MAX_SPEED_RANGE * max(float(np.mean(tail)), MIN_SPEED):
            break
        start -= 1
    return [(first + start * block, end)]
