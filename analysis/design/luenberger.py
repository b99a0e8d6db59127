"""Observers of chosen poles, continuous and discrete."""

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
    """The roots of a Butterworth polynomial, rad/s, (order,) complex; conjugates to the bit."""
    half = [
        frequency * np.exp(1j * pi * (2 * k + order + 1) / (2 * order)) for k in range(order // 2)
    ]
    real = [-frequency + 0j] * (order % 2)
    return np.array([*half, *np.conj(half), *real])


def binomial_poles(order: int, frequency: float) -> ComplexArray:
    """The roots of (s + frequency)^order, rad/s, (order,) complex."""
    return np.full(order, -frequency + 0j)


POLE_PATTERNS = {"butterworth": butterworth_poles, "binomial": binomial_poles}


@dataclass(frozen=True, eq=False)
class DiscreteObserver:
    """A discrete observer x+ = F x, corrected by M (y - C x+), and the error noise leaves in it."""

    correction: FloatArray  # M, (n,)
    noise_gain: FloatArray  # (n,) standard deviation of each state per unit of y's


def discrete_observer(
    A: FloatArray, C: FloatArray, poles: ComplexArray, dt: float
) -> DiscreteObserver:
    """The observer of continuous poles for measurements every `dt` seconds, one output.

    Raises `UsageError` for poles that rounding cannot tell from standing still, and what
    `place_multilevel` raises.
    """
    F, M = expm(A * dt), discrete_correction(A, C, poles, dt)[:, None]
    kept = (np.eye(len(A)) - M @ C) @ F
    return DiscreteObserver(M[:, 0], _noise_gain(kept, M))


def discrete_correction(A: FloatArray, C: FloatArray, poles: ComplexArray, dt: float) -> FloatArray:
    """The correction M (n,) of continuous poles for measurements every `dt` seconds, one output.

    Each pole s becomes exp(s dt); M is F^-1 L of the predictor's gain L. Raises what
    `place_multilevel` raises.
    """
    F = expm(A * dt)
    found: FloatArray = np.linalg.solve(F, place_multilevel(F, C, np.exp(poles * dt)))[:, 0]
    return found


def _noise_gain(kept: FloatArray, M: FloatArray) -> FloatArray:
    """The standard deviations of x+ = kept x + M e, e being white and one, (n,)."""
    # the states' own units differ by so much that the equation would seem singular
    units = np.where(M == 0, 1.0, np.abs(M))
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            P = solve_discrete_lyapunov(kept * units.T / units, (M / units) @ (M / units).T)
        except (LinAlgError, LinAlgWarning):
            raise UsageError(
                f"the {len(M)} poles are so slow for the samples that rounding hides them;"
                " take faster ones"
            ) from None
    gain: FloatArray = units[:, 0] * np.sqrt(np.diag(P))
    return gain
