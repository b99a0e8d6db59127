"""From a log to what it says: the order of the steps.

A log may be longer than memory: it is gone through in chunks, twice to plan the replay (`plan`) and
at last to replay it; where its states are to be smoothed, once between, to learn what the end says
of the beginning. Every stage takes chunks, gives chunks and carries its state; where the chunks are
cut changes nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.disturbance.observer import Disturbance, DisturbanceSummary, ForceObserver
from analysis.filters.base import OUTPUT_STATES, Estimates, Filter
from analysis.filters.factory import make_filter
from analysis.filters.smoother import Adjoint, SmoothingPass, smoothed
from analysis.regression.changes import Change, ShipChangeTest
from analysis.regression.coefficients import CoefficientFit
from analysis.regression.sliding import History
from analysis.signals.concat import concatenate
from analysis.signals.hold import InputHold, held_throughout
from shiplog import LogError, Signals, Vessel
from shiplog.errors import UsageError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.types import Log

from .plan import FITTED, Plan, Planner, signals_of, weak_form_of
from .residuals import OutputResiduals, ResidualTest
from .track import Track, Tracker

STEPS = ("check", "one clock", "model", "look ahead", "replay")  # the fourth where it smooths


@dataclass(frozen=True, eq=False)
class ReplayChunk:
    """What a replay says of a stretch of the trial; each part as far as it is known by then."""

    signals: Signals  # as measured, NaN where not
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: History
    surge_history: History
    track: Track


@dataclass(frozen=True, eq=False)
class Findings(Plan):
    """What a replay comes to."""

    metadata: dict[str, str]  # of the log
    residuals: tuple[OutputResiduals, ...]  # of yaw rate and speed
    courses: dict[str, DisturbanceSummary]  # of the disturbances
    yaw: CoefficientFit
    surge: CoefficientFit
    changes: tuple[Change, ...]  # of coefficients, within the trial
    track_origin: str  # how the track is known, in words


@dataclass(frozen=True, eq=False)
class Analysis(Findings, ReplayChunk):
    """All that a replay found: what it comes to, and the whole trial in one chunk."""


def analyse(
    log: Log,
    vessel: Vessel | None = None,
    *,
    settings: Mapping[str, object] | None = None,
    on_progress: ProgressCallback = no_progress,
) -> Analysis:
    """Replay a log: check it, filter it, observe what disturbed it, identify the ship.

    The model is `vessel`'s, or the one the log carries, or else a first one fitted to the log.
    `settings`, such as {"filter.kind": "extended"}, stand above those of its `[filter]` and
    `[disturbance]`. `on_progress` is told each of `STEPS`, and the share of it that is done. For a
    log longer than memory use `Replay`.

    Raises `LogError` where the log lacks a needed channel or cannot be used as it is, `UsageError`
    for settings that do not do.
    """
    replay = Replay(log, vessel, settings=settings, on_progress=on_progress)
    whole = concatenate(list(replay.chunks()))
    return Analysis(**vars(whole), **vars(replay.findings))


class Replay:
    """A replay in chunks: go through `chunks`, then ask for the `findings`.

    As `analyse`, except that no more than a chunk is held. Its `plan` is made at once, from two
    passes over the log; the chunks are the last.
    """

    def __init__(
        self,
        log: Log,
        vessel: Vessel | None = None,
        *,
        settings: Mapping[str, object] | None = None,
        on_progress: ProgressCallback = no_progress,
    ) -> None:
        self._log, self._tell = log, on_progress
        planned = Planner(log, vessel, settings or {}, on_progress)
        self.plan, self._yaw, self._surge = planned.plan, planned.yaw, planned.surge
        self._begun = False
        self._findings: Findings | None = None

    def chunks(self) -> Iterator[ReplayChunk]:
        """Replay the trial, once.

        Raises `LogError` where the model does not fit it at all.
        """
        if self._begun:
            raise ValueError("the chunks of a replay come once; make another")
        self._begun = True
        plan, clock, fastest = self.plan, self.plan.clock, self.plan.stats.fastest
        ends = self._looked_ahead() if plan.vessel.filter.smooth else None
        holding, (filtering, observing) = InputHold(clock), self._designed()
        tests = [self._residual_test(output) for output in range(len(PAPER_OUTPUTS))]
        weak_form = weak_form_of(plan.vessel.paper, clock, plan.stats.intervals)
        watching = ShipChangeTest(weak_form, guessed=plan.model_origin == FITTED)
        tracking = Tracker(clock, plan.log_stats.get("position"))
        watches = holding.add_raw, tracking.add_raw
        on_clock = signals_of(self._log, clock, self._tell, "replay", *watches)
        for signals, held, following in held_throughout(on_clock, holding):
            estimates = _estimated(filtering, held, following, ends)
            if not np.all(np.isfinite(estimates.states)):
                raise self._runs_away()
            for i, test in enumerate(tests):
                e, stds, gated = estimates.innovations, estimates.innovation_stds, estimates.gated
                test.add(e[:, i], stds[:, i], gated[:, i])
            disturbance = observing.step(_without_gated(held, estimates), following)
            yaw_rows, surge_rows = weak_form.step(signals, fastest)
            watching.add(yaw_rows, surge_rows)
            yaw, surge = self._yaw.step(yaw_rows), self._surge.step(surge_rows)
            track = tracking.step(signals, *(estimates.states[:, i] for i in OUTPUT_STATES))
            yield ReplayChunk(signals, estimates, disturbance, yaw, surge, track)
        residuals = tuple(test.result() for test in tests)
        changes = watching.result()
        said = [residual.caution for residual in residuals if residual.caution]
        said += map(str, changes)
        self._findings = Findings(
            **vars(plan) | {"warnings": (*plan.warnings, *said)},
            metadata=dict(self._log.metadata),
            residuals=residuals,
            courses=observing.result(),
            yaw=self._yaw.result(),
            surge=self._surge.result(),
            changes=changes,
            track_origin=tracking.origin,
        )

    @property
    def findings(self) -> Findings:
        """What the replay came to. Raises `ValueError` before its chunks were gone through."""
        if self._findings is None:
            raise ValueError("go through the chunks first")
        return self._findings

    def _looked_ahead(self) -> Iterator[Adjoint]:
        """Of each chunk, in their order, what the measurements after it say: one more pass."""
        holding, (filtering, _) = InputHold(self.plan.clock), self._designed()
        ahead = SmoothingPass(filtering.outputs)
        on_clock = signals_of(self._log, self.plan.clock, self._tell, "look ahead", holding.add_raw)
        for _, held, following in held_throughout(on_clock, holding):
            ahead.add(filtering.trace(held, following)[1])
        return iter(ahead.result())

    def _designed(self) -> tuple[Filter, ForceObserver]:
        """The filter and the observer; of a model that runs away neither may be had."""
        model, noise, stats = self.plan.vessel.paper, self.plan.noise, self.plan.stats
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                filtering = make_filter(model, noise, stats, self.plan.vessel.filter)
                observed = self.plan.observed
                observing = ForceObserver(model, noise, stats, observed, observed.wave_frequency)
                return filtering, observing
        except (UsageError, np.linalg.LinAlgError) as error:
            raise self._runs_away(f" ({error})") from error

    def _residual_test(self, output: int) -> ResidualTest:
        name, plan = PAPER_OUTPUTS[output], self.plan
        interval = float(plan.stats.intervals[output])
        unit, noise_measured = plan.log_stats[name].unit, plan.noise.measured[output]
        return ResidualTest(name, unit, interval, noise_measured=noise_measured)

    def _runs_away(self, why: str = "") -> LogError:
        return LogError(
            f"the filter or the observer runs away{why}: the model ({self.plan.model_origin}) or "
            f"the settings do not fit this log; give the ship's own with --vessel: {self._log.name}"
        )


def _without_gated(held: Signals, estimates: Estimates) -> Signals:
    """The signals without what the filter did not believe."""
    if not estimates.gated.any():
        return held
    believed = {
        name: np.where(estimates.gated[:, i], np.nan, held[name])
        for i, name in enumerate(PAPER_OUTPUTS)
    }
    return replace(held, values=dict(held.values) | believed)


def _estimated(
    filtering: Filter,
    held: Signals,
    following: Mapping[str, float],
    ends: Iterator[Adjoint] | None,
) -> Estimates:
    """The next chunk's estimates, smoothed where it is known what comes after."""
    if ends is None:
        return filtering.step(held, following)
    estimates, trace = filtering.trace(held, following)
    return smoothed(filtering, held, following, estimates, trace, next(ends))
