"""Parameter estimates over time by one method, and how much of them is prior.

Each method that has a prior is run from two priors, one on either side of the fitted value. The
distance between the two estimates, over the distance between the two priors, is the share of the
prior in the estimate: where the estimates are as far apart as the priors, the data have added
nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.identification.fit.segment import Segment
from analysis.identification.fit.uncertainty import MAX_PRIOR_SHARE, Uncertainty
from shiplog.types import FloatArray

PRIOR_OFFSET = 0.3  # distance of each prior from the fitted value, as a share of that value
MAX_PRIOR_OFFSET = 1.0  # the same for a value that is hardly determined


@dataclass(frozen=True, eq=False)
class ParameterHistory:
    """Estimates of p parameters at k instants by one method, from each of q priors.

    The runs are put end to end, with a break between them (`with_breaks`).

    Attributes
    ----------
    method
        The method's name, as printed in tables and drawings.
    names
        The p parameters.
    time_secs
        (k,) since the beginning of the first run, as if each run began when the one before ended.
    values
        (q, k, p) estimates in the parameters' own units; NaN where the method returns none.
    stds
        (q, k, p) standard deviations as the method computes them; NaN where it has none.
    priors
        (q, p) the values each pass started from. Where the method has no prior, q is 1 and they
        are NaN.
    """

    method: str
    names: tuple[str, ...]
    time_secs: FloatArray
    values: FloatArray
    stds: FloatArray
    priors: FloatArray

    @property
    def prior_share(self) -> FloatArray:
        """(k, p) share of the prior in each estimate: 0 for none, 1 for a copy of the prior.

        A method that amplifies errors exceeds 1. It is 0 for a method without priors, and NaN
        where there is no estimate.
        """
        if len(self.values) < 2:
            return np.where(np.isfinite(self.values[0]), 0.0, np.nan)
        distance = np.abs(self.values[0] - self.values[1])
        return np.asarray(distance / np.abs(self.priors[0] - self.priors[1]))

    @property
    def mostly_prior(self) -> NDArray[np.bool_]:
        """(k, p) where an estimate, then or at any later instant, is more prior than data.

        Looking ahead excludes instants at which the two passes merely cross: there they agree by
        chance.
        """
        later = np.fmax.accumulate(self.prior_share[::-1])[::-1]
        return np.asarray(later > MAX_PRIOR_SHARE)

    @property
    def median_prior_share(self) -> FloatArray:
        """(p,) the median of `prior_share` over the latter half; NaN where there is no estimate."""
        half = self.prior_share[len(self.time_secs) // 2 :]
        return np.array([_finite_median(column) for column in half.T])


def _finite_median(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else np.nan


def two_priors(fitted: Uncertainty, bounds: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Compute two priors, one on either side of the fitted values.

    The first prior is above the value for every other parameter and below it for the rest, the
    second the reverse, so that no prior is a uniform scaling of the fit. The distance is three
    standard deviations, limited to between `PRIOR_OFFSET` and `MAX_PRIOR_OFFSET` of the value.

    Parameters
    ----------
    fitted
        Values and standard deviations of the p parameters.
    bounds
        Lower and upper limits, (m,) each with m >= p, the parameters first, as `Problem.bounds`.

    Returns
    -------
    priors
        (2, p), within the bounds.
    """
    size = np.abs(fitted.values)
    offset = np.clip(3 * fitted.std, PRIOR_OFFSET * size, MAX_PRIOR_OFFSET * size)
    offset = np.where(offset > 0, offset, np.minimum(3 * fitted.std, 1.0))
    signs = np.where(np.arange(len(size)) % 2, -1.0, 1.0)
    priors = np.array([fitted.values + signs * offset, fitted.values - signs * offset])
    lowest, highest = (bound[: len(size)] for bound in bounds)
    return np.asarray(np.clip(priors, lowest, highest))


def with_breaks(parts: Sequence[FloatArray]) -> FloatArray:
    """Concatenate instants or values of several runs, with a break between two runs.

    Parameters
    ----------
    parts
        Of each run either instants, (k,), or values, (k, ...).

    Returns
    -------
    concatenated
        After each run but the last one row is inserted: the last instant again, or values of NaN,
        so that a drawn line is interrupted there.

    Examples
    --------
    >>> with_breaks([np.array([0.0, 1.0]), np.array([5.0])])
    array([0., 1., 1., 5.])
    """
    rows = []
    for part in parts:
        rows += [part, part[-1:] if part.ndim == 1 else np.full((1, *part.shape[1:]), np.nan)]
    return np.concatenate(rows[:-1])


def total_duration_secs(segments: tuple[Segment, ...]) -> float:
    """Return the duration of some segments put end to end, in s."""
    return sum(len(segment) * segment.dt_secs for segment in segments)


def start_times_secs(segments: tuple[Segment, ...]) -> Iterator[float]:
    """Yield the start of each of some segments put end to end, in s since the first one's."""
    start = 0.0
    for segment in segments:
        yield start
        start += len(segment) * segment.dt_secs
