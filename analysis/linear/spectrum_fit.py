"""Fit of spectra of coloured noise to a log: the parameters of the most likely innovations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import log, pi

import numpy as np
from scipy.optimize import minimize

from shiplog.errors import LogError, ShiplogError
from shiplog.types import FloatArray

from .estimator_model import EstimatorModel
from .initial_estimate import StartSignals, initial_estimate
from .joined_system import OutputSampling, estimator_model, with_spectra
from .linear_loop import run_stretch, stretch_model
from .methods import EstimatorDesign
from .system import LinearSystem

MAX_FITTED = 50_000  # instants: enough to determine a spectrum, and little of a long log
SEARCH = log(1e4)  # the search ends at this factor from the given values
MAX_LOG_STD = 0.7  # of a parameter's logarithm: beyond, it is uncertain by a factor of four
CURVATURE_STEP = 0.05  # of a logarithm
UNLIKELY = 1e300  # value of a likelihood that cannot be computed


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of a spectrum that was fitted to the log.

    Attributes
    ----------
    noise, name
        The coloured noise, and the name of its parameter.
    value, std
        The estimate and its standard error.
    """

    noise: str
    name: str
    value: float
    std: float


@dataclass(frozen=True, eq=False)
class FitSignals:
    """The signals to which spectra are fitted: y (k, m), NaN where not measured, and u (k, r)."""

    y: FloatArray
    u: FloatArray
    start: StartSignals


def fit_spectra(
    system: LinearSystem, sampling: OutputSampling, signals: FitSignals, name: str
) -> tuple[LinearSystem, tuple[FittedParameter, ...]]:
    """Fit the spectra of a system whose parameters are to be fitted.

    The likelihood of the innovations of the Kalman filter is maximised over the logarithms of the
    parameters, from the given values; standard errors follow from its curvature.

    Parameters
    ----------
    system
        The system, with the initial values of the parameters.
    sampling
        How the outputs are measured.
    signals
        The signals of the log.
    name
        Name of the log, for messages.

    Returns
    -------
    system
        The system with the fitted spectra.
    fitted
        The parameters.

    Raises
    ------
    LogError
        The log does not determine a parameter.
    """
    keys = [(noise.name, key) for noise in system.shaped for key in noise.fit]
    given = [noise.parameters[key] for noise in system.shaped for key in noise.fit]
    if not keys:
        return system, ()
    start = np.log(given)

    def cost(logs: FloatArray) -> float:
        return _cost(with_spectra(system, _by_noise(keys, logs)), sampling, signals)

    bounds = [(x - SEARCH, x + SEARCH) for x in start]
    found = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-4})
    logs = np.asarray(found.x)
    stds = _standard_errors(cost, logs)
    at_bound = np.abs(logs - start) > SEARCH - CURVATURE_STEP
    unknown = [
        f"{key!r} of {noise!r}"
        for (noise, key), std, ended in zip(keys, stds, at_bound, strict=True)
        if ended or not std < MAX_LOG_STD
    ]
    if unknown:
        raise LogError(
            f"the log does not determine {' and '.join(unknown)}; state them instead of fitting"
            f" them, or choose a longer log: {name}"
        )
    fitted = tuple(
        FittedParameter(noise, key, float(np.exp(x)), float(np.exp(x) * std))
        for (noise, key), x, std in zip(keys, logs, stds, strict=True)
    )
    return with_spectra(system, _by_noise(keys, logs)), fitted


def _by_noise(
    keys: Sequence[tuple[str, str]], logs: FloatArray
) -> Mapping[str, Mapping[str, float]]:
    values: dict[str, dict[str, float]] = {}
    for (noise, key), value in zip(keys, np.exp(logs).tolist(), strict=True):
        values.setdefault(noise, {})[key] = value
    return values


def _cost(system: LinearSystem, sampling: OutputSampling, signals: FitSignals) -> float:
    """Return minus the log likelihood of a system; a large number where it has none."""
    with np.errstate(all="ignore"):  # far from the solution matrices may overflow
        try:
            model = estimator_model(system, sampling)
            x, P = initial_estimate(system, model, signals.start, signals.u[0])
            return _minus_log_likelihood(model, x, P, signals)
        except (ShiplogError, ValueError):
            return UNLIKELY


def _minus_log_likelihood(
    model: EstimatorModel, x: FloatArray, P: FloatArray, signals: FitSignals
) -> float:
    loop = stretch_model(model, EstimatorDesign(None, None))
    result = run_stretch(loop, x, P, signals.u[0].copy(), signals.y, signals.u, True)
    e, S = result.sequential, result.sequential_variances
    value = 0.5 * float(np.sum(np.log(S) + e**2 / S))
    value += 0.5 * log(2 * pi) * int(np.isfinite(signals.y).sum())
    return value if np.isfinite(value) else UNLIKELY


def _standard_errors(cost: Callable[[FloatArray], float], logs: FloatArray) -> FloatArray:
    """Return the standard errors (p,) of the logarithms; NaN where they are not determined."""
    p, h = len(logs), CURVATURE_STEP
    steps = h * np.eye(p)
    H = np.empty((p, p))
    middle = cost(logs)
    for i in range(p):
        H[i, i] = (cost(logs + steps[i]) - 2 * middle + cost(logs - steps[i])) / h**2
        for j in range(i):
            corners = ((1, 1), (-1, -1), (1, -1), (-1, 1))
            terms = [a * b * cost(logs + a * steps[i] + b * steps[j]) for a, b in corners]
            H[i, j] = H[j, i] = sum(terms) / (4 * h**2)
    values, vectors = np.linalg.eigh(H)
    with np.errstate(invalid="ignore", divide="ignore"):
        inverse = np.where(values > 0, 1 / values, np.inf)
    involved = vectors**2 > 1e-6
    variances = np.sum(np.where(involved, vectors**2 * inverse, 0.0), axis=1)
    return np.asarray(np.sqrt(variances))
