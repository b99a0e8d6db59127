"""What every filter has in common: its protocol, its kind and its results."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from analysis.signals.signal_stats import SignalStats
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray, Signals
from shiplog.vessel.settings import FilterSettings

from .noise_model import NoiseModel

STATES = ("yaw_rate", "yaw_acceleration", "yaw_jerk", "speed", "surge_acceleration")
OUTPUT_STATES = (0, 3)  # the positions of the outputs, yaw rate and speed, among the states

NOISE_SETTINGS = ("yaw_rate_std", "speed_std", "process_ratio")  # they determine the noise model
WAVE_SETTINGS = ("wave", "wave_frequency", "wave_damping", "wave_std")


@dataclass(frozen=True, eq=False)
class Estimates:
    """The states of a trial, or of a chunk of it, on the clock of the signals.

    Attributes
    ----------
    states
        (n, 5): the `STATES`; yaw rate, its first and second derivative in rad/s, rad/s² and
        rad/s³, speed in m/s, surge acceleration in m/s².
    stds
        (n, 5): their standard deviations.
    innovations
        (n, 2): yaw rate, rad/s, and speed, m/s, measured minus predicted; NaN where not measured.
    innovation_stds
        (n, 2): the standard deviations that the filter predicts for them.
    rejected
        (n, 2): whether a sample was rejected by the gate.
    wave
        (n,): the part of the yaw rate that is due to waves, rad/s; None where no wave is modelled.
    """

    states: FloatArray
    stds: FloatArray
    innovations: FloatArray
    innovation_stds: FloatArray
    rejected: NDArray[np.bool_]
    wave: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Trace:
    """The intermediate results of a filter that a smoother needs.

    The filter has s states of its own and two outputs, which correct it one after the other.

    Attributes
    ----------
    states
        (n, s): the filtered state at each instant, after its corrections.
    covariances
        (n, s, s): the covariance of the same.
    transitions
        (n, s, s): the transition matrix from each instant to the next.
    gains
        (n, 2, s): the gain of each output; zero where there was no correction.
    innovations
        (n, 2): the innovation of each output; zero where there was no correction.
    variances
        (n, 2): the variance of each innovation.
    """

    states: FloatArray
    covariances: FloatArray
    transitions: FloatArray
    gains: FloatArray
    innovations: FloatArray
    variances: FloatArray


class Filter(Protocol):
    """A filter of yaw rate and speed that processes a trial chunk by chunk."""

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk.

        Parameters
        ----------
        chunk
            The signals ``yaw_rate``, rad/s, and ``speed``, m/s, NaN where not measured, and the
            inputs ``rudder``, rad, and ``rpm``, which are never NaN.
        following
            The inputs at the instant after the chunk.
        """
        ...


@runtime_checkable
class SmoothableFilter(Filter, Protocol):
    """A filter that also returns what the smoother needs."""

    @property
    def outputs(self) -> FloatArray:
        """The output matrix C, (2, s): yaw rate and speed from the states."""
        ...

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """Filter the next chunk as `step` does, and return the intermediate results as well."""
        ...

    def to_estimates(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Convert states of the filter to `states`, `stds` and `wave` of `Estimates`.

        Parameters
        ----------
        chunk, following
            As in `step`.
        states
            (n, s): states of the filter.
        covariances
            (n, s, s): their covariances.
        """
        ...


@dataclass(frozen=True)
class FilterKind:
    """A kind of filter: its name, how it is made, and what it can do.

    An installed package adds one by an entry point of the group ``shiplog.filters``.

    Attributes
    ----------
    name
        The name by which the command line and vessel files select it.
    make
        Return a filter at the start of a trial, given the model's coefficients, the noise model,
        the statistics of the signals and the settings of ``[filter]``.
    smoothable
        Whether `make` returns a `SmoothableFilter` whose gain is the optimal one, which the
        smoother's equations assume.
    settings
        The keys of ``[filter]`` that the filter uses, beside ``kind`` and ``smooth``. A filter that
        models a wave in the yaw rate lists `WAVE_SETTINGS`.
    process_noise
        What the process noise drives: ``"forces"``, the yaw moment and the surge force
        (`NoiseModel.process_ratio` in 1/s⁴ and 1/s²), or ``"states"``, all states (in 1/s², as in
        the identification paper).
    """

    name: str
    make: Callable[[Coefficients, NoiseModel, SignalStats, FilterSettings], Filter]
    smoothable: bool = False
    settings: tuple[str, ...] = NOISE_SETTINGS
    process_noise: Literal["forces", "states"] = "forces"

    @property
    def models_wave(self) -> bool:
        """Whether the filter can separate waves in the yaw rate from the ship's own turning."""
        return "wave" in self.settings
