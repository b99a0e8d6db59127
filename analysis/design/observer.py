"""Observers of chosen poles: Butterworth's, continuous and discrete."""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.linalg import expm, solve_discrete_lyapunov

from shiplog.types import FloatArray

from .placement import place_multilevel


def butterworth_poles(order: int, frequency: float) -> FloatArray:
    """The roots of a Butterworth polynomial, rad/s, (order,) complex; conjugates to the bit."""
    half = [
        frequency * np.exp(1j * pi * (2 * k + order + 1) / (2 * order)) for k in range(order // 2)
    ]
    real = [-frequency + 0j] * (order % 2)
    return np.array([*half, *np.conj(half), *real])


@dataclass(frozen=True, eq=False)
class Observer:
    """A discrete observer x+ = F x, corrected by M (y - C x+), and the error noise leaves in it."""

    correction: FloatArray  # M, (n,)
    noise_gain: FloatArray  # (n,) standard deviation of each state per unit of y's


def discrete_observer(A: FloatArray, C: FloatArray, poles: FloatArray, dt: float) -> Observer:
    """The observer of continuous poles for measurements every `dt` seconds, one output.

    Each pole s becomes exp(s dt); the correction is F^-1 L of the predictor's gain L.
    """
    F = expm(A * dt)
    L = place_multilevel(F, C, np.exp(poles * dt))
    M = np.linalg.solve(F, L)
    kept = (np.eye(len(A)) - M @ C) @ F
    P = solve_discrete_lyapunov(kept, M @ M.T)
    return Observer(M[:, 0], np.sqrt(np.diag(P)))
