"""What a filter says of a stretch of the trial, whichever filter it was."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from shiplog.types import FloatArray, Signals

STATES = ("yaw_rate", "yaw_acceleration", "yaw_jerk", "speed", "surge_acceleration")
OUTPUT_STATES = (0, 3)  # where the outputs stand among the states


@dataclass(frozen=True, eq=False)
class Estimates:
    """The filter's account of a trial, on the signals' clock."""

    states: FloatArray  # (n, 5): w, w', w'', v, v' in rad/s^k and m/s^k
    stds: FloatArray  # (n, 5) of the same
    innovations: FloatArray  # (n, 2), NaN where nothing was measured
    innovation_stds: FloatArray  # (n, 2), as the filter expects them
    gated: NDArray[np.bool_]  # (n, 2) what was measured and not believed
    wave: FloatArray | None = None  # (n,) rad/s: what of the yaw rate is waves', if it was asked


@dataclass(frozen=True, eq=False)
class Trace:
    """How a filter came to its estimates: what a smoother needs on its way back.

    With s states of the filter's own and two outputs.
    """

    states: FloatArray  # (n, s) each instant's, its measurements taken in
    covariances: FloatArray  # (n, s, s) of the same
    transitions: FloatArray  # (n, s, s) from each instant to the next
    gains: FloatArray  # (n, 2, s); zero where nothing was taken in
    innovations: FloatArray  # (n, 2), one output after the other; zero where nothing was taken in
    variances: FloatArray  # (n, 2) of these


class Filter(Protocol):
    """A filter that takes a trial in chunks; the inputs must be known throughout."""

    @property
    def outputs(self) -> FloatArray:
        """What is measured of its states: C, (2, s)."""
        ...

    def step(self, chunk: Signals, following: Mapping[str, float]) -> Estimates:
        """Filter the next chunk; `following` are the inputs at the instant after it."""
        ...

    def trace(self, chunk: Signals, following: Mapping[str, float]) -> tuple[Estimates, Trace]:
        """As `step`, and how it came about."""
        ...

    def told(
        self,
        chunk: Signals,
        following: Mapping[str, float],
        states: FloatArray,
        covariances: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """`Estimates`' states, stds and wave, of states (n, s) and covariances (n, s, s)."""
        ...
