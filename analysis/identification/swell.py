"""A wave in what a fit leaves: a ship rolls and pitches in a swell, and her sensors with her."""

from collections.abc import Sequence
from math import pi

import numpy as np

from shiplog.types import FloatArray

LEAST_CYCLES = 4.0  # in a segment: of a slower one it cannot be told what it is
SHORTEST_SECS = 2.0  # of a period; a faster one harms no fit
OVERSAMPLED = 4  # frequencies to each that the segment's length resolves
MOST = 0.5  # of what stays off: where a wave is less, it is not a wave alone
SURE = 40.0  # of a peak in a periodogram of chi-squared numbers: one in a hundred million


def swell_frequency(
    residuals: FloatArray, usual: FloatArray, dt: float, slow: Sequence[float] = ()
) -> float | None:
    """The frequency, in rad/s, of the wave that stands out most in a segment's residuals, if any.

    Both are (n, c), the residuals with NaN; each output's are weighed by their usual std. Of an
    output's `slow` part, a std, a wave must be able to explain the half. The
    periodogram is Lomb's, "Least-squares frequency analysis of unequally spaced data", 1976.
    """
    n = len(residuals)
    span = n * dt
    lowest, highest = LEAST_CYCLES / span, min(1 / SHORTEST_SECS, 0.4 / dt)
    grid = np.arange(lowest, highest, 1 / (OVERSAMPLED * span))
    if not len(grid):
        return None
    best, found = 1.0, None
    for c in range(residuals.shape[1]):
        known = np.isfinite(residuals[:, c])
        if known.sum() < 2:
            continue
        power = _periodogram(residuals[:, c], usual[:, c], grid * dt)
        whole = slow[c] ** 2 * float(np.sum(usual[known, c] ** -2.0)) if slow else 0.0
        peak = int(np.argmax(power))
        share = power[peak] / max(SURE, MOST * whole)
        if share > best:
            best, found = float(share), float(2 * pi * grid[peak])
    return found


def _periodogram(residual: FloatArray, std: FloatArray, cycles: FloatArray) -> FloatArray:
    """By how much a wave of so many cycles a sample lessens the weighted sum of squares.

    By a Fourier transform, padded so that its frequencies lie close together.
    """
    known = np.isfinite(residual)
    weight = np.where(known, std**-2.0, 0.0)
    off = np.where(known, residual, 0.0)
    off = off - np.average(off, weights=weight) * known
    length = OVERSAMPLED * len(off)
    spectrum = np.abs(np.fft.rfft(weight * off, length)) ** 2
    power = 2 * spectrum / np.sum(weight)
    return np.asarray(np.interp(cycles, np.fft.rfftfreq(length), power))
