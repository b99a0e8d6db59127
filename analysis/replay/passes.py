"""The two passes over a log before its replay, and the log resampled in chunks.

The first pass collects statistics of the raw channels and defines the clock; the second resamples
the log, collects statistics of the signals and fits the regression of the whole trial.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from analysis.regression.coefficients import WholeTrialRegression
from analysis.regression.first_model import SPEED_PROPORTIONAL_RUDDER
from analysis.regression.sliding import min_window_secs
from analysis.regression.weak_form import WeakForm
from analysis.signals.hold import InputHold
from analysis.signals.signal_stats import SignalStats, SignalStatsCollector
from shiplog import Channel, LogError, Signals, Vessel
from shiplog.checks.channel_stats import LogStats
from shiplog.checks.consistency.consistency_check import ConsistencyCheck
from shiplog.checks.consistency.findings import CONTRADICTIONS, refuse_contradictions
from shiplog.progress import ProgressCallback
from shiplog.resampling import Clock, choose_clock, resample_chunks, with_steering_gear
from shiplog.screening import ScreenedLog, Screening, screen_log, screen_without_delays
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS, Coefficients
from shiplog.types import ChunkedLog, FloatArray, Log
from shiplog.vessel.settings import MIN_WINDOW_SECS, WIND

from .channel_warnings import channel_warnings, end_warnings, late_channel_warnings
from .measured_channels import MeasuredChannels, RawChunks, with_measured_channels
from .reading_options import ReadingOptions
from .wind_signals import WIND_CHANNEL_NAMES, WindSignals, with_wind_channels

REQUIRED_CHANNELS = (*PAPER_OUTPUTS, *PAPER_INPUTS)
OPTIONAL_CHANNELS = ("heading", "position")
MIN_OUTPUT_SAMPLES = 4  # the noise level is estimated from third differences


@dataclass(frozen=True, eq=False)
class FirstPass:
    """Results of the first pass over a log.

    Attributes
    ----------
    log
        The log as screened.
    clock
        The uniform clock on which the log is replayed.
    """

    log: ScreenedLog
    clock: Clock

    @property
    def screening(self) -> Screening:
        """What is used of the log."""
        return self.log.screening

    @property
    def log_stats(self) -> LogStats:
        """Statistics of each channel as screened."""
        return self.log.screening.stats


@dataclass(frozen=True, eq=False)
class SecondPass:
    """Results of the second pass over a log.

    Attributes
    ----------
    stats
        Statistics of the resampled signals.
    yaw, surge
        The least-squares sums of each equation over the whole trial.
    warnings
        Problems of the data, each in a sentence.
    contradictions
        Those of the warnings by which a unit or a sign is wrong.
    gyro_warnings
        Those of the warnings that report a bias of the gyro.
    """

    stats: SignalStats
    yaw: WholeTrialRegression
    surge: WholeTrialRegression
    warnings: tuple[str, ...]
    contradictions: tuple[str, ...] = ()
    gyro_warnings: tuple[str, ...] = ()


def first_pass(
    log: Log, vessel: Vessel, options: ReadingOptions, on_progress: ProgressCallback
) -> FirstPass:
    """Screen a log and define the clock of its replay.

    Parameters
    ----------
    log
        The log as recorded.
    vessel
        The vessel, whose steering gear follows an order of the rudder.
    options
        Of these the sources of channels, the channels to derive, and the delays of sensors.
    on_progress
        Called with the step and its share done.

    Raises
    ------
    LogError
        Where a required channel is missing or a channel cannot be used.
    UsageError
        Where a wind is asked for that the log does not state.
    """
    on_progress("check the log", 0.0)
    needs_wind = WIND in vessel.disturbance.models

    def screen(recorded: Log) -> ScreenedLog:
        return screen_log(
            recorded,
            REQUIRED_CHANNELS,
            (*OPTIONAL_CHANNELS, *(WIND_CHANNEL_NAMES if needs_wind else ())),
            purpose="a replay",
            sources=options.sources,
            derive=options.derive,
        )

    screened = screen_without_delays(log, options.sensor_delays, screen)
    stats = screened.screening.stats
    clock = choose_clock(screened, stats, channels=REQUIRED_CHANNELS, optional=("heading",))
    if vessel.filter.sensors:
        clock = with_measured_channels(clock, stats)
    if needs_wind:
        clock = with_wind_channels(clock, stats)
    return FirstPass(screened, with_steering_gear(clock, vessel.rudder_rate))


def second_pass(
    first: FirstPass, vessel: Vessel, on_progress: ProgressCallback, *, strict: bool = False
) -> SecondPass:
    """Collect the statistics of the signals and fit both equations to the whole trial.

    The equations need the sampling intervals on the clock, which are known only after the pass.
    They nearly always equal those expected from the first pass; where they do not, the equations
    are set up again in a further pass.

    Parameters
    ----------
    first
        Results of the first pass over the log.
    vessel
        The vessel; without coefficients, the rudder is taken to act in proportion to the speed.
    on_progress
        Called with the step and its share done.
    strict
        Refuse a log whose channels contradict each other in unit or sign.

    Raises
    ------
    LogError
        Where an output has too few samples, or a unit or sign is wrong and `strict` is set.
    """
    log, log_stats, clock = first.log, first.log_stats, first.clock
    alphas, window_secs = (
        vessel.coefficients or SPEED_PROPORTIONAL_RUDDER,
        vessel.identifier.window_secs,
    )
    consistency = ConsistencyCheck(log_stats)
    hold, collector, wind = InputHold(clock), SignalStatsCollector(alphas), WindSignals(clock)
    expected = [clock.channels[name].interval_secs / clock.dt_secs for name in PAPER_OUTPUTS]
    intervals = np.maximum(np.round(expected), 1.0)
    equations = _Equations(alphas, clock, intervals, window_secs)
    listeners, chunked = (hold.add_raw, consistency.add), MeasuredChannels(log, clock, log_stats)
    for signals in resampled_chunks(chunked, clock, on_progress, "resample", *listeners, wind=wind):
        collector.add(hold.step(signals))
        equations.add(signals, collector.max_speed)
    stats = collector.result()
    if not np.array_equal(stats.intervals, equations.intervals):
        equations = _Equations(alphas, clock, stats.intervals, window_secs)
        for signals in resampled_chunks(chunked, clock, on_progress, "resample"):
            equations.add(signals, stats.max_speed)
    _require_outputs(log, stats)
    findings = consistency.result()
    if strict:
        refuse_contradictions(findings)
    warnings = [
        *channel_warnings(log_stats),
        *(finding.text for finding in findings),
        *late_channel_warnings(log_stats),
        *end_warnings(log_stats, clock, REQUIRED_CHANNELS),
        *hold.warnings(),
        *wind.warnings(),
        *equations.window_warnings(),
    ]
    wrong = tuple(finding.text for finding in findings if finding.kind in CONTRADICTIONS)
    biases = tuple(finding.text for finding in findings if finding.kind == "bias")
    return SecondPass(stats, equations.yaw, equations.surge, tuple(warnings), wrong, biases)


def resampled_chunks(
    log: RawChunks,
    clock: Clock,
    on_progress: ProgressCallback,
    step: str,
    *listeners: Callable[[tuple[Channel, ...]], None],
    wind: WindSignals | None = None,
) -> Iterator[Signals]:
    """Resample a log to its clock, chunk by chunk.

    Parameters
    ----------
    log
        The log.
    clock
        Its clock.
    on_progress
        Called with `step` and the share of the clock's instants done.
    step
        The name of this pass.
    *listeners
        Called with each chunk of raw channels before it is resampled.
    wind
        Adds the regressors of the wind; by default one without a state.

    Yields
    ------
    Signals
        Consecutive chunks of the signals.
    """
    wind = wind or WindSignals(clock)

    def raw_chunks() -> Iterator[tuple[Channel, ...]]:
        for chunk in log.chunks():
            for listener in listeners:
                listener(chunk)
            yield chunk

    on_progress(step, 0.0)
    for signals in resample_chunks(raw_chunks(), clock):
        yield wind.step(signals)
        on_progress(step, (signals.first + len(signals)) / clock.count)


def weak_form_on_clock(model: Coefficients, clock: Clock, intervals: FloatArray) -> WeakForm:
    """Set up the equations in integral form for signals on a clock.

    Parameters
    ----------
    model
        Only its alphas are used.
    clock
        The clock of the signals.
    intervals
        (2,) the median number of instants between samples of yaw rate and speed; the inputs are
        known at every instant outside their gaps.
    """
    return WeakForm(model, clock.count, clock.dt_secs, (*intervals.tolist(), 1.0, 1.0))


class _Equations:
    """The regressions of yaw and surge over the whole trial, from signals in chunks."""

    def __init__(
        self, alphas: Coefficients, clock: Clock, intervals: FloatArray, window_secs: float
    ) -> None:
        self.intervals, self._window_secs = intervals, window_secs
        self._log_secs = clock.count * clock.dt_secs
        self._weak_form = weak_form_on_clock(alphas, clock, intervals)
        self.yaw = WholeTrialRegression(self._weak_form.yaw, constant=True)
        self.surge = WholeTrialRegression(self._weak_form.surge)

    def add(self, signals: Signals, fastest: float) -> None:
        """Add the next signals; `fastest` is the greatest speed so far, m/s."""
        yaw_rows, surge_rows = self._weak_form.step(signals, fastest)
        self.yaw.add(yaw_rows)
        self.surge.add(surge_rows)

    def window_warnings(self) -> list[str]:
        """Warn of windows longer than the log, or too short for the number of coefficients."""
        window = f"identifier.window_secs = {self._window_secs:g}"
        least = {
            "yaw": min_window_secs(self._weak_form.yaw),
            "surge": min_window_secs(self._weak_form.surge),
        }
        if self._window_secs > self._log_secs:
            long_enough = self._log_secs > max(*least.values(), MIN_WINDOW_SECS)
            shorter = "shorten the windows or " if long_enough else ""
            text = f"{window} is longer than the log ({self._log_secs:.0f} s): one window covers "
            return [text + f"the whole log; {shorter}use a longer log"]
        too_short = [name for name, secs in least.items() if self._window_secs <= secs]
        if not too_short:
            return []
        needed = max(least[name] for name in too_short)
        text = f"{window} is too short for the coefficients of {' and '.join(too_short)}: "
        return [text + f"their windows are empty; use more than {needed:.0f} s"]


def _require_outputs(log: ChunkedLog, stats: SignalStats) -> None:
    """Raise `LogError` where yaw rate or speed has too few samples to estimate its noise."""
    for name, count in zip(PAPER_OUTPUTS, stats.sample_counts, strict=True):
        if count < MIN_OUTPUT_SAMPLES:
            raise LogError(
                f"channel {name!r} has {count} samples where the other channels have some, too, "
                f"but {MIN_OUTPUT_SAMPLES} are needed; check the recorder or choose another log: "
                f"{log.name}"
            )
