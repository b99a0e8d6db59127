"""Gains that are designed once: the steady-state filter, the quality filter, the placed poles.

Yaw and surge are channels of their own, each about the ship's usual motion: designed together they
would be coupled, and each would hear the other's noise. The papers design in continuous time; the
poles found there are placed exactly for the sensor's own interval.
"""

from dataclasses import dataclass

import numpy as np

from analysis.design.luenberger import discrete_correction
from analysis.design.observability import ComplexArray
from analysis.design.quality import quality_filter
from analysis.design.riccati import kalman_gain
from analysis.design.shaping import augment_with_shaping, wave_filter
from analysis.signals.signal_stats import SignalStats
from shiplog.compiled import compiled
from shiplog.ships.paper import Coefficients, yaw_stiffness
from shiplog.types import FloatArray
from shiplog.vessel.settings import FilterSettings

from .noise_model import NoiseModel

FORGETTING = 0.2  # of a wave's frequency: how fast its error decays, where poles are stated


@dataclass(frozen=True, eq=False)
class LinearAxis:
    """x' = A x + G white noise of intensity Q, measured by C with white noise of intensity R."""

    A: FloatArray  # (k, k)
    G: FloatArray  # (k, q)
    C: FloatArray  # (1, k)
    Q: FloatArray  # (q, q)
    R: float
    interval_secs: float  # from sample to sample


def channels(
    c: Coefficients, noise: NoiseModel, stats: SignalStats
) -> tuple[LinearAxis, LinearAxis]:
    """Yaw, of w, w' and the wave's two states if there is one, and surge, of v.

    Linear about the usual turning and the usual speed. Sampled noise of variance σ² is of the
    intensity σ² times the interval; the wave stands in the measurement.
    """
    R = noise.measurement_std**2 * stats.interval_secs
    q = noise.process_ratio * R
    A = np.array([[0.0, 1.0], [yaw_stiffness(c, stats.turning), c.a]])
    G, C, Q = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]), q[:1, None]
    if noise.wave is not None:
        shaping = wave_filter(noise.wave.std**2, noise.wave.frequency, noise.wave.damping)
        whole = augment_with_shaping(A, G, C, np.ones(1), shaping, at="output", noise=G)
        A, G, C = whole.A, whole.G, whole.C
        Q = np.diag([q[0], 1.0])
    surge = np.array([[2 * c.g * stats.ahead]])
    one = np.ones((1, 1))
    yaw_secs, surge_secs = stats.interval_secs
    return (
        LinearAxis(A, G, C, Q, float(R[0]), float(yaw_secs)),
        LinearAxis(surge, one, one, q[1:, None], float(R[1]), float(surge_secs)),
    )


def discrete_gain(settings: FilterSettings, channel: LinearAxis) -> tuple[FloatArray, ComplexArray]:
    """The gain (k,) by which a sample corrects the state, and the poles (k,) from sample to sample.

    Raises `UsageError` where there is none.
    """
    poles = _poles(settings, channel)
    gain = discrete_correction(channel.A, channel.C, poles, channel.interval_secs)
    return gain, np.exp(poles * channel.interval_secs)


def _poles(settings: FilterSettings, channel: LinearAxis) -> ComplexArray:
    """The continuous ones, 1/s."""
    A, G, C, Q = channel.A, channel.G, channel.C, channel.Q
    R = np.array([[channel.R]])
    if settings.chosen == "quality":
        damped = np.zeros(A.shape)
        if len(A) > 1:
            damped[1, 1] = settings.damping * channel.R
        return quality_filter(A, C, G @ Q @ G.T, R, G=damped, shift=settings.shift).poles
    poles = kalman_gain(A, G, C, Q, R).poles
    decay = settings.yaw_decay if len(A) > 1 else settings.surge_decay
    if settings.chosen != "per-tick" or decay is None:
        return poles
    wave = np.linalg.eigvals(A[2:, 2:]).astype(complex)
    wave.real -= FORGETTING * np.abs(wave)
    return np.concatenate((np.full(len(A[:2]), -decay + 0j), wave))


@compiled
def ticked_gain(
    J: FloatArray,
    wave: FloatArray,
    c: FloatArray,
    poles: ComplexArray,
    interval: float,
    output: int,
) -> FloatArray:
    """The gain (s,) of one output that places its channel's poles for the motion of this instant.

    J (3, 3) of w, w' and v; `wave` (k, k) from sample to sample; c and poles (s,). Ackermann's
    formula: a channel has one output, so that its poles leave no choice.
    """
    size = len(c)
    K = np.zeros(size)
    if output == 1:
        K[2] = 1.0 - poles[2].real / np.exp(J[2, 2] * interval)
        return K
    count = size - 1
    F, seen, wanted = np.zeros((count, count)), np.empty(count), np.empty(count, np.complex128)
    F[:2, :2], F[2:, 2:] = _exponential(J[:2, :2] * interval), wave
    for i in range(count):
        of_all = i if i < 2 else i + 1
        seen[i], wanted[i] = c[of_all], poles[of_all]
    O, polynomial = np.empty((count, count)), np.eye(count).astype(np.complex128)
    row = seen
    for i in range(count):
        O[i] = row
        row = row @ F
        polynomial = polynomial @ (F - wanted[i] * np.eye(count))
    last = np.zeros(count)
    last[-1] = 1.0
    gain = np.linalg.solve(F, np.ascontiguousarray(polynomial.real) @ np.linalg.solve(O, last))
    for i in range(count):
        K[i if i < 2 else i + 1] = gain[i]
    return K


@compiled
def _exponential(A: FloatArray) -> FloatArray:
    """exp A: the series of A halved until it is small, and squared as often."""
    halvings = 0
    while np.abs(A).sum() > 2.0**halvings:
        halvings += 1
    small = A / 2.0**halvings
    total, term = np.eye(len(A)), np.eye(len(A))
    for k in range(1, 20):
        term = term @ small / k
        total += term
    for _ in range(halvings):
        total = total @ total
    return total
