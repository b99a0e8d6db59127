"""A wave's shaping filter, fitted to the spectrum of what a slow filter leaves of a signal.

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

import warnings
from dataclasses import dataclass
from math import ceil, exp, inf, log, nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, irfft, next_fast_len, rfft
from scipy.optimize import minimize
from scipy.signal.windows import tukey

from shiplog.compiled import compiled
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .design.arguments import number

LOWEST = 0.25  # rad/s: a ship turns below it, and seas and swell are above
BEGIN = 0.7  # of the lowest frequency: where the spectrum is fitted from
HIGHEST_SHARE = 0.9  # of half the sensor's rate
FEWEST = 100  # measurements, to tell anything
FEWEST_ORDINATES = 32  # of the spectrum
CYCLES = 6.0  # of the lowest frequency in a segment: two of its ordinates are the taper's own
SEGMENT = 16_384  # instants: in most logs more than is needed to resolve a wave
TAPERED = 0.2  # the share of a segment that a cosine fades out; it costs a ninth of what is known
LEAST_DAMPING = 1e-7  # as good as none, of a regular wave
BROADEST = 0.5  # damping: beyond it there is no wave, but a red part
LEAST_DECAY = 0.5  # ζ ω0 times a segment: a wave that fades more slowly shows no fading
ROUNDING = 1e-12  # of the largest value: a residual that changes by less is constant
FALSE_CLAIMS = 0.01  # the share of logs without a wave that may claim one
LEAST_CONTRAST = 1.5  # standard errors

# the logarithms that are fitted; powers in units of the mean ordinate of the band
_WHITE, _RED, _RATE, _POWER, _FREQUENCY, _DAMPING = range(6)


@dataclass(frozen=True)
class Wave:
    """The shaping filter of a wave in the yaw rate, and what speaks for there being one."""

    frequency: float  # rad/s
    damping: float
    std: float  # rad/s
    evidence: float  # 2 log likelihood ratio of the spectrum with the wave against the one without
    needed: float = 0.0  # what evidence noise alone reaches in one log of 100 at the most
    contrast: float = inf  # by how much the spectrum is higher than beside it, standard errors

    @property
    def stands_out(self) -> bool:
        """Whether there is a wave: it is likelier than none, and a peak.

        Likelier alone is also what a sensor's low-pass or a steep red part makes it, for which the
        background has no room; but neither is higher in its middle than on either side.
        """
        return self.evidence > self.needed and self.contrast > LEAST_CONTRAST


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
    sine of 0.1 rad/s, is left to the red part. The search ends at 0.9 of half the sensor's rate.
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
    seen = _spectrum(np.asarray(residual, np.float64), dt_secs, half_rate, lowest, frequency)
    if seen is None:
        if frequency is None or damping is None or std is None:
            return None
        return Wave(frequency, damping, std, nan)
    found, evidence = _likeliest(seen, _logarithms(seen.unit, frequency, damping, std))
    omega = exp(found[_FREQUENCY]) if frequency is None else frequency
    zeta = max(exp(found[_DAMPING]), LEAST_DECAY / (omega * len(seen.overlap) * dt_secs))
    places = np.sum(seen.omega > lowest) if frequency is None else 1
    return Wave(
        frequency=omega,
        damping=zeta if damping is None else damping,
        std=sqrt(_held_power(seen, found) * seen.unit) if std is None else std,
        evidence=evidence,
        needed=2 * log(places / FALSE_CLAIMS),
        contrast=_contrast(seen, omega, exp(found[_DAMPING])),
    )


def _half_rate(dt_secs: float, interval: float, frequency: float | None) -> float:
    """The frequency beyond which the sensor shows nothing, rad/s."""
    _positive("dt_secs", dt_secs)
    half_rate = pi / (number("interval", interval, least=1.0) * dt_secs)
    if frequency is not None and frequency >= half_rate:
        raise UsageError(
            f"the wave's frequency is {frequency:g} rad/s, and a sample every"
            f" {interval * dt_secs:g} s shows none beyond {half_rate:g}; state a lower one"
        )
    return half_rate


def _positive(name: str, value: float | None) -> None:
    if value is not None:
        number(name, value, least=np.finfo(float).tiny)


def _logarithms(
    unit: float, frequency: float | None, damping: float | None, std: float | None
) -> FloatArray:
    """Of the parameters (6,), those that are stated; NaN for the others."""
    power = None if std is None else std**2 / unit
    zeta = None if damping is None else min(damping, 0.999)  # at 1 it is of another form
    return np.log([nan, nan, nan, *(nan if x is None else x for x in (power, frequency, zeta))])


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """The periodogram, averaged over segments, up to half the sensor's rate; and how it was made.

    In units of its mean over the band in which it is fitted, which begins at ordinate `first`.
    """

    omega: FloatArray  # (k,) rad/s
    power: FloatArray  # (k,)
    unit: float  # rad^2/s^2: white noise of this variance has that mean
    first: int
    searched: tuple[float, float]  # rad/s, from where to where a wave may be
    overlap: FloatArray  # (length,) of the tapers with themselves, by lag; the middle one twice
    half: int  # of the transform's length
    dt_secs: float
    weight: float  # how many independent ordinates one counts for

    @property
    def fitted(self) -> FloatArray:
        """The ordinates of the band."""
        return self.power[self.first :]

    @property
    def begin(self) -> float:
        """Of the band, rad/s."""
        return float(self.omega[self.first])

    @property
    def end(self) -> float:
        """Of the band, rad/s."""
        return float(self.omega[-1])

    @property
    def resolution(self) -> float:
        """From ordinate to ordinate, rad/s."""
        return float(self.omega[1])


def _spectrum(
    residual: FloatArray, dt_secs: float, half_rate: float, lowest: float, frequency: float | None
) -> _Spectrum | None:
    """None where it would tell nothing."""
    at = np.flatnonzero(np.isfinite(residual))
    if len(at) < FEWEST:
        return None
    values, taper = _segments(residual[at[0] : at[-1] + 1])
    length = taper.shape[1]
    slowest = CYCLES * 2 * pi / (length * dt_secs)
    lowest, highest = max(lowest, slowest), HIGHEST_SHARE * half_rate
    searched = (lowest, highest) if frequency is None else (frequency, frequency)
    half = next_fast_len(length // 2 + 1, real=True)
    omega = pi / (half * dt_secs) * np.arange(half)
    omega = omega[: np.searchsorted(omega, half_rate)]
    first = int(np.searchsorted(omega, BEGIN * min(lowest, searched[0])))
    if searched[0] < slowest or searched[1] < searched[0] or len(omega) - first < FEWEST_ORDINATES:
        return None
    energy = float(np.sum(taper**2))
    power = _squared(values * taper, 2 * half)[: len(omega)] / energy
    unit = float(np.mean(power[first:]))
    if unit <= ROUNDING**2 * float(np.max(residual[at] ** 2)):
        return None
    double = next_fast_len(2 * length, real=True)
    overlap = irfft(_squared(taper, double), double)[:length] / energy
    overlap[half] *= 2.0  # where the transform's symmetric halves meet
    alike = _squared(taper**2, 2 * half)[: len(omega)] / energy**2  # ordinates, by their distance
    return _Spectrum(
        omega, power / unit, unit, first, searched, overlap, half, dt_secs,
        1 / float(alike[0] + 2 * np.sum(alike[1:])),
    )  # fmt: skip


def _segments(residual: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of equal length (s, length), zero where nothing was measured, and their tapers."""
    count = ceil(len(residual) / SEGMENT)
    length = ceil(len(residual) / count)
    values = np.full((count, length), nan)
    values.flat[: len(residual)] = residual - np.mean(residual[np.isfinite(residual)])
    known = np.isfinite(values)
    return np.where(known, values, 0.0), tukey(length, TAPERED) * known


def _squared(rows: FloatArray, size: int) -> FloatArray:
    """The squares of the rows' transforms of that size, summed."""
    return np.asarray(np.sum(np.abs(rfft(rows, size)) ** 2, axis=0))


def _likeliest(seen: _Spectrum, known: FloatArray) -> tuple[FloatArray, float]:
    """The parameters' logarithms, of which those `known` stay, and the evidence for the wave."""
    white, red = _backgrounds(seen)
    alone, without = _least(seen, [white, red], np.isin(np.arange(6), (_WHITE, _RED, _RATE)))
    # the background alone may have taken a wave for its red part; a regular wave is far from others
    beside, above = _likeliest_place(seen, alone), _likeliest_place(seen, white)
    regular = np.array([*above[:2], log(LEAST_DAMPING)])
    pairs = ((alone, beside), (white, above), (white, regular))
    starts = [np.concatenate((background[:3], place)) for background, place in pairs]
    free = np.isnan(known)
    found, with_it = _least(seen, [np.where(free, start, known) for start in starts], free)
    return found, 2 * (without - with_it)


def _backgrounds(seen: _Spectrum) -> list[FloatArray]:
    """White noise as low as the spectrum anywhere is, with little red or what it begins with."""
    parts = [float(np.mean(part)) for part in np.array_split(seen.fitted, 16)]
    rate = seen.begin / 2
    red = parts[0] * seen.dt_secs * (seen.begin**2 + rate**2) / (2 * rate)
    no_wave = 1e-12, sqrt(seen.begin * seen.end), 0.1
    return [np.log([min(parts), part, rate, *no_wave]) for part in (1e-3, red)]


def _likeliest_place(seen: _Spectrum, background: FloatArray) -> FloatArray:
    """The logarithms of power, frequency and damping of what is most too high for a background.

    Of m ordinates x times as high as their mean, the log likelihood ratio is m (x - 1 - ln x).
    """
    omega, (mean, _) = seen.omega[seen.first :], _mean(seen, background)
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
    seen: _Spectrum, starts: list[FloatArray], free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """The parameters under which minus the log likelihood is least, and how much it is then.

    Those that are `free` are sought from each start, the others stay.
    """
    fits = [_descended(seen, start, free) for start in starts]
    return min(fits, key=lambda fit: fit[1])


def _descended(
    seen: _Spectrum, start: FloatArray, free: NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    low = np.log([1e-4, 1e-8, seen.begin / 10, 1e-8, seen.searched[0], LEAST_DAMPING])
    high = np.log([1e2, 1e8, seen.end / 2, 1e4, seen.searched[1], BROADEST])
    start = np.where(free, np.clip(start, low, high), start)
    narrow = max(exp(start[_DAMPING]), seen.resolution / exp(start[_FREQUENCY]) / 3)
    steps = np.array([0.1, 0.5, 0.5, 0.3, narrow, 0.5])[free]  # about a standard error each

    def parameters(taken: FloatArray) -> FloatArray:
        moved = start.copy()
        moved[free] += steps * taken
        return moved

    def unlikelihood(taken: FloatArray) -> tuple[float, FloatArray]:
        value, slope = _unlikelihood(seen, parameters(taken))
        return value, slope[free] * steps

    bounds = np.column_stack((low - start, high - start))[free] / steps[:, None]
    with warnings.catch_warnings():  # that a step was cut at a bound
        warnings.simplefilter("ignore", RuntimeWarning)
        found = minimize(
            unlikelihood,
            np.zeros(len(steps)),
            jac=True,
            method="SLSQP",
            bounds=bounds,
            options={"ftol": 1e-5, "maxiter": 200},
        )
    return parameters(found.x), float(found.fun)


def _held_power(seen: _Spectrum, found: FloatArray) -> float:
    """The power seen where the wave's is above the background's.

    As good as the likeliest power for a random wave, and much better for a regular one, which the
    likelihood takes for random.
    """
    background, wave = _mean(seen, found)
    own = wave > background
    excess = float(np.sum((seen.fitted - background)[own]))
    return exp(found[_POWER]) * (excess / float(np.sum(wave[own])) if excess > 0 else 1.0)


def _contrast(seen: _Spectrum, frequency: float, damping: float) -> float:
    """By how much the spectrum is higher about a frequency than on its higher side.

    In standard errors of the logarithm of their ratio. The flanks begin where a wave has fallen to
    a fifth of its peak, and end where it has fallen to a seventeenth.
    """
    zeta = max(damping, seen.resolution / frequency)

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


def _unlikelihood(seen: _Spectrum, theta: FloatArray) -> tuple[float, FloatArray]:
    """Minus Whittle's log likelihood, and its slope (6,)."""
    shapes = _shapes(seen, theta)
    slope = np.zeros(6)
    value = _whittle(seen.fitted, np.exp(theta), shapes, slope)
    return seen.weight * value, seen.weight * slope


def _mean(seen: _Spectrum, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The mean periodogram (k,) of white noise and red part, and that of the wave."""
    shapes = _shapes(seen, theta)
    white, red, power = np.exp(theta[[_WHITE, _RED, _POWER]])
    return white + red * shapes[0], power * shapes[2]


def _shapes(seen: _Spectrum, theta: FloatArray) -> FloatArray:
    """The mean periodogram (5, k) of a red part of unit variance and its slope in its rate.

    And that of a wave of unit variance, and its slopes in frequency and damping.
    """
    folded = np.zeros((5, seen.half + 1))
    rate, frequency, damping = np.exp(theta[[_RATE, _FREQUENCY, _DAMPING]])
    _folded(seen.overlap, seen.dt_secs, rate, frequency, damping, folded)
    return np.asarray(dct(folded, type=1, axis=1)[:, seen.first : len(seen.omega)])


@compiled
def _folded(
    overlap: FloatArray, dt: float, rate: float, frequency: float, damping: float,
    folded: FloatArray,
) -> None:  # fmt: skip
    """The autocovariances e^-ρτ and e^-aτ (cos ωτ - (a/ω) sin ωτ), a = ζ ω0, ω^2 = ω0^2 - a^2.

    With their slopes in ln ρ, ln ω0 and ln ζ; times the tapers' overlap, and folded as a transform
    of twice the length of `folded` folds them.
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
    power: FloatArray, parameters: FloatArray, shapes: FloatArray, slope: FloatArray
) -> float:
    """The sum of I/S + ln S over the ordinates, and its slope in the parameters' logarithms."""
    white, red, wave = parameters[_WHITE], parameters[_RED], parameters[_POWER]
    total = 0.0
    for k in range(len(power)):
        mean = white + red * shapes[0, k] + wave * shapes[2, k]
        ratio = power[k] / mean
        total += ratio + log(mean)
        per_mean = (1 - ratio) / mean
        slope[_WHITE] += per_mean * white
        slope[_RED] += per_mean * red * shapes[0, k]
        slope[_RATE] += per_mean * red * shapes[1, k]
        slope[_POWER] += per_mean * wave * shapes[2, k]
        slope[_FREQUENCY] += per_mean * wave * shapes[3, k]
        slope[_DAMPING] += per_mean * wave * shapes[4, k]
    return total
