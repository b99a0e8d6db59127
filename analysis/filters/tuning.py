"""The noise of a trial: what its vessel file states, and from the log what that leaves open."""

from dataclasses import replace

import numpy as np

from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

from .base import Estimates
from .factory import make_filter
from .noise_model import NoiseModel
from .wave_fit import Wave, fit_wave

PAPER_RATIO = 0.01 / 400  # Burylin's Q over his R, 1/s^2: no default trusts the model more
EVERYTHING = 1e12  # standard deviations
SPIKE = 8.0
HIGHEST_RATIO = 1e8  # beyond it an estimate is what was measured


def noise_of(stats: SignalStats, model: Coefficients, settings: FilterSettings) -> NoiseModel:
    """The noise a vessel file states, and from the log what it leaves open.

    The measurement noise shows in the third differences of a signal, where the ship's motion does
    not; the process noise is what makes the innovations most likely: those of the extended filter,
    where the one chosen has not the best gain. The wave, if one is asked for, is what stands out in
    the spectrum of what a slow filter leaves.
    """
    given = (settings.yaw_rate_std, settings.speed_std)
    stds = np.array([a if b is None else b for a, b in zip(stats.noise, given, strict=True)])
    stated, least, most = _ratios(settings)
    noise = NoiseModel(stds, np.array(least), (given[0] is None, given[1] is None))
    of_head = signal_stats(stats.head, model)
    if settings.wave:
        noise = replace(noise, wave=_told_wave(of_head, model, noise, settings))
    for output, ratio in enumerate(stated):
        likely = ratio
        if likely is None:
            bounds = (least[output], most[output])
            likely = _likeliest(of_head, model, noise, settings, output, bounds)
        ratios = noise.process_ratio.copy()
        ratios[output] = likely
        noise = replace(noise, process_ratio=ratios)
    return replace(noise, tuned=(stated[0] is None, stated[1] is None))


_Pair = tuple[float, float]
_Stated = tuple[float | None, float | None]


def _ratios(settings: FilterSettings) -> tuple[_Stated, _Pair, _Pair]:
    """Of process to measurement intensity: what is stated, and the bounds of what is likely.

    The root of the paper's ratio is about the bandwidth of his filter. In the others, where the
    noise is that of a moment and a force alone, a bandwidth ω takes ω^4 in yaw and ω^2 in surge.
    """
    same = settings.process_ratio
    if settings.chosen == "pseudo-input":
        return (same, same), (PAPER_RATIO, PAPER_RATIO), (HIGHEST_RATIO, HIGHEST_RATIO)
    yaw, surge = (
        same if width is None else width**2
        for width in (settings.yaw_bandwidth, settings.surge_bandwidth)
    )
    stated = (None if yaw is None else yaw**2, surge)
    return stated, (PAPER_RATIO**2, PAPER_RATIO), (HIGHEST_RATIO**2, HIGHEST_RATIO)


def _likeliest(
    stats: SignalStats,
    model: Coefficients,
    noise: NoiseModel,
    settings: FilterSettings,
    output: int,
    bounds: _Pair,
) -> float:
    """The ratio of one output that makes its innovations most likely; what is off counts as far."""

    def unlikelihood(log_ratio: float) -> float:
        ratios = noise.process_ratio.copy()
        ratios[output] = 10.0**log_ratio
        estimates = _head_filtered(stats, model, replace(noise, process_ratio=ratios), settings)
        e, s = estimates.innovations[:, output], estimates.innovation_stds[:, output]
        surprise = np.minimum((e / s) ** 2, settings.gate**2)
        score = float(np.nansum(surprise + 2 * np.log(s)))
        return score if np.isfinite(score) else 1e300

    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - it takes long to import

    best = minimize_scalar(
        unlikelihood,
        bounds=(float(np.log10(bounds[0])), float(np.log10(bounds[1]))),
        method="bounded",
        options={"xatol": 0.02},
    )
    return float(10.0**best.x)


def wave_in(
    stats: SignalStats, model: Coefficients, noise: NoiseModel, settings: FilterSettings
) -> Wave | None:
    """The wave in the yaw rate, whether it stands out or not; None of too few samples."""
    _, least, _ = _ratios(settings)
    slow = replace(noise, process_ratio=np.array(least), wave=None)
    return _wave(signal_stats(stats.head, model), model, slow, settings)


def _told_wave(
    stats: SignalStats, model: Coefficients, noise: NoiseModel, settings: FilterSettings
) -> Wave | None:
    """The wave that is to be told from the turning: one that is stated, or that stands out."""
    wave = _wave(stats, model, noise, settings)
    stated = settings.wave_frequency is not None and settings.wave_std is not None
    return wave if wave is not None and (stated or wave.stands_out) else None


def _wave(
    stats: SignalStats, model: Coefficients, noise: NoiseModel, settings: FilterSettings
) -> Wave | None:
    """The wave in what the slowest filter leaves of the yaw rate.

    Its gate is open, for a filter that knows of no wave would not believe the crests; spikes are
    what is far beyond all else.
    """
    believing = replace(settings, gate=EVERYTHING)
    left = _head_filtered(stats, model, noise, believing).innovations[:, 0]
    usually = 1.4826 * float(np.nanmedian(np.abs(left)))
    return fit_wave(
        np.where(np.abs(left) <= SPIKE * usually, left, np.nan),
        stats.dt_secs,
        float(stats.intervals[0]),
        frequency=settings.wave_frequency,
        damping=settings.wave_damping,
        std=settings.wave_std,
    )


def _head_filtered(
    stats: SignalStats, model: Coefficients, noise: NoiseModel, settings: FilterSettings
) -> Estimates:
    kind = "pseudo-input" if settings.chosen == "pseudo-input" else "extended"
    judging = replace(settings, kind=kind, smooth=False)
    return make_filter(model, noise, stats, judging).step(stats.head, last_inputs(stats.head))
