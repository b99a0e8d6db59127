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
FURTHER_SETTINGS = ("sensor_bias", "heading_std", "position_std")


@dataclass(frozen=True, eq=False)
class FurtherStates:
    """Estimates beside those of the ship's motion: heading, position, sensor errors, disturbances.

    Attributes
    ----------
    names, units
        The k estimates: ``heading``, ``north``, ``east``, the sensor errors (`SENSOR_ERRORS` of the
        settings), ``current_north``, ``current_east``, ``drift_length``, ``yaw_moment``,
        ``surge_force`` and the waves of these, and the coefficients of the wind (`WIND_TERMS`), as
        far as the filter has them.
    prior_stds
        Their standard deviations before anything is measured.
    values, stds
        (n, k): the estimates, and their standard deviations.

    Examples
    --------
    >>> from analysis import analyse
    >>> log = "sample_data/zigzag_10_10_dropouts.mcap"
    >>> analysis = analyse(log, settings={"filter.sensor_bias": "auto"})
    >>> bias, std = analysis.estimates.further.of("gyro")  # (n,) rad/s each
    >>> f"{bias[-1]:.6f} ± {std[-1]:.6f}"
    '0.000349 ± 0.000002'
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    prior_stds: tuple[float, ...]
    values: FloatArray
    stds: FloatArray

    def of(self, name: str) -> tuple[FloatArray, FloatArray] | None:
        """Return values (n,) and standard deviations (n,) of an estimate; None if there is none."""
        if name not in self.names:
            return None
        at = self.names.index(name)
        return self.values[:, at], self.stds[:, at]


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
        (n, m): yaw rate, rad/s, speed, m/s, and the further outputs that the filter uses (heading,
        rad, or heading and position, m), measured minus predicted; NaN where not measured.
    innovation_stds
        (n, m): the standard deviations that the filter predicts for them.
    rejected
        (n, m): whether a sample was rejected by the gate.
    wave
        (n,): the part of the yaw rate that is due to waves, rad/s; None where no wave is modelled.
    further
        The further estimates; None where the filter has none.
    """

    states: FloatArray
    stds: FloatArray
    innovations: FloatArray
    innovation_stds: FloatArray
    rejected: NDArray[np.bool_]
    wave: FloatArray | None = None
    further: FurtherStates | None = None


@dataclass(frozen=True, eq=False)
class Trace:
    """The intermediate results of a filter that a smoother needs.

    The filter has s states of its own and m outputs, which correct it one after the other.

    Attributes
    ----------
    states
        (n, s): the filtered state at each instant, after its corrections.
    covariances
        (n, s, s): the covariance of the same.
    transitions
        (n, s, s): the transition matrix from each instant to the next.
    rows
        (n, m, s): the row of the output matrix by which each output corrected the state; zero where
        there was no correction.
    gains
        (n, m, s): the gain of each output; zero where there was no correction.
    innovations
        (n, m): the innovation of each output; zero where there was no correction.
    variances
        (n, m): the variance of each innovation.
    """

    states: FloatArray
    covariances: FloatArray
    transitions: FloatArray
    rows: FloatArray
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
            inputs ``rudder``, rad, and ``rpm``, which are never NaN; where `NoiseModel.further` has
            further outputs, these too.
        following
            The inputs at the instant after the chunk.
        """
        ...


@runtime_checkable
class SmoothableFilter(Filter, Protocol):
    """A filter that also returns what the smoother needs."""

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """Filter the next chunk as `step` does, and return the intermediate results as well."""
        ...

    def to_estimates(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None, FurtherStates | None]:
        """Convert states of the filter to `states`, `stds`, `wave` and `further` of `Estimates`.

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
        models a wave in the yaw rate lists `WAVE_SETTINGS`, one that has the further states of
        `NoiseModel.further` lists `FURTHER_SETTINGS`.
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

    @property
    def has_further_states(self) -> bool:
        """Whether the filter can have sensor errors and disturbances as states."""
        return "sensor_bias" in self.settings
