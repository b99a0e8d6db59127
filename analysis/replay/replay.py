"""The replay: a log run through filter, disturbance observer and regression, chunk by chunk.

A log may be longer than memory: it is read in chunks, twice to plan the replay (`plan`), once to
replay it, and once in between where the states are smoothed. Every stage takes a chunk, returns a
chunk and carries its state; where the chunks are cut changes no result.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.disturbance.observer import (
    Disturbance,
    DisturbanceSummary,
    ForceObserver,
    force_models,
)
from analysis.filters.base import OUTPUT_STATES, Estimates, Filter, FilterKind
from analysis.filters.factory import smoothable
from analysis.filters.smoother import Adjoint, SmoothingPass, smoothed
from analysis.regression.changes import Change, ShipChangeTest
from analysis.regression.coefficients import CoefficientFit, CoefficientStage
from analysis.regression.sliding import CoefficientHistory
from analysis.signals.concat import concatenate
from analysis.signals.hold import InputHold, held_throughout
from shiplog import LogError, Signals, Vessel, open_log
from shiplog.checks.consistency.findings import naming_contradictions
from shiplog.errors import UsageError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.screening import ScreenedLog
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.types import Log

from .passes import resampled_chunks, weak_form_on_clock
from .plan import Plan, changed_settings, plan_replay, with_default_settings
from .residuals import ResidualSummary, ResidualTest
from .track import Track, Tracker

MIN_EXCESS_SHARE = 0.1  # of the trial, with a disturbance beyond the rudder: the model is wrong
DESIGN_ERRORS = (UsageError, np.linalg.LinAlgError, ArithmeticError)
# the steps reported as progress; the fourth only where states are smoothed
PROGRESS_STEPS = ("check the log", "resample", "choose the model", "smooth", "replay")


@dataclass(frozen=True, eq=False)
class ReplayChunk:
    """The results of a replay for a stretch of the trial, as far as they are known by its end.

    Attributes
    ----------
    signals
        The resampled signals, as measured; NaN where nothing was measured.
    estimates
        The filter's states, on the clock of the signals.
    disturbance
        The disturbances estimated, on the same clock.
    yaw_history, surge_history
        The coefficients of the windows that end in this stretch.
    track
        The positions that have become known in this stretch.
    """

    signals: Signals
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: CoefficientHistory
    surge_history: CoefficientHistory
    track: Track


@dataclass(frozen=True, eq=False)
class Findings:
    """The results of a replay for the whole trial, without its time series.

    Attributes
    ----------
    plan
        The plan of the replay: vessel, clock, statistics, noise.
    metadata
        The metadata of the log.
    residuals
        The tests of the innovations of yaw rate and speed.
    disturbances
        The summary of each disturbance: ``"yaw"``, ``"rudder"`` (yaw, as the rudder that would do
        the same), ``"surge"``, and ``"yaw_wave"`` and ``"surge_wave"`` where they are estimated.
    yaw, surge
        The coefficients over the whole trial, with standard deviations.
    changes
        The coefficients that changed within the trial.
    track_origin
        How the track is known, in words.
    warnings
        Those of the plan and those of the replay.
    """

    plan: Plan
    metadata: dict[str, str]
    residuals: tuple[ResidualSummary, ...]
    disturbances: dict[str, DisturbanceSummary]
    yaw: CoefficientFit
    surge: CoefficientFit
    changes: tuple[Change, ...]
    track_origin: str
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Analysis:
    """All results of a replay: the findings, and the time series of the whole trial.

    Attributes
    ----------
    findings
        What holds for the whole trial: plan, residual tests, coefficients, warnings.
    signals, estimates, disturbance, yaw_history, surge_history, track
        The time series; see `ReplayChunk`.
    """

    findings: Findings
    signals: Signals
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: CoefficientHistory
    surge_history: CoefficientHistory
    track: Track

    def as_chunk(self) -> ReplayChunk:
        """Return the time series as one chunk."""
        return ReplayChunk(
            self.signals,
            self.estimates,
            self.disturbance,
            self.yaw_history,
            self.surge_history,
            self.track,
        )


def analyse(
    log: Log | str | os.PathLike[str],
    vessel: Vessel | None = None,
    *,
    filter: FilterKind | str | None = None,  # noqa: A002 - as on the command line
    settings: Mapping[str, object] | None = None,
    sources: Mapping[str, str] | None = None,
    length: float | None = None,
    on_progress: ProgressCallback = no_progress,
) -> Analysis:
    """Replay a log: filter it, estimate disturbances and coefficients, test the residuals.

    All results are held in memory; for a log longer than that use `plan_replay` and `Replay`.

    Parameters
    ----------
    log
        A log, or the path of one.
    vessel
        The vessel; by default the one that the log carries, or else a first model is fitted to the
        log.
    filter
        The filter, or its name; by default the one that the settings or the vessel name.
    settings
        Settings that take precedence over the vessel's, such as ``{"filter.gate": 4.0}``.
    sources
        The source of a channel that has several, by its name, such as ``{"yaw_rate": "TI"}``.
    length
        The ship's length, m, in place of the vessel's.
    on_progress
        Called with each of `PROGRESS_STEPS` and its share done.

    Raises
    ------
    LogError
        Where the log lacks a required channel, cannot be used as it is, or does not fit the model.
    UsageError
        Where a setting is invalid.

    Examples
    --------
    >>> analysis = analyse("sample_data/zigzag_20_20.mcap")
    >>> analysis.estimates.states.shape
    (6001, 5)
    >>> print(f"{analysis.findings.yaw.coefficients['d'].value:.3g}")
    0.000133
    """
    if isinstance(log, str | os.PathLike):
        log = open_log(log)
    plan = plan_replay(
        log,
        vessel,
        filter=filter,
        settings=settings,
        sources=sources,
        length=length,
        on_progress=on_progress,
    )
    replay = Replay(log, plan, on_progress=on_progress)
    whole = concatenate(list(replay.chunks()))
    return Analysis(
        replay.findings,
        whole.signals,
        whole.estimates,
        whole.disturbance,
        whole.yaw_history,
        whole.surge_history,
        whole.track,
    )


class Replay:
    """A replay in chunks: iterate over `chunks`, then read `findings`.

    No more than a chunk is held in memory.

    Parameters
    ----------
    log
        The log.
    plan
        Its plan, from `plan_replay`. It is not changed; another replay may use it, too.
    on_progress
        Called with each step and its share done.

    Examples
    --------
    >>> from shiplog import open_log
    >>> log = open_log("sample_data/zigzag_20_20.mcap")
    >>> replay = Replay(log, plan_replay(log))
    >>> sum(len(chunk.signals) for chunk in replay.chunks())
    6001
    """

    def __init__(
        self, log: Log, plan: Plan, *, on_progress: ProgressCallback = no_progress
    ) -> None:
        self._log = ScreenedLog(log, plan.screening)
        self.plan, self._on_progress = plan, on_progress
        self._started = False
        self._findings: Findings | None = None

    def chunks(self) -> Iterator[ReplayChunk]:
        """Replay the trial, once.

        Raises
        ------
        LogError
            Where the filter or the observer diverges.
        """
        if self._started:
            raise ValueError("the chunks of a replay can be read once only; make another Replay")
        self._started = True
        with naming_contradictions(self.plan.contradictions):
            yield from self._chunks()

    def _chunks(self) -> Iterator[ReplayChunk]:
        clock = self.plan.clock
        adjoints = self._backward_pass() if self.plan.vessel.filter.smooth else None
        hold, stages = InputHold(clock), _Stages(self.plan, self._log.name)
        listeners = hold.add_raw, stages.tracker.add_raw
        resampled = resampled_chunks(self._log, clock, self._on_progress, "replay", *listeners)
        for signals, held, following in held_throughout(resampled, hold):
            adjoint = next(adjoints) if adjoints is not None else None
            yield stages.step(signals, held, following, adjoint)
        self._findings = stages.findings(dict(self._log.metadata))

    @property
    def findings(self) -> Findings:
        """The findings; raises `ValueError` before the chunks were iterated over."""
        if self._findings is None:
            raise ValueError("no findings yet; iterate over chunks() first")
        return self._findings

    def _backward_pass(self) -> Iterator[Adjoint]:
        """Return for each chunk, in order, what the measurements after it add: one more pass."""
        plan = self.plan
        hold, (filter_, _) = InputHold(plan.clock), _estimators(plan, self._log.name)
        tracing = smoothable(filter_)
        backward = SmoothingPass(tracing.outputs)
        resampled = resampled_chunks(
            self._log, plan.clock, self._on_progress, "smooth", hold.add_raw
        )
        for _, held, following in held_throughout(resampled, hold):
            backward.add(tracing.trace(held, following)[1])
        return iter(backward.result())


class _Stages:
    """The stages of a replay; each takes a chunk, returns a chunk and carries its state."""

    def __init__(self, plan: Plan, log_name: str) -> None:
        self._plan, self._log_name = plan, log_name
        self._filter, self._observer = _estimators(plan, log_name)
        self._residual_tests = [_residual_test(plan, i) for i in range(len(PAPER_OUTPUTS))]
        weak_form = weak_form_on_clock(
            plan.vessel.paper_coefficients, plan.clock, plan.stats.intervals
        )
        count, window_secs = weak_form.row_count, plan.vessel.identifier.window_secs
        self._yaw = CoefficientStage(
            weak_form.yaw, count, plan.yaw_solution, constant=True, window_secs=window_secs
        )
        self._surge = CoefficientStage(
            weak_form.surge, count, plan.surge_solution, window_secs=window_secs
        )
        self._weak_form = weak_form
        self._change_test = ShipChangeTest(weak_form, model_is_fitted=plan.model_is_fitted)
        self.tracker = Tracker(plan.clock, plan.log_stats.get("position"))

    def step(
        self,
        signals: Signals,
        held: Signals,
        following: Mapping[str, float],
        adjoint: Adjoint | None,
    ) -> ReplayChunk:
        """Replay the next chunk.

        Parameters
        ----------
        signals
            The chunk as measured.
        held
            The same with the inputs held where they were not measured.
        following
            The inputs at the instant after the chunk.
        adjoint
            What the measurements after the chunk add; None where the states are not smoothed.
        """
        estimates = self._estimates(held, following, adjoint)
        for i, test in enumerate(self._residual_tests):
            test.add(
                estimates.innovations[:, i],
                estimates.innovation_stds[:, i],
                estimates.rejected[:, i],
            )
        disturbance = self._observer.step(_without_rejected(held, estimates), following)
        yaw_rows, surge_rows = self._weak_form.step(signals, self._plan.stats.max_speed)
        self._change_test.add(yaw_rows, surge_rows)
        return ReplayChunk(
            signals,
            estimates,
            disturbance,
            self._yaw.step(yaw_rows),
            self._surge.step(surge_rows),
            self.tracker.step(signals, *(estimates.states[:, i] for i in OUTPUT_STATES)),
        )

    def findings(self, metadata: dict[str, str]) -> Findings:
        """Return the findings, once all chunks were replayed."""
        residuals = tuple(test.result() for test in self._residual_tests)
        changes = self._change_test.result()
        warnings = [residual.warning for residual in residuals if residual.warning]
        warnings += _excess_warnings(self._plan, self._observer.excess_share)
        return Findings(
            plan=self._plan,
            metadata=metadata,
            residuals=residuals,
            disturbances=self._observer.result(),
            yaw=self._yaw.result(),
            surge=self._surge.result(),
            changes=changes,
            track_origin=self.tracker.origin,
            warnings=(*self._plan.warnings, *warnings, *map(str, changes)),
        )

    def _estimates(
        self, held: Signals, following: Mapping[str, float], adjoint: Adjoint | None
    ) -> Estimates:
        """Filter the next chunk, and smooth it where `adjoint` is given."""
        if adjoint is None:
            estimates = self._filter.step(held, following)
        else:
            tracing = smoothable(self._filter)
            filtered, trace = tracing.trace(held, following)
            estimates = smoothed(tracing, held, following, filtered, trace, adjoint)
        if not np.all(np.isfinite(estimates.states)):
            raise _diverged(self._plan, self._log_name)
        return estimates


def _estimators(plan: Plan, log_name: str) -> tuple[Filter, ForceObserver]:
    """Design the filter and the observer; for a model that diverges neither may exist."""
    settings = plan.disturbance_settings
    # an invalid setting stays a UsageError that names it; only the model can diverge
    force_models(settings, settings.wave_frequency, plan.stats)
    try:
        return _design(plan)
    except DESIGN_ERRORS as error:
        with np.errstate(over="ignore", invalid="ignore"):
            names = _unsuitable_settings(plan)
        if names:
            raise UsageError(
                f"{names} does not suit this log or its model: {error}: {log_name}"
            ) from error
        raise _diverged(plan, log_name, f" ({error})") from error


def _design(plan: Plan) -> tuple[Filter, ForceObserver]:
    model, noise, stats = plan.vessel.paper_coefficients, plan.noise, plan.stats
    settings = plan.disturbance_settings
    with np.errstate(over="ignore", invalid="ignore"):
        filter_ = plan.filter_kind.make(model, noise, stats, plan.vessel.filter)
        return filter_, ForceObserver(
            model,
            noise,
            stats,
            settings,
            settings.wave_frequency,
            rudder_max=plan.vessel.rudder_max,
        )


def _unsuitable_settings(plan: Plan) -> str:
    """Name the settings without which the design succeeds; "" where it fails without any."""
    changed = changed_settings(plan.vessel)
    for names in (*((name,) for name in changed), tuple(changed)):
        try:
            _design(with_default_settings(plan, names))
        except (*DESIGN_ERRORS, LogError):
            continue
        return ", ".join(f"{name} = {changed[name]}" for name in names)
    return ""


def _diverged(plan: Plan, log_name: str, reason: str = "") -> LogError:
    changed = [f"{name} = {value}" for name, value in changed_settings(plan.vessel).items()]
    settings = f", or remove the settings {', '.join(changed)}" if changed else ""
    return LogError(
        f"the filter or the disturbance observer diverges{reason}: the model "
        f"({plan.model_origin}) or the settings do not fit this log; give another model with "
        f"--vessel{settings}: {log_name}"
    )


def _excess_warnings(plan: Plan, share: float) -> list[str]:
    """Warn where the yaw disturbance is worth more rudder than the ship has."""
    if share < MIN_EXCESS_SHARE:
        return []
    text = (
        f"for {100 * share:.0f} % of the trial the yaw disturbance is worth more than the largest "
        f"rudder angle ({np.degrees(plan.vessel.rudder_max):.0f}°): the model "
        f"({plan.model_origin}) is wrong for this log; check the signs and units of rudder and "
        "yaw rate, or give another model with --vessel"
    )
    return [text]


def _residual_test(plan: Plan, output: int) -> ResidualTest:
    """Set up the test of the innovations of yaw rate, 0, or speed, 1."""
    name, interval = PAPER_OUTPUTS[output], float(plan.stats.intervals[output])
    unit, noise_measured = plan.log_stats[name].unit, plan.noise.measured[output]
    return ResidualTest(name, unit, interval, noise_measured=noise_measured)


def _without_rejected(held: Signals, estimates: Estimates) -> Signals:
    """Return the signals with the samples that the filter rejected set to NaN."""
    if not estimates.rejected.any():
        return held
    accepted = {
        name: np.where(estimates.rejected[:, i], np.nan, held[name])
        for i, name in enumerate(PAPER_OUTPUTS)
    }
    return replace(held, values=dict(held.values) | accepted)
