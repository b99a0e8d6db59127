"""The replay: a log run through filter, disturbance observer and regression, chunk by chunk.

A log may be longer than memory: it is read in chunks, twice to plan the replay (`plan`), once to
replay it, and once in between where the states are smoothed. Every stage takes a chunk, returns a
chunk and carries its state; where the chunks are cut changes no result.
"""

import os
from collections.abc import Iterator, Mapping

from analysis.filters.base import FilterKind
from analysis.filters.factory import smoothable
from analysis.filters.smoother import Adjoint, SmoothingPass, trace_chunk
from analysis.signals.concat import concatenate
from analysis.signals.hold import InputHold, held_throughout
from shiplog import open_log
from shiplog.checks.consistency.findings import naming_contradictions
from shiplog.progress import ProgressCallback, no_progress
from shiplog.screening import ScreenedLog
from shiplog.types import Log

from .estimator_design import make_estimators
from .measured_channels import MeasuredChannels
from .passes import resampled_chunks
from .plan import Plan, plan_replay
from .reading_options import DEFAULT_OPTIONS, ReadingOptions
from .replay_results import Analysis, Findings, ReplayChunk
from .stages import Stages

# the steps reported as progress; the fourth only where states are smoothed
PROGRESS_STEPS = ("check the log", "resample", "choose the model", "smooth", "replay")


def analyse(
    log: Log | str | os.PathLike[str],
    options: ReadingOptions = DEFAULT_OPTIONS,
    *,
    filter: FilterKind | str | None = None,  # noqa: A002 - as on the command line
    settings: Mapping[str, object] | None = None,
    on_progress: ProgressCallback = no_progress,
) -> Analysis:
    """Replay a log: filter it, estimate disturbances and coefficients, test the residuals.

    All results are held in memory; for a log longer than that use `plan_replay` and `Replay`.

    Parameters
    ----------
    log
        A log, or the path of one.
    options
        The vessel, the ship's length, the sources of channels, and whether contradictions are
        refused; by default all that the log states holds, and without a vessel a first model is
        fitted to it.
    filter
        The filter, or its name; by default the one that the settings or the vessel name.
    settings
        Settings that take precedence over the vessel's, such as ``{"filter.gate": 4.0}``.
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
    plan = plan_replay(log, options, filter=filter, settings=settings, on_progress=on_progress)
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
        self._chunked = MeasuredChannels(self._log, plan.clock, plan.log_stats)
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
        hold, stages = InputHold(clock), Stages(self.plan)
        listeners = hold.add_raw, stages.tracker.add_raw
        resampled = resampled_chunks(self._chunked, clock, self._on_progress, "replay", *listeners)
        for signals, held, following in held_throughout(resampled, hold):
            yield stages.step(signals, held, following, adjoints)
        self._findings = stages.findings(self._log)

    @property
    def findings(self) -> Findings:
        """The findings; raises `ValueError` before the chunks were iterated over."""
        if self._findings is None:
            raise ValueError("no findings yet; iterate over chunks() first")
        return self._findings

    def _backward_pass(self) -> Iterator[Adjoint]:
        """Return what the measurements after each piece of a chunk add, in order: one more pass."""
        plan = self.plan
        hold, (filter_, _) = InputHold(plan.clock), make_estimators(plan)
        tracing = smoothable(filter_)
        first = SmoothingPass()
        resampled = resampled_chunks(
            self._chunked, plan.clock, self._on_progress, "smooth", hold.add_raw
        )
        for _, held, following in held_throughout(resampled, hold):
            trace_chunk(tracing, held, following, first)
        return iter(first.result())
