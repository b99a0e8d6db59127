"""Periodogram of a residual, and Whittle's likelihood of white noise, red noise and a wave.

The mean of the periodogram is exact, whichever samples are missing: the transform of the
autocovariance times that of the taper. Sources: see `wave_fit`.
"""

from dataclasses import dataclass
from math import ceil, exp, log, nan, pi, sqrt

import numpy as np
from scipy.fft import dct, irfft, next_fast_len, rfft

from shiplog.compiled import compiled
from shiplog.types import FloatArray

MAX_BAND_SHARE = 0.9  # of half the sampling rate
BAND_START_SHARE = 0.7  # of the lowest frequency: the lower end of the band that is fitted
MIN_CYCLES_PER_SEGMENT = 6.0  # the taper blurs two ordinates to either side
SEGMENT_SAMPLES = 16_384  # enough to resolve a wave in most logs
TAPER_SHARE = 0.2  # of a segment, cosine; it costs a ninth of the information
MIN_SAMPLES = 100
MIN_ORDINATES = 32
MIN_RELATIVE_VARIATION = 1e-12  # of the largest value: below, a residual is constant

# the logarithms that are fitted; powers in units of the mean ordinate of the band
WHITE, RED, RATE, POWER, FREQUENCY, DAMPING = range(6)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Periodogram averaged over segments, up to half the sampling rate, and how it was computed.

    Attributes
    ----------
    omega
        (k,) the frequencies, rad/s.
    power
        (k,) the ordinates, in units of their mean over the fitted band.
    unit
        That mean, rad²/s²: white noise of this variance has it.
    first
        The ordinate with which the fitted band begins.
    searched
        The limits of the search for a wave, rad/s.
    overlap
        (length,) the autocorrelation of the tapers; the middle lag counts twice.
    half
        Half the length of the transform.
    dt_secs
        The sampling interval, s.
    weight
        The number of independent ordinates per ordinate.
    """

    omega: FloatArray
    power: FloatArray
    unit: float
    first: int
    searched: tuple[float, float]
    overlap: FloatArray
    half: int
    dt_secs: float
    weight: float

    @property
    def fitted(self) -> FloatArray:
        """Ordinates of the fitted band."""
        return self.power[self.first :]

    @property
    def begin(self) -> float:
        """Lower end of the band, rad/s."""
        return float(self.omega[self.first])

    @property
    def end(self) -> float:
        """Upper end of the band, rad/s."""
        return float(self.omega[-1])

    @property
    def resolution(self) -> float:
        """Distance of the ordinates, rad/s."""
        return float(self.omega[1])


def spectrum_of(
    residual: FloatArray, dt_secs: float, half_rate: float, lowest: float, frequency: float | None
) -> Spectrum | None:
    """Compute the spectrum of a residual of the yaw rate.

    Parameters
    ----------
    residual
        (n,) rad/s at the instants of a clock; NaN where nothing was measured.
    dt_secs
        The step of the clock, s.
    half_rate
        Half the sampling rate of the sensor, rad/s, up to which the spectrum is computed.
    lowest
        The lowest frequency of a wave, rad/s.
    frequency
        The frequency of the wave where it is given, rad/s; None searches for it.

    Returns
    -------
    The spectrum; None where the residual is too short or constant, or the band has too few
    ordinates.
    """
    at = np.flatnonzero(np.isfinite(residual))
    if len(at) < MIN_SAMPLES:
        return None
    values, taper = _segments(residual[at[0] : at[-1] + 1])
    length = taper.shape[1]
    slowest = MIN_CYCLES_PER_SEGMENT * 2 * pi / (length * dt_secs)
    lowest, highest = max(lowest, slowest), MAX_BAND_SHARE * half_rate
    searched = (lowest, highest) if frequency is None else (frequency, frequency)
    half = next_fast_len(length // 2 + 1, real=True)
    omega = pi / (half * dt_secs) * np.arange(half)
    omega = omega[: np.searchsorted(omega, half_rate)]
    first = int(np.searchsorted(omega, BAND_START_SHARE * min(lowest, searched[0])))
    if searched[0] < slowest or searched[1] < searched[0] or len(omega) - first < MIN_ORDINATES:
        return None
    energy = float(np.sum(taper**2))
    power = _squared(values * taper, 2 * half)[: len(omega)] / energy
    unit = float(np.mean(power[first:]))
    if unit <= MIN_RELATIVE_VARIATION**2 * float(np.max(residual[at] ** 2)):
        return None
    double = next_fast_len(2 * length, real=True)
    overlap = irfft(_squared(taper, double), double)[:length] / energy
    overlap[half] *= 2.0  # where the transform's symmetric halves meet
    alike = _squared(taper**2, 2 * half)[: len(omega)] / energy**2  # ordinates, by their distance
    return Spectrum(
        omega, power / unit, unit, first, searched, overlap, half, dt_secs,
        1 / float(alike[0] + 2 * np.sum(alike[1:])),
    )  # fmt: skip


def _segments(residual: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return segments of equal length, (s, length), zero where not measured, and their tapers."""
    count = ceil(len(residual) / SEGMENT_SAMPLES)
    length = ceil(len(residual) / count)
    values = np.full((count, length), nan)
    values.flat[: len(residual)] = residual - np.mean(residual[np.isfinite(residual)])
    known = np.isfinite(values)
    from scipy.signal.windows import tukey  # noqa: PLC0415 - scipy.signal takes long to import

    return np.where(known, values, 0.0), tukey(length, TAPER_SHARE) * known


def _squared(rows: FloatArray, size: int) -> FloatArray:
    """Return the squares of the rows' transforms of that size, summed over the rows."""
    return np.asarray(np.sum(np.abs(rfft(rows, size)) ** 2, axis=0))


def negative_log_likelihood(
    spectrum: Spectrum, theta: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Compute minus the logarithm of Whittle's likelihood, with its derivatives.

    Parameters
    ----------
    spectrum
        The spectrum of the residual.
    theta
        (6,) the logarithms of the parameters, in the order of `WHITE` to `DAMPING`: the powers of
        white noise and red noise, the rate of the red noise, 1/s, and the wave's power, frequency,
        rad/s, and damping ratio.

    Returns
    -------
    value
        Minus the logarithm of the likelihood.
    slope
        (6,) its derivative by `theta`.
    information
        (6, 6) Fisher's information.

    References
    ----------
    Whittle, "Estimation and information in stationary time series", 1953.
    """
    slope, information = np.zeros(6), np.zeros((6, 6))
    value = _whittle(spectrum.fitted, np.exp(theta), _shapes(spectrum, theta), slope, information)
    return spectrum.weight * value, spectrum.weight * slope, spectrum.weight * information


def mean_periodogram(spectrum: Spectrum, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the mean periodogram that the parameters predict.

    Parameters
    ----------
    spectrum
        The spectrum, which states segments and tapers.
    theta
        (6,) the logarithms of the parameters, as in `negative_log_likelihood`.

    Returns
    -------
    background
        (k,) of white and red noise, in the unit of `spectrum.power`, over the fitted band.
    wave
        (k,) of the wave.
    """
    shapes = _shapes(spectrum, theta)
    white, red, power = np.exp(theta[[WHITE, RED, POWER]])
    return white + red * shapes[0], power * shapes[2]


def _shapes(spectrum: Spectrum, theta: FloatArray) -> FloatArray:
    """Return mean periodograms and their derivatives, (5, k), for unit variances.

    The rows are red noise, its derivative by the rate, a wave, and its derivatives by frequency
    and damping.
    """
    folded = np.zeros((5, spectrum.half + 1))
    rate, frequency, damping = np.exp(theta[[RATE, FREQUENCY, DAMPING]])
    _folded(spectrum.overlap, spectrum.dt_secs, rate, frequency, damping, folded)
    return np.asarray(dct(folded, type=1, axis=1)[:, spectrum.first : len(spectrum.omega)])


@compiled
def _folded(
    overlap: FloatArray, dt: float, rate: float, frequency: float, damping: float,
    folded: FloatArray,
) -> None:  # fmt: skip
    """Add the autocovariances e^-ρτ and e^-aτ (cos ωτ - (a/ω) sin ωτ) to `folded`.

    Here a = ζ ω0 and ω² = ω0² - a². Their derivatives by ln ρ, ln ω0 and ln ζ are added, too; all
    are multiplied by the tapers' overlap, and folded as a transform of twice the length of
    `folded` folds them.
    """
    half = folded.shape[1] - 1
    a, one = damping * frequency, sqrt(1 - damping**2)
    omega, tilt = frequency * one, damping / one
    red, fading, c, s = 1.0, 1.0, 1.0, 0.0
    red_step, fading_step = exp(-rate * dt), exp(-a * dt)
    c_step, s_step = np.cos(omega * dt), np.sin(omega * dt)
    for t in range(len(overlap)):
        tau, at = t * dt, min(t, 2 * half - t)
        wave, turned = fading * (c - tilt * s), -fading * (s + tilt * c) * omega * tau
        folded[0, at] += overlap[t] * red
        folded[1, at] -= overlap[t] * red * rate * tau
        folded[2, at] += overlap[t] * wave
        folded[3, at] += overlap[t] * (turned - a * tau * wave)
        folded[4, at] -= overlap[t] * (
            a * tau * wave + tilt**2 * turned + tilt / one**2 * fading * s
        )
        red *= red_step
        fading *= fading_step
        c, s = c * c_step - s * s_step, s * c_step + c * s_step


@compiled
def _whittle(
    power: FloatArray, parameters: FloatArray, shapes: FloatArray, slope: FloatArray,
    information: FloatArray,
) -> float:  # fmt: skip
    """Return the sum of I/S + ln S over the ordinates; add to its slope and its information."""
    white, red, wave = parameters[WHITE], parameters[RED], parameters[POWER]
    total, parts = 0.0, np.empty(6)
    for k in range(len(power)):
        per_mean = 1 / (white + red * shapes[0, k] + wave * shapes[2, k])
        ratio = power[k] * per_mean
        total += ratio - log(per_mean)
        parts[WHITE] = white * per_mean
        parts[RED], parts[RATE] = red * per_mean * shapes[0, k], red * per_mean * shapes[1, k]
        for i in range(POWER, 6):
            parts[i] = wave * per_mean * shapes[i - 1, k]
        for i in range(6):
            slope[i] += (1 - ratio) * parts[i]
            for j in range(i + 1):
                information[i, j] += parts[i] * parts[j]
    for i in range(6):
        for j in range(i):
            information[j, i] = information[i, j]
    return total
