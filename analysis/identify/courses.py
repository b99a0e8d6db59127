"""How coefficients came about along the runs, and how much of them was there before.

Each method goes through the runs from two priors, one to either side of what was identified. Where
it ends apart by as much as it began, it has learnt nothing: it echoes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

from .trial import Trial
from .uncertainty import Uncertainty

OFF = 0.3  # of a value: how far to either side of it the priors are
MOST_OFF = 1.0  # the same where the value is hardly told


@dataclass(frozen=True, eq=False)
class Courses:
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
    def echo(self) -> FloatArray:
        """(k, p) of each value, how much of it is the prior: 0 for none of it, 1 for all.

        A method that makes errors grow goes beyond 1. Zero where there are no priors.
        """
        if len(self.values) < 2:
            return np.where(np.isfinite(self.values[0]), 0.0, np.nan)
        apart = np.abs(self.values[0] - self.values[1])
        return np.asarray(apart / np.abs(self.priors[0] - self.priors[1]))

    @property
    def last_echo(self) -> FloatArray:
        """(p,) of the last value that is told of each; NaN where none is."""
        return np.array([_last(column) for column in self.echo.T])


def _last(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known[-1]) if len(known) else np.nan


def two_priors(told: Uncertainty) -> FloatArray:
    """(2, p) to either side of the values of a fit, by turns high and low.

    They are off by `OFF` of the value, by more where that is no more than its uncertainty.
    """
    size = np.abs(told.values)
    reach = np.clip(3 * told.std, OFF * size, MOST_OFF * size)
    reach = np.where(reach > 0, reach, np.minimum(3 * told.std, 1.0))
    sides = np.where(np.arange(len(size)) % 2, -1.0, 1.0)
    return np.array([told.values + sides * reach, told.values - sides * reach])


def run_secs(trials: tuple[Trial, ...]) -> float:
    """How long some runs take, put end to end."""
    return sum(len(trial) * trial.dt_secs for trial in trials)


def begins_secs(trials: tuple[Trial, ...]) -> Iterator[float]:
    """When each of some runs put end to end begins."""
    start = 0.0
    for trial in trials:
        yield start
        start += len(trial) * trial.dt_secs
