"""The regulator u = L x̂ beside the recorded inputs, and the costs of both: Antonov, (2) to (11)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from analysis.design.quality import Regulator, cycle_regulator
from analysis.signals.moments import Moments
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel
from .methods import EstimatorDesign
from .system import LinearSystem, RegulatorWeights


@dataclass(frozen=True)
class MeanCost:
    """Mean of x'P x and of u'R u over time.

    Attributes
    ----------
    state, input
        The two parts; NaN where they are not known.
    """

    state: float
    input: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.state + self.input


@dataclass(frozen=True, eq=False)
class FeedbackDesign:
    """The regulator of a system.

    Attributes
    ----------
    weights
        Its weights.
    regulator
        Gain L (inputs, n) and poles of A + B L.
    predicted
        Mean cost of the loop closed by the estimate, from the process and measurement noise; NaN
        where it is not known: a disturbance does not decay, the plant varies, or the
        estimator is of another form than x̂' = A x̂ + B u + K (y - C x̂): a cascade, a reduced order.
    """

    weights: RegulatorWeights
    regulator: Regulator
    predicted: MeanCost


@dataclass(frozen=True)
class CostSummary:
    """Costs over a log.

    Attributes
    ----------
    recorded
        Of the estimated states and the recorded inputs.
    feedback
        Of the same states and the inputs that the regulator commands for them.
    predicted
        Of the loop that the regulator closes, as in `FeedbackDesign`.
    recorded_rms, feedback_rms
        Root mean square of each input, as recorded and as commanded.
    """

    recorded: MeanCost
    feedback: MeanCost
    predicted: MeanCost
    recorded_rms: tuple[float, ...]
    feedback_rms: tuple[float, ...]


def design_feedback(
    system: LinearSystem, model: EstimatorModel, design: EstimatorDesign
) -> FeedbackDesign | None:
    """Design the regulator of a system; None where it has no weights for one.

    Raises
    ------
    UsageError
        There is no stabilising regulator; the message names the mode.
    """
    weights, n = system.regulator, model.size
    if weights is None:
        return None
    regulator = cycle_regulator(
        model.A[:n, :n],
        model.B[:n],
        weights.P,
        weights.R,
        weights.cycles,
        G=weights.G,
        shift=weights.shift,
    )[-1]
    is_stationary = not system.disturbances and system.linearise is None
    predicted = MeanCost(np.nan, np.nan)
    if is_stationary and design.gain is not None and design.is_luenberger:
        predicted = closed_loop_cost(model, design.gain, regulator.gain, weights)
    return FeedbackDesign(weights, regulator, predicted)


def closed_loop_cost(
    model: EstimatorModel, K: FloatArray, L: FloatArray, weights: RegulatorWeights
) -> MeanCost:
    """Compute the stationary mean cost of x' = A x + B L x̂ + w with the estimator of gain K.

    State and error e = x - x̂ form one linear system driven by w and by the measurement noise.

    Parameters
    ----------
    model
        The joined system, N states.
    K
        (N, m).
    L
        (inputs, n).
    weights
        P and R.
    """
    N, n = len(model.A), model.size
    whole = np.hstack((L, np.zeros((len(L), N - n))))
    drive = model.B @ whole
    F = np.block([[model.A + drive, -drive], [np.zeros((N, N)), model.A - K @ model.C]])
    W = np.kron(np.ones((2, 2)), model.W)
    W[N:, N:] += K @ model.R @ K.T
    S = solve_continuous_lyapunov(F, -W)
    row = np.hstack((whole, -whole))
    return MeanCost(
        float(np.trace(weights.P @ S[:n, :n])), float(np.trace(weights.R @ row @ S @ row.T))
    )


class CostMeter:
    """Computes the commanded inputs and the costs of estimates that come in chunks."""

    def __init__(self, feedback: FeedbackDesign) -> None:
        self._feedback = feedback
        inputs = len(feedback.regulator.gain)
        self._state, self._recorded, self._commanded = Moments(), Moments(), Moments()
        self._rms = [(Moments(), Moments()) for _ in range(inputs)]

    def add(self, states: FloatArray, inputs: FloatArray) -> FloatArray:
        """Return the commanded inputs (k, inputs) of states (k, n) beside recorded inputs."""
        commanded = _combined(states, self._feedback.regulator.gain)
        weights = self._feedback.weights
        self._state.add(_quadratic(states, weights.P))
        self._recorded.add(_quadratic(inputs, weights.R))
        self._commanded.add(_quadratic(commanded, weights.R))
        for j, (recorded, given) in enumerate(self._rms):
            recorded.add(inputs[:, j])
            given.add(commanded[:, j])
        return commanded

    def result(self) -> CostSummary:
        """Return the costs of all chunks."""
        state = self._state.mean
        recorded, commanded = zip(*self._rms, strict=True)
        return CostSummary(
            MeanCost(state, self._recorded.mean),
            MeanCost(state, self._commanded.mean),
            self._feedback.predicted,
            tuple(float(np.sqrt(each.mean_square)) for each in recorded),
            tuple(float(np.sqrt(each.mean_square)) for each in commanded),
        )


def _combined(values: FloatArray, gain: FloatArray) -> FloatArray:
    """Return gain · value of each row: term by term, so that no chunk's edge shows in a bit."""
    columns = [sum(values[:, i] * g for i, g in enumerate(row)) for row in gain]
    return np.column_stack(columns)


def _quadratic(values: FloatArray, weight: FloatArray) -> FloatArray:
    """Return value' weight value of each row."""
    weighted = _combined(values, weight)
    total: FloatArray = np.zeros(len(values))
    for i in range(values.shape[1]):
        total = total + values[:, i] * weighted[:, i]
    return total
