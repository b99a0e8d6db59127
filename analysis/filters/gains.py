"""Constant gains: of the steady-state filter, of the quality filter and of placed poles.

Yaw and surge are designed apart, each linearised about the ship's typical motion. Designed together
they would be coupled, and the noise of each sensor would enter the estimates of the other. The
papers design in continuous time; the gain places the poles found there exactly for the sampling
interval of the sensor.
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

WAVE_DECAY = 0.2  # decay rate of the wave's error over the wave's frequency, for stated poles


@dataclass(frozen=True, eq=False)
class LinearAxis:
    """A linear system of one output, x' = A x + G w, y = C x + v, for yaw or for surge.

    Attributes
    ----------
    A
        (k, k), 1/s.
    G
        (k, q): where the process noise enters.
    C
        (1, k).
    Q
        (q, q): intensity of the white noise w.
    R
        Intensity of the white noise v.
    interval_secs
        The sampling interval of the sensor.
    """

    A: FloatArray
    G: FloatArray
    C: FloatArray
    Q: FloatArray
    R: float
    interval_secs: float


def linear_axes(
    c: Coefficients, noise: NoiseModel, stats: SignalStats
) -> tuple[LinearAxis, LinearAxis]:
    """Linearise yaw and surge about the typical yaw rate and speed.

    The states of yaw are w, w' and, where a wave is modelled, the two states of its shaping filter,
    which adds to the measurement; the state of surge is v. Samples of noise of variance σ² count as
    white noise of intensity σ² times the sampling interval.
    """
    R = noise.measurement_std**2 * stats.interval_secs
    q = noise.process_ratio * R
    A = np.array([[0.0, 1.0], [yaw_stiffness(c, stats.yaw_rate_rms), c.a]])
    G, C, Q = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]), q[:1, None]
    if noise.wave is not None:
        shaping = wave_filter(noise.wave.std**2, noise.wave.frequency, noise.wave.damping)
        both = augment_with_shaping(A, G, C, np.ones(1), shaping, at="output", noise=G)
        A, G, C = both.A, both.G, both.C
        Q = np.diag([q[0], 1.0])
    surge = np.array([[2 * c.g * stats.median_speed]])
    one = np.ones((1, 1))
    yaw_secs, surge_secs = stats.interval_secs
    return (
        LinearAxis(A, G, C, Q, float(R[0]), float(yaw_secs)),
        LinearAxis(surge, one, one, q[1:, None], float(R[1]), float(surge_secs)),
    )


def discrete_gain(axis: LinearAxis, poles: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Place the continuous poles (k,), 1/s, exactly for the sampling interval.

    Returns
    -------
    gain
        (k,): the gain by which a sample corrects the state.
    poles
        (k,): the poles from sample to sample.

    Raises
    ------
    UsageError
        No gain places these poles.
    """
    gain = discrete_correction(axis.A, axis.C, poles, axis.interval_secs)
    return gain, np.exp(poles * axis.interval_secs)


def kalman_poles(axis: LinearAxis, settings: FilterSettings) -> ComplexArray:  # noqa: ARG001
    """Return the poles (k,), 1/s, of the steady-state Kalman filter.

    Source: Sakharov, Shergina, Chertkov, (11) and (13).
    """
    return kalman_gain(axis.A, axis.G, axis.C, axis.Q, np.array([[axis.R]])).poles


def quality_poles(axis: LinearAxis, settings: FilterSettings) -> ComplexArray:
    """Return the poles (k,), 1/s, of the quality filter of `settings.shift` and `.damping`.

    `settings.damping` is the weight of the yaw acceleration over R. See `design.quality`.
    """
    G = np.zeros(axis.A.shape)
    if len(axis.A) > 1:
        G[1, 1] = settings.damping * axis.R
    W, R = axis.G @ axis.Q @ axis.G.T, np.array([[axis.R]])
    return quality_filter(axis.A, axis.C, W, R, G=G, shift=settings.shift).poles


def stated_poles(axis: LinearAxis, settings: FilterSettings) -> ComplexArray:
    """Return the poles (k,), 1/s, that the settings state, or else those of the Kalman filter.

    `settings.yaw_decay` states a double pole of w and w', `settings.surge_decay` that of v. The
    poles of a wave are its own, with a decay rate larger by `WAVE_DECAY` of its frequency.
    """
    decay = settings.yaw_decay if len(axis.A) > 1 else settings.surge_decay
    if decay is None:
        return kalman_poles(axis, settings)
    wave = np.linalg.eigvals(axis.A[2:, 2:]).astype(complex)
    wave.real -= WAVE_DECAY * np.abs(wave)
    return np.concatenate((np.full(len(axis.A[:2]), -decay + 0j), wave))


@compiled
def relinearised_gain(
    J: FloatArray,
    wave: FloatArray,
    c: FloatArray,
    poles: ComplexArray,
    interval: float,
    output: int,
) -> FloatArray:
    """Compute the gain (s,) of one output that places the poles for the motion of this instant.

    Ackermann's formula: each of yaw and surge has one output, so that the poles determine the gain.
    Their coupling is neglected: hard over, the poles of both together deviate by up to a quarter.
    Gains that place them exactly have the same noise or more (`docs/papers_per_tick_observer.md`).

    Parameters
    ----------
    J
        (3, 3): derivatives of w', w'' and v' by w, w' and v.
    wave
        (k, k): transition matrix of the wave from sample to sample.
    c
        (s,): row of the output matrix.
    poles
        (s,): poles from sample to sample, one for each state.
    interval
        Sampling interval, s.
    output
        0 for yaw rate, 1 for speed.
    """
    size = len(c)
    K = np.zeros(size)
    if output == 1:
        K[2] = 1.0 - poles[2].real / np.exp(J[2, 2] * interval)
        return K
    count = size - 1
    F, row, placed = np.zeros((count, count)), np.empty(count), np.empty(count, np.complex128)
    F[:2, :2], F[2:, 2:] = _exponential(J[:2, :2] * interval), wave
    for i in range(count):
        state = i if i < 2 else i + 1  # v, the third state, is no state of yaw
        row[i], placed[i] = c[state], poles[state]
    O, polynomial = np.empty((count, count)), np.eye(count).astype(np.complex128)
    for i in range(count):
        O[i] = row
        row = row @ F
        polynomial = polynomial @ (F - placed[i] * np.eye(count))
    last = np.zeros(count)
    last[-1] = 1.0
    gain = np.linalg.solve(F, np.ascontiguousarray(polynomial.real) @ np.linalg.solve(O, last))
    for i in range(count):
        K[i if i < 2 else i + 1] = gain[i]
    return K


@compiled
def _exponential(A: FloatArray) -> FloatArray:
    """Return exp(A): the power series of A / 2^k, squared k times."""
    halvings = 0
    while np.abs(A).sum() > 2.0**halvings:
        halvings += 1
    scaled = A / 2.0**halvings
    total, term = np.eye(len(A)), np.eye(len(A))
    for k in range(1, 20):
        term = term @ scaled / k
        total += term
    for _ in range(halvings):
        total = total @ total
    return total
