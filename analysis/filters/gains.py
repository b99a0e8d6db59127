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

from .kernels import copy_matrix
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
    F, gain = np.zeros((count, count)), np.zeros(count)
    row, placed = np.empty(count), np.empty(count, np.complex128)
    _set_exponential(F, J, interval)
    copy_matrix(F[2:, 2:], wave)
    for i in range(count):
        state = i if i < 2 else i + 1  # v, the third state, is no state of yaw
        row[i], placed[i] = c[state], poles[state]
    gain[-1] = 1.0
    _solve(_observability(F, row), gain)
    _multiply_by_factors(F, placed, gain)
    _solve(F, gain)
    for i in range(count):
        K[i if i < 2 else i + 1] = gain[i]
    return K


@compiled
def _observability(F: FloatArray, row: FloatArray) -> FloatArray:
    """Return the rows c, c F, c F² ... (k, k) of the output c (k,)."""
    O = np.zeros(F.shape)
    for j in range(len(row)):
        O[0, j] = row[j]
    for i in range(1, len(row)):
        for j in range(len(row)):
            for k in range(len(row)):
                O[i, j] += O[i - 1, k] * F[k, j]
    return O


@compiled
def _multiply_by_factors(F: FloatArray, poles: ComplexArray, vector: FloatArray) -> None:
    """Multiply a vector (k,) by F - p I of each pole p, in place; the product is real."""
    product, factor = vector.astype(np.complex128), np.empty(len(vector), np.complex128)
    for pole in poles:
        for i in range(len(vector)):
            factor[i] = -pole * product[i]
            for j in range(len(vector)):
                factor[i] += F[i, j] * product[j]
        product, factor = factor, product
    for i in range(len(vector)):
        vector[i] = product[i].real


@compiled
def _set_exponential(F: FloatArray, J: FloatArray, interval: float) -> None:
    """Set the first two rows and columns of F to exp(A), A being those of J times the interval.

    By the theorem of Cayley and Hamilton exp(A) = e^m (c I + s (A - m I)), where m is the mean of
    the eigenvalues m ± q, c = cosh q and s = sinh q / q.
    """
    mean = 0.5 * (J[0, 0] + J[1, 1]) * interval
    half = 0.5 * (J[0, 0] - J[1, 1]) * interval
    b, c = J[0, 1] * interval, J[1, 0] * interval
    square = half * half + b * c  # of q
    q = np.sqrt(abs(square))
    if q < 1e-4:  # the next term of the series is below the rounding
        even, odd = 1.0 + square / 2, 1.0 + square / 6
    elif square > 0:
        even, odd = np.cosh(q), np.sinh(q) / q
    else:
        even, odd = np.cos(q), np.sin(q) / q
    growth = np.exp(mean)
    F[0, 0], F[0, 1] = growth * (even + odd * half), growth * odd * b
    F[1, 0], F[1, 1] = growth * odd * c, growth * (even - odd * half)


@compiled
def _solve(M: FloatArray, b: FloatArray) -> None:
    """Replace b (n,) by the solution of M x = b, by elimination with pivots; M (n, n) is changed.

    Numba compiles `numpy.linalg.solve` for six seconds.
    """
    n = len(b)
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[pivot, k]):
                pivot = i
        if M[pivot, k] == 0.0:
            raise np.linalg.LinAlgError("the yaw is not observable at this motion")
        b[k], b[pivot] = b[pivot], b[k]
        for j in range(n):
            M[k, j], M[pivot, j] = M[pivot, j], M[k, j]
        for i in range(k + 1, n):
            ratio = M[i, k] / M[k, k]
            b[i] -= ratio * b[k]
            for j in range(k, n):
                M[i, j] -= ratio * M[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= M[k, j] * b[j]
        b[k] /= M[k, k]
