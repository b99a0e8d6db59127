"""Levels of a signal: the stretches in which a rudder, or the revolutions, are held."""

from dataclasses import dataclass
from math import radians

import numpy as np

from shiplog.types import FloatArray

from .execute import MAX_SPIKE_SECS, remove_spikes
from .trial_signals import noise_std

MIN_HELD_SECS = 2.0
MOVING_SECS, MAX_MOVING_SECS = 1.0, 5.0  # half the time over which a movement is looked for
MIN_MOVING_RATE = radians(0.3)  # rad/s: a slower rudder is held, or is helm
NOISE_MARGIN = 3.0  # standard deviations of the noise that are no movement
MEDIAN_NOISE_GAIN = 1.25  # of the noise of a median over that of a mean
HELM_LEVEL = radians(2.5)  # from neutral: within it the rudder keeps the course
SAME_LEVEL, SAME_LEVEL_SHARE = radians(1.5), 0.08
MAX_LEVEL_GAP_SECS = 5.0  # between two stretches at one level
MAX_NEUTRAL = radians(5.0)


@dataclass(frozen=True)
class HeldLevel:
    """A stretch in which a signal is held.

    Attributes
    ----------
    first, last
        The first and the last sample.
    level
        The median value.
    """

    first: int
    last: int
    level: float


def held_levels(
    values: FloatArray, dt: float, min_movement: float, moving_secs: float = MOVING_SECS
) -> list[HeldLevel]:
    """Find the stretches of at least `MIN_HELD_SECS` in which a signal does not move.

    Parameters
    ----------
    values
        (n,) without NaN.
    dt
        Sample interval, s.
    min_movement
        Change within twice `moving_secs` that is a movement, in the unit of the values.
    moving_secs
        Half the time over which a movement is looked for, s.

    Examples
    --------
    >>> import numpy as np
    >>> steps = np.repeat([0.0, 1.0], 20)
    >>> [(round(held.level), held.last - held.first > 15) for held in held_levels(steps, 1.0, 0.5)]
    [(0, True), (1, True)]
    """
    k = max(1, round(moving_secs / dt))
    padded = np.pad(values, k, mode="edge")
    moving = np.abs(padded[2 * k :] - padded[: -2 * k]) > min_movement
    edges = np.flatnonzero(np.diff(np.concatenate(([0], (~moving).astype(np.int8), [0]))))
    spans = [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [
        HeldLevel(first, last, float(np.median(values[first : last + 1])))
        for first, last in spans
        if (last - first + 1) * dt >= min(MIN_HELD_SECS, len(values) * dt)
    ]


def rudder_levels(rudder: FloatArray, dt: float) -> list[HeldLevel]:
    """Find the levels at which a rudder is held, (n,) rad, whatever its noise.

    The noisier the rudder, the longer is the time over which it must have moved.
    """
    samples = 1 + 2 * round(MAX_SPIKE_SECS / 2 / dt)
    noise = noise_std(rudder) * MEDIAN_NOISE_GAIN / np.sqrt(samples)
    secs = NOISE_MARGIN * np.sqrt(2.0) * noise / (2 * MIN_MOVING_RATE)
    half_secs = float(np.clip(secs, MOVING_SECS, MAX_MOVING_SECS))
    return held_levels(remove_spikes(rudder, dt), dt, 2 * half_secs * MIN_MOVING_RATE, half_secs)


def neutral_rudder(levels: list[HeldLevel]) -> float:
    """Return the rudder angle that keeps a straight course: the median of small levels by time.

    Examples
    --------
    >>> neutral_rudder([HeldLevel(0, 100, 0.02), HeldLevel(110, 150, 0.6)])
    0.02
    """
    small = [held for held in levels if abs(held.level) < MAX_NEUTRAL]
    if not small:
        return 0.0
    order = sorted(small, key=lambda held: held.level)
    times = np.cumsum([held.last - held.first + 1 for held in order])
    return order[int(np.searchsorted(times, times[-1] / 2))].level


def merged_levels(levels: list[HeldLevel], neutral: float, dt: float) -> list[HeldLevel]:
    """Merge consecutive stretches at one level, and those in which the rudder keeps the course."""
    merged: list[HeldLevel] = []
    for held in levels:
        before = merged[-1] if merged else None
        if before is not None and _one_level(before, held, neutral, dt):
            longer = max(before, held, key=lambda each: each.last - each.first)
            merged[-1] = HeldLevel(before.first, held.last, longer.level)
        else:
            merged.append(held)
    return merged


def _one_level(before: HeldLevel, held: HeldLevel, neutral: float, dt: float) -> bool:
    if max(abs(before.level - neutral), abs(held.level - neutral)) < HELM_LEVEL:
        return True
    tolerance = max(SAME_LEVEL, SAME_LEVEL_SHARE * abs(before.level - neutral))
    is_near = (held.first - before.last) * dt <= MAX_LEVEL_GAP_SECS
    return is_near and abs(before.level - held.level) <= tolerance
