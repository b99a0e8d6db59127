"""The noise of a trial: what the settings state, and otherwise estimated from the log."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

from .base import Estimates, FilterKind
from .factory import filter_kind
from .noise_model import NO_FURTHER, FurtherModel, NoiseModel, Wave

PAPER_RATIO = 0.01 / 400  # Burylin's Q over his R, 1/s²; no filter trusts its model more by default
MAX_RATIO = 1e8  # 1/s²; above it the estimate is the measurement itself
OPEN_GATE = 1e12  # standard deviations: nothing is rejected
SPIKE_STDS = 8.0  # a residual beyond this many standard deviations is a spike
MAD_TO_STD = 1.4826  # of normal noise: standard deviation over median absolute deviation
MIN_FREQUENCY_SHARE = 0.1  # of the frequency set: a slower random walk is constant in most trials

_Pair = tuple[float, float]
_Stated = tuple[float | None, float | None]


@dataclass(frozen=True, eq=False)
class _Head:
    """The first part of a trial, and what the filter is made of by which the noise is estimated."""

    stats: SignalStats
    model: Coefficients
    settings: FilterSettings
    kind: FilterKind


def noise_of(
    stats: SignalStats,
    model: Coefficients,
    settings: FilterSettings,
    kind: FilterKind | None = None,
    further: FurtherModel = NO_FURTHER,
) -> NoiseModel:
    """Return the noise that the settings state; what they do not state is estimated from the log.

    The measurement noise follows from the third differences of a signal, in which the ship's motion
    does not show. The intensity of the process noise is the one that makes the innovations most
    likely: those of the filter itself if its process noise drives all states, otherwise those of
    the extended Kalman filter, whose gain is optimal. The wave, where the settings ask for one, is
    a peak in the spectrum of a slow filter's innovations.

    The further states are there when the process noise is estimated: an error of a sensor is not
    taken for process noise. Then the frequencies of the disturbances among them are estimated in
    the same way, below those set.

    Parameters
    ----------
    stats
        The statistics of the signals. The first part of the trial, `stats.head`, is used.
    model
        The coefficients of the identification paper's model.
    settings
        The settings of ``[filter]``.
    kind
        The kind of filter; by default the one that `settings` names.
    further
        The further states of the filter.
    """
    kind = kind or filter_kind(settings.chosen)
    given = (settings.yaw_rate_std, settings.speed_std)
    stds = np.array([a if b is None else b for a, b in zip(stats.noise_std, given, strict=True)])
    stated, least, most = _ratios(settings, kind)
    noise = NoiseModel(stds, np.array(least), (given[0] is None, given[1] is None))
    head = _Head(signal_stats(stats.head, model), model, settings, kind)
    if settings.wave:
        noise = replace(noise, wave=_distinct_wave(head, noise))
    noise = replace(noise, further=further)
    for output, ratio in enumerate(stated):
        if ratio is not None:
            noise = _with_ratio(noise, output, ratio)
            continue
        of_ratio = partial(_with_ratio, noise, output)
        noise = _likeliest(head, output, of_ratio, (least[output], most[output]))
    for output, force in enumerate((further.yaw, further.surge)):
        if force is not None and force.degree is not None:
            slowest = MIN_FREQUENCY_SHARE * force.frequency
            of_frequency = partial(_with_frequency, noise, output)
            noise = _likeliest(head, output, of_frequency, (slowest, force.frequency))
    return replace(noise, tuned=(stated[0] is None, stated[1] is None))


def _ratios(settings: FilterSettings, kind: FilterKind) -> tuple[_Stated, _Pair, _Pair]:
    """Return the stated ratios of process to measurement noise, and the bounds of unstated ones.

    The square root of the paper's ratio is about the bandwidth of its filter. Where the process
    noise drives the yaw moment and the surge force only, a bandwidth ω corresponds to a ratio of
    ω⁴ in yaw and ω² in surge.
    """
    ratio = settings.process_ratio
    if kind.process_noise == "states":
        return (ratio, ratio), (PAPER_RATIO, PAPER_RATIO), (MAX_RATIO, MAX_RATIO)
    yaw, surge = (
        ratio if bandwidth is None else bandwidth**2
        for bandwidth in (settings.yaw_bandwidth, settings.surge_bandwidth)
    )
    stated = (None if yaw is None else yaw**2, surge)
    return stated, (PAPER_RATIO**2, PAPER_RATIO), (MAX_RATIO**2, MAX_RATIO)


def _with_ratio(noise: NoiseModel, output: int, ratio: float) -> NoiseModel:
    ratios = noise.process_ratio.copy()
    ratios[output] = ratio
    return replace(noise, process_ratio=ratios)


def _with_frequency(noise: NoiseModel, output: int, frequency: float) -> NoiseModel:
    """Return the noise with another frequency of the force that acts on an output."""
    axis = ("yaw", "surge")[output]
    force = replace(getattr(noise.further, axis), frequency=frequency)
    return replace(noise, further=replace(noise.further, **{axis: force}))


def _likeliest(
    head: _Head, output: int, candidate: Callable[[float], NoiseModel], bounds: _Pair
) -> NoiseModel:
    """Return the candidate that makes the innovations of one output most likely.

    The candidates are those of a number between the bounds, of which the logarithm is searched.
    Innovations outside the gate count as if they were at the gate.
    """

    def deviance(log_number: float) -> float:
        estimates = _filter_head(head, candidate(10.0**log_number), head.settings)
        e, s = estimates.innovations[:, output], estimates.innovation_stds[:, output]
        with np.errstate(over="ignore", invalid="ignore"):  # of a filter that diverges
            squares = np.minimum((e / s) ** 2, head.settings.gate**2)
            total = float(np.nansum(squares + 2 * np.log(s)))
        return total if np.isfinite(total) else 1e300

    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - it takes long to import

    best = minimize_scalar(
        deviance,
        bounds=(float(np.log10(bounds[0])), float(np.log10(bounds[1]))),
        method="bounded",
        options={"xatol": 0.02},
    )
    return candidate(float(10.0**best.x))


def wave_in(
    stats: SignalStats,
    model: Coefficients,
    noise: NoiseModel,
    settings: FilterSettings,
    kind: FilterKind | None = None,
) -> Wave | None:
    """Fit a wave to the yaw rate, distinct from the noise or not.

    Parameters
    ----------
    stats, model, settings, kind
        As in `noise_of`.
    noise
        The noise of the measurements; its process noise and wave are not used.

    Returns
    -------
    Wave or None
        None where there are too few samples for a fit.
    """
    kind = kind or filter_kind(settings.chosen)
    _, least, _ = _ratios(settings, kind)
    slow = replace(noise, process_ratio=np.array(least), wave=None, further=NO_FURTHER)
    return _fitted_wave(_Head(signal_stats(stats.head, model), model, settings, kind), slow)


def _distinct_wave(head: _Head, noise: NoiseModel) -> Wave | None:
    """Return the wave for the filter to model: one that is stated, or distinct from the noise."""
    wave, settings = _fitted_wave(head, noise), head.settings
    stated = settings.wave_frequency is not None and settings.wave_std is not None
    return wave if wave is not None and (stated or wave.stands_out) else None


def _fitted_wave(head: _Head, noise: NoiseModel) -> Wave | None:
    """Fit a wave to the innovations of the slowest filter in the yaw rate.

    Its gate is open, because a filter without a wave model would reject the crests. Spikes are
    excluded by their distance from the typical innovation.
    """
    settings, stats = head.settings, head.stats
    unlimited = replace(settings, gate=OPEN_GATE)
    innovations = _filter_head(head, noise, unlimited).innovations[:, 0]
    std = MAD_TO_STD * float(np.nanmedian(np.abs(innovations)))
    from .wave_fit import fit_wave  # noqa: PLC0415 - scipy.fft takes long to import

    return fit_wave(
        np.where(np.abs(innovations) <= SPIKE_STDS * std, innovations, np.nan),
        stats.dt_secs,
        float(stats.intervals[0]),
        frequency=settings.wave_frequency,
        damping=settings.wave_damping,
        std=settings.wave_std,
    )


def _filter_head(head: _Head, noise: NoiseModel, settings: FilterSettings) -> Estimates:
    """Filter the first part of the trial with the filter that the noise is estimated by."""
    judge = head.kind if head.kind.process_noise == "states" else filter_kind("extended")
    judge_settings = replace(settings, kind=judge.name, smooth=False)
    filter_ = judge.make(head.model, noise, head.stats, judge_settings)
    return filter_.step(head.stats.head, last_inputs(head.stats.head))
