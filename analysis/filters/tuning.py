"""The noise of a trial: what the settings state, and otherwise estimated from the log."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray
from shiplog.vessel.settings import FilterSettings

from .base import Estimates, FilterKind
from .factory import filter_kind
from .noise_model import NO_FURTHER, ForceNoise, FurtherModel, NoiseModel, Wave

PAPER_RATIO = 0.01 / 400  # Burylin's Q over his R, 1/s²; no filter trusts its model more by default
MAX_RATIO = 1e8  # 1/s²; above it the estimate is the measurement itself
OPEN_GATE = 1e12  # standard deviations: nothing is rejected
SPIKE_STDS = 8.0  # a residual beyond this many standard deviations is a spike
MAD_TO_STD = 1.4826  # of normal noise: standard deviation over median absolute deviation
RATIO_TOLERANCE, FREQUENCY_TOLERANCE = 0.02, 0.05  # of their decimal logarithms
DIVERGED = 1e300  # the deviance of a filter that diverges
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
    the same way, below those set. Where the whole trial is in `stats.head`, a disturbance without
    which Akaike's criterion of the innovations is lower has no slow part, if the process noise that
    acts with it is stated.

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
    noise = replace(noise, further=further, tuned=(stated[0] is None, stated[1] is None))
    for output, ratio in enumerate(stated):
        noise = (
            _with_likeliest_ratio(head, noise, output, (least, most))
            if ratio is None
            else _with_ratio(noise, output, ratio)
        )
    slow = _slow_forces(further)
    for output in slow:
        noise = _with_likeliest_frequency(head, noise, output)
    is_whole = len(stats.head) == stats.count  # else a disturbance may begin after it
    if slow and is_whole and not further.wind:
        noise = _without_absent_forces(head, noise)
    return noise


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


def _slow_forces(further: FurtherModel) -> dict[int, ForceNoise]:
    """Return the forces with a slow part, by the output on which they act."""
    forces = enumerate((further.yaw, further.surge))
    return {i: force for i, force in forces if force is not None and force.degree is not None}


def _with_force(noise: NoiseModel, output: int, **changes: float | None) -> NoiseModel:
    """Return the noise with other attributes of the force that acts on an output."""
    axis = ("yaw", "surge")[output]
    force = replace(getattr(noise.further, axis), **changes)
    return replace(noise, further=replace(noise.further, **{axis: force}))


def _with_likeliest_ratio(
    head: _Head, noise: NoiseModel, output: int, bounds: tuple[_Pair, _Pair]
) -> NoiseModel:
    """Return the noise with the ratio that makes the innovations of an output most likely.

    The logarithm of the ratio is searched between the least and the largest.
    """
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - it takes long to import

    least, most = (float(np.log10(pair[output])) for pair in bounds)
    best = minimize_scalar(
        lambda log_ratio: _deviances(head, _with_ratio(noise, output, 10.0**log_ratio))[output],
        bounds=(least, most),
        method="bounded",
        options={"xatol": RATIO_TOLERANCE},
    )
    return _with_ratio(noise, output, float(10.0**best.x))


def _with_likeliest_frequency(head: _Head, noise: NoiseModel, output: int) -> NoiseModel:
    """Return the noise with the frequency of a force that makes its output most likely.

    The logarithm of the frequency is searched. Most are at a bound: a disturbance that begins
    suddenly is followed as fast as allowed, one that is constant as slowly.
    """
    fastest = _slow_forces(noise.further)[output].frequency

    def deviance(log_share: float) -> float:
        candidate = _with_force(noise, output, frequency=fastest * 10.0**log_share)
        return float(_deviances(head, candidate)[output])

    low = float(np.log10(MIN_FREQUENCY_SHARE))
    best = golden_section(deviance, (low, 0.0), FREQUENCY_TOLERANCE)
    return _with_force(noise, output, frequency=fastest * 10.0**best)


def golden_section(function: Callable[[float], float], bounds: _Pair, tolerance: float) -> float:
    """Minimise a function of one number by golden section, the bounds included.

    The function is evaluated no more often than the tolerance needs. Where its minimum is within
    the tolerance of a bound, the bound is returned, which other methods only approach.

    Parameters
    ----------
    function
        The function, with one minimum.
    bounds
        The least and the largest number.
    tolerance
        The largest error of the minimum.

    Examples
    --------
    >>> golden_section(lambda x: (x - 2) ** 2, (0.0, 1.0), 0.01)
    1.0
    """
    share = (sqrt(5.0) - 1) / 2
    low, high = bounds
    left, right = high - share * (high - low), low + share * (high - low)
    at_left, at_right = function(left), function(right)
    while high - low > 2 * tolerance:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - share * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + share * (high - low)
            at_right = function(right)
    if low == bounds[0]:
        return low
    return high if high == bounds[1] else (low + high) / 2


def _without_absent_forces(head: _Head, noise: NoiseModel) -> NoiseModel:
    """Return the noise without the slow forces for which the log has no evidence.

    There is none where Akaike's criterion, the deviance of all innovations and twice the number of
    parameters, is lower without the force: its frequency is one parameter more. How uncertain the
    force is at the start is in the deviance. A force stays as it is beside process noise that was
    estimated, beside a wave and beside the wind: these take up a slow force, and no evidence would
    not mean that there is none.

    References
    ----------
    Akaike, "A new look at the statistical model identification", 1974.
    """
    deviance = float(np.sum(_deviances(head, noise)))
    for output, force in _slow_forces(noise.further).items():
        if force.wave is not None or noise.tuned[output]:
            continue
        without = _with_force(noise, output, degree=None)
        deviance_without = float(np.sum(_deviances(head, without)))
        reduction = deviance + 2 - deviance_without
        if reduction > 0:
            noise, deviance = _with_force(without, output, reduction=reduction), deviance_without
    return noise


def _deviances(head: _Head, noise: NoiseModel) -> FloatArray:
    """Return minus twice the log likelihood of the innovations of each output, but for a constant.

    Innovations outside the gate count as if they were at the gate.
    """
    estimates = _filter_head(head, noise, head.settings)
    e, s = estimates.innovations, estimates.innovation_stds
    with np.errstate(over="ignore", invalid="ignore"):  # of a filter that diverges
        squares = np.minimum((e / s) ** 2, head.settings.gate**2)
        totals: FloatArray = np.nansum(squares + 2 * np.log(s), axis=0)
    return np.where(np.isfinite(totals), totals, DIVERGED)


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
