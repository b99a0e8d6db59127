"""The estimator of a plan over chunks of signals: gains, ticks of a varying plant, stages."""

from dataclasses import dataclass

import numpy as np

from analysis.filters.base import Trace
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .estimate_plan import EstimatePlan
from .initial_estimate import initial_estimate
from .joined_system import OutputSampling, estimator_model
from .linear_loop import (
    StretchModel,
    StretchResult,
    cascade_model,
    combine,
    run_stretch,
    stretch_model,
)
from .system import Linearisation

MAX_RATE_PER_STEP = 1e3  # of an entry of A: near a singular point they grow without bound
MAX_STRETCH = 4096  # samples whose covariances are in memory at once


@dataclass(frozen=True, eq=False)
class EstimatorRun:
    """What the estimator returns for the k instants of a chunk.

    Attributes
    ----------
    first
        Number of instants at its start without an estimate, for want of inputs; NaN there.
    values, stds
        (k, q): the reported quantities and their standard deviations.
    predicted, innovations, variances
        (k, m): as in `StretchResult`.
    trace
        What the smoother needs of the instants from `first` on; None where it was not asked for.
    """

    first: int
    values: FloatArray
    stds: FloatArray
    predicted: FloatArray
    innovations: FloatArray
    variances: FloatArray
    trace: Trace | None = None


class Estimator:
    """The estimator of a plan; it carries its state from chunk to chunk.

    Parameters
    ----------
    plan
        The plan.
    """

    def __init__(self, plan: EstimatePlan) -> None:
        self._plan, system = plan, plan.system
        self._sampling = OutputSampling(plan.model.r, plan.model.intervals, plan.clock.dt_secs)
        ticks = (system.tick_secs or plan.clock.dt_secs) / plan.clock.dt_secs
        self._tick = None if system.linearise is None else max(1, round(ticks))
        self._design, self._model = plan.design, stretch_model(plan.model, plan.design)
        if plan.design.stages > 1:
            self._model = cascade_model(self._model, plan.design)
        self._started, self._count, self._skipped = False, 0, 0
        self._x: FloatArray = np.zeros(0)
        self._P: FloatArray = np.zeros((0, 0))
        self._before: FloatArray = np.zeros(0)
        self._rows = np.array([quantity.row for quantity in plan.quantities])

    def step(self, y: FloatArray, u: FloatArray, at: FloatArray) -> EstimatorRun:
        """Run over the next chunk.

        Parameters
        ----------
        y
            (k, m): measured outputs, NaN where there are none.
        u
            (k, inputs): inputs, NaN before their first sample.
        at
            (k, s): scheduling signals, likewise.
        """
        first = 0
        if not self._started:
            known = np.isfinite(u).all(axis=1) & np.isfinite(at).all(axis=1)
            first = int(np.argmax(known)) if known.any() else len(y)
            self._skipped += first
            if known.any():
                self._start(u[first], at[first])
        parts, k = [_not_estimated(first, len(self._rows), len(self._sampling.r))], first
        results: list[StretchResult] = []
        transitions: list[FloatArray] = []
        while k < len(y):
            end = min(k + self._length(), len(y))
            transitions += [self._model.F] * (end - k)
            result = self._run(y[k:end], u[k:end])
            reported = combine(self._rows, result.states, result.covariances)
            parts.append((*reported, result.predicted, result.innovations, result.variances))
            if self._plan.smooth:
                results.append(result)
            if self._tick and self._count % self._tick == 0:
                self._linearise(at[end - 1])
            k = end
        values, stds, predicted, innovations, variances = (
            np.concatenate(arrays) for arrays in zip(*parts, strict=True)
        )
        trace = self._trace(results, transitions) if self._plan.smooth else None
        return EstimatorRun(first, values, stds, predicted, innovations, variances, trace)

    def _trace(self, results: list[StretchResult], transitions: list[FloatArray]) -> Trace:
        """Return what the smoother needs; `transitions` are those into each instant."""
        following = [*transitions[1:], self._model.F][: len(transitions)]
        results = results or [_no_result(self._model)]
        names = ("states", "covariances", "gains", "sequential", "sequential_variances")
        arrays = [np.concatenate([getattr(r, name) for r in results]) for name in names]
        states, covariances, gains, innovations, variances = arrays
        F = np.ascontiguousarray(np.reshape(following, (len(following), *covariances.shape[1:])))
        rows = self._model.C * np.any(gains != 0.0, axis=2, keepdims=True)
        return Trace(states, covariances, F, rows, gains, innovations, variances)

    def warnings(self) -> tuple[str, ...]:
        """Return a warning where the estimate began late."""
        if not self._skipped:
            return ()
        secs = self._skipped * self._plan.clock.dt_secs
        return (f"the inputs are not known before {secs:.1f} s; the estimates begin there",)

    def _start(self, u: FloatArray, at: FloatArray) -> None:
        plan = self._plan
        self._x, self._P = initial_estimate(
            plan.system, plan.model, plan.start, u, plan.design.poles
        )
        self._before = u.copy()
        stages = plan.design.stages
        self._x, self._P = np.tile(self._x, stages), np.kron(np.ones((stages, stages)), self._P)
        if self._tick:
            self._linearise(at)

    def _length(self) -> int:
        """Return the number of samples until the next tick, or the longest stretch."""
        return self._tick - self._count % self._tick if self._tick else MAX_STRETCH

    def _linearise(self, at: FloatArray) -> None:
        """Linearise the plant at the estimate and the scheduling signals, (s,), of this instant."""
        system = self._plan.system
        assert system.linearise is not None  # noqa: S101 - there is a tick only with it
        with np.errstate(all="ignore"):
            there = system.linearise(self._x[: len(system.plant.A)], at)
        try:
            _require_regular(there, self._sampling.dt)
            model = estimator_model(system, self._sampling, there)
            if self._design.correction is not None:
                self._design = system.method.design(model)
        except UsageError as error:
            secs = self._count * self._plan.clock.dt_secs
            raise UsageError(f"no gain at {secs:.1f} s: {error}") from None
        self._model = stretch_model(model, self._design)

    def _run(self, y: FloatArray, u: FloatArray) -> StretchResult:
        m, N = len(self._sampling.r), len(self._plan.model.A)
        zeros = np.zeros((len(y), len(self._model.r) - m))  # the further outputs of a cascade
        result = run_stretch(
            self._model, self._x, self._P, self._before, np.hstack((y, zeros)),
            np.ascontiguousarray(u), not self._started,
        )  # fmt: skip
        self._started = True
        self._count += len(y)
        if self._design.stages == 1:
            return result
        return result._replace(
            states=np.ascontiguousarray(result.states[:, -N:]),
            covariances=np.ascontiguousarray(result.covariances[:, -N:, -N:]),
            predicted=result.predicted[:, :m],
            innovations=result.innovations[:, :m],
            variances=result.variances[:, :m],
        )


def _require_regular(there: Linearisation, dt: float) -> None:
    """Refuse a linearisation that is not finite or far faster than the samples."""
    if not (np.isfinite(there.A).all() and np.abs(there.A).max() * dt < MAX_RATE_PER_STEP):
        raise UsageError(
            "the plant is singular there (Euler angles are where cos θ = 0); use other coordinates"
        )


def _not_estimated(count: int, quantities: int, outputs: int) -> tuple[FloatArray, ...]:
    """Return values, stds, predictions, innovations and variances where there is no estimate."""
    values, predicted = np.full((count, quantities), np.nan), np.full((count, outputs), np.nan)
    return values, values, predicted, predicted, predicted


def _no_result(model: StretchModel) -> StretchResult:
    """Return the result of no instant."""
    N, m = model.M.shape
    outputs = np.zeros((0, m))
    return StretchResult(
        np.zeros((0, N)), np.zeros((0, N, N)), outputs, outputs, outputs, np.zeros((0, m, N)),
        outputs, outputs,
    )  # fmt: skip
