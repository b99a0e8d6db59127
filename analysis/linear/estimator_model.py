"""The system that an estimator works with: plant, disturbances and shaping filters as one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm

from analysis.design.discrete import discretise
from shiplog.types import FloatArray


@dataclass(frozen=True, eq=False)
class EstimatorModel:
    """x' = A x + B u + b + w, y = C x + D u + v, with N states, sampled every `dt` seconds.

    Attributes
    ----------
    A
        (N, N), 1/s: the n states of the plant first, then those of disturbances, then those of
        shaping filters.
    B
        (N, inputs).
    b
        (N,): the constant part of the rate; zero unless the plant is linearised along a trajectory.
    C, D
        (m, N) and (m, inputs).
    W
        (N, N): intensity of the white noise w.
    r
        (m,): variance of v in one measurement.
    intervals
        (m,): time from one measurement to the next, s.
    dt
        Step of the clock, s.
    size
        n, the number of states of the plant.
    shaped
        Indices of the states of shaping filters.
    """

    A: FloatArray
    B: FloatArray
    b: FloatArray
    C: FloatArray
    D: FloatArray
    W: FloatArray
    r: FloatArray
    intervals: FloatArray
    dt: float
    size: int
    shaped: tuple[int, ...] = ()

    @property
    def R(self) -> FloatArray:
        """Intensity of v as continuous white noise, (m, m)."""
        return np.diag(self.r * self.intervals)

    @cached_property
    def step(self) -> "ModelStep":
        """The model from one instant of the clock to the next."""
        N, inputs = self.B.shape
        extended = np.zeros((N + 2 * inputs + 2, N + 2 * inputs + 2))
        drive = np.column_stack((self.B, self.b)) * self.dt
        extended[:N, :N], extended[:N, N : N + inputs + 1] = self.A * self.dt, drive
        extended[N : N + inputs + 1, N + inputs + 1 :] = np.eye(inputs + 1)
        response = expm(extended)
        whole = response[:N, N : N + inputs + 1]
        after = response[:N, N + inputs + 1 : N + 2 * inputs + 1]
        F, Q = discretise(self.A, self.W, self.dt)
        return ModelStep(
            np.ascontiguousarray(F),
            np.ascontiguousarray(whole[:, :inputs] - after),
            np.ascontiguousarray(after),
            np.ascontiguousarray(whole[:, inputs]),
            np.ascontiguousarray(Q),
        )


@dataclass(frozen=True, eq=False)
class ModelStep:
    """x⁺ = F x + G0 u + G1 u⁺ + g + w, the inputs varying linearly within the step.

    Attributes
    ----------
    F
        (N, N).
    G0, G1
        (N, inputs): effect of the inputs at the start and at the end of the step.
    g
        (N,).
    Q
        (N, N): covariance of w.
    """

    F: FloatArray
    G0: FloatArray
    G1: FloatArray
    g: FloatArray
    Q: FloatArray
