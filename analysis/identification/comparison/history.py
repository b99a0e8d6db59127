"""How coefficients came about along the runs, and how much of them was there before.

Each method goes through the runs from two priors, one to either side of what was identified. Where
it ends apart by as much as it began, it has learnt nothing: it echoes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.identification.segment import Segment
from analysis.identification.uncertainty import ECHO, Uncertainty
from shiplog.types import FloatArray

OFF = 0.3  # of a value: how far to either side of it the priors are
MOST_OFF = 1.0  # the same where the value is hardly told


@dataclass(frozen=True, eq=False)
class ParameterHistory:
    """Coefficients by one method from one or two priors, over the runs put end to end.

    p coefficients at k instants from each of q priors; NaN where the method cannot tell.
    """

    method: str
    names: tuple[str, ...]
    time_secs: FloatArray  # (k,) since the first run began, as if each began when one ended
    values: FloatArray  # (q, k, p)
    stds: FloatArray  # (q, k, p) as the method has it; NaN where it has none
    priors: FloatArray  # (q, p); q is 1 and they are NaN where there are none

    @property
    def prior_share(self) -> FloatArray:
        """(k, p) of each value, how much of it is the prior: 0 for none of it, 1 for all.

        A method that makes errors grow goes beyond 1. Zero where there are no priors.
        """
        if len(self.values) < 2:
            return np.where(np.isfinite(self.values[0]), 0.0, np.nan)
        apart = np.abs(self.values[0] - self.values[1])
        return np.asarray(apart / np.abs(self.priors[0] - self.priors[1]))

    @property
    def mostly_prior(self) -> NDArray[np.bool_]:
        """(k, p) where a value is more prior than data, or will be so again.

        Two courses that cross have learnt nothing there.
        """
        later = np.fmax.accumulate(self.prior_share[::-1])[::-1]
        return np.asarray(later > ECHO)

    @property
    def median_prior_share(self) -> FloatArray:
        """(p,) the median over the latter half; NaN where nothing is told."""
        half = self.prior_share[len(self.time_secs) // 2 :]
        return np.array([_median(column) for column in half.T])


def _median(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else np.nan


def two_priors(told: Uncertainty, bounds: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(2, p) to either side of the values of a fit, by turns high and low, within bounds.

    They are off by `OFF` of the value, by more where that is no more than its uncertainty. The
    bounds, of a problem, may be of more unknowns.
    """
    size = np.abs(told.values)
    reach = np.clip(3 * told.std, OFF * size, MOST_OFF * size)
    reach = np.where(reach > 0, reach, np.minimum(3 * told.std, 1.0))
    sides = np.where(np.arange(len(size)) % 2, -1.0, 1.0)
    either = np.array([told.values + sides * reach, told.values - sides * reach])
    lowest, highest = (bound[: len(size)] for bound in bounds)
    return np.asarray(np.clip(either, lowest, highest))


def with_breaks(parts: Sequence[FloatArray]) -> FloatArray:
    """Instants or values of several runs, one below the other, and a break between runs.

    An instant that breaks is that before it; a value is NaN.
    """
    rows = []
    for part in parts:
        rows += [part, part[-1:] if part.ndim == 1 else np.full((1, *part.shape[1:]), np.nan)]
    return np.concatenate(rows[:-1])


def run_secs(segments: tuple[Segment, ...]) -> float:
    """How long some runs take, put end to end."""
    return sum(len(segment) * segment.dt_secs for segment in segments)


def begins_secs(segments: tuple[Segment, ...]) -> Iterator[float]:
    """When each of some runs put end to end begins."""
    start = 0.0
    for segment in segments:
        yield start
        start += len(segment) * segment.dt_secs
