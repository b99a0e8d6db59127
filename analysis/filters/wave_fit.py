"""Fit of a wave's shaping filter to the spectrum of a slow filter's innovations.

The residual is taken for a sum of white noise, a red part of one pole (what the model does not know
of the ship) and a wave, kw s / (s² + 2 ζ ω0 s + ω0²) of white noise (`design.shaping.wave_filter`).
Their autocovariances are known, and so, whatever is missing, is the mean of the periodogram: the
transform of the autocovariance times the taper's own. The parameters are those under which the
periodogram is likeliest, its ordinates taken for independent and exponential about that mean.
Because the mean is exact, neither a short log nor a slow sensor's aliases bias them.

Sources: Whittle, "Estimation and information in stationary time series", 1953; Sykulski, Olhede,
Guillaumin, Lilly and Early, "The debiased Whittle likelihood", 2019; Guillaumin, Sykulski, Olhede
and Simons, "The debiased spatial Whittle likelihood", 2022, of what is missing.
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
    spectrum_of,
    unlikelihood,
)

# where a wave is looked for
LOWEST = 0.25  # rad/s: a ship turns below it, and seas and swell are above
BROADEST = 0.5  # damping: beyond it there is no wave, but a red part
LEAST_DAMPING = 1e-7  # as good as none, of a regular wave

# the way to the highest likelihood
STEPS = 60  # at the most
LONGEST = 2.0  # of a step, in a logarithm
ENOUGH = 1e-3  # of the log likelihood: a step that gains and promises less is the last

# what is said of it
LEAST_DECAY = 0.5  # ζ ω0 times a segment: a wave that fades more slowly shows no fading
FALSE_CLAIMS = 0.01  # the share of logs without a wave that may claim one
PEAK_ORDINATES = 5.0  # at the least, in a peak and in its flanks: fewer scatter too much


def fit_wave(
    residual: FloatArray,
    dt_secs: float,
    interval: float,
    *,
    lowest: float = LOWEST,
    frequency: float | None = None,
    damping: float | None = None,
    std: float | None = None,
) -> Wave | None:
    """The wave that a residual (n,) of the yaw rate, rad/s, most likely holds; NaN: not measured.

    `dt_secs` is that of the clock, `interval` the usual number of its instants from sample to
    sample. The residual is to be that of a filter much slower than `lowest`, rad/s, where the
    search begins: a wave that the filter follows is not in it, and a slower one, as the paper's
    sine of 0.1 rad/s, is left to the red part. A model in a basin turns faster than a ship, by the
    root of its scale, and wants a higher one. The search ends at 0.9 of half the sensor's rate.
    What is stated, of `frequency`, `damping` and `std`, is kept as it is. A wave whose fading does
    not show (a regular one in a basin) has the damping of one that fades in two segments.

    The evidence that is needed: in a place of m ordinates of mean x, twice the log likelihood ratio
    2 m (x - 1 - ln x) exceeds t with a probability of e^(-t/2) at the most (Chernoff's bound); of
    K places one in a hundred logs exceeds 2 ln(100 K). K is the number of ordinates searched.

    None where it cannot be told: of fewer than 100 measurements, of a residual that never changes,
    of less than six periods of the frequency stated, or of a sensor too slow for the lowest one. A
    wave that is stated altogether is known even there, with evidence NaN. Raises `UsageError` for a
    number out of range, and for a frequency beyond half the sensor's rate.
    """
    _positive("lowest", lowest)
    _positive("the wave's frequency", frequency)
    _positive("the wave's damping", damping)
    _positive("the wave's std", std)
    if damping is not None and damping > 1:
        raise UsageError(f"the wave's damping is {damping:g}; expected one of at most 1")
    half_rate = _half_rate(dt_secs, interval, frequency)
    seen = spectrum_of(np.asarray(residual, np.float64), dt_secs, half_rate, lowest, frequency)
    if seen is None:
        if frequency is None or damping is None or std is None:
            return None
        return Wave(frequency, damping, std, nan)
    found, evidence = _likeliest(seen, _logarithms(seen.unit, frequency, damping, std))
    omega = exp(found[FREQUENCY]) if frequency is None else frequency
    zeta = max(exp(found[DAMPING]), LEAST_DECAY / (omega * len(seen.overlap) * dt_secs))
    places = np.sum(seen.omega > lowest) if frequency is None else 1
    return Wave(
        frequency=omega,
        damping=zeta if damping is None else damping,
        std=sqrt(_held_power(seen, found) * seen.unit) if std is None else std,
        evidence=evidence,
        needed=2 * log(places / FALSE_CLAIMS),
        contrast=_contrast(seen, omega, exp(found[DAMPING])),
    )


def _half_rate(dt_secs: float, interval: float, frequency: float | None) -> float:
    """The frequency beyond which the sensor shows nothing, rad/s."""
    _positive("dt_secs", dt_secs)
    half_rate = pi / (as_number("interval", interval, least=1.0) * dt_secs)
    if frequency is not None and frequency >= half_rate:
        raise UsageError(
            f"the wave's frequency is {frequency:g} rad/s, and a sample every"
            f" {interval * dt_secs:g} s shows none beyond {half_rate:g}; state a lower one"
        )
    return half_rate


def _positive(name: str, value: float | None) -> None:
    if value is not None:
        as_number(name, value, least=np.finfo(float).tiny)


def _logarithms(
    unit: float, frequency: float | None, damping: float | None, std: float | None
) -> FloatArray:
    """Of the parameters (6,), those that are stated; NaN for the others."""
    power = None if std is None else std**2 / unit
    zeta = None if damping is None else min(damping, 0.999)  # at 1 it is of another form
    return np.log([nan, nan, nan, *(nan if x is None else x for x in (power, frequency, zeta))])


def _likeliest(seen: Spectrum, known: FloatArray) -> tuple[FloatArray, float]:
    """The parameters' logarithms, of which those `known` stay, and the evidence for the wave.

    The background found without a wave may have taken it for its red part, and a regular wave is
    too narrow to be come upon from a broad one: hence three starts.
    """
    white, red = _backgrounds(seen)
    alone, without = _least(seen, [white, red], np.isin(np.arange(6), (WHITE, RED, RATE)))
    beside, above = _likeliest_place(seen, alone), _likeliest_place(seen, white)
    regular = np.array([*above[:2], log(LEAST_DAMPING)])
    pairs = ((alone, beside), (white, above), (white, regular))
    starts = [np.concatenate((background[:3], place)) for background, place in pairs]
    free = np.isnan(known)
    found, with_it = _least(seen, [np.where(free, start, known) for start in starts], free)
    return found, 2 * (without - with_it)


def _backgrounds(seen: Spectrum) -> list[FloatArray]:
    """White noise as low as the spectrum anywhere is, with little red or what it begins with."""
    parts = [float(np.mean(part)) for part in np.array_split(seen.fitted, 16)]
    rate = seen.begin / 2
    red = parts[0] * seen.dt_secs * (seen.begin**2 + rate**2) / (2 * rate)
    no_wave = 1e-12, sqrt(seen.begin * seen.end), 0.1
    return [np.log([min(parts), part, rate, *no_wave]) for part in (1e-3, red)]


def _likeliest_place(seen: Spectrum, background: FloatArray) -> FloatArray:
    """The logarithms of power, frequency and damping of what is most too high for a background.

    Of m ordinates x times as high as their mean, the log likelihood ratio is m (x - 1 - ln x).
    """
    omega, (mean, _) = seen.omega[seen.first :], mean_periodogram(seen, background)
    ratios, excess = (
        np.cumsum(np.insert(values, 0, 0.0)) for values in (seen.fitted / mean, seen.fitted - mean)
    )
    low, high = seen.searched[0] - seen.resolution, seen.searched[1] + seen.resolution
    best, run = -inf, slice(0, 1)
    for width in 2 ** np.arange(int(np.log2(len(omega)))):
        x = np.maximum((ratios[width:] - ratios[:-width]) / width, 1.0)
        centres = (omega[: len(x)] + omega[width - 1 :]) / 2
        gain = np.where((centres >= low) & (centres <= high), width * (x - 1 - np.log(x)), -1.0)
        at = int(np.argmax(gain))
        if gain[at] > best:
            best, run = float(gain[at]), slice(at, at + int(width))
    above = np.maximum(seen.fitted[run] - mean[run], 1e-9)
    frequency = np.clip(np.sum(above * omega[run]) / np.sum(above), *seen.searched)
    # over all ordinates of the transform; a slow sensor's repeat those of the band
    variance = max(excess[run.stop] - excess[run.start], 1e-3) / len(seen.omega)
    # a wave's (∫S)²/∫S² is 2π ζ ω0, and half of it where the ordinates are exponential
    width = np.sum(above) ** 2 / np.sum(above**2) * seen.resolution
    damping = np.clip(width / (pi * frequency), 1e-4, 0.4)
    return np.log([variance, frequency, damping])


def _least(
    seen: Spectrum, starts: list[FloatArray], free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """The parameters under which minus the log likelihood is least, and how much it is then.

    Those that are `free` are sought from each start, the others stay.
    """
    fits = [_descended(seen, start, free) for start in starts]
    return min(fits, key=lambda fit: fit[1])


def _descended(
    seen: Spectrum, start: FloatArray, free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """Levenberg's and Marquardt's steps on Fisher's information, within the bounds."""
    low = np.log([1e-4, 1e-8, seen.begin / 10, 1e-8, seen.searched[0], LEAST_DAMPING])
    high = np.log([1e2, 1e8, seen.end / 2, 1e4, seen.searched[1], BROADEST])
    theta, caution = np.where(free, np.clip(start, low, high), start), 1e-3
    value, slope, information = unlikelihood(seen, theta)
    for _ in range(STEPS):
        held = ((theta <= low) & (slope > 0)) | ((theta >= high) & (slope < 0))
        moved = np.flatnonzero(free & ~held)
        careful = information + np.diag(caution * np.diag(information) + 1e-6)
        step = np.zeros(6)
        step[moved] = np.linalg.solve(careful[np.ix_(moved, moved)], -slope[moved])
        step = np.clip(theta + np.clip(step, -LONGEST, LONGEST), low, high) - theta
        step[~free] = 0.0
        expected = -float(slope @ step + step @ information @ step / 2)
        found = unlikelihood(seen, theta + step)
        gained = value - found[0]
        if gained > 0:
            theta, (value, slope, information) = theta + step, found
        if max(abs(gained), abs(expected)) < ENOUGH:
            break
        if gained < max(expected, 0.0) / 4:
            caution = 4 * caution + 1e-2
        elif gained > expected / 2:
            caution /= 5
    return theta, value


def _held_power(seen: Spectrum, found: FloatArray) -> float:
    """The power seen where the wave's is above the background's.

    As good as the likeliest power for a random wave, and much better for a regular one, which the
    likelihood takes for random.
    """
    background, wave = mean_periodogram(seen, found)
    own = wave > background
    excess = float(np.sum((seen.fitted - background)[own]))
    return exp(found[POWER]) * (excess / float(np.sum(wave[own])) if excess > 0 else 1.0)


def _contrast(seen: Spectrum, frequency: float, damping: float) -> float:
    """By how much the spectrum about a frequency is above the higher of its flanks.

    In standard errors of the logarithm of their ratio. The flanks begin where a wave has fallen to
    a fifth of its peak, and end where it has fallen to a seventeenth.
    """
    zeta = max(damping, PEAK_ORDINATES / 2 * seen.resolution / frequency)

    def ordinates(start: float, end: float, fewest: int) -> FloatArray:
        from_peak = zeta * np.array([start, end])
        first, last = np.searchsorted(seen.omega, frequency * (from_peak + np.hypot(1, from_peak)))
        last = min(last, len(seen.omega))
        return seen.power[max(min(first, last - fewest), 1) : last]

    peak = ordinates(-1, 1, 2)
    fewest = max(2, len(peak) // 4)
    contrasts = []
    for flank in (ordinates(-4, -2, fewest), ordinates(2, 4, fewest)):
        error = sqrt((1 / len(peak) + 1 / len(flank)) / seen.weight)
        contrasts.append(log(np.mean(peak) / np.mean(flank)) / error)
    return min(contrasts)
