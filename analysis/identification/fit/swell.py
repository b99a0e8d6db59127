"""A swell in the residuals of a fit: a narrow peak in their periodogram.

In a swell the ship rolls and pitches, and the motion of its sensors appears in their measurements.
"""

from collections.abc import Sequence
from math import pi

import numpy as np

from shiplog.types import FloatArray

MIN_CYCLES = 4.0  # in a segment: slower waves cannot be distinguished from other slow errors
MIN_PERIOD_SECS = 2.0  # faster waves do not disturb a fit
OVERSAMPLING = 4  # frequencies for each one that the segment's length resolves
MIN_SLOW_SHARE = 0.5  # of an output's slow variance that the wave has to explain
MIN_PEAK = 40.0  # of a periodogram of white noise, whose ordinates are chi-squared: 1 in 1e8


def swell_frequency(
    residuals: FloatArray, typical: FloatArray, dt: float, slow: Sequence[float] = ()
) -> float | None:
    """Find the frequency of the most significant wave in a segment's residuals.

    Parameters
    ----------
    residuals
        (n, c), NaN where not measured.
    typical
        (n, c) their standard deviations, by which they are weighted.
    dt
        Sample interval, s.
    slow
        (c,) standard deviation of each output's slow noise, of which the wave has to explain at
        least half; by default none.

    Returns
    -------
    float or None
        In rad/s; None where no peak is significant.

    References
    ----------
    N. R. Lomb, "Least-squares frequency analysis of unequally spaced data", Astrophysics and Space
    Science 39, 1976.
    """
    n = len(residuals)
    span = n * dt
    lowest, highest = MIN_CYCLES / span, min(1 / MIN_PERIOD_SECS, 0.4 / dt)
    grid = np.arange(lowest, highest, 1 / (OVERSAMPLING * span))
    if not len(grid):
        return None
    best, frequency = 1.0, None
    for c in range(residuals.shape[1]):
        measured = np.isfinite(residuals[:, c])
        if measured.sum() < 2:
            continue
        power = _periodogram(residuals[:, c], typical[:, c], grid * dt)
        slow_power = slow[c] ** 2 * float(np.sum(typical[measured, c] ** -2.0)) if slow else 0.0
        peak = int(np.argmax(power))
        significance = power[peak] / max(MIN_PEAK, MIN_SLOW_SHARE * slow_power)
        if significance > best:
            best, frequency = float(significance), float(2 * pi * grid[peak])
    return frequency


def _periodogram(residual: FloatArray, std: FloatArray, cycles: FloatArray) -> FloatArray:
    """Return by how much a wave reduces the weighted sum of squares.

    `cycles` are the wave's frequencies in cycles per sample. A Fourier transform is padded with
    zeros, so that its frequencies lie close together, and interpolated.
    """
    measured = np.isfinite(residual)
    weight = np.where(measured, std**-2.0, 0.0)
    r = np.where(measured, residual, 0.0)
    r = r - np.average(r, weights=weight) * measured
    length = OVERSAMPLING * len(r)
    spectrum = np.abs(np.fft.rfft(weight * r, length)) ** 2
    power = 2 * spectrum / np.sum(weight)
    return np.asarray(np.interp(cycles, np.fft.rfftfreq(length), power))
