"""Direct and reverse spirals: levels of the rudder, or of the yaw rate, from side to side.

Source: ITTC Recommended Procedure 7.5-04-02-01, full scale manoeuvring trials; IMO
MSC/Circ.1053, explanatory notes, section 3.4.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import radians

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .rudder_levels import MIN_HELD_SECS, NOISE_MARGIN, HeldLevel, held_levels
from .sailed_manoeuvre import ManoeuvreKind
from .smoothing import fitted_slope, moving_mean
from .trial_signals import noise_std

MIN_SPIRAL_LEVELS = 5
MIN_SPIRAL_SECS = 30.0  # of each level
MAX_PAUSE_SECS = 40.0  # between two levels
MIN_SPIRAL_STEP = radians(0.5)
MIN_SIDE = radians(2.0)  # that the largest levels of both sides reach
MIN_RATE_STEP, MIN_RATE_SIDE = radians(0.03), radians(0.1)  # of a reverse spiral, rad/s
MAX_RATE_NOISE = radians(0.005)  # rad/s, of a yaw rate from the heading
RATE_SMOOTHING_SECS = (8.0, 20.0)  # half widths of its fit
RATE_MOVING_SECS = 16.0  # half the time over which a change of the yaw rate is looked for
MIN_STEERING_STD = radians(0.5)  # of the rudder within a level
MIN_BEYOND = radians(1.0)  # of the rudder beyond the next level's angle
STEERING_SMOOTHING_SECS = 4.0
RUDDER_SMOOTHING_SECS = 10.0  # of the rudder of a direct spiral, whose steps may be small
DELAY_SHARE = 0.25  # of a level of the yaw rate, at whose end the rudder may move to the next one


def find_direct_spirals(rudder: FloatArray, neutral: float, dt: float) -> Iterator[FoundManoeuvre]:
    """Find direct spirals: the rudder is held at one angle after another, on both sides.

    Parameters
    ----------
    rudder
        (n,) rad, without NaN.
    neutral
        The rudder angle that keeps a straight course, rad.
    dt
        Sample interval, s.
    """
    count = 1 + 2 * round(RUDDER_SMOOTHING_SECS / 2 / dt)
    if count > len(rudder):
        return
    noise = noise_std(rudder) / np.sqrt(count)
    movement = max(0.8 * MIN_SPIRAL_STEP, NOISE_MARGIN * np.sqrt(2.0) * noise)
    levels = held_levels(moving_mean(rudder, count), dt, movement, RUDDER_SMOOTHING_SECS / 2)
    joined = _joined(levels, dt, MIN_SPIRAL_STEP / 2, 2 * MIN_HELD_SECS)
    # the mean moves before the rudder does, and is compared with the one ahead of it
    margin = round(0.8 * RUDDER_SMOOTHING_SECS / dt)
    joined = [replace(each, last=min(each.last + margin, len(rudder) - 1)) for each in joined]
    steps = _Steps(MIN_SPIRAL_STEP, MIN_SIDE, MAX_PAUSE_SECS)
    for chain in _chains(joined, dt, steps, neutral):
        yield _spiral(ManoeuvreKind.DIRECT_SPIRAL, chain, neutral)


def find_reverse_spirals(
    heading: FloatArray, neutral: float, dt: float
) -> Iterator[FoundManoeuvre]:
    """Find reverse spirals: the rudder is moved to hold one yaw rate after another.

    Parameters
    ----------
    heading
        (n,) rad, continuous.
    neutral
        The rudder angle that keeps a straight course, rad.
    dt
        Sample interval, s.
    """
    noise = noise_std(heading)
    # as wide a fit as keeps the noise of its slope small
    samples = np.cbrt(12.0 * (noise / (MAX_RATE_NOISE * dt)) ** 2)
    half = round(float(np.clip(samples * dt / 2, *RATE_SMOOTHING_SECS)) / dt)
    if not 2 <= half < len(heading) // 2 or not np.isfinite(heading).all():
        return
    rate = fitted_slope(heading, half, dt)
    if np.ptp(rate) < 2 * MIN_RATE_SIDE:
        return
    rate_noise = noise / (dt * np.sqrt((2 * half + 1) ** 3 / 12.0))
    movement = MIN_RATE_STEP / 2 + NOISE_MARGIN * np.sqrt(2.0) * rate_noise
    steady = held_levels(rate, dt, movement, RATE_MOVING_SECS)
    steps = _Steps(
        MIN_RATE_STEP, MIN_RATE_SIDE, 2 * (half * dt + RATE_MOVING_SECS) + MAX_PAUSE_SECS
    )
    joined = _joined(steady, dt, 0.75 * MIN_RATE_STEP, RATE_MOVING_SECS)
    for chain in _chains(joined, dt, steps, 0.0):
        yield _spiral(ManoeuvreKind.REVERSE_SPIRAL, chain, neutral)


def _joined(levels: list[HeldLevel], dt: float, same: float, gap_secs: float) -> list[HeldLevel]:
    """Join stretches of one level that a short movement separates."""
    joined: list[HeldLevel] = []
    for held in levels:
        if (
            joined
            and abs(held.level - joined[-1].level) < same
            and (held.first - joined[-1].last) * dt < gap_secs
        ):
            joined[-1] = _union(joined[-1], held)
        else:
            joined.append(held)
    return joined


def _union(one: HeldLevel, other: HeldLevel) -> HeldLevel:
    """Return both stretches of one level as one."""
    longer = max(one, other, key=lambda each: each.last - each.first)
    return HeldLevel(one.first, other.last, longer.level)


@dataclass(frozen=True)
class _Steps:
    """The smallest step between two levels, the smallest end of both sides, the longest pause."""

    step: float
    side: float
    pause_secs: float


def _chains(
    levels: list[HeldLevel], dt: float, steps: _Steps, neutral: float
) -> Iterator[list[HeldLevel]]:
    """Yield the chains of long levels that go down and up, or up and down, on both sides."""
    chain: list[HeldLevel] = []
    for held in [*levels, None]:
        if held is not None and (held.last - held.first) * dt < MIN_SPIRAL_SECS:
            continue
        if held is not None and (
            not chain or (held.first - chain[-1].last) * dt <= steps.pause_secs
        ):
            if chain and abs(held.level - chain[-1].level) < steps.step:
                chain[-1] = _union(chain[-1], held)
            else:
                chain.append(held)
            continue
        if _is_spiral([each.level - neutral for each in chain], steps.side):
            yield chain
        chain = [] if held is None else [held]


def _is_spiral(levels: list[float], side: float) -> bool:
    """Whether levels run monotonously from side to side, with at most two turning points."""
    if len(levels) < MIN_SPIRAL_LEVELS or max(levels) < side or min(levels) > -side:
        return False
    steps = np.sign(np.diff(levels))
    return int(np.sum(steps[1:] != steps[:-1])) <= 2 and len({round(x, 3) for x in levels}) >= 5


def is_steered(rudder: FloatArray, found: FoundManoeuvre, dt: float) -> bool:
    """Whether the rudder, (n,) rad, is moved to keep each rate, as in a reverse spiral.

    It moves while the rate is steady, or goes beyond the next angle to bring about the next rate.
    In a direct spiral it does neither; near the end of a steady rate it moves to the next angle,
    for the rate follows it with a delay.
    """
    count = 1 + 2 * round(STEERING_SMOOTHING_SECS / 2 / dt)
    smooth = moving_mean(rudder, count)
    least = MIN_BEYOND + NOISE_MARGIN * noise_std(rudder) / np.sqrt(count)
    spans = [
        (int(first), int(last - DELAY_SHARE * (last - first)) + 1)
        for first, last in found.levels[:, :2]
    ]
    variances = [
        float(np.var(rudder[first:last])) - noise_std(rudder) ** 2 for first, last in spans
    ]
    angles = [float(np.median(smooth[first:last])) for first, last in spans]
    beyond = []
    for k, (one, other) in enumerate(pairwise(angles)):
        between = smooth[spans[k][1] : spans[k + 1][0] + 1]
        low, high = min(one, other), max(one, other)
        beyond.append(max(float(np.max(between)) - high, low - float(np.min(between))))
    return bool(np.median(variances) > MIN_STEERING_STD**2 or np.median(beyond) > least)


def _spiral(kind: ManoeuvreKind, chain: list[HeldLevel], neutral: float) -> FoundManoeuvre:
    is_direct = kind is ManoeuvreKind.DIRECT_SPIRAL
    straight, near = (neutral, MIN_SPIRAL_STEP) if is_direct else (0.0, MIN_RATE_STEP)
    has_approach = abs(chain[0].level - straight) < near
    execute = chain[0].last if has_approach else chain[0].first
    sailed = chain[1:] if has_approach else chain
    levels = np.array([(held.first, held.last, held.level) for held in sailed])
    level = sailed[0].level - straight
    return FoundManoeuvre(kind, execute, sailed[-1].last + 1, level, neutral, levels=levels)
