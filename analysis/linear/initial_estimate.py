"""Initial state of an estimator and its covariance, from the size of the measured signals."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from analysis.design.observability import ComplexArray
from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel
from .joined_system import state_names
from .system import LinearSystem

POINTS = 200  # of the stretch over which the outputs must show the states
SAMPLES_PER_STATE = 10  # its length
MIN_INFORMATION = 1e-15  # relative: a state of less does not show in the outputs


@dataclass(frozen=True, eq=False)
class StartSignals:
    """Measured values from which an estimate starts, (m,) each: the first, and the rms values."""

    first: FloatArray
    rms: FloatArray


def initial_estimate(
    system: LinearSystem,
    model: EstimatorModel,
    signals: StartSignals,
    u: FloatArray,
    poles: ComplexArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the state before the first sample, (N,), and its covariance, (N, N).

    Shaping filters start at zero with their stationary covariance, states whose start the system
    states with that, zero by default. The standard deviation of another state is that with which
    outputs, uncertain by their rms values, determine it in a short time: a few samples, or the time
    constant of the estimator's fastest pole. It is large against all that the state can be. These
    states are the smallest ones, in their standard deviations, that give the first measured values.

    Parameters
    ----------
    system, model
        The system, and the model joined from it.
    signals
        First values and rms values of the outputs.
    u
        (inputs,): the inputs at the first instant.
    poles
        1/s: of the estimator, where it has constant ones.

    Raises
    ------
    UsageError
        The outputs do not show a state, whose initial value must be stated.
    """
    N, names = len(model.A), state_names(system)
    stated = {_first_state(name, names): std for name, std in system.initial_std.items()}
    P = np.diag(_shown_variances(model, signals, names, frozenset(stated), poles))
    shaped = np.ix_(model.shaped, model.shaped)
    P[shaped] = solve_continuous_lyapunov(model.A[shaped], -model.W[shaped])
    for state, std in stated.items():
        P[state, :] = P[:, state] = 0.0
        P[state, state] = std**2
    values = {_first_state(name, names): value for name, value in system.initial.items()}
    x = np.array([values.get(state, 0.0) for state in range(N)])
    is_open = np.array([s not in {*stated, *values, *model.shaped} for s in range(N)])
    spread = np.where(is_open, np.diag(P), 0.0)
    known = np.isfinite(signals.first)
    C = model.C[known]
    y = (signals.first - model.D @ u)[known] - C @ x
    weighted = spread[:, None] * C.T
    return x + weighted @ np.linalg.lstsq(C @ weighted, y, rcond=None)[0], P


def _shown_variances(
    model: EstimatorModel,
    signals: StartSignals,
    names: tuple[str, ...],
    stated: frozenset[int],
    poles: ComplexArray | None,
) -> FloatArray:
    """Return the variances (N,) with which the outputs determine the states in a short time."""
    N = len(model.A)
    sizes = np.maximum(np.nan_to_num(signals.rms), np.sqrt(model.r))
    length = SAMPLES_PER_STATE * N * float(model.intervals.max())
    if poles is not None and np.abs(poles).max() > 0:
        length = max(length, 1 / float(np.abs(poles).max()))
    F, rows = expm(model.A * length / POINTS), model.C / sizes[:, None]
    information = np.zeros((N, N))
    for _ in range(POINTS):
        information += rows.T @ rows / POINTS
        rows = rows @ F
    shaped = np.ix_(model.shaped, model.shaped)
    if model.shaped:
        information[shaped] += np.linalg.inv(
            solve_continuous_lyapunov(model.A[shaped], -model.W[shaped])
        )
    free = [i for i in range(N) if i not in stated]
    information = information[np.ix_(free, free)]
    scale = np.sqrt(np.diag(information))
    hidden = [names[i] for i, size in zip(free, scale, strict=True) if size == 0]
    if not hidden:
        values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
        if free and values[0] < MIN_INFORMATION:
            hidden = [names[free[int(np.argmax(np.abs(vectors[:, 0])))]]]
    if hidden:
        raise UsageError(
            f"the outputs hardly show the initial value of {hidden[0]!r}; state initial.std of it"
        )
    variances = np.zeros(N)
    if free:
        variances[free] = ((vectors**2 / values).sum(axis=1)) / scale**2
    return variances


def _first_state(name: str, names: tuple[str, ...]) -> int:
    """Return the index of a state, or of the first state of a disturbance of that name."""
    return names.index(name if name in names else f"{name}[0]")
