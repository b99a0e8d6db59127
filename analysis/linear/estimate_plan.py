"""The plan of an estimation: all that must be known of a log before the estimator starts."""

from dataclasses import dataclass

import numpy as np

from analysis.replay.passes import resampled_chunks
from analysis.replay.reading_options import ReadingOptions
from shiplog.errors import UsageError
from shiplog.progress import ProgressCallback
from shiplog.resampling import Clock, choose_clock
from shiplog.screening import ScreenedLog, Screening, screen_log, screen_without_delays
from shiplog.types import FloatArray, Log

from .estimator_model import EstimatorModel
from .feedback import FeedbackDesign, design_feedback
from .initial_estimate import StartSignals
from .joined_system import (
    OutputSampling,
    Quantity,
    estimator_model,
    quantities,
    require_distinguishable,
    state_names,
)
from .methods import EstimatorDesign, KalmanMethod
from .signal_sizes import (
    MIN_STRIDE,
    measurement_interval,
    measurement_noise,
    signal_sizes,
    with_stride,
)
from .spectrum_fit import MAX_FITTED, FitSignals, FittedParameter, fit_spectra
from .system import LinearSystem, naming_system_file
from .system_signals import BoundSignal, HeldSignals, bind_signals, require_same_units


@dataclass(frozen=True, eq=False)
class EstimatePlan:
    """The plan of an estimation.

    Attributes
    ----------
    name
        Name of the log.
    system
        The system, with fitted spectra.
    screening
        What is used of the log.
    clock
        The uniform clock.
    outputs, inputs, schedule
        The signals in the units of the system.
    stds
        (m,): standard deviation of the noise of one measurement of each output.
    measured
        (m,): whether it was estimated from the log.
    start
        First values and rms values of the outputs.
    model, design
        The joined system and the gain; of a varying plant those at the rms values of its schedule.
    feedback
        The regulator; None where the system has none.
    quantities
        What is reported of the estimate.
    states
        Names of all N states.
    smooth
        Whether the states are smoothed backwards from the end.
    fitted
        Parameters of spectra that were fitted to the log.
    warnings
        What of the system does not act, each in a sentence.
    """

    name: str
    system: LinearSystem
    screening: Screening
    clock: Clock
    outputs: tuple[BoundSignal, ...]
    inputs: tuple[BoundSignal, ...]
    schedule: tuple[BoundSignal, ...]
    stds: FloatArray
    measured: tuple[bool, ...]
    start: StartSignals
    model: EstimatorModel
    design: EstimatorDesign
    feedback: FeedbackDesign | None
    quantities: tuple[Quantity, ...]
    states: tuple[str, ...]
    smooth: bool
    fitted: tuple[FittedParameter, ...]
    warnings: tuple[str, ...]


def plan_estimate(
    log: Log,
    system: LinearSystem,
    options: ReadingOptions,
    on_progress: ProgressCallback,
    *,
    smooth: bool = False,
) -> EstimatePlan:
    """Plan an estimation: choose the clock, measure the noise, design the gain.

    Parameters
    ----------
    log
        The log as recorded.
    system
        The system.
    options
        Of these the sources of channels, and the channels to derive.
    on_progress
        Called with each step and its share done.
    smooth
        Smooth the states backwards from the end.

    Raises
    ------
    LogError
        A channel is missing or cannot be used.
    UsageError
        A unit does not fit, disturbances cannot be distinguished, or there is no gain.
    """
    on_progress("check the log", 0.0)
    names = tuple(dict.fromkeys(binding.channel for binding in system.bindings))

    def screen(recorded: Log) -> ScreenedLog:
        return screen_log(
            recorded, names, purpose=f"the system {system.name!r}", sources=options.sources,
            derive=options.derive,
        )  # fmt: skip

    screened = screen_without_delays(log, options.sensor_delays, screen)
    with naming_system_file(system):
        return _plan(log.name, system, screened, on_progress, smooth=smooth)


def _plan(
    name: str,
    system: LinearSystem,
    screened: ScreenedLog,
    on_progress: ProgressCallback,
    *,
    smooth: bool,
) -> EstimatePlan:
    """Measure the signals of the system on the screened log, and design its gain."""
    names = tuple(dict.fromkeys(binding.channel for binding in system.bindings))
    signals = _measured_signals(screened, system, names, on_progress)
    sampling, there = signals.sampling, system.linearised_at(signals.typical)
    require_distinguishable(system, estimator_model(system, sampling, there), there)
    _require_method(system, smooth=smooth)
    _require_every_step(system, signals)
    fitted: tuple[FittedParameter, ...] = ()
    if any(noise.fit for noise in system.shaped):
        recorded = _fit_signals(screened, signals, on_progress)
        system, fitted = fit_spectra(system, sampling, recorded, name)
    model = estimator_model(system, sampling, there)
    design = system.method.design(model)
    return EstimatePlan(
        name=name,
        system=system,
        screening=screened.screening,
        clock=signals.clock,
        outputs=signals.outputs,
        inputs=signals.inputs,
        schedule=signals.schedule,
        stds=signals.stds,
        measured=signals.measured,
        start=signals.start,
        model=model,
        design=design,
        feedback=design_feedback(system, model, design),
        quantities=quantities(system, model),
        states=state_names(system),
        smooth=smooth,
        fitted=fitted,
        warnings=_warnings(system),
    )


@dataclass(frozen=True, eq=False)
class _MeasuredSignals:
    """The signals of a system on the clock of a log, with their noise and their sizes."""

    clock: Clock
    outputs: tuple[BoundSignal, ...]
    inputs: tuple[BoundSignal, ...]
    schedule: tuple[BoundSignal, ...]
    stds: FloatArray
    measured: tuple[bool, ...]
    start: StartSignals
    typical: FloatArray  # rms values of the schedule

    @property
    def sampling(self) -> OutputSampling:
        """How the outputs are measured."""
        intervals = np.array([measurement_interval(each, self.clock) for each in self.outputs])
        return OutputSampling(self.stds**2, intervals, self.clock.dt_secs)


def _measured_signals(
    log: ScreenedLog, system: LinearSystem, names: tuple[str, ...], on_progress: ProgressCallback
) -> _MeasuredSignals:
    """Choose the clock and measure the signals of a system in a pass over the log."""
    stats = log.screening.stats
    step = system.step_secs or _step_secs(system, log)
    clock = choose_clock(log, stats, step, channels=names)
    bound = bind_signals(system.bindings, stats)
    m, r = len(system.outputs), len(system.inputs)
    outputs = tuple(with_stride(signal, clock) for signal in bound[:m])
    require_same_units(system, outputs)
    sizes = signal_sizes(log, clock, outputs, bound[m:], on_progress)
    stds, measured = measurement_noise(outputs, sizes.outputs, clock)
    start = StartSignals(
        np.array([each.first for each in sizes.outputs]),
        np.sqrt([each.moments.mean_square for each in sizes.outputs]),
    )
    inputs, schedule, typical = bound[m : m + r], bound[m + r :], sizes.rms[r:]
    return _MeasuredSignals(clock, outputs, inputs, schedule, stds, measured, start, typical)


def _step_secs(system: LinearSystem, log: ScreenedLog) -> float | None:
    """Return the step of the clock: the shortest interval of an output, or the longest.

    A constant gain assumes that all outputs are measured at every step.
    """
    stats = log.screening.stats
    intervals = [stats[output.channel].interval_secs for output in system.outputs]
    intervals = [each for each in intervals if each > 0]
    if not intervals:
        return None
    return min(intervals) if _is_optimal(system) else max(intervals)


def _is_optimal(system: LinearSystem) -> bool:
    return isinstance(system.method, KalmanMethod) and not system.method.steady_state


def _require_every_step(system: LinearSystem, signals: _MeasuredSignals) -> None:
    """Refuse a constant gain on a stated step of the clock in which an output is not measured."""
    if _is_optimal(system):
        return
    dt = signals.clock.dt_secs
    for output, interval in zip(signals.outputs, signals.sampling.intervals, strict=True):
        if interval > MIN_STRIDE * dt:
            raise UsageError(
                f"{output.binding.name!r} is measured every {interval:.3g} s, but the method"
                f" {system.method.name!r} needs it at every step, of {dt:.3g} s; remove step_secs,"
                " or use kalman with a time-varying gain"
            )


def _warnings(system: LinearSystem) -> tuple[str, ...]:
    return tuple(
        f"the input {name!r} of the plant has no channel and is taken as zero"
        for name in system.zero_inputs
    )


def _fit_signals(
    log: ScreenedLog, bound: _MeasuredSignals, on_progress: ProgressCallback
) -> FitSignals:
    """Return the first `MAX_FITTED` instants of the signals at which the inputs are known."""
    held, y, u, count = HeldSignals(bound.inputs, bound.clock), [], [], 0
    for signals in resampled_chunks(log, bound.clock, on_progress, "fit"):
        if count < MAX_FITTED:
            part = signals.part(0, MAX_FITTED - count)
            y.append(np.column_stack([output.measured(part) for output in bound.outputs]))
            u.append(held.step(part))
            count += len(part)
    measured, known = np.concatenate(y), np.concatenate(u)
    first = int(np.argmax(np.isfinite(known).all(axis=1)))
    return FitSignals(
        np.ascontiguousarray(measured[first:]), np.ascontiguousarray(known[first:]), bound.start
    )


def _require_method(system: LinearSystem, *, smooth: bool) -> None:
    """Refuse a method that the system or the request does not allow."""
    method = system.method
    if system.linearise is not None and not method.per_tick:
        raise UsageError(
            f"the method {method.name!r} has a constant gain, but the plant varies along its"
            " trajectory; use kalman, per-tick or reduced-order"
        )
    if system.linearise is not None and any(noise.fit for noise in system.shaped):
        raise UsageError(
            "spectra are fitted for a constant plant, and this one varies along its trajectory;"
            " state their parameters"
        )
    if smooth and not _is_optimal(system):
        raise UsageError(
            f"the method {method.name!r} cannot be smoothed: the smoother assumes the optimal gain;"
            " use kalman with a time-varying gain"
        )
