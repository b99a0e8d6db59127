"""Rules by which one of several sources of a quantity is chosen."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.types import FloatArray

from .compared_source import (
    MIN_INSTANTS,
    ComparedSource,
    display_unit,
    min_disagreement,
    root_mean_square,
)

MIN_COVERAGE_SHARE = 0.5  # of the most complete source; one that has less is not used
DECISIVE_RATIO = 1.5  # between two sources' errors, or their rates, for one to be better
EFFECT_RATIO = 1.2  # the same between rudders, whose residuals are mostly those of a coarse model
MAX_CURRENT = 2.5  # m/s, by which speeds through the water and over the ground may differ
GROUND_SOURCES = re.compile("sog|gps|gnss|ground|vtg|rmc|bottom")  # names of such sources
MIN_ZERO_DIFFERENCE = 0.5  # deg of rudder on a straight course
SMOOTHING_SECS = 10.0  # a heading is differentiated over this time


@dataclass(frozen=True, eq=False)
class SourceComparison:
    """Sources of one quantity to choose from, with the sources chosen of other quantities.

    Attributes
    ----------
    name
        The quantity.
    sources
        Its sources.
    references
        The source of each other quantity that is known already, by name.
    clock
        (n,) s, on which all of them are.
    """

    name: str
    sources: Sequence[ComparedSource]
    references: Mapping[str, ComparedSource]
    clock: FloatArray


# the sources that are kept, and why, in words; None where the rule does not apply
_Kept = tuple[list[ComparedSource], str] | None


def best_source(comparison: SourceComparison) -> tuple[ComparedSource, str]:
    """Return the source of a quantity to use, and why, in words."""
    sources, reason = comparison.sources, ""
    for rule in (
        _alive, _complete, _by_range, _by_other_quantity, _through_water, _by_effect, _by_median,
        _by_zero, _by_rate,
    ):  # fmt: skip
        kept = rule(replace(comparison, sources=sources))
        if kept is not None and 0 < len(kept[0]) < len(sources):
            sources, reason = kept[0], reason or kept[1]
        if len(sources) == 1:
            return sources[0], reason
    return sources[0], reason or "the first in the log"


def _alive(comparison: SourceComparison) -> _Kept:
    alive = [source for source in comparison.sources if not source.is_dead]
    return alive, "the others are constant or not measured"


def _complete(comparison: SourceComparison) -> _Kept:
    most = max(source.coverage for source in comparison.sources)
    kept = [s for s in comparison.sources if s.coverage >= MIN_COVERAGE_SHARE * most]
    return kept, f"measured for {most:.0%} of the time, the others less"


def _by_range(comparison: SourceComparison) -> _Kept:
    """Keep the headings that turn with the ship; a stuck one may be noisy."""
    if comparison.name != "heading":
        return None
    ranges = [float(np.nanmax(s.values) - np.nanmin(s.values)) for s in comparison.sources]
    return _smallest(comparison, [-each for each in ranges], "the others hardly vary", ratio=0.2)


def _by_other_quantity(comparison: SourceComparison) -> _Kept:
    """Keep the sources close to the heading's derivative, or to the speed of the fixes."""
    reference = comparison.references.get(
        {"yaw_rate": "heading", "speed": "position"}.get(comparison.name, "")
    )
    if reference is None:
        return None
    derivative = _derivative(reference.values, comparison.clock)
    if comparison.name == "speed":
        derivative = np.hypot(*derivative.T)
    smooth = [_smooth(source.values, comparison.clock) for source in comparison.sources]
    errors = [root_mean_square(each - derivative) for each in smooth]
    if comparison.name == "speed":  # the fixes move over the ground: a current is no error
        words, least = "the others differ from the fixes by more than a current", MAX_CURRENT
        return _smallest(comparison, errors, words, ratio=1.0, margin=least)
    return _smallest(comparison, errors, "the closest to the heading")


def _through_water(comparison: SourceComparison) -> _Kept:
    """Keep the speeds that are not over the ground by the name of their source."""
    if comparison.name != "speed":
        return None
    kept = [s for s in comparison.sources if not GROUND_SOURCES.search(s.stats.source.lower())]
    return kept, "through the water; the others are over the ground by their names"


def _by_effect(comparison: SourceComparison) -> _Kept:
    """Keep the rudders that explain the yaw rate; one that is stuck for a time does not."""
    residuals = [effect.residual for effect in _rudder_effects(comparison)]
    if not residuals or not np.isfinite(residuals).all():
        return None
    limit = EFFECT_RATIO * min(residuals)
    kept = [s for s, r in zip(comparison.sources, residuals, strict=True) if r <= limit]
    return kept, "the others do not explain the yaw rate"


def _by_median(comparison: SourceComparison) -> _Kept:
    """Keep the sources close to the median of three or more."""
    sources = comparison.sources
    if len(sources) < 3 or sources[0].values.ndim > 1:
        return None
    values = np.column_stack([source.values for source in sources])
    known = np.isfinite(values).all(axis=1)
    if np.count_nonzero(known) < MIN_INSTANTS:
        return None
    middle = np.median(values[known], axis=1)
    errors = [root_mean_square(source.values[known] - middle) for source in sources]
    return _smallest(comparison, errors, "the closest to the median of all")


def _by_zero(comparison: SourceComparison) -> _Kept:
    """Keep the rudder that is nearest to zero where it does not turn the ship."""
    zeros = [effect.zero for effect in _rudder_effects(comparison)]
    if not zeros:
        return None
    zeros_deg = np.degrees(zeros)
    if not np.isfinite(zeros_deg).all() or np.ptp(np.abs(zeros_deg)) < MIN_ZERO_DIFFERENCE:
        return None
    best = int(np.argmin(np.abs(zeros_deg)))
    words = f"without effect at {zeros_deg[best]:+.1f} deg, the nearest to zero"
    return [comparison.sources[best]], words


@dataclass(frozen=True)
class _RudderEffect:
    """Effect of a rudder on the yaw rate; NaN where undetermined.

    Attributes
    ----------
    zero
        The angle at which it does not turn the ship, rad.
    residual
        Rms of the change of the yaw rate over `SMOOTHING_SECS` that it does not explain, rad/s.
    """

    zero: float = np.nan
    residual: float = np.nan


def _rudder_effects(comparison: SourceComparison) -> list[_RudderEffect]:
    """Return the effect of each source of the rudder; none of another quantity."""
    rate = comparison.references.get("yaw_rate")
    if comparison.name != "rudder" or rate is None:
        return []
    return [_rudder_effect(s.values, rate.values, comparison.clock) for s in comparison.sources]


def _rudder_effect(rudder: FloatArray, rate: FloatArray, clock: FloatArray) -> _RudderEffect:
    """Return the effect of one rudder.

    r(t + W) - r(t) = a ∫r + b ∫δ + c W is solved for a, b and c; the zero is -c / b.
    """
    known = np.isfinite(rudder) & np.isfinite(rate)
    dt = float(clock[1] - clock[0])
    width = max(round(SMOOTHING_SECS / dt), 1)
    if np.count_nonzero(known) < MIN_INSTANTS + width:
        return _RudderEffect()
    columns = np.column_stack((rate, rudder, np.ones_like(rate)))
    sums = np.cumsum(np.where(known[:, None], columns, 0.0), axis=0) * dt
    gaps = np.cumsum(~known)
    whole = (gaps[width:] == gaps[:-width]) & known[:-width]
    X, y = (sums[width:] - sums[:-width])[whole], (rate[width:] - rate[:-width])[whole]
    if len(y) < MIN_INSTANTS:
        return _RudderEffect()
    theta, _, rank, _ = np.linalg.lstsq(X, y, rcond=1e-9)
    if rank < 3 or theta[1] == 0:
        return _RudderEffect()
    return _RudderEffect(float(-theta[2] / theta[1]), root_mean_square(y - X @ theta))


def _by_rate(comparison: SourceComparison) -> _Kept:
    """Keep the sources with the highest sampling rate."""
    intervals = [source.stats.interval_secs for source in comparison.sources]
    fastest = min(intervals)
    kept = [
        source
        for source, interval in zip(comparison.sources, intervals, strict=True)
        if interval < DECISIVE_RATIO * fastest
    ]
    return kept, f"the fastest: {1 / fastest:.3g} Hz" if fastest > 0 else ""


def _smallest(
    comparison: SourceComparison,
    errors: Sequence[float],
    words: str,
    *,
    ratio: float = DECISIVE_RATIO,
    margin: float | None = None,
) -> _Kept:
    """Keep the sources whose error is about the smallest.

    Parameters
    ----------
    comparison
        The k sources.
    errors
        (k,) errors; NaN where unknown.
    words
        Why the sources that are kept are kept.
    ratio
        A source is kept whose error is at most so many times the smallest,
    margin
        or exceeds it by no more than this; by default as much as sources of the quantity may
        differ.
    """
    known = [error for error in errors if np.isfinite(error)]
    if len(known) < 2:
        return None
    allowed = min_disagreement(comparison.name, comparison.sources) if margin is None else margin
    limit = max(ratio * min(known), min(known) + allowed)
    kept = [s for s, error in zip(comparison.sources, errors, strict=True) if error <= limit]
    worst = max(known)
    if min(known) >= 0 and len(kept) < len(errors):
        unit, factor = display_unit(comparison.sources[0].stats)
        words += f": {min(known) * factor:.2g} {unit} rms against {worst * factor:.2g} {unit}"
    return kept, words


def _smooth(values: FloatArray, clock: FloatArray) -> FloatArray:
    """Return the mean over `SMOOTHING_SECS` about each instant; NaN near gaps and ends."""
    half = max(round(SMOOTHING_SECS / 2 / float(clock[1] - clock[0])), 1)
    known = np.isfinite(values)
    sums = np.concatenate(([0.0], np.cumsum(np.where(known, values, 0.0))))
    counts = np.concatenate(([0], np.cumsum(known)))
    smooth = np.full_like(values, np.nan)
    width = 2 * half + 1
    if len(values) < width:
        return smooth
    total, count = sums[width:] - sums[:-width], counts[width:] - counts[:-width]
    smooth[half:-half] = np.where(count == width, total / width, np.nan)
    return smooth


def _derivative(values: FloatArray, clock: FloatArray) -> FloatArray:
    """Return the central difference over `SMOOTHING_SECS`; NaN near gaps and ends."""
    dt = float(clock[1] - clock[0])
    half = max(round(SMOOTHING_SECS / 2 / dt), 1)
    result = np.full_like(values, np.nan)
    if len(values) > 2 * half:
        result[half:-half] = (values[2 * half :] - values[: -2 * half]) / (2 * half * dt)
    return result
