"""Fit of a wave's shaping filter to the spectrum of a slow filter's innovations.

The residual is modelled as the sum of white noise, a red part of one pole (the error of the ship
model) and a wave, kw s / (s² + 2 ζ ω0 s + ω0²) of white noise (`design.shaping.wave_filter`).
Their autocovariances give the exact mean of the periodogram, whichever samples are missing: the
transform of the autocovariance times that of the taper. The parameters maximise the likelihood of
the periodogram, its ordinates taken as independent and exponential about that mean. Because the
mean is exact, neither a short log nor the aliases of a slow sensor bias them.

Sources: Whittle, "Estimation and information in stationary time series", 1953; Sykulski, Olhede,
Guillaumin, Lilly and Early, "The debiased Whittle likelihood", 2019; Guillaumin, Sykulski, Olhede
and Simons, "The debiased spatial Whittle likelihood", 2022, for missing samples.
"""

from math import exp, inf, log, nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.design.matrices import as_number
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .noise_model import Wave
from .whittle import (
    DAMPING,
    FREQUENCY,
    POWER,
    RATE,
    RED,
    WHITE,
    Spectrum,
    mean_periodogram,
    negative_log_likelihood,
    spectrum_of,
)

# where a wave is searched
MIN_FREQUENCY = 0.25  # rad/s: ships turn below it; seas and swell are above
MAX_DAMPING = 0.5  # above it, a wave cannot be distinguished from a red part
MIN_DAMPING = 1e-7  # of a regular wave

# the search for the maximum likelihood
MAX_ITERATIONS = 60
MAX_LOG_STEP = 2.0  # of the logarithm of a parameter, per iteration
MIN_GAIN = 1e-3  # of the log likelihood: an iteration that gains and predicts less is the last

# the decision
MIN_DECAY_PER_SEGMENT = 0.5  # ζ ω0 times the segment: a slower decay cannot be measured
MAX_FALSE_ALARM_SHARE = 0.01  # of logs without a wave
MIN_PEAK_ORDINATES = 5.0  # in a peak and in its flanks: fewer scatter too much


def fit_wave(
    residual: FloatArray,
    dt_secs: float,
    interval: float,
    *,
    lowest: float = MIN_FREQUENCY,
    frequency: float | None = None,
    damping: float | None = None,
    std: float | None = None,
) -> Wave | None:
    """Fit the shaping filter of a wave to the residual of a slow filter.

    The residual must be that of a filter much slower than `lowest`: a wave that the filter follows
    is not in its residual. A slower wave, such as the paper's sine of 0.1 rad/s, is attributed to
    the red part. The search ends at 0.9 of half the sensor's sampling rate. A model in a basin
    turns faster than a ship, by the root of its scale, and needs a higher `lowest`.

    The evidence needed: in a band of m ordinates of mean x, twice the log likelihood ratio
    2 m (x - 1 - ln x) exceeds t with a probability of at most exp(-t/2) (Chernoff's bound); of K
    bands, in one log of a hundred, 2 ln(100 K). K is the number of ordinates searched.

    Parameters
    ----------
    residual
        (n,): innovations of the yaw rate, rad/s; NaN where not measured.
    dt_secs
        Step of the clock, s.
    interval
        Typical number of clock steps from sample to sample.
    lowest
        Where the search begins, rad/s.
    frequency, damping, std
        Stated parameters (rad/s, 1, rad/s), which are kept; None where they are fitted.

    Returns
    -------
    Wave or None
        None where there are fewer than 100 measurements, where the residual is constant, where the
        log is shorter than six periods of the stated frequency, or where the sensor is too slow
        for `lowest`; a wave of which all three parameters are stated is returned even then, with
        evidence NaN. A wave that decays too slowly to be measured (a regular one in a basin) gets
        the damping of one that decays over two segments.

    Raises
    ------
    UsageError
        A parameter is out of range, or the frequency above half the sampling rate.
    """
    _positive("lowest", lowest)
    _positive("the wave's frequency", frequency)
    _positive("the wave's damping", damping)
    _positive("the wave's std", std)
    if damping is not None and damping > 1:
        raise UsageError(f"the wave's damping is {damping:g}; expected one of at most 1")
    half_rate = _half_rate(dt_secs, interval, frequency)
    spectrum = spectrum_of(np.asarray(residual, np.float64), dt_secs, half_rate, lowest, frequency)
    if spectrum is None:
        if frequency is None or damping is None or std is None:
            return None
        return Wave(frequency, damping, std, nan)
    found, evidence = _likeliest(spectrum, _logarithms(spectrum.unit, frequency, damping, std))
    omega = exp(found[FREQUENCY]) if frequency is None else frequency
    zeta = max(
        exp(found[DAMPING]), MIN_DECAY_PER_SEGMENT / (omega * len(spectrum.overlap) * dt_secs)
    )
    places = np.sum(spectrum.omega > lowest) if frequency is None else 1
    return Wave(
        frequency=omega,
        damping=zeta if damping is None else damping,
        std=sqrt(_held_power(spectrum, found) * spectrum.unit) if std is None else std,
        evidence=evidence,
        needed=2 * log(places / MAX_FALSE_ALARM_SHARE),
        contrast=_contrast(spectrum, omega, exp(found[DAMPING])),
    )


def _half_rate(dt_secs: float, interval: float, frequency: float | None) -> float:
    """Return the Nyquist frequency of the sensor, rad/s."""
    _positive("dt_secs", dt_secs)
    half_rate = pi / (as_number("interval", interval, least=1.0) * dt_secs)
    if frequency is not None and frequency >= half_rate:
        raise UsageError(
            f"filter.wave_frequency is {frequency:g} rad/s, and a sample every"
            f" {interval * dt_secs:g} s resolves none above {half_rate:g}; state a lower one"
        )
    return half_rate


def _positive(name: str, value: float | None) -> None:
    if value is not None:
        as_number(name, value, least=np.finfo(float).tiny)


def _logarithms(
    unit: float, frequency: float | None, damping: float | None, std: float | None
) -> FloatArray:
    """Return the logarithms (6,) of the stated parameters; NaN for the others."""
    power = None if std is None else std**2 / unit
    zeta = None if damping is None else min(damping, 0.999)  # at 1 it is of another form
    return np.log([nan, nan, nan, *(nan if x is None else x for x in (power, frequency, zeta))])


def _likeliest(spectrum: Spectrum, known: FloatArray) -> tuple[FloatArray, float]:
    """The parameters' logarithms, of which those `known` stay, and the evidence for the wave.

    The background found without a wave may have taken it for its red part, and a regular wave is
    too narrow to be come upon from a broad one: hence three starts.
    """
    white, red = _backgrounds(spectrum)
    alone, without = _minimise(spectrum, [white, red], np.isin(np.arange(6), (WHITE, RED, RATE)))
    beside, above = _likeliest_place(spectrum, alone), _likeliest_place(spectrum, white)
    regular = np.array([*above[:2], log(MIN_DAMPING)])
    pairs = ((alone, beside), (white, above), (white, regular))
    starts = [np.concatenate((background[:3], place)) for background, place in pairs]
    free = np.isnan(known)
    found, with_it = _minimise(spectrum, [np.where(free, start, known) for start in starts], free)
    return found, 2 * (without - with_it)


def _backgrounds(spectrum: Spectrum) -> list[FloatArray]:
    """White noise as low as the spectrum anywhere is, with little red or what it begins with."""
    parts = [float(np.mean(part)) for part in np.array_split(spectrum.fitted, 16)]
    rate = spectrum.begin / 2
    red = parts[0] * spectrum.dt_secs * (spectrum.begin**2 + rate**2) / (2 * rate)
    no_wave = 1e-12, sqrt(spectrum.begin * spectrum.end), 0.1
    return [np.log([min(parts), part, rate, *no_wave]) for part in (1e-3, red)]


def _likeliest_place(spectrum: Spectrum, background: FloatArray) -> FloatArray:
    """The logarithms of power, frequency and damping of what is most too high for a background.

    Of m ordinates x times as high as their mean, the log likelihood ratio is m (x - 1 - ln x).
    """
    omega, (mean, _) = spectrum.omega[spectrum.first :], mean_periodogram(spectrum, background)
    ratios, excess = (
        np.cumsum(np.insert(values, 0, 0.0))
        for values in (spectrum.fitted / mean, spectrum.fitted - mean)
    )
    low, high = (
        spectrum.searched[0] - spectrum.resolution,
        spectrum.searched[1] + spectrum.resolution,
    )
    best, run = -inf, slice(0, 1)
    for width in 2 ** np.arange(int(np.log2(len(omega)))):
        x = np.maximum((ratios[width:] - ratios[:-width]) / width, 1.0)
        centres = (omega[: len(x)] + omega[width - 1 :]) / 2
        gain = np.where((centres >= low) & (centres <= high), width * (x - 1 - np.log(x)), -1.0)
        at = int(np.argmax(gain))
        if gain[at] > best:
            best, run = float(gain[at]), slice(at, at + int(width))
    above = np.maximum(spectrum.fitted[run] - mean[run], 1e-9)
    frequency = np.clip(np.sum(above * omega[run]) / np.sum(above), *spectrum.searched)
    # over all ordinates of the transform; a slow sensor's repeat those of the band
    variance = max(excess[run.stop] - excess[run.start], 1e-3) / len(spectrum.omega)
    # a wave's (∫S)²/∫S² is 2π ζ ω0, and half of it where the ordinates are exponential
    width = np.sum(above) ** 2 / np.sum(above**2) * spectrum.resolution
    damping = np.clip(width / (pi * frequency), 1e-4, 0.4)
    return np.log([variance, frequency, damping])


def _minimise(
    spectrum: Spectrum, starts: list[FloatArray], free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """Minimise the negative log likelihood over the `free` parameters, from several starts.

    Returns the parameters and the minimum.
    """
    fits = [_newton_descent(spectrum, start, free) for start in starts]
    return min(fits, key=lambda fit: fit[1])


def _newton_descent(
    spectrum: Spectrum, start: FloatArray, free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """Levenberg's and Marquardt's steps on Fisher's information, within the bounds."""
    low = np.log([1e-4, 1e-8, spectrum.begin / 10, 1e-8, spectrum.searched[0], MIN_DAMPING])
    high = np.log([1e2, 1e8, spectrum.end / 2, 1e4, spectrum.searched[1], MAX_DAMPING])
    theta, caution = np.where(free, np.clip(start, low, high), start), 1e-3
    value, slope, information = negative_log_likelihood(spectrum, theta)
    for _ in range(MAX_ITERATIONS):
        held = ((theta <= low) & (slope > 0)) | ((theta >= high) & (slope < 0))
        moved = np.flatnonzero(free & ~held)
        careful = information + np.diag(caution * np.diag(information) + 1e-6)
        step = np.zeros(6)
        step[moved] = np.linalg.solve(careful[np.ix_(moved, moved)], -slope[moved])
        step = np.clip(theta + np.clip(step, -MAX_LOG_STEP, MAX_LOG_STEP), low, high) - theta
        step[~free] = 0.0
        expected = -float(slope @ step + step @ information @ step / 2)
        found = negative_log_likelihood(spectrum, theta + step)
        gained = value - found[0]
        if gained > 0:
            theta, (value, slope, information) = theta + step, found
        if max(abs(gained), abs(expected)) < MIN_GAIN:
            break
        if gained < max(expected, 0.0) / 4:
            caution = 4 * caution + 1e-2
        elif gained > expected / 2:
            caution /= 5
    return theta, value


def _held_power(spectrum: Spectrum, found: FloatArray) -> float:
    """The power seen where the wave's is above the background's.

    As good as the likeliest power for a random wave, and much better for a regular one, which the
    likelihood takes for random.
    """
    background, wave = mean_periodogram(spectrum, found)
    own = wave > background
    excess = float(np.sum((spectrum.fitted - background)[own]))
    return exp(found[POWER]) * (excess / float(np.sum(wave[own])) if excess > 0 else 1.0)


def _contrast(spectrum: Spectrum, frequency: float, damping: float) -> float:
    """By how much the spectrum about a frequency is above the higher of its flanks.

    In standard errors of the logarithm of their ratio. The flanks begin where a wave has fallen to
    a fifth of its peak, and end where it has fallen to a seventeenth.
    """
    zeta = max(damping, MIN_PEAK_ORDINATES / 2 * spectrum.resolution / frequency)

    def ordinates(start: float, end: float, fewest: int) -> FloatArray:
        from_peak = zeta * np.array([start, end])
        first, last = np.searchsorted(
            spectrum.omega, frequency * (from_peak + np.hypot(1, from_peak))
        )
        last = min(last, len(spectrum.omega))
        return spectrum.power[max(min(first, last - fewest), 1) : last]

    peak = ordinates(-1, 1, 2)
    fewest = max(2, len(peak) // 4)
    contrasts = []
    for flank in (ordinates(-4, -2, fewest), ordinates(2, 4, fewest)):
        error = sqrt((1 / len(peak) + 1 / len(flank)) / spectrum.weight)
        contrasts.append(log(np.mean(peak) / np.mean(flank)) / error)
    return min(contrasts)
