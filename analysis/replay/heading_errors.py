"""Errors of a measured heading, from its difference to the integral of the yaw rate.

A compass errs by more than white noise: by its own dynamics, by an error of its scale in a turn, by
its lag. A filter that takes such errors as white believes the heading too much. The structure
function of the difference shows their size and how long they last.
"""

from dataclasses import dataclass
from math import e, exp, sqrt

import numpy as np

from analysis.filters.noise_model import SlowError
from analysis.signals.signal_stats import SignalStats
from shiplog.types import FloatArray

MIN_LAG_SECS = 1.0
MAX_LAG_SHARE = 1 / 4  # of the differences: longer lags have too few independent pairs
LAG_RATIO = 2**0.5  # of a lag to the one before
MEAN_SHARE = 1 / 8  # of a lag: values are averaged over so long, which reduces white noise
MAX_RESOLVED_SHARE = 1 / 16  # of the differences: an error that lasts longer shows no limit
TREND_LOSS = 6 / 5  # of a random walk's changes, over the lag's share: a fitted line removes it
MIN_EXCESS, MIN_EXCESS_STDS = 0.2, 2.0  # over what white noise explains, to be an error
MIN_SAMPLES = 50


def heading_errors(stats: SignalStats, white_std: float) -> tuple[float, SlowError | None]:
    """Return the white noise and the slow error of the heading in the first part of a trial.

    Half the mean square of the changes of the difference in a time t is, for a Gauss-Markov error
    of variance s² and correlation time T, s² (1 - exp(-t/T)) beside r + q t / 2 by white noise of
    heading and yaw rate. The excess over the latter gives s² as its largest value, and T where it
    has risen to 1 - 1/e of that. Where T is so long that no limit is seen, the change in the
    longest time is taken as that of an error whose T is the length of the trial. What remains at
    the shortest time, by errors that last less than a second, counts as white.

    Parameters
    ----------
    stats
        The statistics of the signals, with the heading's single values as ``compass``.
    white_std
        The white noise of the heading by its third differences, rad.

    Returns
    -------
    white_std
        Standard deviation of the white noise, rad; not less than that given.
    slow
        Standard deviation, rad, and correlation time, s. None where white noise explains the
        difference, or where there are too few samples.
    """
    structure = _structure(_difference(stats), stats.noise_std[0])
    if structure is None:
        return white_std, None
    expected = structure.walk + white_std**2 / structure.averaged
    excess = structure.changes - expected
    errors = np.sqrt(4 / 3 * structure.lags / structure.secs)  # of a random walk's changes
    significant = excess > (MIN_EXCESS + MIN_EXCESS_STDS * errors) * expected
    slow = _gauss_markov(structure, excess) if significant.any() else None
    fast = excess[0] - (_changes_of(slow, structure.lags[0]) if slow else 0.0)
    if significant[0] and fast > 0:
        white_std = sqrt(white_std**2 + fast)
    return white_std, slow


@dataclass(frozen=True, eq=False)
class _Difference:
    """Heading minus integral of the yaw rate.

    Attributes
    ----------
    secs, values
        (n,) times without gaps, s, and values without linear trend, rad.
    weights
        Mean square of the time, s, for which each sample of the yaw rate stands, per second.
    """

    secs: FloatArray
    values: FloatArray
    weights: float


@dataclass(frozen=True, eq=False)
class _Structure:
    """The structure function of a difference at k lags.

    Attributes
    ----------
    secs
        The length of the difference, s.
    lags
        (k,) s.
    changes
        (k,) half the mean squares of the changes over the lags, rad².
    walk
        (k,) what the white noise of the yaw rate gives, rad².
    averaged
        (k,) the number of values of each mean.
    """

    secs: float
    lags: FloatArray
    changes: FloatArray
    walk: FloatArray
    averaged: FloatArray


def _gauss_markov(structure: _Structure, excess: FloatArray) -> SlowError:
    """Return the Gauss-Markov error that gives an excess of changes, (k,)."""
    variance = float(excess.max())
    secs = float(structure.lags[excess >= (1 - 1 / e) * variance][0])
    if secs > MAX_RESOLVED_SHARE * structure.secs and excess[-1] > 0:
        secs = structure.secs
        share = structure.lags[-1] / secs
        variance = float(excess[-1]) / (1 - exp(-share)) / (1 - TREND_LOSS * share)
    return SlowError(sqrt(variance), secs)


def _changes_of(error: SlowError, lag: float) -> float:
    return error.std**2 * (1 - exp(-lag / error.secs))


def _difference(stats: SignalStats) -> _Difference:
    """Return the difference without its linear trend, which a bias of the yaw rate gives.

    The stretches between gaps of the yaw rate are joined without a step.
    """
    head = stats.head
    rate, heading, dt = head["yaw_rate"], head["compass"], head.dt_secs
    known, at = np.flatnonzero(np.isfinite(rate)), np.arange(len(rate))
    integral = np.interp(at, known, rate[known])
    integral = np.concatenate(([0.0], np.cumsum((integral[1:] + integral[:-1]) * dt / 2)))
    spacings = np.diff(known)
    after = np.clip(np.searchsorted(known, at), 1, len(known) - 1)
    in_gap = (spacings[after - 1] > stats.gap_steps[0]) & (at != known[after])
    stretch = np.cumsum(np.diff(in_gap.astype(int), prepend=0) > 0)
    used = np.isfinite(heading) & ~in_gap & (at >= known[0]) & (at <= known[-1])
    within = np.diff(stretch[used]) == 0
    secs, values = (
        np.concatenate(([0.0], np.cumsum(np.where(within, np.diff(each[used]), 0.0))))
        for each in (at * dt, heading - integral)
    )
    if len(values) >= MIN_SAMPLES:
        values = values - np.polyval(np.polyfit(secs, values, 1), secs)
    spacings = spacings[spacings <= stats.gap_steps[0]] * dt
    spans = (spacings[1:] + spacings[:-1]) / 2
    return _Difference(secs, values, float(np.sum(spans**2) / np.sum(spans)))


def _structure(difference: _Difference, noise_std: float) -> _Structure | None:
    """Return the structure function; None where there are too few values."""
    values, length = difference.values, float(difference.secs[-1])
    if len(values) < MIN_SAMPLES or MAX_LAG_SHARE * length < MIN_LAG_SECS:
        return None
    step = length / (len(values) - 1)
    exponents = np.arange(1 + np.log(len(values)) / np.log(LAG_RATIO))
    counts = np.unique(np.round(LAG_RATIO**exponents).astype(int))
    counts = counts[(counts * step >= MIN_LAG_SECS) & (counts * step <= MAX_LAG_SHARE * length)]
    averaged = np.maximum(np.round(MEAN_SHARE * counts).astype(int), 1)
    sums = np.concatenate(([0.0], np.cumsum(values)))
    changes = np.empty(len(counts))
    for k, (lag, width) in enumerate(zip(counts, averaged, strict=True)):
        means = (sums[width:] - sums[:-width]) / width
        changes[k] = np.mean((means[lag:] - means[:-lag]) ** 2) / 2
    walk = noise_std**2 * difference.weights / 2 * (counts - (averaged - 1) / 3) * step
    return _Structure(length, counts * step, changes, walk, averaged.astype(float))
