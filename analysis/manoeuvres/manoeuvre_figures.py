"""What the figures of a manoeuvre show: time histories, track, and instants to be marked."""

from itertools import pairwise

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .manoeuvre_part import TAIL_SECS, ManoeuvrePart
from .manoeuvre_values import MAX_TRACK_SMOOTHING_SECS, IndexCase
from .sailed_manoeuvre import ManoeuvreKind, ManoeuvreMark, ManoeuvreSeries
from .trial_index import TrialIndex
from .turning_circle import COURSE_SECS

EXECUTED = (ManoeuvreKind.STOPPING, ManoeuvreKind.ACCELERATION)


def manoeuvre_series(part: ManoeuvrePart, case: IndexCase) -> ManoeuvreSeries:
    """Return the time histories for the figures."""
    signals, measured = case.signals, part.filled
    count = min(len(signals), part.found.end + round(TAIL_SECS / signals.dt_secs))
    none = np.empty(0)

    def shown(name: str) -> FloatArray:
        values: FloatArray = getattr(measured, name)[:count]
        return values if np.isfinite(values).sum() > 1 else none

    track = np.empty((0, 2))
    if measured.has("positions"):
        samples = np.arange(len(signals))
        start = [np.interp(case.execute, samples, column) for column in signals.positions.T]
        made = (signals.positions[:count] - start) @ [1, 1j] * np.exp(-1j * case.approach)
        track = np.column_stack((made.real, made.imag))
    drift: FloatArray = none
    if signals.has("sway") and signals.has("speed"):
        drift = -np.arctan2(signals.sway[:count], signals.speed[:count])
        if not measured.has("sway"):
            drift = _within_fixes(drift, part)
    change = signals.heading[:count] - case.approach
    return ManoeuvreSeries(
        time_secs=(np.arange(count) - case.execute) * signals.dt_secs,
        rudder=shown("rudder"),
        rudder_order=shown("rudder_order"),
        heading_change=change if np.isfinite(change).any() else none,
        yaw_rate=shown("yaw_rate"),
        speed=shown("speed"),
        drift=drift,
        rpm=shown("rpm"),
        track=track,
    )


def _within_fixes(drift: FloatArray, part: ManoeuvrePart) -> FloatArray:
    """Return a drift angle from differentiated positions, NaN where these were not on both sides.

    At the ends of the track its slope, and the smoothing of track and heading, are one-sided, which
    shows as a jump.
    """
    fixes = np.flatnonzero(np.isfinite(part.measured.positions[:, 0])) * part.measured.dt_secs
    margin = max(COURSE_SECS + min(part.half_secs / 2, MAX_TRACK_SMOOTHING_SECS), part.half_secs)
    time = np.arange(len(drift)) * part.filled.dt_secs
    inside = (time >= fixes[0] + margin) & (time <= fixes[-1] - margin)
    return np.where(inside, drift, np.nan)


def manoeuvre_marks(
    part: ManoeuvrePart, case: IndexCase, indices: tuple[TrialIndex, ...]
) -> tuple[ManoeuvreMark, ...]:
    """Return the instants that the figures mark."""
    dt = case.signals.dt_secs
    marks = execute_marks(part.found, case.execute, dt)
    marks += [
        ManoeuvreMark(index.name.removeprefix("time to "), index.value)
        for index in indices
        if index.name.startswith("time to ") and index.name.endswith("°")
    ]
    if part.found.kind is ManoeuvreKind.ZIGZAG:
        change = case.signals.heading - case.approach
        marks += [
            ManoeuvreMark(f"overshoot {k}", (at - case.execute) * dt)
            for k, at in enumerate(overshoot_samples(part.found, change), 1)
            if any(index.name == f"overshoot {k}" for index in indices)
        ]
    marks += [
        ManoeuvreMark("stopped", index.value) for index in indices if index.name == "stopping time"
    ]
    return tuple(sorted(marks, key=lambda mark: mark.time_secs))


def execute_marks(found: FoundManoeuvre, execute: float, dt: float) -> list[ManoeuvreMark]:
    """Return the marks of the executes; a manoeuvre without an order has none.

    Parameters
    ----------
    found
        The manoeuvre.
    execute
        The sample of the first execute, from which their times count.
    dt
        Sample interval, s.
    """
    has_order = np.isfinite(found.level) or found.kind in EXECUTED
    marks = [ManoeuvreMark("execute", 0.0)] if has_order else []
    return marks + [
        ManoeuvreMark(f"execute {k}", (at - execute) * dt)
        for k, at in enumerate(found.reversals, 2)
    ]


def overshoot_samples(found: FoundManoeuvre, change: FloatArray) -> list[int]:
    """Return the samples at which a zig-zag's heading is furthest, after each of its reversals.

    Parameters
    ----------
    found
        The zig-zag.
    change
        (n,) change of heading, of the same samples.
    """
    edges = [*found.reversals, found.end]
    return [start + int(np.argmax(np.abs(change[start:stop]))) for start, stop in pairwise(edges)]
