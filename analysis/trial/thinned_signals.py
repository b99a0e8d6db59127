"""Signals of a trial of any length, thinned while they come in chunks."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from analysis.manoeuvres.trial_signals import TrialSignals, noise_std
from shiplog.types import FloatArray

from .trial_record import MAX_SAMPLES, MOTION, STEERING

SEARCHED = (*STEERING, *MOTION)  # in which manoeuvres are looked for
NOISY = ("rudder", "rpm")  # whose noise the search needs


class ThinnedSignals:
    """Averages of signals over stretches of their clock, `MAX_SAMPLES` at most.

    The signals of a shorter trial stay as they are. Where the chunks are cut changes no result.

    Parameters
    ----------
    count, dt_secs
        The number of instants of the clock and its step, s.
    names
        The signals to be kept.
    """

    def __init__(self, count: int, dt_secs: float, names: Sequence[str]) -> None:
        self._stride = -(-count // MAX_SAMPLES)
        self._dt_secs, size = self._stride * dt_secs, -(-count // self._stride)
        self._sums = {name: np.zeros(size) for name in names}
        self._counts = {name: np.zeros(size) for name in names}

    def add(self, first: int, values: Mapping[str, FloatArray]) -> None:
        """Add the next values.

        Parameters
        ----------
        first
            The number of their first instant.
        values
            (n,) each, NaN where not known; a signal that is not among them counts as not known.
        """
        for name, total in self._sums.items():
            if name in values:
                known = np.flatnonzero(np.isfinite(values[name]))
                stretch = (first + known) // self._stride
                # one after the other: sums of parts would be rounded by the cuts of the chunks
                np.add.at(total, stretch, values[name][known])
                np.add.at(self._counts[name], stretch, 1.0)

    @property
    def time_secs(self) -> FloatArray:
        """The middle of each stretch, (m,) s since the first instant."""
        size = len(next(iter(self._sums.values())))
        step = self._dt_secs / self._stride
        return np.arange(size) * self._dt_secs + (self._stride - 1) / 2 * step

    def values(self) -> dict[str, FloatArray]:
        """Return the mean of each signal in each stretch, (m,); NaN where nothing is known."""
        with np.errstate(invalid="ignore"):
            return {name: total / self._counts[name] for name, total in self._sums.items()}

    def trial_signals(self) -> TrialSignals:
        """Return the signals as a search for manoeuvres takes them, without positions."""
        values = self.values()
        absent = np.full(len(self.time_secs), np.nan)
        noise = {name: noise_std(values[name]) for name in NOISY if name in values}
        searched: dict[str, Any] = {name: values.get(name, absent) for name in SEARCHED}
        return TrialSignals(
            self._dt_secs,
            positions=np.column_stack((absent, absent)),
            noise=noise,
            **searched,
        )
