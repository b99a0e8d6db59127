"""The layout of a segment's own unknowns in the vector of a fit."""

from dataclasses import dataclass
from math import pi

import numpy as np

from shiplog.types import FloatArray

WAVE_FREQUENCY_CYCLES = 0.25  # over a segment: prior standard deviation of a wave's frequency
WAVE_AMPLITUDE_STD = 1.0  # of its prior, rad/s, m/s or rad: far above any real wave


@dataclass(frozen=True, eq=False)
class OwnUnknowns:
    """The own unknowns of one segment.

    Attributes
    ----------
    state
        (s,) the initial state in the units of the equations.
    rudder
        The deviation of the rudder zero from that of all runs, rad.
    biases
        (b,) of the sensors that have one, SI.
    speed_scale
        The relative error of the measured speed.
    current
        (2,) north and east, m/s.
    waves
        A row for each: frequency, rad/s, cosine and sine amplitude of each output, SI.
    """

    state: FloatArray
    rudder: float
    biases: FloatArray
    speed_scale: float
    current: FloatArray
    waves: FloatArray


@dataclass(frozen=True)
class OwnLayout:
    """How many values each kind of own unknown has, in the order of the vector.

    Attributes
    ----------
    states, rudder, biases, speed_scale, current
        Their numbers.
    waved
        The number of outputs that have waves.
    """

    states: int
    rudder: int
    biases: int
    speed_scale: int
    current: int
    waved: int

    @property
    def calm(self) -> int:
        """The number of unknowns besides the waves."""
        return self.states + self.rudder + self.biases + self.speed_scale + self.current

    @property
    def per_wave(self) -> int:
        """The number of unknowns of a wave."""
        return 1 + 2 * self.waved

    @property
    def first_bias(self) -> int:
        """Where the biases begin."""
        return self.states + self.rudder

    @property
    def first_scale(self) -> int:
        """Where the speed scale is."""
        return self.first_bias + self.biases

    @property
    def first_current(self) -> int:
        """Where the current begins."""
        return self.first_scale + self.speed_scale

    def split(self, own: FloatArray) -> OwnUnknowns:
        """Name the values of a segment's own unknowns, (k,); those it lacks are zero."""
        return OwnUnknowns(
            state=own[: self.states],
            rudder=float(own[self.states]) if self.rudder else 0.0,
            biases=own[self.first_bias : self.first_scale],
            speed_scale=float(own[self.first_scale]) if self.speed_scale else 0.0,
            current=own[self.first_current : self.calm] if self.current else np.zeros(2),
            waves=own[self.calm :].reshape(-1, self.per_wave),
        )


def add_waves(out: FloatArray, waves: FloatArray, time: FloatArray) -> None:
    """Add waves to outputs, (n, c), at the instants of (n,) s."""
    for omega, *sizes in waves:
        cosine, sine = np.array(sizes).reshape(2, -1)
        out += np.outer(np.cos(omega * time), cosine) + np.outer(np.sin(omega * time), sine)


def wave_derivatives(wave: FloatArray, time: FloatArray) -> FloatArray:
    """Compute the derivatives of a wave, (n, c, 1 + 2c), by its frequency and amplitudes."""
    omega, outputs = wave[0], len(wave) // 2
    derivatives = np.zeros((len(time), outputs, len(wave)))
    cosine, sine = np.cos(omega * time), np.sin(omega * time)
    for c in range(outputs):
        derivatives[:, c, 0] = time * (wave[1 + outputs + c] * cosine - wave[1 + c] * sine)
        derivatives[:, c, 1 + c] = cosine
        derivatives[:, c, 1 + outputs + c] = sine
    return derivatives


def wave_prior_stds(layout: OwnLayout, secs: float) -> list[float]:
    """Return the prior standard deviations of a wave's unknowns in a segment of some length."""
    frequency = WAVE_FREQUENCY_CYCLES * 2 * pi / secs
    return [frequency] + [WAVE_AMPLITUDE_STD] * (layout.per_wave - 1)
