"""Luenberger observers with poles in a Butterworth or binomial pattern, discretised."""

import warnings
from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.linalg import LinAlgError, LinAlgWarning, expm, solve_discrete_lyapunov

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .observability import ComplexArray
from .placement import place_multilevel


def butterworth_poles(order: int, frequency: float) -> ComplexArray:
    """Compute the poles of a Butterworth filter.

    Parameters
    ----------
    order
        Number of poles n.
    frequency
        Radius of the half circle on which the poles lie, rad/s.

    Returns
    -------
    ComplexArray
        (n,), rad/s; pairs are exact conjugates.

    Examples
    --------
    >>> butterworth_poles(2, 1.0).round(4).tolist()
    [(-0.7071+0.7071j), (-0.7071-0.7071j)]
    """
    half = [
        frequency * np.exp(1j * pi * (2 * k + order + 1) / (2 * order)) for k in range(order // 2)
    ]
    real = [-frequency + 0j] * (order % 2)
    return np.array([*half, *np.conj(half), *real])


def binomial_poles(order: int, frequency: float) -> ComplexArray:
    """Compute the roots of (s + frequency)^order: (order,), rad/s."""
    return np.full(order, -frequency + 0j)


POLE_PATTERNS = {"butterworth": butterworth_poles, "binomial": binomial_poles}


@dataclass(frozen=True, eq=False)
class DiscreteObserver:
    """The observer x⁺ = F x̂, x̂ = x⁺ + M (y - C x⁺), of a sampled measurement y.

    Attributes
    ----------
    correction
        M, (n,).
    noise_gain
        (n,): standard deviation of each estimated state per unit standard deviation of white noise
        in y.
    """

    correction: FloatArray
    noise_gain: FloatArray


def discrete_observer(
    A: FloatArray, C: FloatArray, poles: ComplexArray, dt: float
) -> DiscreteObserver:
    """Design the discrete observer of one output with the poles of a continuous one.

    Parameters
    ----------
    A
        (n, n), 1/s: x' = A x.
    C
        (1, n): y = C x.
    poles
        (n,), 1/s: continuous poles; each pole s becomes exp(s dt).
    dt
        Sampling interval of y, s.

    Raises
    ------
    UsageError
        The poles are so slow for the sampling interval that rounding hides them, or
        `place_multilevel` rejects the arguments.

    Examples
    --------
    A double integrator, its position measured every second:

    >>> A, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[1.0, 0.0]])
    >>> discrete_observer(A, C, butterworth_poles(2, 0.2), dt=1.0).correction.round(3).tolist()
    [0.246, 0.035]
    """
    F, M = expm(A * dt), discrete_correction(A, C, poles, dt)[:, None]
    closed = (np.eye(len(A)) - M @ C) @ F
    return DiscreteObserver(M[:, 0], _noise_gain(closed, M))


def discrete_correction(A: FloatArray, C: FloatArray, poles: ComplexArray, dt: float) -> FloatArray:
    """Compute the correction M of a discrete observer of one output.

    Each continuous pole s becomes exp(s dt); M = F⁻¹ L, where F = exp(A dt) and L is the gain of
    the one-step predictor. Arguments and errors are those of `discrete_observer`.

    Returns
    -------
    FloatArray
        M, (n,).
    """
    F = expm(A * dt)
    correction: FloatArray = np.linalg.solve(F, place_multilevel(F, C, np.exp(poles * dt)))[:, 0]
    return correction


def _noise_gain(F: FloatArray, M: FloatArray) -> FloatArray:
    """Compute the standard deviations (n,) of x⁺ = F x + M e, e being white and of variance one."""
    # without scaling, units that differ by orders of magnitude make the equation look singular
    units = np.where(M == 0, 1.0, np.abs(M))
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            P = solve_discrete_lyapunov(F * units.T / units, (M / units) @ (M / units).T)
        except (LinAlgError, LinAlgWarning):
            raise UsageError(
                f"the {len(M)} poles are too slow for the sampling interval and lost in"
                " rounding; choose faster poles"
            ) from None
    gain: FloatArray = units[:, 0] * np.sqrt(np.diag(P))
    return gain
