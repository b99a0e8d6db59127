"""Methods of estimation: each designs the gain of the estimator of a given model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.design.augmentation import Plant
from analysis.design.cascade import cascade
from analysis.design.discrete_correction import matched_correction, optimal_correction
from analysis.design.exosystem import disturbance_observer
from analysis.design.noise_placement import place_for_noise
from analysis.design.observability import ComplexArray
from analysis.design.placement import place_multilevel
from analysis.design.quality import (
    Shift,
    cycle_regulator,
    decay_projectors,
    quality_filter,
)
from analysis.design.riccati import kalman_gain, sorted_eigenvalues
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel

NO_STEADY_STATE = (
    "No poles and no gain are listed, because the gain does not become constant, as with a constant"
    " disturbance without an intensity: {}."
)


@dataclass(frozen=True, eq=False)
class EstimatorDesign:
    """The gain of an estimator, continuous and as it is applied to samples.

    Attributes
    ----------
    gain
        L (N, m) of x̂' = A x̂ + B u + L (y - C x̂); None where there is no constant one.
    correction
        M (N, m) of x̂ = x⁻ + M (y - C x⁻) at each sample; None for the optimal one of each instant.
    poles
        (N,), 1/s: eigenvalues of A - L C, of a reduced order those of the states that are not
        measured; None without L.
    stages
        Number of stages of a cascade; 1 otherwise.
    stage_correction
        (N, N): correction of every stage after the first by the estimate of the one before.
    remarks
        What the design found, each in a sentence.
    """

    gain: FloatArray | None
    correction: FloatArray | None
    poles: ComplexArray | None = None
    stages: int = 1
    stage_correction: FloatArray | None = None
    remarks: tuple[str, ...] = ()

    @property
    def is_luenberger(self) -> bool:
        """Whether x̂ follows from the gain alone: there is one stage, and it is of full order."""
        if self.gain is None or self.poles is None:
            return False
        return self.stages == 1 and len(self.poles) == len(self.gain)


class Method(Protocol):
    """A method of estimation.

    Attributes
    ----------
    per_tick
        Whether the gain is designed anew at each tick of a plant that varies.
    """

    per_tick: ClassVar[bool]

    @property
    def name(self) -> str:
        """Its name in a system file."""
        ...

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Design the gain; raise `UsageError` where there is none, naming the cause."""
        ...


@dataclass(frozen=True)
class KalmanMethod:
    """The Kalman filter: the optimal gain of each instant, or that of the steady state."""

    per_tick: ClassVar[bool] = True
    steady_state: bool = False

    @property
    def name(self) -> str:
        """Its name in a system file."""
        return "kalman"

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Design the filter; its steady-state gain is computed for information in any case."""
        try:
            steady = kalman_gain(model.A, np.eye(len(model.A)), model.C, model.W, model.R)
        except UsageError as error:
            if self.steady_state:
                raise
            return EstimatorDesign(None, None, remarks=(NO_STEADY_STATE.format(error),))
        step = model.step
        M = optimal_correction(step.F, model.C, step.Q, model.r) if self.steady_state else None
        return EstimatorDesign(steady.gain, M, steady.poles)


@dataclass(frozen=True, eq=False)
class QualityMethod:
    """Antonov's filter of prescribed decay and damping, designed once or in cycles, (8) and (11).

    Attributes
    ----------
    shift
        c, 1/s, or c1 and c2 for the modes faster and slower than `border`.
    G
        (n, n): intensity of the additional noise, by which the estimates are damped.
    border
        Decay rate that separates fast and slow modes, 1/s.
    cycles
        Number of designs one after the other, each for the loop closed by those before.
    """

    per_tick: ClassVar[bool] = False
    shift: Shift
    G: FloatArray
    border: float | None = None
    cycles: int = 1

    @property
    def name(self) -> str:
        """Its name in a system file."""
        return "quality" if self.cycles == 1 else "cycles"

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Design the filter, by duality where there are several cycles."""
        N, A, C = len(model.A), model.A, model.C
        G = np.zeros((N, N))
        G[: len(self.G), : len(self.G)] = self.G
        E = None if self.border is None else decay_projectors(A, self.border)
        if self.cycles == 1:
            L = quality_filter(A, C, model.W, model.R, G=G, shift=self.shift, projectors=E).gain
        else:
            dual = None if E is None else (E[0].T, E[1].T)
            cycles = cycle_regulator(
                A.T, C.T, model.W, model.R, self.cycles, G=G, shift=self.shift, projectors=dual
            )
            L = -cycles[-1].gain.T
        return EstimatorDesign(
            L, matched_correction(A, C, L, model.dt), sorted_eigenvalues(A - L @ C)
        )


@dataclass(frozen=True)
class CascadeMethod:
    """Antonov's cascade (12): a Kalman filter, and stages that take its estimate as measured.

    Attributes
    ----------
    stages
        Number of stages, the first included.
    correlation_secs
        Correlation time of the first filter's error that the others assume, s.
    noise_factor
        Factor on the measurement noise for which the first filter is designed.
    """

    per_tick: ClassVar[bool] = False
    stages: int
    correlation_secs: float
    noise_factor: float = 1.0

    @property
    def name(self) -> str:
        """Its name in a system file."""
        return "cascade"

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Design all stages; the remark states which one is the best."""
        N, A, C = len(model.A), model.A, model.C
        tuned = replace(model, r=model.r * self.noise_factor)
        first = KalmanMethod(steady_state=True).design(tuned)
        assert first.gain is not None  # noqa: S101 - of the steady state
        found = cascade(
            A, C, model.W, model.R, first.gain,
            stages=self.stages, correlation_secs=self.correlation_secs,
        )  # fmt: skip
        K = matched_correction(A, np.eye(N), found.gain, model.dt)
        remarks = (found.summary, "more than one stage after the first improves no filter")
        return replace(first, stages=self.stages, stage_correction=K, remarks=remarks)


@dataclass(frozen=True, eq=False)
class PlacedMethod:
    """An observer with placed poles, each channel by itself.

    What the poles leave free in a channel of several outputs is used to keep the noise low.

    Attributes
    ----------
    spectrum
        ``butterworth``, ``binomial``, or (N,) poles in 1/s, channel by channel.
    frequency
        rad/s: one, or one for each channel; None where the poles are given.
    """

    per_tick: ClassVar[bool] = False
    spectrum: ArrayLike
    frequency: float | Sequence[float] | None = None

    @property
    def name(self) -> str:
        """Its name in a system file."""
        return "luenberger" if isinstance(self.spectrum, str) else "multi-level"

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Place the poles of the continuous observer, and exp(s dt) of the sampled one."""
        N, m = len(model.A), len(model.C)
        names = tuple(map(str, range(N))), tuple(map(str, range(m)))
        observer = disturbance_observer(
            Plant(model.A, np.zeros((N, 1)), model.C, *names),
            (),
            self.spectrum,
            frequency=self.frequency,
        )
        L, M, first, remarks = np.zeros((N, m)), np.zeros((N, m)), 0, []
        for states in map(np.array, observer.channels):
            sensors = np.flatnonzero(model.C[:, states].any(axis=1))
            own, gain = np.ix_(states, states), np.ix_(states, sensors)
            poles = observer.poles[first : first + len(states)]
            C, R = model.C[np.ix_(sensors, states)], np.diag(np.diag(model.R)[sensors])
            placed = place_for_noise(model.A[own], C, poles, model.W[own], R)
            L[gain] = placed.gain
            M[gain] = _sampled_for_noise(model, own, C, poles, model.r[sensors])
            first += len(states)
            if np.isfinite(placed.kalman_ratio).all():
                remarks.append(f"{placed.summary} at these poles")
        return EstimatorDesign(L, M, observer.poles, remarks=tuple(remarks))


@dataclass(frozen=True, eq=False)
class TickMethod:
    """The per-tick observer: poles placed anew at each tick of a plant that varies.

    Attributes
    ----------
    poles
        1/s: (N,), or (N - m,) of a reduced order.
    reduced
        Whether the measured states are replaced by their measurements and only the others are
        estimated: ω̂ = z + N y. The estimate itself is propagated, so that z = ω̂ - N y is reset
        whenever N changes.
    """

    per_tick: ClassVar[bool] = True
    poles: ComplexArray
    reduced: bool = False

    @property
    def name(self) -> str:
        """Its name in a system file."""
        return "reduced-order" if self.reduced else "per-tick"

    def design(self, model: EstimatorModel) -> EstimatorDesign:
        """Place the poles for the plant of this tick."""
        if self.reduced:
            return self._reduced(model)
        L = place_multilevel(model.A, model.C, self.poles)
        M = _sampled(model.step.F, model.C, self.poles, model.dt)
        return EstimatorDesign(L, M, sorted_eigenvalues(model.A - L @ model.C))

    def _reduced(self, model: EstimatorModel) -> EstimatorDesign:
        C, F, A = model.C, model.step.F, model.A
        if not (np.isin(C, (0, 1)).all() and (C.sum(axis=1) == 1).all()) or C.sum(axis=0).max() > 1:
            raise UsageError(
                "reduced order needs outputs that are states of the plant, each once; use per-tick"
            )
        measured, others = np.argmax(C, axis=1), np.flatnonzero(~C.any(axis=0))
        if len(self.poles) != len(others):
            raise UsageError(
                f"method.poles are {len(self.poles)}; expected {len(others)}, one for each state"
                " that is not measured"
            )
        L, M = np.zeros(C.T.shape), np.zeros(C.T.shape)
        L[others] = place_multilevel(
            A[np.ix_(others, others)], A[np.ix_(measured, others)], self.poles
        )
        M[measured] = np.eye(len(C))
        M[others] = place_multilevel(
            F[np.ix_(others, others)], F[np.ix_(measured, others)], np.exp(self.poles * model.dt)
        )
        return EstimatorDesign(L, M, self.poles)


def _sampled_for_noise(
    model: EstimatorModel,
    own: tuple[NDArray[np.intp], ...],
    C: FloatArray,
    poles: ComplexArray,
    r: FloatArray,
) -> FloatArray:
    """Compute the correction (n, m) with the poles exp(s dt) that keeps the noise low.

    The bilinear transform X = (F_L - I) (F_L + I)⁻¹ of F_L = F - K C, K being the gain of the
    predictor, is X = A - L C of a continuous pair, in which L is placed; M = F⁻¹ K.
    """
    F, one = model.step.F[own], np.eye(len(C.T))
    inverse, z = np.linalg.inv(F + one), np.exp(poles * model.dt)
    A, S = (F - one) @ inverse, C @ inverse
    L = place_for_noise(A, S, (z - 1) / (z + 1), model.step.Q[own] / 2, np.diag(r) / 2).gain / 2
    M: FloatArray = np.linalg.solve(F, (F + one) @ np.linalg.solve(one + L @ C, L))
    return M


def _sampled(F: FloatArray, C: FloatArray, poles: ComplexArray, dt: float) -> FloatArray:
    """Compute the correction M (n, m) that gives the sampled observer the poles exp(s dt)."""
    M: FloatArray = np.linalg.solve(F, place_multilevel(F, C, np.exp(poles * dt)))
    return M
