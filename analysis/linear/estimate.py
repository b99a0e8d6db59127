"""Estimation of a linear system from a log: plan, estimator, tests of the innovations."""

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from analysis.filters.smoother import Adjoint, SmoothingPass, smooth
from analysis.replay.passes import resampled_chunks
from analysis.replay.reading_options import DEFAULT_OPTIONS, ReadingOptions
from analysis.replay.residuals import ResidualSummary, ResidualTest
from analysis.signals.moments import Moments
from shiplog import open_log
from shiplog.errors import LogError
from shiplog.progress import ProgressCallback, no_progress
from shiplog.screening import ScreenedLog
from shiplog.types import FloatArray, Log, Signals

from .estimate_plan import EstimatePlan, plan_estimate
from .estimator import Estimator
from .feedback import CostMeter, CostSummary
from .linear_loop import combine
from .system import LinearSystem, naming_system_file
from .system_file import load_system
from .system_signals import HeldSignals


@dataclass(frozen=True, eq=False)
class EstimateChunk:
    """The estimates of consecutive instants, in the units of the system.

    Attributes
    ----------
    first
        Number of the first instant.
    values, stds
        (k, q): the reported quantities and their standard deviations; NaN before the inputs are
        known.
    measured, predicted
        (k, m): outputs as measured, NaN where they were not, and as predicted from the samples
        before.
    innovations, innovation_stds
        (k, m): measured minus predicted, and the expected standard deviation.
    inputs
        (k, inputs): the inputs, held where they were not measured.
    commanded
        (k, inputs): the inputs that the regulator commands; (k, 0) without one.
    """

    first: int
    values: FloatArray
    stds: FloatArray
    measured: FloatArray
    predicted: FloatArray
    innovations: FloatArray
    innovation_stds: FloatArray
    inputs: FloatArray
    commanded: FloatArray


@dataclass(frozen=True)
class QuantitySummary:
    """A reported quantity over the log.

    Attributes
    ----------
    name, unit, kind
        As in `Quantity`.
    mean, rms, min, max, at_end
        Of its estimate.
    std_at_end
        Standard deviation of the last estimate.
    """

    name: str
    unit: str
    kind: str
    mean: float
    rms: float
    min: float
    max: float
    at_end: float
    std_at_end: float


@dataclass(frozen=True, eq=False)
class EstimateFindings:
    """The results of an estimation without time series.

    Attributes
    ----------
    plan
        The plan.
    residuals
        Test of the innovations of each output.
    summaries
        Each reported quantity over the log.
    costs
        Costs of the recorded and the commanded inputs; None without a regulator.
    warnings
        Problems of the data, each in a sentence.
    """

    plan: EstimatePlan
    residuals: tuple[ResidualSummary, ...]
    summaries: tuple[QuantitySummary, ...]
    costs: CostSummary | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SystemEstimate:
    """An estimation with its time series: the findings, and the estimates of all instants."""

    findings: EstimateFindings
    chunk: EstimateChunk

    @property
    def time_secs(self) -> FloatArray:
        """Time of each instant since the start of the clock, (k,), s."""
        return np.arange(len(self.chunk.values)) * self.findings.plan.clock.dt_secs

    def __getitem__(self, name: str) -> FloatArray:
        """Return the estimate of a state, disturbance or coloured noise by name, (k,)."""
        return self.chunk.values[:, self._index(name)]

    def std(self, name: str) -> FloatArray:
        """Return the standard deviation of the same, (k,)."""
        return self.chunk.stds[:, self._index(name)]

    def _index(self, name: str) -> int:
        names = [quantity.name for quantity in self.findings.plan.quantities]
        if name not in names:
            raise KeyError(f"{name}; the estimate has {', '.join(names)}")
        return names.index(name)


def estimate(
    log: Log | str | os.PathLike[str],
    system: LinearSystem | str | os.PathLike[str],
    options: ReadingOptions = DEFAULT_OPTIONS,
    *,
    smoothed: bool = False,
    on_progress: ProgressCallback = no_progress,
) -> SystemEstimate:
    """Estimate the states of a linear system from a log.

    Parameters
    ----------
    log
        A log, or the path of one.
    system
        The system, or the path of a system file.
    options
        Of these the sources of channels, and the channels to derive.
    smoothed
        Smooth the states backwards from the end; for the Kalman filter of time-varying gain.
    on_progress
        Called with each step and its share done.

    Raises
    ------
    SystemFileError
        The system file has errors.
    LogError
        A channel is missing or cannot be used.
    UsageError
        A unit does not fit, disturbances cannot be distinguished, or there is no gain.
    """
    log = open_log(log) if isinstance(log, str | os.PathLike) else log
    system = system if isinstance(system, LinearSystem) else load_system(system)
    plan = plan_estimate(log, system, options, on_progress, smooth=smoothed)
    run = EstimateRun(log, plan, on_progress=on_progress)
    with threadpool_limits(limits=1, user_api="blas"):  # on small matrices threads only wait
        chunks = list(run.chunks())
    whole = {
        name: np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in EstimateChunk.__dataclass_fields__
        if name != "first"
    }
    return SystemEstimate(run.findings, EstimateChunk(0, **whole))


class EstimateRun:
    """An estimation in chunks: iterate over `chunks`, then read `findings`.

    Parameters
    ----------
    log
        The log as it was given to `plan_estimate`.
    plan
        The plan.
    on_progress
        Called with each step and its share done.
    """

    def __init__(
        self, log: Log, plan: EstimatePlan, *, on_progress: ProgressCallback = no_progress
    ) -> None:
        self._log, self.plan = ScreenedLog(log, plan.screening), plan
        self._on_progress = on_progress
        self._findings: EstimateFindings | None = None
        self._rows = np.array([quantity.row for quantity in plan.quantities])

    @property
    def findings(self) -> EstimateFindings:
        """The findings; raises `ValueError` before the chunks were iterated over."""
        if self._findings is None:
            raise ValueError("no findings yet; iterate over chunks() first")
        return self._findings

    def chunks(self) -> Iterator[EstimateChunk]:
        """Run the estimator over the log.

        Raises
        ------
        LogError
            The estimates diverge.
        UsageError
            There is no gain at an instant of the trial.
        """
        with naming_system_file(self.plan.system):
            yield from self._chunks()

    def _chunks(self) -> Iterator[EstimateChunk]:
        plan = self.plan
        adjoints = self._adjoints() if plan.smooth else None
        estimator = Estimator(plan)
        inputs, schedule = self._held()
        tests = _Tests(plan)
        meter = CostMeter(plan.feedback) if plan.feedback else None
        for signals in self._resampled("estimate"):
            measured = self._measured(signals)
            u, at = inputs.step(signals), schedule.step(signals)
            run = estimator.step(measured, u, at)
            if adjoints is not None and run.trace is not None:
                smoothed = smooth(run.trace, next(adjoints))
                run.values[run.first :], run.stds[run.first :] = combine(self._rows, *smoothed)
            plant = run.values[:, : plan.model.size]  # the states come first
            commanded = meter.add(plant, u) if meter else np.zeros((len(u), 0))
            chunk = EstimateChunk(
                signals.first, run.values, run.stds, measured, run.predicted, run.innovations,
                np.sqrt(run.variances), u, commanded,
            )  # fmt: skip
            _require_finite(plan, chunk, run.first)
            tests.add(chunk)
            yield chunk
        held = (*inputs.warnings(), *schedule.warnings())
        warnings = (*self._log.warnings, *plan.warnings, *held, *estimator.warnings())
        self._findings = tests.findings(meter.result() if meter else None, warnings)

    def _adjoints(self) -> Iterator[Adjoint]:
        """Return for each chunk, in order, what the measurements after it add: one more pass."""
        estimator = Estimator(self.plan)
        inputs, schedule = self._held()
        backward = SmoothingPass()
        for signals in self._resampled("smooth"):
            u, at = inputs.step(signals), schedule.step(signals)
            trace = estimator.step(self._measured(signals), u, at).trace
            assert trace is not None  # noqa: S101 - the plan asks for it
            backward.add(trace)
        return iter(backward.result())

    def _held(self) -> tuple[HeldSignals, HeldSignals]:
        clock = self.plan.clock
        return HeldSignals(self.plan.inputs, clock), HeldSignals(self.plan.schedule, clock)

    def _resampled(self, step: str) -> Iterator[Signals]:
        return resampled_chunks(self._log, self.plan.clock, self._on_progress, step)

    def _measured(self, signals: Signals) -> FloatArray:
        return np.column_stack([output.measured(signals) for output in self.plan.outputs])


class _Tests:
    """Tests of the innovations and summaries of the quantities, chunk by chunk."""

    def __init__(self, plan: EstimatePlan) -> None:
        self._plan = plan
        self._tests = [
            ResidualTest(
                output.binding.name,
                output.unit,
                interval / plan.clock.dt_secs,
                plan.clock.dt_secs,
                noise_measured=measured,
            )
            for output, interval, measured in zip(
                plan.outputs, plan.model.intervals, plan.measured, strict=True
            )
        ]
        self._moments = [Moments() for _ in plan.quantities]
        self._end = np.full((2, len(plan.quantities)), np.nan)

    def add(self, chunk: EstimateChunk) -> None:
        """Add the next chunk."""
        for j, test in enumerate(self._tests):
            none_rejected = np.zeros(len(chunk.values), np.bool_)
            test.add(chunk.innovations[:, j], chunk.innovation_stds[:, j], none_rejected)
        for k, moments in enumerate(self._moments):
            moments.add(chunk.values[:, k])
        self._end = np.array([chunk.values[-1], chunk.stds[-1]])

    def findings(self, costs: CostSummary | None, warnings: tuple[str, ...]) -> EstimateFindings:
        """Return the findings of all chunks."""
        summaries = (
            QuantitySummary(
                q.name, q.unit, q.kind, m.mean, float(np.sqrt(m.mean_square)), m.min, m.max,
                float(end), float(std),
            )
            for q, m, end, std in zip(self._plan.quantities, self._moments, *self._end, strict=True)
        )  # fmt: skip
        residuals = tuple(test.result() for test in self._tests)
        return EstimateFindings(self._plan, residuals, tuple(summaries), costs, warnings)


def _require_finite(plan: EstimatePlan, chunk: EstimateChunk, first: int) -> None:
    if not np.isfinite(chunk.values[first:]).all():
        raise LogError(
            f"the estimates of {plan.system.name!r} diverge; choose slower poles or a larger"
            f" measurement noise: {plan.name}"
        )
