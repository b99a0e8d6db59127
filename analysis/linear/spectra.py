"""Spectra of coloured noise by name: shaping filters from their standard deviation and scale.

All have a stated standard deviation, whichever convention of the spectrum a source uses: under
white noise of unit two-sided intensity the output has the variance std².
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.design.shaping import TransferFunction, shaped_variance, wave_filter
from shiplog.types import FloatArray

RATIONAL = "rational"  # a spectrum given by num and den


def dryden(std: float, length: float, speed: float) -> TransferFunction:
    """Build Dryden's filter of gusts across the path, T = length / speed in s.

    H(s) is proportional to (s + 1 / (T √3)) / (s + 1 / T)². Sakharov's σ is std / √2: his spectrum
    has the variance 2σ².

    Examples
    --------
    >>> dryden(std=10 * 2**0.5, length=3.49, speed=1.0).numerator.round(4).tolist()
    [13.1118, 2.1691]
    """
    T = length / speed
    return _scaled(np.array([np.sqrt(3) * T, 1.0]), np.array([T**2, 2 * T, 1.0]), std)


def first_order(std: float, time: float) -> TransferFunction:
    """Build the filter of an exponentially correlated noise; Dryden's gusts along the path."""
    return _scaled(np.array([1.0]), np.array([time, 1.0]), std)


def von_karman(std: float, length: float, speed: float) -> TransferFunction:
    """Build a rational approximation of von Kármán's spectrum of gusts across the path.

    References
    ----------
    MIL-F-8785C, "Flying qualities of piloted airplanes", 1980, as approximated in
    S. Gage, "Creating a unified graphical wind turbulence model from multiple specifications",
    2003.
    """
    T = length / speed
    top = np.array([0.3398 * T**2, 2.7478 * T, 1.0])
    return _scaled(top, np.array([0.1539 * T**3, 1.9754 * T**2, 2.9958 * T, 1.0]), std)


def von_karman_along(std: float, length: float, speed: float) -> TransferFunction:
    """Build the same for gusts along the path."""
    T = length / speed
    return _scaled(np.array([0.25 * T, 1.0]), np.array([0.1987 * T**2, 1.357 * T, 1.0]), std)


def wave(std: float, frequency: float, damping: float) -> TransferFunction:
    """Build the filter of waves about a frequency in rad/s."""
    return wave_filter(std**2, frequency, damping)


@dataclass(frozen=True)
class SpectrumForm:
    """A spectrum by name: its function and its parameters, each with a default or None."""

    make: Callable[..., TransferFunction]
    parameters: Mapping[str, float | None]


SPECTRA: Mapping[str, SpectrumForm] = {
    "dryden": SpectrumForm(dryden, {"std": None, "length": None, "speed": None}),
    "first-order": SpectrumForm(first_order, {"std": None, "time": None}),
    "von-karman": SpectrumForm(von_karman, {"std": None, "length": None, "speed": None}),
    "von-karman-along": SpectrumForm(
        von_karman_along, {"std": None, "length": None, "speed": None}
    ),
    "wave": SpectrumForm(wave, {"std": None, "frequency": None, "damping": 0.1}),
}


@dataclass(frozen=True, eq=False)
class ShapedNoise:
    """Coloured noise on the rates of states or on outputs.

    Attributes
    ----------
    name, unit
        Name and unit of the noise.
    spectrum
        One of `SPECTRA`, or `RATIONAL`.
    parameters
        The parameters of the spectrum; of a rational one, none or ``std`` alone.
    on_state, on_sensor
        Factor on the rate of change of each named state, or on each named output.
    fit
        Names of the parameters that are fitted to the log, the given values being the start.
    rational
        The transfer function of a rational spectrum.
    """

    name: str
    spectrum: str
    parameters: Mapping[str, float]
    on_state: Mapping[str, float] = field(default_factory=dict)
    on_sensor: Mapping[str, float] = field(default_factory=dict)
    fit: tuple[str, ...] = ()
    rational: TransferFunction | None = None
    unit: str = "1"

    @property
    def shaping(self) -> TransferFunction:
        """The shaping filter H(s).

        Raises
        ------
        UsageError
            A rational spectrum is not stable.
        """
        if self.rational is None:
            return SPECTRA[self.spectrum].make(**self.parameters)
        if "std" not in self.parameters:
            return self.rational
        H = self.rational
        return _scaled(H.numerator, H.denominator, self.parameters["std"])

    def with_parameters(self, parameters: Mapping[str, float]) -> "ShapedNoise":
        """Return the noise with some of its parameters replaced."""
        return replace(self, parameters={**self.parameters, **parameters})


def _scaled(numerator: FloatArray, denominator: FloatArray, std: float) -> TransferFunction:
    """Return a filter of these zeros and poles whose output has the standard deviation `std`."""
    unit = TransferFunction(numerator / denominator[0], denominator / denominator[0])
    gain = std / np.sqrt(shaped_variance(unit))
    return TransferFunction(unit.numerator * gain, unit.denominator)
