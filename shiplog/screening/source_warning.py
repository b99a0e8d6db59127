"""Warning about several sources of one quantity: the choice, its reason, and the disagreement."""

from collections.abc import Sequence

import numpy as np

from .compared_source import (
    MIN_INSTANTS,
    ComparedSource,
    display_unit,
    is_circular,
    min_disagreement,
    root_mean_square,
)

MIN_CORRELATION = 0.9  # of two sources, for one to be described as a multiple of the other
ROUNDING = 1e-9  # of a source's range, below which an offset is one of arithmetic
NOISE_ERRORS = 3.0  # standard deviations of noise that are no disagreement


def choice_warning(
    name: str, best: ComparedSource, reason: str, sources: Sequence[ComparedSource]
) -> str:
    """Report the choice among the sources of a quantity, and how far the others differ.

    Parameters
    ----------
    name
        The quantity.
    best, reason
        The source used, and why, in words.
    sources
        All its sources, at least two.
    """
    others = [source for source in sources if source is not best]
    listed = ", ".join(source.stats.source for source in sources)
    differences = [text for other in others if (text := _difference(best, other, sources))]
    text = f"{name}: {len(sources)} sources ({listed}); {best.stats.source} is used ({reason})"
    if differences:
        text += f"; they disagree: {'; '.join(differences)}: check which is right"
    return f"{text}; --source {name}={others[0].stats.source} selects another"


def _difference(
    best: ComparedSource, other: ComparedSource, sources: Sequence[ComparedSource]
) -> str:
    """Describe how a source differs from the one used; empty within their noise."""
    unit, factor = display_unit(best.stats)
    if other.is_dead and not best.is_dead:
        known = other.values[np.isfinite(other.values)]
        value = f"constant at {known[0] * factor:.3g} {unit}" if len(known) else "not measured"
        return f"{other.stats.source} is {value}"
    both = np.isfinite((best.values + other.values).reshape(len(best.values), -1)).all(axis=1)
    if np.count_nonzero(both) < MIN_INSTANTS:
        return f"{other.stats.source} is never measured at the same time"
    a, b = best.values[both], other.values[both]
    difference = b - a
    if is_circular(best.stats):
        difference = difference - 2 * np.pi * np.round(np.median(difference) / (2 * np.pi))
        b = a + difference
    rms = root_mean_square(difference)
    noise = float(np.hypot(best.noise, other.noise))
    if rms <= max(min_disagreement(best.stats.name, sources), NOISE_ERRORS * noise):
        return ""
    text = f"{other.stats.source} differs by {rms * factor:.2g} {unit} rms"
    if a.ndim == 1 and min(np.ptp(a), np.ptp(b)) > 0:
        scale, offset = np.polyfit(a, b, 1)
        if abs(np.corrcoef(a, b)[0, 1]) > MIN_CORRELATION:
            multiple = f"{scale:.2f} x {best.stats.source}"
            if abs(offset) > ROUNDING * np.ptp(a):
                multiple += f" {offset * factor:+.2g} {unit}"
            text += f" ({other.stats.source} = {multiple})"
    return text
